"""`formiga import`: read another tool's file as a task file."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile, read_world, readable, rendered, written


def command(
    file: Annotated[Path, typer.Argument(help="XML file of BehaviorTree.CPP (versions 3 and 4).", metavar="FILE")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write to this file.", metavar="FILE")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE of --out.")] = False,
    actions: ActionsOption = None,
) -> None:
    """Read an XML file of BehaviorTree.CPP as a task file, and report what cannot be carried over.

    What a person has to decide stands in the task file as `# TODO`. Exit code 0: written. 1: the XML is refused, or it has
    what cannot be said as a task (codes X08, X09): the file is written, and the task fails at these places. 2: the file
    cannot be read.
    """
    from formiga_bt.bridges.btcpp_in import import_btcpp
    from formiga_bt.bridges.elements import MAX_BYTES
    from formiga_bt.lang.loader import load_task_text

    with readable(file).open("rb") as stream:
        try:
            data = stream.read(MAX_BYTES + 1)
        except OSError as error:
            raise UnusableFile(f"cannot read {file}: {error.strerror or error}") from error
    world = read_world(actions or ())
    done = import_btcpp(data, str(file), world.catalogue)
    for text in rendered(done.found, {str(file): data.decode("utf-8", "replace")}):
        typer.echo(text + "\n", err=True)
    if not done.text:
        raise typer.Exit(1)
    written(done.text, out, force=force)
    checked = load_task_text(done.text, str(out or "task"), catalogue=world.catalogue)
    errors = sum(d.severity == "error" for d in checked.diagnostics)
    verdict = "checks clean" if not checked.diagnostics else f"has {errors} errors left; see formiga check"
    unsaid = f", {len(done.errors)} of them of what cannot be said as a task" if done.errors else ""
    typer.echo(f"imported with {len(done.found)} remarks{unsaid}; the task {verdict}", err=True)
    if done.errors:
        raise typer.Exit(1)
