"""`formiga zone`: close a region for machines while the engine runs, and open it again."""

from enum import StrEnum
from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect


class Word(StrEnum):
    """What is done."""

    LIST = "list"
    CLOSE = "close"
    OPEN = "open"


def command(
    word: Annotated[Word, typer.Argument(help="What to do.", metavar="list|close|open")] = Word.LIST,
    name: Annotated[str, typer.Argument(help="A region or a place of the site.", metavar="[NAME]")] = "",
    reason: Annotated[str, typer.Option("--reason", help="With close: why, for those who ask.", metavar="TEXT")] = "",
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List what is closed for machines, close a region of the site (or 30 m around a place), or open it again.

    No machine enters what is closed. One that is in it, or on a way into it, is stopped, its task ends envelope.keep_out.
    Example: formiga zone close meadow --reason 'sheep'
    """
    if (word is Word.LIST) == bool(name) or (word is Word.CLOSE) != bool(reason):
        raise UnusableFile("say formiga zone list, formiga zone close NAME --reason TEXT, or formiga zone open NAME")
    client = connect(site, url, token_file)
    if word is Word.LIST:
        found = client.zones()
        if as_json:
            print_json(found)
        elif found.zones:
            print_table([("CLOSED", "BY", "WHY"), *((one.name, one.by, one.reason) for one in found.zones)])
        else:
            typer.echo("nothing is closed")
        return
    who = by or user()
    said = client.close_zone(name, reason, by=who) if word is Word.CLOSE else client.open_zone(name, by=who)
    if as_json:
        print_json({"text": said})
        return
    typer.echo(said)
    show_next("formiga zone list", "formiga agents")
