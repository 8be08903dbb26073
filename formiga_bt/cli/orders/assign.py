"""`formiga assign`: give an agent to a task that waits for agents."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect


def command(
    task: Annotated[str, typer.Argument(help="The task's id, for example PickUp-12.", metavar="TASK")],
    agent: Annotated[str, typer.Argument(help="A machine or a person, for example hwd_1.", metavar="AGENT")],
    role: Annotated[str, typer.Option(help="Which role of the task, if it could take several.", metavar="ROLE")] = "",
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Give an agent to a task that waits for agents, though another one is nearer.

    It passes every filter of the allocator, or is refused with the reason: it must be free, at its port, fit and charged.
    It is kept for the task until all of its roles are filled. Example: formiga assign PickUp-12 hwd_1
    """
    done = connect(site).assign(task, agent, role, by=by or user())
    if as_json:
        print_json(done)
        return
    typer.echo(done.text)
    show_next(f"formiga why {task}", f"formiga unassign {agent}", said=done.text)
