"""`formiga hold`: machines stop and hover."""

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
    """Stop a machine, the machines of a task, or all: what flies hovers, what stands stays.

    Nothing asks back. A machine that hovers returns by itself before its reserve is reached. The task is HELD until
    formiga continue or formiga abort. Example: formiga hold PickUp-3
    """
    give(connect(site), "hold", target, everything=everything, by=by, as_json=as_json)
