"""`formiga priority`: say which of the tasks that wait goes first."""

from enum import StrEnum
from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect


class Level(StrEnum):
    """How urgent a task is."""

    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


def command(
    task: Annotated[str, typer.Argument(help="The task's id, for example PickUp-12.", metavar="TASK")],
    level: Annotated[Level, typer.Argument(help="How urgent it is.", metavar="low|medium|high")],
    first: Annotated[bool, typer.Option("--first", help="Before all others of that priority.")] = False,
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Give a task that waits for its first agents another priority, or the first place in it.

    One that is high now may have others step aside. Example: formiga priority Survey-4 medium --first
    """
    said = connect(site).prioritize(task, level, first=first, by=by or user())
    if as_json:
        print_json({"text": said})
        return
    typer.echo(said)
    show_next("formiga tasks", f"formiga why {task}")
