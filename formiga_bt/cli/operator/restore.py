"""`formiga restore`: make a site of its backup, in a folder that has none."""

import shlex
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.clock import SECOND
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption
from formiga_bt.cli.printing import print_json, show_next


def command(
    file: Annotated[Path, typer.Argument(help="What `formiga backup` made.", metavar="FILE")],
    into: Annotated[Path, typer.Option(help="Folder of the site; made if it is not there.", metavar="FOLDER")] = Path(),
    as_json: JsonOption = False,
) -> None:
    """Make a site of its backup. Nothing is ever written over: the folder must have no such site.

    All is checked before anything gets its name. The next `formiga up` there begins HELD, under lockdown: nothing starts and
    nothing goes on until a person says `formiga lockdown release`, and `formiga continue` for each task. End the old engine.
    """
    if not file.is_file():
        raise UnusableFile(f"there is no backup {file}")
    from formiga_bt.services.kept.restoring import restore

    found = restore(file, into)
    made = f"{datetime.fromtimestamp(found.made / SECOND).astimezone():%Y-%m-%d %H:%M:%S}"
    if as_json:
        print_json(
            {"site": found.site, "into": str(into), "made": made, "files": len(found.files), "journal": found.journal}
        )
        return
    typer.echo(f"{found.site} as of {made} is in {into.resolve()}; its next start is HELD, under lockdown")
    if "://" in found.journal:
        typer.echo(f"its journal is not in the backup: restore it into {found.journal} (pg_restore) before the start")
    for path in found.left_out:
        typer.echo(f"warning: {path} is not in the backup: put it back yourself", err=True)
    go = f"cd {shlex.quote(str(into))} && " if into != Path() else ""
    show_next(f"{go}formiga doctor", f"{go}formiga up")
