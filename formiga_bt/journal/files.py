"""The files of an SQLite journal, known by `stat` alone: closing any descriptor of one drops SQLite's locks on it.

POSIX locks belong to a process: when it closes a file, all its locks on that file are gone, also those that SQLite holds. Then
another program that looks at the journal takes itself for the last one, and removes the write-ahead log under the engine. So no
process that uses a journal opens its files but through SQLite (docs/adr/0014-only-sqlite-opens-a-journal.md).
"""

import stat
from pathlib import Path
from typing import Final

from formiga_bt.base.errors import JournalError

ANEW: Final = "begin anew, what is there is set aside: formiga up --start-anew"
"""What to do where nothing can be put back."""


def beside(file: Path) -> Path:
    """Return the write-ahead log of an SQLite file."""
    return file.with_name(file.name + "-wal")


def index_of(file: Path) -> Path:
    """Return the index of an SQLite file's write-ahead log, which all who use it share."""
    return file.with_name(file.name + "-shm")


def all_of(file: Path) -> tuple[Path, Path, Path]:
    """Return a journal's files: itself, its write-ahead log, the index of that."""
    return file, beside(file), index_of(file)


def size_of(file: Path) -> int | None:
    """Return the bytes of a file; None: it is not there.

    Raises:
        OSError: it cannot be known.
    """
    try:
        return file.stat().st_size
    except (FileNotFoundError, NotADirectoryError):
        return None


def lost(file: Path) -> str:
    """Return how a journal that an engine wrote before is gone: missing or empty; an empty text if it is there.

    Raises:
        JournalError: it cannot be known.
    """
    try:
        size = size_of(file)
    except OSError as error:
        raise _unusable(file, error) from error
    return "is missing" if size is None else "is empty" if not size else ""


def check_file(file: Path, *, create: bool) -> None:
    """Look at an SQLite file before SQLite does, for that removes a write-ahead log whose file is empty.

    Raises:
        JournalError: it cannot be used, or (unless `create`) is not there; nothing was changed.
    """
    try:
        size = size_of(file)
        if size is not None and not stat.S_ISREG(file.stat().st_mode):
            raise JournalError(
                f"{file} is no journal: it is no regular file", help="name another file: formiga up --journal FILE"
            )
        if size is None and not create:
            raise JournalError(f"there is no journal {file}", help="formiga up makes one")
        if not size and size_of(beside(file)):
            what = "is missing" if size is None else "is empty"
            raise JournalError(
                f"the journal {file} {what}, and {beside(file).name} beside it has steps of it",
                help=f"put the file back that belongs to it; or {ANEW}",
            )
        if size is None:
            if file.parent.exists() and not file.parent.is_dir():
                raise JournalError(f"cannot use the journal {file}: {file.parent} is no folder")
            file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unusable(file, error) from error


def _unusable(file: Path, error: OSError) -> JournalError:
    return JournalError(
        f"cannot use the journal {file}: {error.strerror or error}", help="look who may read the file and its folder"
    )


class Identity:
    """The files that an engine has open, by their inodes. SQLite goes on writing into one that has no name any more.

    Args:
        file: of the journal; its log and index are there, too.

    Raises:
        OSError: one cannot be looked at.
    """

    def __init__(self, file: Path) -> None:
        self._known = {one: _inode(one) for one in all_of(file)}
        self._file = file

    def gone(self) -> str:
        """Return which file is missing or another one; an empty text if all are what they were."""
        try:
            for one, known in self._known.items():
                if _inode(one) != known:
                    return f"{one} is another file than the one that this engine writes"
            return "" if self._file.stat().st_size else f"{self._file} was emptied"
        except FileNotFoundError as error:
            return f"{error.filename} is missing"
        except OSError as error:
            return f"{error.filename}: {error.strerror or error}"

    @property
    def is_only_the_log_lost(self) -> bool:
        """Return whether the file itself is there, and nobody began another log."""
        try:
            return _inode(self._file) == self._known[self._file] and not size_of(beside(self._file))
        except OSError:
            return False


def _inode(file: Path) -> tuple[int, int]:
    found = file.stat()
    return found.st_dev, found.st_ino
