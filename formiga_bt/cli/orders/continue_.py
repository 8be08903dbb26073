"""`formiga continue`: what was stopped goes on."""

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
    """Let a machine, a task, or all go on that were stopped: interrupted steps are sent again.

    Refused (cannot_continue) where a step may not be done a second time, or the machine is no longer as it must be; then
    formiga restart or formiga abort. Example: formiga continue PickUp-3
    """
    give(connect(site), "continue", target, everything=everything, by=by, as_json=as_json)
