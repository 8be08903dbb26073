"""`formiga load`: have a running engine read new and changed task files."""

import sys
from pathlib import Path
from typing import Annotated, Final, Literal

import typer
from msgspec import Struct

from formiga_bt.cli.inputs import UnusableFile, task_files
from formiga_bt.cli.loading import load_file
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import ApiError, Client, connect
from formiga_bt.show.facts import TaskLoaded

EXIT_NO: Final = 1
OF_NO_FILE: Final = (401, 403)
"""Statuses of answers that the next file would get too."""


class FileRefused(Struct, frozen=True):
    """A file that the engine does not serve as it is now, and why."""

    file: str
    code: str
    text: str
    what: Literal["refused"] = "refused"


def command(
    files: Annotated[list[Path], typer.Argument(help="Task files, or folders of them.", metavar="FILE...")],
    by: Annotated[str, typer.Option(help="Who loads them. Default: you.", metavar="NAME")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """Have the running engine read task files: new requests get them as they are now. Starts nothing.

    The engine checks each with its own catalogue and site. A task that runs goes on with the version it has. A file that is
    served as it is changes nothing. On a site in mode real a new version flies only once it is approved. One that is refused
    keeps no other from being read.
    """
    client = connect(site, url, token_file)
    tasks = task_files(files)
    if len(tasks) == 1 and not as_json:
        answers: list[TaskLoaded | FileRefused] = [load_file(client, tasks[0], by=by or user(), site=site)]
    else:
        answers = [_loaded(client, file, by=by or user(), site=site, quiet=as_json) for file in tasks]
    refused = [answer for answer in answers if isinstance(answer, FileRefused)]
    if as_json:
        print_json(answers)
    else:
        _tell(answers, refused)
    if refused:
        raise typer.Exit(EXIT_NO)


def _loaded(client: Client, file: Path, *, by: str, site: Path | None, quiet: bool) -> "TaskLoaded | FileRefused":
    """Return what an engine said of a file; of one that is refused, why: that is told at once."""
    try:
        return load_file(client, file, by=by, site=site, quiet=quiet)
    except (ApiError, UnusableFile) as error:
        if isinstance(error, ApiError) and (error.status in OF_NO_FILE or error.status >= 500):
            raise
        print(f"formiga: {error}\n", file=sys.stderr)
        return FileRefused(str(file), error.code if isinstance(error, ApiError) else "unusable_file", str(error))


def _tell(answers: "list[TaskLoaded | FileRefused]", refused: list[FileRefused]) -> None:
    taken = [answer for answer in answers if isinstance(answer, TaskLoaded)]
    for answer in taken:
        if answer.what == "same":
            typer.echo(answer.text, err=True)
    if refused:
        verb = "is" if len(refused) == 1 else "are"
        names = ", ".join(one.file for one in refused)
        typer.echo(f"{len(refused)} of {len(answers)} files {verb} not served as now written: {names}", err=True)
    if taken:
        show_next(f"formiga run {taken[-1].task}", "formiga tasks --library")
