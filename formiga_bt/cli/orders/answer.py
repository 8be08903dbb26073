"""`formiga answer`: answer a question for a person who works at the engine's desk."""

from typing import Annotated

import typer

from formiga_bt.cli.client import JsonOption, SiteOption, connect, print_json, segment, show_next


def command(
    number: Annotated[str, typer.Argument(help="The question, for example Q7.", metavar="QUESTION")],
    option: Annotated[str, typer.Argument(help="One of its options.", metavar="OPTION")],
    by: Annotated[str, typer.Option(help="Who answers, if several people here are asked.", metavar="PERSON")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Answer a question that people at this engine's desk are asked (`formiga up --desk`)."""
    reply = connect(site).post(f"/v1/inbox/{segment(number)}/answer", {"option": option, "by": by})
    if as_json:
        print_json(reply)
        return
    typer.echo(reply["text"])
    show_next("formiga inbox", "formiga tasks")
