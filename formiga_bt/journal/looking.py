"""Looking at an SQLite journal, which never writes: no table, no step, and no file stays beside it that was not there.

| what lies there | how it is opened |
|---|---|
| the file, its log and the log's index: an engine writes it, or was killed | read-only, the index too |
| the file alone: its engine has ended | `query_only`; an engine may start meanwhile; SQLite takes its files away again |
| the file alone, where nothing can be written | as a file that nobody changes |
| the log without its index: a copy of a killed engine's files | a copy of both, in a temporary folder |

`immutable` takes no locks, and a copy opens the files: neither happens where an engine has the journal open.
"""

import os
import sqlite3
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Final, NamedTuple

from formiga_bt.base.errors import JournalError
from formiga_bt.journal.files import beside, index_of, size_of

TRIES: Final = 3
"""A copy is made so often, if somebody writes meanwhile."""
_CANNOT: Final = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM, sqlite3.SQLITE_IOERR)


class JournalAccess(NamedTuple):
    """How a journal is opened to be read."""

    uri: str
    """For SQLite."""
    note: str = ""
    """What people are told of it; mostly nothing."""
    folder: "TemporaryDirectory[str] | None" = None
    """Of the copy; gone when it is cleaned up."""


def look_at(file: Path) -> JournalAccess:
    """Return how to open a journal that is only read.

    Raises:
        JournalError: there is no way.
    """
    wal, name = beside(file), file.resolve().as_uri()
    try:
        waiting, has_index = size_of(wal), size_of(index_of(file)) is not None
        if has_index and waiting is not None:
            for way in ("mode=ro&readonly_shm=1", "mode=ro"):
                if not is_refused(f"{name}?{way}"):
                    return JournalAccess(f"{name}?{way}")
        if waiting is None and not has_index and is_writable(file) and not is_refused(f"{name}?mode=rw"):
            return JournalAccess(f"{name}?mode=rw")
        if not waiting:
            return JournalAccess(f"{name}?mode=ro&immutable=1")
        folder = _copied(file, wal)
    except OSError as error:
        raise JournalError(
            f"cannot look at the journal {file}: its newest steps are in {wal.name}, without the index of that, "
            f"and no copy of both could be made in {gettempdir()}: {_told(error)}",
            help=f"copy {file.name} and {wal.name} into a folder of yours, and name that: --journal FILE; "
            "if only room is missing: TMPDIR=FOLDER formiga ...",
        ) from error
    note = f"the newest steps of {file} are in {wal.name}, without its index: a copy of both is looked at, in {folder.name}"
    return JournalAccess((Path(folder.name) / file.name).as_uri(), note, folder)


def is_writable(file: Path) -> bool:
    """Return whether SQLite may write the file, and others beside it."""
    own = os.access in os.supports_effective_ids
    folder = file.absolute().parent
    return os.access(file, os.W_OK, effective_ids=own) and os.access(folder, os.W_OK | os.X_OK, effective_ids=own)


def is_refused(uri: str) -> bool:
    """Return whether SQLite cannot open a file so because of what it may do there."""
    try:
        connection = sqlite3.connect(uri, uri=True)
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
            _copy(file, wal, folder=folder.name)
            if _marks(file, wal) == before:
                return folder
        raise OSError(None, "somebody writes it all the time")
    except BaseException:
        folder.cleanup()
        raise


def _copy(*files: Path, folder: str) -> None:
    """Copy files in a process of its own, which has no locks that it could drop."""
    done = subprocess.run(["cp", "--", *map(str, files), folder], capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(None, done.stderr.strip().replace("\n", "; ") or f"cp ended with {done.returncode}")


def _told(error: OSError) -> str:
    what = error.strerror or str(error)
    return f"{what} ({error.filename})" if error.filename else what


def _marks(*files: Path) -> list[tuple[int, int]]:
    return [((found := one.stat()).st_mtime_ns, found.st_size) for one in files]
