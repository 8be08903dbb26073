"""`formiga stats`: how long tasks, actions, waits and answers took in a running engine, with their spread."""

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.cli.past import AtOption, JournalOption

if TYPE_CHECKING:
    from formiga_bt.show.facts import Stats


def command(
    name: Annotated[str, typer.Argument(help="Only tasks of this name.", metavar="TASK-NAME")] = "",
    hours: Annotated[float, typer.Option(help="Only what ended in the last so many hours.", min=0.0)] = 0.0,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write it as CSV (.csv); replaces the file.", metavar="FILE")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of tables.")] = False,
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")] = False,
    width: Annotated[int | None, typer.Option(min=40, help="Columns to fit into. Default: the terminal's.")] = None,
    site: Annotated[
        Path | None, typer.Option(help="Site file of the engine. Default: the engine of this folder.", metavar="FILE")
    ] = None,
    url: Annotated[str, typer.Option(help="Address of the engine to ask.", metavar="URL")] = "",
    journal: JournalOption = "",
    at: AtOption = "",
) -> None:
    """Show how long things took: least, quartiles and most, with a box plot per row on a scale that a table shares.

    n counts what ended well, failed what did not. Examples: formiga stats; formiga stats PickUp --hours 8 -o day.csv
    """
    if out is not None and out.suffix.lower() != ".csv":
        raise UnusableFile(f"{out} has no ending that is known", help="say a name that ends in .csv")
    from formiga_bt.cli.past import source_of
    from formiga_bt.show.stats import as_csv, is_empty

    source = source_of(site, url, journal=journal, at=at)
    stats = source.stats(task=name, hours=hours)
    if name and is_empty(stats):
        every = source.stats(hours=hours)
        ran = sorted({one.name for one in (*every.tasks, *every.waits)})
        when = f" in the last {hours:g} h" if hours else ""
        raise FormigaError(f"no task called '{name}' began or ended here{when}; others: {', '.join(ran) or 'none'}")
    if out is not None:
        try:
            out.write_text(as_csv(stats), encoding="utf-8")
        except OSError as error:
            raise UnusableFile(f"cannot write {out}: {error.strerror or error}") from error
        typer.echo(f"written: {out}", err=True)
    if as_json:
        import msgspec

        typer.echo(msgspec.json.format(msgspec.json.encode(stats), indent=2).decode())
    elif out is None:
        show(stats, width=width, ascii_only=ascii_only)


def show(stats: "Stats", *, width: int | None = None, ascii_only: bool = False) -> None:
    """Print the tables, as wide as the terminal, in colours where it takes them."""
    from formiga_bt.cli.author.show import coloured
    from formiga_bt.show.stats import UNICODE_USED, draw

    columns = width or max(40, shutil.get_terminal_size((100, 24)).columns)
    plain = ascii_only or not _can_print(UNICODE_USED)
    colour = coloured()
    for line in draw(stats, width=columns, ascii_only=plain):
        typer.echo(line.styled() if colour else line.plain(), color=colour)


def _can_print(text: str) -> bool:
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
