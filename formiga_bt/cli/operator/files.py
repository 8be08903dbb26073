"""`formiga files TASK`: the files that agents named for a task, beside their steps; `--save` fetches them."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.errors import FormigaError
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table, tell_clock
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import ApiError, Client, connect
from formiga_bt.show.facts import FileFact
from formiga_bt.show.why.words import span
from formiga_bt.transport.attachments import FileError, check_bytes


def command(
    task: Annotated[str, typer.Argument(help="The task, such as Inspect-3.", metavar="TASK")],
    save: Annotated[Path | None, typer.Option("--save", help="Fetch them into this folder.", metavar="FOLDER")] = None,
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List the files that agents named for a task: photos, logs; oldest first, each with the step it came with."""
    client = connect(site, url, token_file)
    tell_clock(client)
    found = client.detail(task)
    if as_json:
        print_json(found.files)
        return
    if not found.files:
        typer.echo(f"no agent named a file for {task}")
        show_next(f"formiga why {task}")
        return
    rows = [("FILE", "TYPE", "SIZE", "AGENT", "FROM", "STEP", "AGO")]
    print_table([*rows, *(_row(one, found.at) for one in found.files)])
    if save is None:
        show_next(f"formiga files {task} --save FOLDER")
    elif not _save(client, found.files, save):
        raise typer.Exit(1)


def size_words(size: int) -> str:
    """Return a size as people read it."""
    return f"{size} B" if size < 1000 else f"{size / 1000:.0f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB"


def _row(one: FileFact, now: int) -> tuple[str, ...]:
    return (
        one.name, one.media_type, size_words(one.size), one.agent, one.what, one.path or "-", span(max(0, now - one.at)),
    )  # fmt: skip


def _save(client: Client, files: tuple[FileFact, ...], folder: Path) -> bool:
    """Fetch files; return whether all came. A file that is there already is never written over."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnusableFile(f"{folder}: {error.strerror}") from error
    came = True
    for one in {file.sha256: file for file in files}.values():
        try:
            data = client.bytes_of(one.sha256)
            check_bytes(one.sha256, data)
            path = _write(folder, one, data)
        except (ApiError, FileError) as error:
            came = False
            typer.echo(f"{one.name}: {error.text if isinstance(error, FormigaError) else error}", err=True)
        except OSError as error:
            raise UnusableFile(f"{folder / one.name}: {error.strerror}") from error
        else:
            typer.echo(str(path))
    return came


def _write(folder: Path, one: FileFact, data: bytes) -> Path:
    stem, dot, end = one.name.rpartition(".")
    names = [one.name, f"{stem or end}-{one.sha256[:8]}{dot if stem else ''}{end if stem else ''}"]
    for name in names:
        path = folder / Path(name).name
        try:
            with path.open("xb") as file:
                file.write(data)
        except FileExistsError:
            if path.read_bytes() == data:
                return path
        else:
            return path
    raise UnusableFile(f"{folder / names[-1]} is there already, and is another file")
