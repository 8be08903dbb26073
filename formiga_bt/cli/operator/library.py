"""Which tasks `formiga up` serves: those of the site, then those that ship; and what it does not serve, and why."""

import shlex
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from formiga_bt.base.packaged import folder
from formiga_bt.cli.inputs import CheckWorld, ReadFile, find_tasks, read_task, rendered, task_files
from formiga_bt.services.not_served import NotServed

if TYPE_CHECKING:
    from formiga_bt.lang.model import Task


def check_options(site: Path, actions: Sequence[Path] = ()) -> str:
    """Return the options with which `formiga check` judges as this start does."""
    return " ".join(
        f"--{name} {shlex.quote(str(path))}" for name, path in [("site", site), *(("actions", a) for a in actions)]
    )


def read_library(
    tasks: list[Path] | None, beside: Path, world: CheckWorld, texts: dict[str, dict[str, str]], options: str
) -> "tuple[dict[str, Task], list[NotServed]]":
    """Return the tasks to serve, and what is not served and why; put the files that each was read from into `texts`.

    A file of the site goes before a shipped one. Tasks in folders of what ships (cookbook, warehouse) are for copying: a site
    serves its copies.

    Args:
        tasks: files and folders; None: those of the site.
        beside: the folder of the site file.
        world: the site and its catalogue.
        texts: is filled.
        options: of the `formiga check` that is advised.
    """
    own = beside / "trees"
    given = find_tasks(tasks) if tasks is not None else find_tasks([own] if own.is_dir() else [], may_be_empty=True)
    mine = given.tasks
    if given.note:
        typer.echo(f"{given.note}\n", err=True)
    shipped = [path for path in task_files([folder("trees")]) if path.parent == folder("trees")]
    served: dict[str, Task] = {}
    refused: list[NotServed] = []
    for path in (*mine, *(p for p in shipped if p not in mine)):
        read = read_task(path, world)
        errors = [d for d in read.diagnostics if d.severity == "error"]
        if read.task is None or errors:
            refused.append(_why_not(read, options, is_shipped=path not in mine))
            if path in mine:
                typer.echo("\n\n".join(rendered(errors, read.sources)) + f"\n\n{path} is not served\n", err=True)
        elif read.task.name in served:
            if path in mine:
                first = served[read.task.name].mark.file
                refused.append(
                    NotServed(f"{path}: {first} has the task {read.task.name} too; name one of them otherwise")
                )
        else:
            served[read.task.name] = read.task
            texts[read.task.name] = dict(read.sources)
    return served, refused


def _why_not(read: ReadFile, options: str, *, is_shipped: bool) -> NotServed:
    """Return the first error of a file that is not served, and the command that tells all of them."""
    errors = [d for d in read.diagnostics if d.severity == "error"]
    whose = " (ships with formiga)" if is_shipped else ""
    file = shlex.quote(str(read.path))
    load = "" if is_shipped else f"formiga load {file}"
    ways = NotServed("", f"formiga check {file} {options}", _names(read.path), load, shipped=is_shipped)
    if not errors:
        return replace(ways, why=f"{read.path}{whose}: it holds no task")
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    first = errors[0]
    return replace(ways, why=f"{first.mark}{whose}: {first.code}: {first.message}{more}")


def _names(path: Path) -> tuple[str, ...]:
    """Return the names under which a task would be requested if its file had no errors; none if there is no telling."""
    from formiga_bt.lang.request.aliases import names_in

    with suppress(OSError, UnicodeDecodeError):
        return tuple(names_in(path.read_text(encoding="utf-8")))
    return ()


def warn_of_waits(served: "dict[str, Task]", world: CheckWorld) -> None:
    """Say which of the tasks may wait for one another's machines; each alone is sound, so they are served."""
    from formiga_bt.lang.checks.deadlock import check_tasks

    for one in check_tasks(list(served.values()), world.catalogue):
        typer.echo(f"warning: {one.mark}: {one.code}: {one.message}\n  help: {one.help}\n", err=True)
