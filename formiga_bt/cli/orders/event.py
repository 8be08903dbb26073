"""`formiga event`: raise an event for a person who works at the engine's desk."""

from typing import Annotated

import typer

from formiga_bt.cli.client import JsonOption, SiteOption, connect, print_json, segment, show_next
from formiga_bt.cli.params import read_params


def command(
    agent: Annotated[str, typer.Argument(help="Who tells it, for example picker_1.", metavar="AGENT")],
    event: Annotated[str, typer.Argument(help="An event of their type, for example sos.", metavar="EVENT")],
    field: Annotated[
        list[str] | None,
        typer.Option("--field", "-f", metavar="NAME=VALUE", help="A field of the event; may be repeated."),
    ] = None,
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Tell an event for a person at this engine's desk (`formiga up --desk`): tasks wait for it with wait_for.

    Example: formiga event picker_1 sos
    """
    body = {"event": event, "fields": read_params(field or [])}
    reply = connect(site).post(f"/v1/agents/{segment(agent)}/events", body)
    if as_json:
        print_json(reply)
        return
    typer.echo(reply["text"])
    show_next("formiga tasks", "formiga inbox")
