"""Files that a power cut leaves whole: replaced at once, or grown by lines. Called by whoever keeps something on disk."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from formiga_bt.errors import SiteError


def append_line(file: Path, record: Mapping[str, Any]) -> None:
    """Add a record to a file of JSON lines, safely on disk when this returns; what a power cut left half written stays alone.

    Raises:
        SiteError: the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        is_new = not file.exists()
        with file.open("ab+") as lines:
            torn = lines.tell() > 0 and _last_byte(lines) != b"\n"
            text = json.dumps(dict(record), ensure_ascii=False)
            lines.write((b"\n" if torn else b"") + text.encode() + b"\n")
            lines.flush()
            os.fsync(lines.fileno())
        if is_new:
            _sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error


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
    try:
        beside = file.with_name(f".{file.name}.new")
        with beside.open("w", encoding="utf-8") as new:
            new.write(text)
            new.flush()
            os.fsync(new.fileno())
        beside.replace(file)
        _sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot write {file}: {error.strerror or error}") from error


def remove_durably(file: Path) -> None:
    """Remove a file so that it does not come back after a power cut.

    Raises:
        SiteError: it cannot be removed.
    """
    try:
        file.unlink(missing_ok=True)
        _sync_folder(file.parent)
    except OSError as error:
        raise SiteError(f"cannot remove {file}: {error.strerror or error}") from error


def _sync_folder(path: Path) -> None:
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
