"""`formiga event`: raise an event for a person who works at the engine's desk."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.params import read_params
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect


def command(
    agent: Annotated[str, typer.Argument(help="Who reports it, for example picker_1.", metavar="AGENT")],
    event: Annotated[str, typer.Argument(help="An event of their type, for example sos.", metavar="EVENT")],
    field: Annotated[
        list[str] | None,
        typer.Option("--field", "-f", metavar="NAME=VALUE", help="A field of the event; may be repeated."),
    ] = None,
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Report an event for a person at this engine's desk (`formiga up --desk`): tasks wait for it with wait_for.

    Example: formiga event picker_1 sos
    """
    said = connect(site).report_event(agent, event, read_params(field or []))
    if as_json:
        print_json({"text": said})
        return
    typer.echo(said)
    show_next("formiga tasks", "formiga inbox")
