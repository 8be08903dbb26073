"""`formiga show`: draw a task as a tree: one of a file, or one that an engine runs, with how its steps stand."""

import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import (
    UnusableFile,
    near,
    read_task,
    read_world,
    readable,
    rendered,
    shipped_task,
    shipped_tasks,
)
from formiga_bt.cli.options import TokenFileOption, UrlOption
from formiga_bt.cli.past import AtOption, JournalOption, is_past

if TYPE_CHECKING:
    from formiga_bt.show.facts import Drawing, TaskPicture
    from formiga_bt.show.source import Source

Format = Literal["terminal", "dot", "svg", "png", "mermaid", "html", "json"]


def command(
    what: Annotated[
        str,
        typer.Argument(
            help="Task file, name of a task that ships, or id of a task; with --blackboard how keys begin.",
            metavar="FILE|TASK-ID",
        ),
    ] = "",
    form: Annotated[
        Format | None, typer.Option("--format", help="How to draw it. Default: as --out ends, else terminal.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write it there; replaces the file.", metavar="FILE")
    ] = None,
    depth: Annotated[int | None, typer.Option(min=1, help="Show at most this many levels of steps.")] = None,
    collapse: Annotated[
        list[str] | None,
        typer.Option(
            help="Leave out what is inside: a subtree, a named step, a path. May be repeated.", metavar="NAME"
        ),
    ] = None,
    blackboard: Annotated[
        bool, typer.Option("--blackboard", help="Show the keys of the engine's blackboard with their values.")
    ] = False,
    live: Annotated[bool, typer.Option("--live", help="Draw it again at every change, until the task ends.")] = False,
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")] = False,
    width: Annotated[int | None, typer.Option(min=40, help="Columns to fit into. Default: the terminal's.")] = None,
    site: Annotated[
        Path | None, typer.Option(help="Site file: to check against, or of the engine to ask.", metavar="FILE")
    ] = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
    journal: JournalOption = "",
    at: AtOption = "",
    actions: ActionsOption = None,
) -> None:
    """Draw a task as a tree: its roles, its steps with their arguments and modifiers, and where each is written.

    Of a running task also how each step stands; without an engine from its journal. Examples: formiga show Circle -o c.svg;
    formiga show Circle-7 --live; formiga show Circle-7 --at "-5 min"; formiga show --blackboard /fleet/
    """
    if blackboard:
        from formiga_bt.cli.past import source_of

        _show_blackboard(source_of(site, url, token_file, journal=journal, at=at), what, as_json=form == "json")
        return
    if not what:
        raise UnusableFile("name a task file, a task that ships, or the id of a task; or say --blackboard")
    from formiga_bt.cli.author.show_out import DrawingOptions

    canvas = DrawingOptions(
        form=form or "",
        out=out,
        depth=depth,
        collapse=tuple(collapse or ()),
        ascii_only=ascii_only or not can_print(),
        width=width or shutil.get_terminal_size((100, 24)).columns,
        colour=coloured(),
    )
    file = _file_of(what) if not (journal or at) else None
    if file is not None:
        if live:
            raise UnusableFile("--live follows a task that an engine runs, and this is a file; name the task's id")
        canvas.show(_drawing(file, site, actions or []))
        _report_written(out)
        return
    source = _connect(what, site, url, token_file, journal, at)
    picture = _task(source, what)
    if live and is_past(source):
        raise UnusableFile("--live follows an engine that runs, and this is its past; formiga replay plays that")
    if live:
        from formiga_bt.cli.author.show_live import follow

        follow(lambda: source.task(what), picture, canvas)
    else:
        canvas.show_task(picture)
    _report_written(out)


def _show_blackboard(source: "Source", prefix: str, *, as_json: bool) -> None:
    """Print the keys of the blackboard that begin with a text, a line each."""
    import msgspec

    wanted = f"/{prefix.removeprefix('/')}"
    board = source.blackboard(wanted)
    if not board.keys and wanted != "/":
        branches = dict.fromkeys(f"/{key.split('/')[1]}/" for key in source.blackboard().keys)
        raise UnusableFile(f"no key of the blackboard begins with {wanted}; it has {', '.join(branches) or 'none'}")
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(board)).decode())
        return
    for key, value in board.keys.items():
        typer.echo(f"{key}  {msgspec.json.encode(value).decode()}")


def _report_written(out: Path | None) -> None:
    if out is not None:
        typer.echo(f"written: {out}", err=True)


def _file_of(what: str) -> Path | None:
    """Return the task file that a word means, or None if it must be a task's id."""
    path = shipped_task(Path(what))
    if path.exists() or path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        return readable(path)
    return None


def _drawing(file: Path, site: Path | None, actions: list[Path]) -> "Drawing":
    from formiga_bt.show.tree.drawing import drawing_of

    world = read_world(actions, site, near=near(file))
    read = read_task(file, world)
    errors = [d for d in (*world.diagnostics, *read.diagnostics) if d.severity == "error"]
    if errors:
        typer.echo("\n\n".join(rendered(errors, {**world.sources, **read.sources})), err=True)
        raise typer.Exit(1)
    if read.task is None:
        typer.echo(f"formiga: {file} holds subtrees only; show a task that uses them", err=True)
        raise typer.Exit(1)
    return drawing_of(read.task, sources=read.sources)


def _connect(
    what: str, site: Path | None, url: str, token_file: Path | None, journal: str = "", at: str = ""
) -> "Source":
    from formiga_bt.cli.past import source_of
    from formiga_bt.client import NoEngine

    try:
        return source_of(site, url, token_file, journal=journal, at=at)
    except NoEngine as error:
        raise NoEngine(
            f"'{what}' is no file here and no task that ships{_near(what, shipped_tasks())}; and {error}"
        ) from (error)


def _task(source: "Source", what: str) -> "TaskPicture":
    from formiga_bt.base.errors import FormigaError

    try:
        return source.task(what)
    except FormigaError as error:
        if getattr(error, "code", "") != "unknown_task":
            raise
        where = "its journal" if is_past(source) else "the engine"
        ids = [task.id for task in source.now(over=True).tasks]
        here = f"; its tasks: {', '.join(ids[:5])}" if ids else ""
        raise FormigaError(
            f"'{what}' is no file here, no task that ships, and no task of {where}"
            f"{_near(what, [*ids, *shipped_tasks()]) or here}"
        ) from error


def _near(word: str, known: "list[str] | dict[str, Path]") -> str:
    from difflib import get_close_matches

    close = get_close_matches(word, known, n=3, cutoff=0.6)
    return f" (near: {', '.join(close)})" if close else ""


def coloured() -> bool:
    """Return whether stdout takes colours: it is a terminal, and nobody said NO_COLOR."""
    return sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def can_print() -> bool:
    """Return whether stdout takes the characters of the drawing."""
    from formiga_bt.show.tree.terminal import UNICODE_USED

    try:
        UNICODE_USED.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
