"""`formiga check`: read task files and report all problems, for people or for programs. The work is done by `checking`."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.author.checking import FORMS, Form, check
from formiga_bt.cli.inputs import UnusableFile


def command(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Task files, or folders of them with their libraries, sites, catalogues and tests.", metavar="FILE"
        ),
    ],
    site: Annotated[Path | None, typer.Option(help="Site file: fence, places, ports.", metavar="FILE")] = None,
    actions: ActionsOption = None,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse warnings too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
    as_sarif: Annotated[bool, typer.Option("--sarif", help="Print a SARIF 2.1.0 log instead of text.")] = False,
    as_github: Annotated[bool, typer.Option("--github", help="Print annotations for GitHub's workflows.")] = False,
) -> None:
    """Check task files, libraries, sites, catalogues, rules, scenarios and test files, or folders of them.

    Exit code 0: usable. 1: there are errors (or, with --strict, warnings). 2: a file cannot be read.
    """
    asked = [form for form, wanted in zip(FORMS, (as_json, as_sarif, as_github), strict=True) if wanted]
    if len(asked) > 1:
        raise UnusableFile(f"--{asked[0]} and --{asked[1]} exclude one another")
    form: Form = asked[0] if asked else "text"
    if code := check(files, site, actions or (), strict=strict, form=form):
        raise typer.Exit(code)
