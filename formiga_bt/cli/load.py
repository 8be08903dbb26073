"""`formiga load`: have a running engine read new and changed task files."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.client import (
    JsonOption,
    SiteOption,
    TokenFileOption,
    UrlOption,
    connect,
    print_json,
    show_next,
    user,
)
from formiga_bt.cli.inputs import task_files
from formiga_bt.cli.loading import load_file


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
    served as it is changes nothing. On a site in mode real a new version flies only once it is approved.
    """
    client = connect(site, url, token_file)
    answers = [load_file(client, file, by=by or user(), site=site, quiet=as_json) for file in task_files(files)]
    if as_json:
        print_json(answers)
        return
    for answer in answers:
        if answer["what"] == "same":
            typer.echo(answer["text"], err=True)
    show_next(f"formiga run {answers[-1]['task']}", "formiga tasks --library")
