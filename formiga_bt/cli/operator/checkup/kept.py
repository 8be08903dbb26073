"""The check of the journal: a file, or a database that may not answer."""

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Final

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import JournalError
from formiga_bt.base.site_folder import NO_JOURNAL, journal_of
from formiga_bt.cli.operator.checkup.finding import Finding, Patient

LOST: Final = "put it back, with its -wal; or begin anew: formiga up --start-anew"


def journal(patient: Patient) -> Iterator[Finding]:
    """Check whether the journal can be read, is whole, and is the one of this folder's last start."""
    folder = patient.runtime
    where = journal_of(folder)
    if not where:
        if (folder / NO_JOURNAL).exists() or not (folder / "epoch").exists():
            yield Finding("ok", "the site keeps no journal yet", str(folder))
        else:
            yield Finding("fail", "the site has run before, and its journal is missing", str(folder), LOST)
        return
    from formiga_bt.journal.keep import file_bytes
    from formiga_bt.journal.store import Journal

    try:
        found = Journal(where, folder.name, read_only=True)
    except JournalError as error:
        text, _, fix = str(error).partition("\n  help: ")
        yield Finding("fail", text, where, fix or "look whether its server runs, and lets this user in")
        return
    with found:
        starts, damage = found.starts(), found.damage()
        if damage:
            yield Finding("fail", f"it is damaged: {damage}", where, "restore a copy: formiga restore FILE")
            return
        if not starts:
            yield Finding("fail", f"it has nothing of {folder.name}", where, LOST)
            return
        last, (seq, at) = starts[-1], found.last()
        size = file_bytes(where)
    known = _epoch(folder)
    said = f"start {last.epoch}, {seq} steps, the last at {datetime.fromtimestamp(at / SECOND).astimezone():%Y-%m-%d %H:%M:%S}"
    yield Finding("ok", said + (f", {size / 1e6:.1f} MB" if size is not None else ""), where)
    if last.ended is None and patient.engine is None:
        what = "the last engine did not end cleanly: it was killed, or its machine went down"
        yield Finding("warn", what, where, "formiga up goes on where it was")
    if known is not None and known > last.epoch + 1:
        what = (
            f"the runtime folder counts {known} starts, the journal {last.epoch}: it is an older copy, or another one"
        )
        yield Finding("warn", what, where, "look whether it is the right one")


def _epoch(folder: Path) -> int | None:
    try:
        return int((folder / "epoch").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
