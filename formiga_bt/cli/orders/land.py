"""`formiga land`: machines land where they are."""

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
    """Land a machine, the machines of a task, or all: where they are, or at the nearest spot 15 m from known people.

    Nothing asks back, also nobody who would say that people stand clear. The task is HELD until formiga continue or formiga
    abort. Example: formiga land --all
    """
    give(connect(site), "land", target, everything=everything, by=by, as_json=as_json)
