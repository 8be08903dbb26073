"""`formiga answer`: answer a question for a person who works at the engine's desk."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.params import read_params
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect


def command(
    number: Annotated[str, typer.Argument(help="The question, for example Q7.", metavar="QUESTION")],
    option: Annotated[str, typer.Argument(help="One of its options.", metavar="OPTION")],
    by: Annotated[str, typer.Option(help="Who answers, if several people here are asked.", metavar="PERSON")] = "",
    field: Annotated[
        list[str] | None,
        typer.Option("--field", "-f", metavar="NAME=VALUE", help="A field of its form; may be repeated."),
    ] = None,
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Answer a question that people at this engine's desk are asked (`formiga up --desk`)."""
    said = connect(site).answer(number, option, by=by, fields=read_params(field or []))
    if as_json:
        print_json({"text": said})
        return
    typer.echo(said)
    show_next("formiga inbox", "formiga tasks")
