"""What verbs that draw share: where a picture goes, and what the terminal can show."""

import os
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.errors import UnusableFile

if TYPE_CHECKING:
    from formiga_bt.show.picture import Format
    from formiga_bt.show.source import Source
    from formiga_bt.show.styled import StyledLine

HERE = Path("-")
"""As the name of a file: the terminal."""

TasksArgument = Annotated[
    list[str] | None, typer.Argument(help="Ids of tasks, for example PickUp-12.", metavar="TASK-ID...")
]
AllOption = Annotated[bool, typer.Option("--all", help="All tasks that the engine knows.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="Write it there: .svg, .png, .html or .txt; replaces the file.", metavar="FILE"),
]
AsciiOption = Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")]
WidthOption = Annotated[int | None, typer.Option(min=40, help="Columns to fit into. Default: the terminal's.")]
UrlOption = Annotated[str, typer.Option(help="Address of the engine to ask.", metavar="URL")]


def chosen(tasks: Sequence[str] | None, every: bool, verb: str) -> list[str]:
    """Return the tasks that are meant; none = all.

    Raises:
        UnusableFile: neither tasks nor --all, or both.
    """
    if tasks and every:
        raise UnusableFile("name tasks, or say --all, not both")
    if not tasks and not every:
        raise UnusableFile(
            "which tasks?", help=f"formiga {verb} PickUp-12, or formiga {verb} --all; ids: formiga tasks"
        )
    return list(dict.fromkeys(tasks or ()))


def source_of(site: Path | None, url: str, journal: str = "", at: str = "") -> "Source":
    """Return what is asked: the engine of this folder, of a site, or at an address; or a journal."""
    from formiga_bt.cli import past

    return past.source_of(site, url, journal=journal, at=at)


def form_of(out: Path) -> "Format":
    """Return what a file shall be, before anything is asked or flown.

    Raises:
        UnusableFile: its name does not tell, its folder is missing, or what draws it is not installed.
    """
    from formiga_bt.base.extras import need_charts
    from formiga_bt.show.picture import format_of

    form = format_of(out)
    if form != "txt":
        need_charts(f"{out.suffix} files", "a file that ends in .txt")
    if not out.parent.is_dir():
        raise UnusableFile(f"cannot write {out}: there is no folder {out.parent}")
    return form


def save(out: Path, data: bytes) -> None:
    """Write a picture, and say so.

    Raises:
        UnusableFile: it cannot be written.
    """
    try:
        out.write_bytes(data)
    except OSError as error:
        raise UnusableFile(f"cannot write {out}: {error.strerror or error}") from error
    typer.echo(f"written: {out}", err=True)


def is_plain(ascii_only: bool) -> bool:
    """Return whether only ASCII may be printed: it is asked for, or stdout takes nothing else."""
    try:
        "⣿┬▒━▓╌╳▚‖✗⊘▶×…⊕□▽★☻═╱↗".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return True
    return ascii_only


def columns(width: int | None) -> int:
    """Return how many columns to fit into."""
    return width or max(40, shutil.get_terminal_size((100, 24)).columns)


def show(lines: "Iterable[StyledLine]") -> None:
    """Print lines, in colours where stdout takes them."""
    coloured = sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    for line in lines:
        typer.echo(line.coloured if coloured else line.plain)


def draw(out: Path | None, made: "Callable[[Format], bytes]", drawn: "Callable[[], Iterable[StyledLine]]") -> None:
    """Write a picture to a file, or print it.

    Args:
        out: the file; None or `-`: stdout.
        made: makes the file.
        drawn: makes the lines for the terminal.
    """
    if out is None or out == HERE:
        show(drawn())
    else:
        save(out, made(form_of(out)))
