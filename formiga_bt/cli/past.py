"""Where history is looked at: which journal is meant, and at what moment.

A running engine is asked; where none of the folder runs, its journal tells. `--journal` and `--at` choose. The room `replay`,
which loads the database library, is imported only if a journal is looked at.
"""

import os
import shlex
import sys
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple
from weakref import finalize

import typer

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.site_folder import FOLDER, find_folders, journal_of
from formiga_bt.client import NoEngine

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine
    from formiga_bt.show.replay.source import JournalSource
    from formiga_bt.show.replay.when import MomentWords
    from formiga_bt.show.source import Source

JournalOption = Annotated[
    str,
    typer.Option("--journal", help="Look at this journal, not at a running engine: file or URL.", metavar="FILE|URL"),
]
AtOption = Annotated[
    str,
    typer.Option(
        "--at", help="Look at this moment of the journal: 10:15, '-5 min', 'PickUp-3 end'; an ISO time.", metavar="TIME"
    ),
]


class JournalAddress(NamedTuple):
    """Which journal, of which site."""

    where: str
    site: str


def source_of(
    site: Path | None = None, url: str = "", token_file: Path | None = None, *, journal: str = "", at: str = ""
) -> "Source":
    """Return what is asked: an engine; or a journal, if that is said or no engine of the folder runs. Then one line tells it.

    Raises:
        NoEngine: neither runs, nor is a journal here.
        UnusableFile: the options do not go together, or `at` is no moment.
        JournalError: the journal cannot be read.
    """
    from formiga_bt.cli.options import connect_source
    from formiga_bt.client import PastClient

    if url and journal:
        raise UnusableFile("--url asks an engine, --journal looks at a file or a database; leave one out")
    if url and at:
        return PastClient(connect_source(site, url, token_file), at)
    if journal or at:
        return looked_at(machine_of(site, journal), at)
    try:
        source = connect_source(site, url, token_file)
        return remembering(source, site) if not (url or os.environ.get("FORMIGA_URL")) else source
    except NoEngine:
        if url or os.environ.get("FORMIGA_URL"):
            raise
        found = journals(site)
        if len(found) != 1:
            raise
        return looked_at(machine_at(found[0]), "", why="no engine runs; ")


def is_past(source: "Source") -> bool:
    """Return whether a source is a journal, not an engine."""
    return hasattr(source, "machine") or hasattr(source, "moment")


def remembering(source: "Source", site: Path | None) -> "Source":
    """Return an engine of a folder with the journal that lies there, which knows tasks that the engine has forgotten."""
    from formiga_bt.cli.remembering import Remembering
    from formiga_bt.client import Client

    found = journals(site)
    if len(found) != 1 or not isinstance(source, Client):
        return source
    return Remembering(source, lambda: machine_at(found[0]), zone)


def looked_at(machine: "TimeMachine", at: str, why: str = "") -> "JournalSource":
    """Return a journal at a moment, and tell which it is."""
    from formiga_bt.show.replay.source import JournalSource
    from formiga_bt.show.replay.when import in_words

    source = JournalSource(machine, moment_of(machine, at) if at else None, zone())
    if not (at and report_end(machine, at)):
        print(f"{why}the journal of {machine.journal.site} as of {in_words(source.at, zone())}", file=sys.stderr)
    return source


def report_end(machine: "TimeMachine", at: str) -> bool:
    """Return whether a text means a moment after the journal's end; then one line tells that it is the end that is shown."""
    from formiga_bt.show.replay.when import in_words, meant

    asked, end = meant(at, _times(machine)), machine.last
    if asked <= end:
        return False
    print(
        f"the journal of {machine.journal.site} ends at {in_words(end, zone())}, before {in_words(asked, zone())}; "
        "this is what stood at its end",
        file=sys.stderr,
    )
    return True


def moment_of(machine: "TimeMachine", text: str, *, or_first: bool = False) -> int:
    """Return the moment that a text means; `or_first`: one before the history is its beginning.

    Raises:
        UnusableFile: it means none.
    """
    from formiga_bt.show.replay.when import moment

    return moment(text, _times(machine), or_first=or_first)


def _times(machine: "TimeMachine") -> "MomentWords":
    from formiga_bt.show.replay.when import MomentWords

    return MomentWords(machine.first, machine.last, machine.record, zone())


def zone() -> tzinfo:
    """Return the time zone of this machine."""
    return datetime.now().astimezone().tzinfo or UTC


def with_journal(error: NoEngine, site: Path | None, url: str) -> NoEngine:
    """Return that no engine runs, with what shows the past if its journal is there."""
    found = [] if url or os.environ.get("FORMIGA_URL") else journals(site)
    if len(found) != 1:
        return error
    of = f" --site {shlex.quote(str(site))}" if site is not None else ""
    said = str(error)
    head = "        " if "\n  help: " in said else "  help: "
    return NoEngine(
        f"{said}\n{head}its journal is there: formiga replay --text{of} lists the tasks, "
        f"formiga show TASK-ID{of} and formiga why TASK-ID{of} show one"
    )


def machine_of(site: Path | None, journal: str = "") -> "TimeMachine":
    """Return the time machine on a journal: the one that is named, or that of the folder.

    Raises:
        FormigaError: there is none, or there are several.
        JournalError: it cannot be read.
    """
    return machine_at(place_of(site, journal))


def machine_at(place: JournalAddress) -> "TimeMachine":
    """Return the time machine on a journal; it lets that go when nobody has it any more, or the process ends."""
    from formiga_bt.show.replay.machine import TimeMachine

    machine = TimeMachine(place.where, place.site)
    finalize(machine, machine.journal.close)
    if machine.journal.database.note:
        print(machine.journal.database.note, file=sys.stderr)
    return machine


def place_of(site: Path | None, journal: str = "") -> JournalAddress:
    """Return which journal is meant.

    Raises:
        FormigaError: there is none, or there are several.
    """
    if journal:
        return JournalAddress(journal, _site_in(journal, site))
    found = journals(site)
    if len(found) == 1:
        return found[0]
    if found:
        sites = ", ".join(place.site for place in found)
        raise FormigaError(f"several sites were run here: {sites}", help="choose one: FORMIGA_SITE=NAME formiga ...")
    raise FormigaError(
        f"no journal lies in {(site or Path.cwd()).resolve()}, or a folder above it",
        help="formiga up keeps one beside the site file; one elsewhere: --journal FILE|URL",
    )


def journals(site: Path | None) -> list[JournalAddress]:
    """Return the journals of a folder's sites, as `calling.connect` looks for engines."""
    if site is not None:
        beside = (site if site.is_dir() else site.parent).resolve()
        folders = sorted(p for p in (beside / FOLDER).glob("*") if p.is_dir())
    else:
        folders = find_folders(Path.cwd())
    named = os.environ.get("FORMIGA_SITE", "")
    return [
        JournalAddress(where, folder.name)
        for folder in folders
        if (where := journal_of(folder)) and (not named or folder.name == named)
    ]


def _site_in(journal: str, site: Path | None) -> str:
    from formiga_bt.journal.reading import sites_of

    sites = sites_of(journal)
    named = os.environ.get("FORMIGA_SITE", "")
    if named and named not in sites:
        raise FormigaError(f"{journal} has nothing of the site '{named}'; its sites: {', '.join(sites) or 'none'}")
    sites = [named] if named else sites
    if len(sites) > 1 and site is not None:
        here = {place.name for place in (site if site.is_dir() else site.parent).glob(f"{FOLDER}/*")}
        sites = [one for one in sites if one in here] or sites
    if len(sites) == 1:
        return sites[0]
    if not sites:
        raise FormigaError(f"{journal} is a journal, but it has nothing in it yet")
    raise FormigaError(
        f"{journal} has the history of several sites: {', '.join(sites)}",
        help="choose one: FORMIGA_SITE=NAME formiga ...",
    )
