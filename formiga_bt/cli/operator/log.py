"""`formiga log export`: the flight log as CSV or JSON, with or without a running engine."""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.site_folder import FOLDER, find_folders
from formiga_bt.cli.inputs import UnusableFile


def command(
    what: Annotated[str, typer.Argument(help="export", metavar="export")],
    form: Annotated[Literal["csv", "json"], typer.Option("--format", help="csv or json")] = "csv",
    since: Annotated[
        str, typer.Option(help="Only flights that took off since then, for example 2026-07-01.", metavar="ISO")
    ] = "",
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write to this file.", metavar="FILE")] = None,
    site: Annotated[
        Path | None,
        typer.Option(help="Site file. Default: the site of this folder, or of one above it.", metavar="FILE"),
    ] = None,
) -> None:
    """Print the flight log: who flew what, when and where, for which task, under which pilot, and how it came down.

    Works with and without a running engine. Flights under way are last, with no landing.
    """
    if what != "export":
        raise UnusableFile("say: formiga log export")
    from formiga_bt.services.kept.flightlog import as_csv, as_json, flights, instant

    if since:
        try:
            instant(since)
        except ValueError as error:
            raise UnusableFile(f"--since {since}: say a day or an instant, 2026-07-01 or 2026-07-01T09:00Z") from error
    found = flights(_folder(site), since)
    text = as_csv(found) if form == "csv" else as_json(found)
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UnusableFile(f"cannot write {out}: {error.strerror or error}") from error
    typer.echo(f"{len(found)} flight{'' if len(found) == 1 else 's'} written to {out}", err=True)


def _folder(site: Path | None) -> Path:
    """Return the runtime folder of the site that is meant.

    Raises:
        FormigaError: there is none, or there are several.
    """
    if site is not None:
        beside = (site if site.is_dir() else site.parent).resolve()
        found = sorted(p for p in (beside / FOLDER).glob("*") if p.is_dir())
    else:
        found = find_folders(Path.cwd())
    named = os.environ.get("FORMIGA_SITE", "")
    found = [folder for folder in found if not named or folder.name == named]
    if len(found) == 1:
        return found[0]
    if found:
        raise FormigaError(
            f"several sites were run here: {', '.join(f.name for f in found)}",
            help="choose one: FORMIGA_SITE=NAME formiga log export",
        )
    raise FormigaError("no site was run here, so that there is no flight log", help="name its file: --site FILE")
