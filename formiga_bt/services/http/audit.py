"""Who asked for what, and whether it was granted: one line of JSON for each request that changes something, and each refusal.

    {"at": "2026-11-27T08:11:02.113Z", "who": "ann", "from": "127.0.0.1", "asked": "POST /v1/tasks", "status": 201}

Never a body, a header or what stands behind `?`: they may hold secrets. What was granted is in the journal, too, with its name.
The file has two generations of `MOST_BYTES`, so nobody fills the disk by being refused.
"""

import json
import logging
import os
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, Final

from formiga_bt.base.durable import PRIVATE_FILE

log = logging.getLogger("formiga.audit")

FILE: Final = "audit.jsonl"
OLDER: Final = "audit.1.jsonl"
MOST_BYTES: Final = 20_000_000


class Audit:
    """Writes the lines. A disk that takes none holds up nobody: it is logged once."""

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES) -> None:
        self._folder = folder
        self._most = most_bytes
        self._lock = threading.Lock()
        self._open: IO[bytes] | None = None
        self._fails = False

    def note(self, who: str, whence: str, method: str, path: str, status: int) -> None:
        """Write one line."""
        at = datetime.fromtimestamp(time.time(), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        line = json.dumps({"at": at, "who": who, "from": whence, "asked": f"{method} {path[:300]}", "status": status})
        with self._lock:
            try:
                self._file().write(line.encode() + b"\n")
                self._fails = False
            except OSError as error:
                if not self._fails:
                    log.warning("the audit cannot be written: %s", error.strerror or error)
                self._fails = True

    def close(self) -> None:
        """End; may be called twice."""
        with self._lock:
            if self._open is not None:
                with suppress(OSError):
                    self._open.close()
                self._open = None

    def _file(self) -> IO[bytes]:
        file = self._folder / FILE
        if self._open is not None and self._open.tell() >= self._most:
            self._open.close()
            self._open = None
            os.replace(file, self._folder / OLDER)
        if self._open is None:
            found = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, PRIVATE_FILE)
            self._open = open(found, "ab", buffering=0)  # noqa: SIM115 - it stays open
        return self._open


def read_audit(folder: Path) -> Iterator[dict[str, Any]]:
    """Iterate over the lines that can be read, oldest first."""
    for name in (OLDER, FILE):
        with suppress(FileNotFoundError), open(folder / name, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                with suppress(ValueError):
                    found = json.loads(line)
                    if isinstance(found, dict):
                        yield found
