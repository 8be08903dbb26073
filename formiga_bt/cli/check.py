"""`formiga check`: read task files and report all problems, for people or (`--json`) for programs."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from formiga_bt.cli.inputs import find_tasks, read_task, read_world, rendered
from formiga_bt.diagnostics import Diagnostic, in_order


def command(
    files: Annotated[list[Path], typer.Argument(help="Task files, or folders of them.", metavar="FILE")],
    site: Annotated[Path | None, typer.Option(help="Site file: fence, places, ports.", metavar="FILE")] = None,
    actions: Annotated[
        list[Path] | None,
        typer.Option(
            help="Catalogue file; may be repeated. Default: the catalogue that ships with formiga.", metavar="FILE"
        ),
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse warnings too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
) -> None:
    """Check task files and report all problems at once.

    Exit code 0: usable. 1: there are errors (or, with --strict, warnings). 2: a file cannot be read.
    """
    given = find_tasks(files)
    paths = given.tasks
    world = read_world(actions or (), site)
    found, sources = list(world.diagnostics), dict(world.sources)
    for path in paths:
        read = read_task(path, world)
        found += read.diagnostics
        sources.update(read.sources)
    problems = in_order(found)
    errors = sum(d.severity == "error" for d in problems)
    warnings = len(problems) - errors
    refused = errors > 0 or (strict and warnings > 0)
    if as_json:
        report: dict[str, Any] = {"ok": not refused, "files": len(paths), "errors": errors, "warnings": warnings}
        report["no_tasks"] = [str(path) for path in given.others]
        typer.echo(json.dumps({**report, "diagnostics": [_as_dict(d) for d in problems]}, indent=2))
    else:
        for text in rendered(problems, sources):
            typer.echo(text + "\n")
        typer.echo(_closing(len(paths), errors, warnings, refused) + (f"; {given.note}" if given.note else ""))
    if refused:
        raise typer.Exit(1)


def _closing(files: int, errors: int, warnings: int, refused: bool) -> str:
    verdict = "refused" if refused else "ok"
    return f"{verdict}: {_count(files, 'file')}, {_count(errors, 'error')}, {_count(warnings, 'warning')}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _as_dict(diagnostic: Diagnostic) -> dict[str, Any]:
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        **asdict(diagnostic.mark),
        "message": diagnostic.message,
        "help": diagnostic.help,
        "within": diagnostic.within,
        "fix": asdict(diagnostic.fix) if diagnostic.fix else None,
    }
