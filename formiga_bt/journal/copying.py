"""A copy of an SQLite journal while its engine writes: all of one moment, in one file.

SQLite's online backup in a single step: it reads one state of the write-ahead log, and writers do not wait for it. In several
steps it would begin anew after each commit of the engine, and never end.
"""

import sqlite3
from contextlib import closing
from pathlib import Path

from formiga_bt.base.errors import JournalError
from formiga_bt.journal import schema
from formiga_bt.journal.database import BUSY_S, told
from formiga_bt.journal.files import check_file
from formiga_bt.journal.looking import look_at


def copy_journal(source: Path, target: Path) -> None:
    """Copy a journal, and check the copy.

    Args:
        source: an SQLite file; an engine may write it.
        target: does not exist; its folder keeps others from it.

    Raises:
        JournalError: it cannot be read, or the copy cannot be written or is not whole.
    """
    check_file(source, create=False)
    look = look_at(source)
    try:
        with (
            closing(sqlite3.connect(look.uri, uri=True, timeout=BUSY_S)) as read,
            closing(sqlite3.connect(target, timeout=BUSY_S)) as written,
        ):
            read.backup(written)
            written.execute("PRAGMA journal_mode = DELETE")  # one file, without a log beside it
    except sqlite3.Error as error:
        raise JournalError(told(str(source), error)) from error
    finally:
        if look.folder is not None:
            look.folder.cleanup()
    check_copy(target)


def check_copy(file: Path) -> None:
    """Look through the whole of a copy that nobody writes.

    Raises:
        JournalError: it is damaged, or no journal.
    """
    try:
        with closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)) as plain:
            ours = plain.execute("PRAGMA application_id").fetchone()[0] == schema.APPLICATION_ID
            said = plain.execute("PRAGMA integrity_check(1)").fetchone()[0] if ours else "it is no journal"
    except sqlite3.Error as error:
        raise JournalError(told(str(file), error)) from error
    if said != "ok":
        raise JournalError(f"the copy {file} of the journal is damaged: {said}")
