"""`formiga map`: the site from above with the ways that agents went, in the terminal or as a picture."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.past import AtOption, JournalOption
from formiga_bt.cli.picture_out import (
    HERE,
    AllOption,
    AsciiOption,
    OutOption,
    TasksArgument,
    UrlOption,
    WidthOption,
    chosen,
    columns,
    draw,
    form_of,
    is_plain,
    source_of,
)


def command(
    tasks: TasksArgument = None,
    every: AllOption = False,
    out: OutOption = None,
    whole: Annotated[bool, typer.Option("--whole", help="All of the site, not only where somebody went.")] = False,
    ascii_only: AsciiOption = False,
    width: WidthOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what it is drawn from as JSON.")] = False,
    site: Annotated[
        Path | None, typer.Option(help="Site file of the engine. Default: the engine of this folder.", metavar="FILE")
    ] = None,
    url: UrlOption = "",
    journal: JournalOption = "",
    at: AtOption = "",
) -> None:
    """Draw where the agents of some tasks went: base, ports, places, regions, fences, heights. North is up.

    Metres are counted from the base. Nothing is fetched from the network. Examples: formiga map PickUp-12;
    formiga map --all --whole -o day.html
    """
    ids = chosen(tasks, every, "map")
    if out is not None and out != HERE:
        form_of(out)
    chart = source_of(site, url, journal, at).chart(ids)
    if as_json:
        import msgspec

        typer.echo(msgspec.json.format(msgspec.json.encode(chart), indent=2).decode())
        return
    from formiga_bt.show.map.files import made
    from formiga_bt.show.map.text import drawn

    plain, room = is_plain(ascii_only), columns(width)
    draw(
        out,
        lambda form: made(chart, form, whole=whole, ids=ids),
        lambda: drawn(chart, room, ascii_only=plain, whole=whole, ids=ids),
    )
