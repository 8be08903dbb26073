"""`formiga restart`: end a run of a task and begin anew."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption, tell
from formiga_bt.cli.printing import user
from formiga_bt.client import connect


def command(
    task: Annotated[str, typer.Argument(help="The task's id, for example PickUp-12.", metavar="TASK")],
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Restart a task: its cleanup runs, what flies comes home, and it waits for agents to begin at its first step.

    For a task that cannot be continued. It keeps its id and what it was requested with. Example: formiga restart PickUp-12
    """
    tell(connect(site).order_task(task, "restart", by=by or user()), as_json=as_json)
