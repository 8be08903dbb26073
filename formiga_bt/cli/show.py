"""`formiga show`: print a checked task as a tree in the terminal."""

import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.inputs import read_task, read_world, readable, rendered


def command(
    file: Annotated[Path, typer.Argument(help="Task file.", metavar="FILE")],
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")] = False,
    depth: Annotated[int | None, typer.Option(min=1, help="Show at most this many levels of steps.")] = None,
    width: Annotated[int | None, typer.Option(min=40, help="Columns to fit into. Default: the terminal's.")] = None,
    site: Annotated[Path | None, typer.Option(help="Site file.", metavar="FILE")] = None,
    actions: Annotated[list[Path] | None, typer.Option(help="Catalogue file; may be repeated.", metavar="FILE")] = None,
) -> None:
    """Print a task as a tree: its roles, its steps with their arguments and modifiers, and where each is written."""
    from formiga_bt.show.terminal import draw

    world = read_world(actions or (), site)
    read = read_task(readable(file), world)
    errors = [d for d in (*world.diagnostics, *read.diagnostics) if d.severity == "error"]
    if errors:
        typer.echo("\n\n".join(rendered(errors, {**world.sources, **read.sources})), err=True)
        raise typer.Exit(1)
    if read.task is None:
        typer.echo(f"formiga: {file} holds subtrees only; show a task that uses them", err=True)
        raise typer.Exit(1)
    columns = width or shutil.get_terminal_size((100, 24)).columns
    plain = ascii_only or not _can_print("├─└│…°")
    for line in draw(read.task, width=columns, ascii_only=plain, depth=depth):
        typer.echo(line.styled() if sys.stdout.isatty() else line.plain())


def _can_print(text: str) -> bool:
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
