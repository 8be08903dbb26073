"""Looking at an SQLite journal that lies where nothing can be written: a copy from a site, a read-only disk, another's folder.

In WAL mode SQLite makes files beside the one that it only reads. Where it may not, this finds another way, in this order:

1. as ever: it can, or the files that it needs are there (also those of an engine that writes now),
2. as a file that nobody changes, if no steps wait in the write-ahead log,
3. in a copy of the file and its write-ahead log.
"""

import os
import shutil
import sqlite3
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Final, NamedTuple

from formiga_bt.errors import JournalError

TRIES: Final = 3
"""A copy is made so often, if somebody writes meanwhile."""
_CANNOT: Final = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM, sqlite3.SQLITE_IOERR)


class Look(NamedTuple):
    """How a journal is opened to be read."""

    uri: str = ""
    """For SQLite; empty: as ever."""
    note: str = ""
    """What people are told of it; mostly nothing."""
    folder: "TemporaryDirectory[str] | None" = None
    """Of the copy; gone when it is cleaned up."""


def look_at(file: Path) -> Look:
    """Return how to open a journal that is only read.

    Raises:
        JournalError: there is no way.
    """
    if is_writable(file) or not is_refused(file):
        return Look()
    wal = beside(file)
    try:
        waiting = wal.stat().st_size if wal.exists() else 0
        if not waiting:
            return Look(f"{file.resolve().as_uri()}?mode=ro&immutable=1")
        folder = _copied(file, wal)
    except OSError as error:
        raise JournalError(
            f"cannot look at the journal {file}: nothing can be written beside it, its newest steps are in {wal.name}, "
            f"and no copy of both could be made in {gettempdir()}: {_told(error)}\n"
            f"  help: copy {file.name} and {wal.name} into a folder of yours, and name that: --journal FILE; "
            "if only room is missing: TMPDIR=FOLDER formiga ..."
        ) from error
    note = (
        f"{file} lies where nothing can be written, and its newest steps are in {wal.name}: "
        f"a copy of both is looked at, in {folder.name}"
    )
    return Look((Path(folder.name) / file.name).as_uri(), note, folder)


def beside(file: Path) -> Path:
    """Return the write-ahead log of an SQLite file."""
    return file.with_name(file.name + "-wal")


def is_writable(file: Path) -> bool:
    """Return whether SQLite may write the file, and others beside it."""
    own = os.access in os.supports_effective_ids
    folder = file.absolute().parent
    return os.access(file, os.W_OK, effective_ids=own) and os.access(folder, os.W_OK | os.X_OK, effective_ids=own)


def is_refused(file: Path) -> bool:
    """Return whether SQLite cannot open the file as ever because it may not write."""
    try:
        connection = sqlite3.connect(file)
        try:
            connection.execute("PRAGMA schema_version").fetchone()
        finally:
            connection.close()
    except sqlite3.Error as error:
        return (getattr(error, "sqlite_errorcode", 0) & 0xFF) in _CANNOT
    return False


def _copied(file: Path, wal: Path) -> "TemporaryDirectory[str]":
    """Copy a journal with its write-ahead log.

    Raises:
        OSError: it cannot be read, there is no room, or somebody writes it all the time.
    """
    folder = TemporaryDirectory(prefix="formiga-journal-")
    try:
        for _ in range(TRIES):
            before = _marks(file, wal)
            for one in (file, wal):
                target = Path(folder.name) / one.name
                target.unlink(missing_ok=True)
                shutil.copyfile(one, target)
            if _marks(file, wal) == before:
                return folder
        raise OSError(None, "somebody writes it all the time")
    except BaseException:
        folder.cleanup()
        raise


def _told(error: OSError) -> str:
    what = error.strerror or str(error)
    return f"{what} ({error.filename})" if error.filename else what


def _marks(*files: Path) -> list[tuple[int, int]]:
    return [((found := one.stat()).st_mtime_ns, found.st_size) for one in files]
