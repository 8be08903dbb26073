"""The bytes of attachments: `.formiga/<site>/attachments/<sha256>`, a file each, never in the journal.

A file is written once, under its hash. The oldest go when all of them are more than `MOST_ALL` bytes, or older than `KEPT_S`.
Called from threads of the HTTP server and of a wire.
"""

import os
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from formiga_bt.transport.attachments import FileError, check_bytes

FOLDER: Final = "attachments"
MOST_ALL: Final = 2 * 1024**3
"""The most bytes of all files together."""
KEPT_S: Final = 30 * 86400.0
"""Seconds (wall time) that a file is kept."""


class AttachmentStore:
    """Keeps the bytes of attachments (`KeepsFiles`).

    Args:
        beside: the site's runtime folder.
        most: bytes of all files together.
        kept_s: seconds that a file is kept.
        now: the wall clock, seconds.
    """

    def __init__(
        self, beside: Path, *, most: int = MOST_ALL, kept_s: float = KEPT_S, now: Callable[[], float] = time.time
    ) -> None:
        self._folder = beside / FOLDER
        self._most, self._kept_s, self._now = most, kept_s, now
        self._lock = threading.Lock()

    def put(self, digest: str, data: bytes) -> None:
        """Keep bytes; the same again only makes them new.

        Raises:
            FileError: they are too many, have another hash, or cannot be written.
        """
        check_bytes(digest, data)
        with self._lock:
            try:
                self._folder.mkdir(mode=0o700, exist_ok=True)
                self._forget(len(data))
                self._write(self._folder / digest, data)
            except OSError as error:
                raise FileError(f"not_kept: the attachment cannot be written: {error}") from error

    def get(self, digest: str) -> bytes | None:
        """Return the bytes of a hash; None: they are not here, or not what they were."""
        path = self._path(digest)
        try:
            data = path.read_bytes() if path is not None else None
            if data is not None:
                check_bytes(digest, data)
        except (OSError, FileError):
            return None
        return data

    def has(self, digest: str) -> bool:
        """Return whether bytes of a hash are here."""
        path = self._path(digest)
        return path is not None and path.is_file()

    def _path(self, digest: str) -> Path | None:
        plain = len(digest) == 64 and all(one in "0123456789abcdef" for one in digest)
        return self._folder / digest if plain else None

    def _write(self, path: Path, data: bytes) -> None:
        handle, name = tempfile.mkstemp(dir=self._folder, prefix=".new-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.utime(name, (self._now(), self._now()))
            os.replace(name, path)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise

    def _forget(self, more: int) -> None:
        """Make room for so many bytes."""
        found = sorted(
            (one.stat().st_mtime, one.stat().st_size, one) for one in self._folder.iterdir() if one.is_file()
        )
        total = sum(size for _, size, _ in found) + more
        for at, size, path in found:
            if at > self._now() - self._kept_s and total <= self._most:
                break
            path.unlink(missing_ok=True)
            total -= size
