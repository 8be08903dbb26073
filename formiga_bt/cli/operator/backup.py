"""`formiga backup`: a site in one file, also while its engine runs."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.packaged import folder
from formiga_bt.base.site_folder import FOLDER
from formiga_bt.cli.inputs import CheckWorld, UnusableFile, find_tasks, is_demo, read_task, read_world
from formiga_bt.cli.options import JsonOption
from formiga_bt.cli.printing import print_json, show_next


def command(
    file: Annotated[Path, typer.Argument(help="The file to write, for example meadow.zip.", metavar="FILE")],
    site: Annotated[Path, typer.Option(help="Site file.", metavar="FILE")] = Path("site.yaml"),
    attachments: Annotated[
        bool, typer.Option("--attachments", help="Photos and logs that agents named, too: up to 2 GiB.")
    ] = False,
    without_journal: Annotated[
        bool,
        typer.Option(
            "--without-journal", help="The journal lies in PostgreSQL, which pg_dump copies; or there is none."
        ),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it is there.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a site into one file: site file, trees, catalogues, journal, accounts, approvals, flight log.

    The engine may run, and nobody waits for it. The file is read again before it gets its name. It is its owner's alone:
    it has the site's token, accounts and keys, but no secrets of news.
    Example: formiga backup meadow.zip; back again: formiga restore meadow.zip --into FOLDER
    """
    if is_demo(site) or not site.is_file():
        raise UnusableFile(f"there is no site file {site}", help="name it: formiga backup FILE --site FILE")
    if file.exists() and not force:
        raise UnusableFile(f"{file} exists; to replace it say --force")
    from formiga_bt.services.kept.backup import Source

    world = read_world([], site)
    source = Source(
        site, _used(site, world), _runtime(site, world), attachments=attachments, without_journal=without_journal
    )
    made = source.write(file)
    if as_json:
        told = {"file": str(file), "site": made.site, "epoch": made.epoch, "journal": made.journal}
        print_json({**told, "bytes": file.stat().st_size, "files": len(made.files), "left_out": made.left_out})
        return
    typer.echo(
        f"{file}: {made.site} with {len(made.files)} files, {file.stat().st_size / 1e6:.1f} MB, read again and whole"
    )
    if world.site is None:
        typer.echo(
            f"warning: {site} has errors, so files that it names may not be in it: formiga check {site}", err=True
        )
    for path in made.left_out:
        typer.echo(f"warning: {path} lies outside of the site's folder, and is not in it: keep it yourself", err=True)
    show_next(f"formiga restore {file} --into FOLDER")


def _used(site: Path, world: CheckWorld) -> list[Path]:
    """Return the files that the site and its tasks are read from, but for those that ship."""
    from formiga_bt.lang.site.libraries import library_folders
    from formiga_bt.lang.site.named_files import named_files

    trees = site.parent / "trees"
    tasks = find_tasks([trees], may_be_empty=True).tasks if trees.is_dir() else []
    read = [Path(name) for task in tasks for name in read_task(task, world).sources]
    libraries = library_folders(site.read_text(encoding="utf-8"), str(site))
    own = [path for one in libraries for path in sorted(one.rglob("*"))]
    found = [
        *own,
        *named_files(site.read_text(encoding="utf-8"), site),
        *map(Path, world.sources),
        *world.actions,
        *read,
    ]
    shipped = [folder(one).resolve() for one in ("actions", "trees")]
    return [one for one in found if one.is_file() and not any(one.resolve().is_relative_to(own) for own in shipped)]


def _runtime(site: Path, world: CheckWorld) -> Path:
    beside = site.parent.resolve() / FOLDER
    if world.site is not None:
        return beside / world.site.name
    there = [one for one in beside.glob("*") if one.is_dir()]  # a site file with an error is no reason to keep nothing
    if len(there) != 1:
        raise UnusableFile(f"{site} has errors, so the name of its site is not known", help=f"formiga check {site}")
    return there[0]
