"""`formiga return`: machines fly to their ports."""

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import AllOption, ByOption, TargetArgument, give
from formiga_bt.client import connect


def command(
    target: TargetArgument = "",
    everything: AllOption = False,
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Send a machine, the machines of a task, or all to their ports.

    Nothing asks back. The task is HELD until formiga continue or formiga abort. Example: formiga return hwd_1
    """
    give(connect(site), "return", target, everything=everything, by=by, as_json=as_json)
