"""Files of a site's runtime folder that commands change while an engine reads them: read within bounds, changed by one."""

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from formiga_bt.base.errors import SiteError


class PrivateFileError(Exception):
    """A file cannot be used; the text says why."""


def read_private(file: Path, most_bytes: int) -> bytes | None:
    """Return what is in a file, or None if there is none. A pipe is not waited for.

    Raises:
        PrivateFileError: it is no file, too large, cannot be read, or a link to nowhere.
    """
    try:
        found = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        if not file.is_symlink():
            return None
        raise PrivateFileError("it is a link to nowhere") from None
    except OSError as error:
        raise PrivateFileError(error.strerror or str(error)) from error
    try:
        with open(found, "rb") as opened:
            told = os.fstat(found)
            if not stat.S_ISREG(told.st_mode) or told.st_size > most_bytes:
                raise PrivateFileError("it is no file, or too large")
            return opened.read(most_bytes)
    except OSError as error:
        raise PrivateFileError(error.strerror or str(error)) from error


@contextmanager
def changing(folder: Path) -> Iterator[None]:
    """Keep other commands from changing such files of a folder meanwhile.

    Raises:
        SiteError: the folder cannot be used.
    """
    try:
        held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise SiteError(f"cannot use {folder}: {error.strerror or error}") from error
    try:
        fcntl.flock(held, fcntl.LOCK_EX)
        yield
    finally:
        os.close(held)
