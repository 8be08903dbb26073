"""`formiga fix`: apply the fixes that the checker offers. The work is done by `lang.text.fixing`."""

import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.author.rewriting import difference, read_exactly, rewrite, yaml_files
from formiga_bt.cli.inputs import UnusableFile, added_catalogues, read_world, rendered


def command(
    files: Annotated[
        list[Path],
        typer.Argument(help="Tasks, libraries, sites, catalogues, scenarios; or folders of them.", metavar="FILE"),
    ],
    site: Annotated[Path | None, typer.Option(help="Site file: fence, places, ports.", metavar="FILE")] = None,
    actions: ActionsOption = None,
    diff: Annotated[bool, typer.Option("--diff", help="Change nothing; show what would change.")] = False,
    write: Annotated[bool, typer.Option("--write", help="Do not ask before writing.")] = False,
) -> None:
    """Fix what has one repair only: misspelt words, words of other tools, missing quotes. Shows each change, and asks.

    Exit code 0: nothing is left to mend. 1: there would be changes, and they were not written. 2: a file cannot be read or
    written. What cannot be mended by a program is told by `formiga check`.
    """
    from formiga_bt.lang.any_file import check_text
    from formiga_bt.lang.text.fixing import mend

    if diff and write:
        raise UnusableFile("--diff and --write exclude one another")
    world = read_world(actions or (), site)
    added = added_catalogues(actions or ())
    changed = left = 0
    unwritten = False
    for path in yaml_files(files):
        text = read_exactly(path)
        check = partial(
            check_text, path=path, catalogue=world.catalogue, actions=world.actions, site=world.site, added=added
        )
        done = mend(text, str(path), check)
        left += len(done.left)
        if done.text == text:
            continue
        changed += 1
        for problem in done.applied:
            typer.echo(rendered([problem], {})[0].splitlines()[0])
        typer.echo(difference(path, text, done.text))
        if diff or not (write or _agreed(path)):
            unwritten = True
        else:
            rewrite(path, done.text)
            typer.echo(f"changed {path}")
    typer.echo(_closing(changed, left))
    if unwritten:
        raise typer.Exit(1)


def _agreed(path: Path) -> bool:
    """Ask whether a file is to be written.

    Raises:
        UnusableFile: nobody is there to answer.
    """
    if not sys.stdin.isatty():
        raise UnusableFile("this is no terminal, nobody can be asked", help="--write writes, --diff only shows")
    return typer.confirm(f"Write {path}?")


def _closing(changed: int, left: int) -> str:
    said = "nothing to fix" if not changed else f"{changed} {'file' if changed == 1 else 'files'} with fixes"
    rest = f"; {left} {'problem is' if left == 1 else 'problems are'} left for you: formiga check" if left else ""
    return said + rest
