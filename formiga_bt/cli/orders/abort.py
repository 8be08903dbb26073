"""`formiga abort`: end a task."""

import sys
from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect


def command(
    task: Annotated[str, typer.Argument(help="The task's id, for example PickUp-12.", metavar="ID")],
    now: Annotated[bool, typer.Option("--now", help="Skip its cleanup; its machines come home at once.")] = False,
    abandon: Annotated[
        bool, typer.Option("--abandon", help="Leave its machines where they are, quarantined. Asks for confirmation.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """End a task: its steps stop, its cleanup runs, what flies comes home; what stands away from its port stays there."""
    if now and abandon:
        raise UnusableFile("--now and --abandon exclude each other")
    client = connect(site)
    if abandon and not yes:
        agents = ", ".join(client.detail(task).task.agents) or "no agents"
        if not sys.stdin.isatty():
            raise UnusableFile(f"--abandon leaves {agents} where they are, also in the air; confirm it with --yes")
        typer.confirm(
            f"{agents} will stay where they are, also in the air, until you clear them. Abandon {task}?", abort=True
        )
    how = "now" if now else "abandon" if abandon else ""
    said = client.abort(task, how, by=by or user(), confirmed=abandon)
    if as_json:
        print_json({"text": said})
        return
    typer.echo(said)
    show_next("formiga agents" if abandon else "formiga tasks", f"formiga why {task}")
