"""`formiga cut`: stop a machine's motors."""

import sys
from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import EXIT_NO, ByOption, tell
from formiga_bt.cli.printing import user
from formiga_bt.client import connect


def command(
    agent: Annotated[str, typer.Argument(help="The machine, for example hwd_1.", metavar="AGENT")],
    yes_cut: Annotated[
        str,
        typer.Option(
            "--yes-cut", help="For scripts: the machine's name once more, instead of typing it.", metavar="AGENT"
        ),
    ] = "",
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Stop the motors of one machine at once; in the air it falls. You confirm it by typing its name.

    Only for machines that announce such an action. It cannot be taken back. Example: formiga cut hwd_1
    """
    client = connect(site)
    if not yes_cut and not sys.stdin.isatty():
        raise UnusableFile(f"cut stops the motors of {agent}, also in the air; confirm it with --yes-cut {agent}")
    typed = yes_cut or typer.prompt(
        f"Cut stops the motors of {agent} at once; in the air it falls. Type its name to do it",
        default="",
        show_default=False,
    )
    if typed != agent:
        if yes_cut:
            raise UnusableFile(f"--yes-cut says {yes_cut}, the order is for {agent}; nothing was done")
        typer.echo(f"that is not {agent}; nothing was done", err=True)
        raise typer.Exit(EXIT_NO)
    tell(client.order_agent(agent, "cut", by=by or user(), confirmed=typed), as_json=as_json)
