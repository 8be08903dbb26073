"""`formiga lockdown`: nothing starts and nothing goes on, until it is released."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.order_words import lock_down
from formiga_bt.cli.ordering import ByOption, leave
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect

WORDS = ("", "release", "status")


def command(
    word: Annotated[
        str,
        typer.Argument(
            help="release: end it. status: show whether it stands. Empty: press it.", metavar="release|status"
        ),
    ] = "",
    hold: Annotated[bool, typer.Option("--hold", help="What flies hovers.")] = False,
    return_: Annotated[bool, typer.Option("--return", help="What flies comes home. This is the default.")] = False,
    land: Annotated[bool, typer.Option("--land", help="What flies lands where it is.")] = False,
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Lock the site down: no task is admitted, no machine granted, no step goes on; what flies comes home, hovers or lands.

    Nothing asks back. Questions to people and notices go on. It stands until: formiga lockdown release. Tasks that it
    interrupted then wait for formiga continue. Example: formiga lockdown --hold
    """
    chosen = [how for how, given in (("hold", hold), ("return", return_), ("land", land)) if given]
    if word not in WORDS:
        raise UnusableFile(f"'{word}' is not release or status; formiga lockdown alone presses it")
    if len(chosen) > 1 or (word and chosen):
        raise UnusableFile("say one of: formiga lockdown --hold, --return, --land; formiga lockdown release")
    client = connect(site)
    if word == "status":
        found = client.lockdown()
        if as_json:
            print_json(found)
            return
        typer.echo(found.text or "no lockdown stands")
        show_next("formiga lockdown release" if found.on else "formiga tasks")
        return
    how = word or (chosen[0] if chosen else "return")
    leave(lock_down(client, how, by=by, as_json=as_json))
