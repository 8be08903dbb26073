"""`formiga diff`: what changed between two task files, as trees and not as text."""

import json
import subprocess
import tarfile
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from msgspec.structs import replace

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import CheckWorld, ReadFile, UnusableFile, near, read_task, read_world, readable, rendered

if TYPE_CHECKING:
    from formiga_bt.show.diff.caution import Caution
    from formiga_bt.show.diff.changes import Difference

EXIT_SAME, EXIT_DIFFERENT, EXIT_UNUSABLE = 0, 1, 2


def command(
    files: Annotated[list[Path], typer.Argument(help="Two task files: as it was, and as it is.", metavar="A B")],
    git: Annotated[
        str, typer.Option("--git", help="Compare one file with itself at a revision of git.", metavar="REV")
    ] = "",
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")] = False,
    width: Annotated[int | None, typer.Option(min=40, help="Columns to fit into. Default: the terminal's.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
    site: Annotated[Path | None, typer.Option(help="Site file that both are checked against.", metavar="FILE")] = None,
    actions: ActionsOption = None,
) -> None:
    """Show what changed between two tasks: added, removed, moved, changed, renamed, and what to look at for safety.

    Formatting, comments, the order of keys and other units are no change. Exit code 0: the same. 1: different.
    2: a file cannot be used. Examples: formiga diff old.yaml new.yaml; formiga diff --git HEAD trees/survey.yaml
    """
    if len(files) != (1 if git else 2):
        raise UnusableFile("name two files, or one file and --git REV" if not git else "--git compares one file")
    world = read_world(actions or (), site, near=near(files[0]))
    old, new = _at_revision(files[0], git, world) if git else (_read(files[0], world), _read(files[1], world))
    _refuse_errors(world, old, new)
    from formiga_bt.show.diff.caution import cautions
    from formiga_bt.show.diff.changes import compare

    assert old.read.task is not None
    assert new.read.task is not None
    difference = compare(old.read.task, new.read.task, old.read.sources, new.read.sources)
    look_at = cautions(difference, world.catalogue.actions)
    if as_json:
        typer.echo(json.dumps(_report(difference, look_at, old), indent=2))
    else:
        _print(difference, look_at, width, ascii_only=ascii_only)
    raise typer.Exit(EXIT_DIFFERENT if difference.changes else EXIT_SAME)


@dataclass(frozen=True, slots=True)
class _Version:
    """A file as read, and how messages call it."""

    read: ReadFile
    name: str
    unpacked: str = ""
    """Where it lies for now, if it is of a revision; no message says so."""


def _read(path: Path, world: CheckWorld) -> _Version:
    read = read_task(readable(path), world)
    lines = [line for text in list(read.sources.values())[:1] for line in text.splitlines()]
    if any(line.startswith("subtrees:") for line in lines) and not any(line.startswith("task:") for line in lines):
        raise UnusableFile(f"{path} holds subtrees only; compare tasks that call them")
    return _Version(read, str(path))


def _refuse_errors(world: CheckWorld, *versions: _Version) -> None:
    """Say what is wrong in the files, and end."""
    problems = [*world.diagnostics, *(d for one in versions for d in one.read.diagnostics)]
    errors = list(dict.fromkeys(d for d in problems if d.severity == "error"))
    sources = {**world.sources, **{file: text for one in versions for file, text in one.read.sources.items()}}
    if errors:
        typer.echo("\n\n".join(rendered(errors, sources)), err=True)
        typer.echo("\nformiga: nothing is compared, for there are errors", err=True)
        raise typer.Exit(EXIT_UNUSABLE)


def _print(difference: "Difference", look_at: "Sequence[Caution]", width: int | None, *, ascii_only: bool) -> None:
    import shutil

    from formiga_bt.cli.author.show import can_print, coloured
    from formiga_bt.show.diff.terminal import draw

    columns = width or shutil.get_terminal_size((100, 24)).columns
    colour = coloured()
    for line in draw(difference, look_at, width=columns, ascii_only=ascii_only or not can_print()):
        typer.echo(line.styled() if colour else line.plain(), color=colour)
    if not difference.changes:
        typer.echo(difference.in_words())


def _report(difference: "Difference", look_at: "Sequence[Caution]", old: _Version) -> dict[str, Any]:
    from msgspec import to_builtins

    def labelled(change: dict[str, Any]) -> dict[str, Any]:
        for spot in (change.get("before"), change.get("spot")):
            if spot and old.unpacked and spot["file"].startswith(old.unpacked):
                spot["file"] = old.name.partition(":")[0] + ":" + str(Path(spot["file"]).relative_to(old.unpacked))
        return change

    return {
        "same": not difference.changes,
        "counts": difference.counts,
        "changes": [labelled(to_builtins(change)) for change in difference.changes],
        "look_at": [labelled(to_builtins(caution)) for caution in look_at],
    }


# -- git ---------------------------------------------------------------------------------------------------------------
def _at_revision(path: Path, revision: str, world: CheckWorld) -> tuple[_Version, _Version]:
    """Return a file as it was at a revision, with its imports of then, and as it is.

    Raises:
        UnusableFile: there is no git, no such revision, or no such file in it.
    """
    now = _read(path, world)
    folder = path.resolve().parent
    root = Path(_git(folder, "rev-parse", "--show-toplevel").decode().strip())
    inside = path.resolve().relative_to(root)
    commit = _git(folder, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}", of=revision)
    tree = _git(root, "archive", "--format=tar", commit.decode().strip(), "--", "*.y*ml", of=revision)
    with tempfile.TemporaryDirectory(prefix="formiga-diff-") as temporary:
        with tarfile.open(fileobj=BytesIO(tree)) as archive:
            archive.extractall(temporary, filter="data")
        then = Path(temporary, inside)
        if not then.is_file():
            raise UnusableFile(f"{path} is not in {revision}")
        libraries = [one.resolve() for one in world.catalogue.libraries]
        of_then = tuple(Path(temporary, one.relative_to(root)) for one in libraries if one.is_relative_to(root))
        catalogue = replace(world.catalogue, libraries=of_then)
        read = _labelled(read_task(then, replace(world, catalogue=catalogue)), temporary, revision)
    return _Version(read, f"{revision}:{inside}", temporary), now


def _git(folder: Path, *words: str, of: str = "") -> bytes:
    try:
        done = subprocess.run(["git", "-C", str(folder), *words], capture_output=True, check=False)
    except OSError as error:
        raise UnusableFile(f"git cannot be run: {error.strerror}") from error
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        what = f"there is no revision '{of}', or no task files in it" if of else "this is no folder of git"
        raise UnusableFile(f"{what}{': ' + said[-1] if said else ''}")
    return done.stdout


def _labelled(read: ReadFile, temporary: str, revision: str) -> ReadFile:
    """Return a file read from a temporary place with problems and texts under the name of its revision."""

    def label(file: str) -> str:
        return f"{revision}:{Path(file).relative_to(temporary)}" if file.startswith(temporary) else file

    problems = tuple(replace(d, mark=replace(d.mark, file=label(d.mark.file))) for d in read.diagnostics)
    return replace(
        read,
        diagnostics=problems,
        sources={**read.sources, **{label(file): text for file, text in read.sources.items()}},
    )
