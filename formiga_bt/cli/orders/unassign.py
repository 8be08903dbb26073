"""`formiga unassign`: take an agent back from its task."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect


def command(
    agent: Annotated[str, typer.Argument(help="A machine or a person, for example hwd_1.", metavar="AGENT")],
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Take an agent back from its task: what flies comes home, and the task begins anew without it.

    The task keeps its id, waits for another agent, and gets this one again only by formiga assign. Refused where the task
    cannot begin anew: it carries a load, or has done what may not be done twice. Example: formiga unassign hwd_1
    """
    done = connect(site).unassign(agent, by=by or user())
    if as_json:
        print_json(done)
        return
    typer.echo(done.text)
    show_next(f"formiga why {done.task}", f"formiga assign {done.task} AGENT")
