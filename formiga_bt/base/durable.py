"""Files that a power cut leaves whole, and that are their owner's alone: replaced at once, or grown by lines.

Called by whoever keeps something on disk. Modes do not depend on the umask of whoever started the process.
"""

import fcntl
import json
import os
import stat
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, Any, Final

from formiga_bt.base.errors import SiteError

PRIVATE_FILE: Final = 0o600
PRIVATE_FOLDER: Final = 0o700


def open_to_others(told: os.stat_result) -> bool:
    """Say whether anybody but its owner may read, write or run a file; of a secret that is a fault."""
    return bool(stat.S_IMODE(told.st_mode) & 0o077)


def private_folder(path: Path) -> None:
    """Make a folder, and those above it that lack; it is its owner's alone, also if it was there before.

    Raises:
        OSError: it cannot be made, or is somebody else's.
    """
    path.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
    path.chmod(PRIVATE_FOLDER)


def make_private(tree: Path) -> None:
    """Take the rights of others away from everything in a folder that is this user's; links are left as they are."""
    for place, folders, files in os.walk(tree):
        for names, mode in ((folders, PRIVATE_FOLDER), (files, PRIVATE_FILE)):
            for name in names:
                path = Path(place) / name
                with suppress(OSError):  # it has gone meanwhile, or is somebody else's
                    if not path.is_symlink() and path.stat().st_mode & 0o777 != mode:
                        path.chmod(mode)


def append_line(file: Path, record: Mapping[str, Any]) -> None:
    """Add a record to a file of JSON lines, safely on disk when this returns; what a power cut left half written stays alone.

    Raises:
        SiteError: the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        is_new = not file.exists()
        with open(file, "ab+", opener=private) as lines:
            torn = lines.tell() > 0 and _last_byte(lines) != b"\n"
            text = json.dumps(dict(record), ensure_ascii=False)
            lines.write((b"\n" if torn else b"") + text.encode() + b"\n")
            lines.flush()
            os.fsync(lines.fileno())
        if is_new:
            sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error


def private(name: str, flags: int) -> int:
    """Open a file that is its owner's alone; an `opener` of `open`."""
    return os.open(name, flags, PRIVATE_FILE)


def _last_byte(file: IO[bytes]) -> bytes:
    file.seek(-1, os.SEEK_END)
    return file.read(1)


def read_lines(file: Path) -> list[dict[str, Any]]:
    """Return the records of a file of JSON lines, those that a power cut cut short left out; none, if there is no file.

    Raises:
        SiteError: the file is there but cannot be read.
    """
    try:
        texts = file.read_bytes().splitlines() if file.exists() else []
    except OSError as error:
        raise SiteError(f"cannot read {file}: {error.strerror or error}") from error
    found = []
    for text in texts:
        try:
            record = json.loads(text)
        except ValueError:
            continue
        if isinstance(record, dict):
            found.append(record)
    return found


def write_durably(file: Path, text: str) -> None:
    """Replace a file so that after a power cut it is either the old or the new one.

    Raises:
        SiteError: it cannot be written.
    """
    _replace(file, text).close()


def write_held(file: Path, text: str) -> IO[str]:
    """Replace a file as `write_durably` does; return it open and `flock`ed, from the first instant that others see it.

    The lock goes with the process, however it ends: `is_held` tells what a living process wrote from what was left.

    Raises:
        SiteError: it cannot be written.
    """
    return _replace(file, text, is_held=True)


def _replace(file: Path, text: str, is_held: bool = False) -> IO[str]:
    beside = file.with_name(f".{file.name}.new")
    try:
        with ExitStack() as until_done:
            new = until_done.enter_context(open(beside, "w", encoding="utf-8", opener=private))
            os.fchmod(new.fileno(), PRIVATE_FILE)
            new.write(text)
            new.flush()
            os.fsync(new.fileno())
            if is_held:
                fcntl.flock(new, fcntl.LOCK_EX)
            beside.replace(file)
            sync_folder(file.parent)
            until_done.pop_all()
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error
    return new


def is_held(file: Path) -> bool:
    """Return whether a living process holds the `flock` of a file; False if the file cannot be opened."""
    try:
        with file.open("r", encoding="utf-8") as there:
            fcntl.flock(there, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def remove_durably(file: Path) -> None:
    """Remove a file so that it does not come back after a power cut.

    Raises:
        SiteError: it cannot be removed.
    """
    try:
        file.unlink(missing_ok=True)
        sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot remove {file}: {error.strerror or error}") from error


def move_aside(files: Sequence[Path], name: str = "aside") -> Path | None:
    """Move files of one folder, in this order, into a folder NAME-N beside them.

    It is the last there is, if none of them is in it yet. Files that are not there are passed over; None: none is there.

    Raises:
        SiteError: they cannot be moved; some may be.
    """
    there = [one for one in files if one.exists() or one.is_symlink()]
    if not there:
        return None
    beside = there[0].parent
    try:
        numbers = (one.name.removeprefix(f"{name}-") for one in beside.glob(f"{name}-*"))
        last = max((int(one) for one in numbers if one.isascii() and one.isdecimal()), default=0)
        if not last or any((beside / f"{name}-{last}" / one.name).exists() for one in there):
            last += 1
        target = beside / f"{name}-{last}"
        target.mkdir(exist_ok=True)
        for one in there:
            one.rename(target / one.name)
        sync_folder(target)
        sync_folder(beside)
    except OSError as error:
        raise SiteError(f"cannot set {there[0]} aside: {error.strerror or error}") from error
    return target


def sync_folder(path: Path) -> None:
    """Have the names in a folder survive a power cut."""
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
