"""`formiga fmt`: lay files out in the one canonical way. The work is done by `lang.text.formatting`."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.author.rewriting import difference, read_exactly, rewrite, yaml_files
from formiga_bt.cli.inputs import rendered
from formiga_bt.lang.text.formatting import format_text


def command(
    files: Annotated[
        list[Path],
        typer.Argument(help="Tasks, libraries, sites, catalogues, scenarios; or folders of them.", metavar="FILE"),
    ],
    check: Annotated[
        bool, typer.Option("--check", help="Change nothing; exit code 1 if something would change.")
    ] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Change nothing; show what would change.")] = False,
) -> None:
    """Lay files out in the canonical way: block style, two spaces a level; comments stay, the meaning never changes.

    Exit code 0: done, or nothing to do. 1: a file cannot be parsed; with --check or --diff: something would change. 2: a file
    cannot be read or written.
    """
    changed: list[Path] = []
    refused = 0
    paths = yaml_files(files)
    for path in paths:
        text = read_exactly(path)
        done = format_text(text, str(path))
        if done.text is None:
            refused += 1
            typer.echo("\n\n".join(rendered(done.diagnostics, {str(path): text})) + "\n", err=True)
        elif done.text != text:
            changed.append(path)
            if diff:
                typer.echo(difference(path, text, done.text), nl=False)
            elif not check:
                rewrite(path, done.text)
    only_look = check or diff
    for path in () if diff else changed:
        typer.echo(f"{'would change' if check else 'changed'} {path}")
    if not diff:
        same = len(paths) - len(changed) - refused
        typer.echo(
            f"{same} of {len(paths)} {'file' if len(paths) == 1 else 'files'} as {'it' if same == 1 else 'they'} should be"
        )
    if refused or (only_look and changed):
        raise typer.Exit(1)
