"""Files of an agent that does not end because its disk is full: what cannot be written waits in memory, and is written later.

`Disk` tells, once on stderr, that an agent's files cannot be written, and once that they are again. `Lines` is a file of
lines: those that have no room wait, the oldest are given up when too many do. Used by `ledger`, `goalbook` and `process`.
"""

import errno
import os
import time
from collections import deque
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from typing import Final

from formiga_bt.base.clock import SECOND, Micros

MOST_BYTES: Final = 4 * 1024 * 1024
"""So much of one file waits in memory."""
CALM_US: Final[Micros] = 5 * SECOND
"""Wall time without a failure before it is told that all is well: a disk that is nearly full fails now and then."""
TAIL_BYTES: Final = 2 * 1024 * 1024
"""No line is longer."""


def say(text: str) -> bool:
    """Write a line to stderr; return whether it could be: that may be a file on a full disk, too."""
    try:
        os.write(2, f"{text}\n".encode())
    except OSError:
        return False
    return True


def _wall_us() -> Micros:
    return time.monotonic_ns() // 1000


class Disk:
    """What one agent knows of the disk that its files are on.

    Args:
        agent: who tells it.
        tell: takes a line for people, returns whether it got through; one that did not is told later.
        wall: a clock in microseconds that never goes back.
    """

    def __init__(self, agent: str, tell: Callable[[str], bool] = say, wall: Callable[[], Micros] = _wall_us) -> None:
        self._agent, self._tell, self._wall = agent, tell, wall
        self._failed_at: Micros | None = None
        self._bad: set[str] = set()
        self._lost = 0
        self._untold: list[str] = []

    def failed(self, file: str, error: OSError) -> None:
        """Note that a file could not be written; the first time it is told."""
        if self._failed_at is None:
            what = f"{self._agent}: {file} cannot be written ({error.strerror or error})"
            self._untold = [*self._untold[-1:], f"{what}; it goes on, and writes again when it can"]
        self._failed_at = self._wall()
        self._bad.add(file)
        self._speak()

    def worked(self, file: str) -> None:
        """Note that a file was written, with all that waited for it."""
        if self._failed_at is not None:
            self._bad.discard(file)
            self._look()

    def lost(self) -> None:
        """Note that a line was given up."""
        self._lost += 1

    def _look(self) -> None:
        if self._failed_at is None or self._bad or self._wall() - self._failed_at < CALM_US:
            return
        gone = f", but for {self._lost} lines that had no room in memory" if self._lost else ""
        self._untold.append(f"{self._agent}: its files are written again{gone}")
        self._failed_at, self._lost = None, 0
        self._speak()

    def _speak(self) -> None:
        while self._untold and self._tell(self._untold[0]):
            self._untold.pop(0)


class Lines:
    """A file of lines, open for appending; a line that was cut short by a death is removed from its end.

    Args:
        path: the file; it is made when there is room.
        disk: whom to tell that it cannot be written.
    """

    def __init__(self, path: Path, disk: Disk) -> None:
        self._path, self._disk = path, disk
        self._file: FileIO | None = None
        self._waiting: deque[bytes] = deque()
        self._bytes = 0
        self.try_again()

    def write(self, line: bytes) -> None:
        """Append a line; if there is room it is with the operating system when this returns."""
        self._waiting.append(line + b"\n")
        self._bytes += len(line) + 1
        self.try_again()
        while self._bytes > MOST_BYTES and len(self._waiting) > 1:
            self._bytes -= len(self._waiting[1])  # of the first one a part may be written
            del self._waiting[1]
            self._disk.lost()

    def try_again(self) -> None:
        """Write what waits, as far as there is room."""
        try:
            if self._file is None:
                self._file = _opened(self._path)
            while self._waiting:
                line = self._waiting[0]
                done = self._file.write(line) or 0
                if not done:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                self._bytes -= done
                if done < len(line):
                    self._waiting[0] = line[done:]  # the next attempt tells why
                else:
                    self._waiting.popleft()
        except OSError as error:
            self._disk.failed(self._path.name, error)
        else:
            self._disk.worked(self._path.name)

    def close(self) -> None:
        """Write what waits, as far as there is room, and close the file."""
        self.try_again()
        if self._file is not None:
            self._file.close()
            self._file = None


def _opened(path: Path) -> FileIO:
    file = FileIO(path, "a+")
    try:
        size = os.fstat(file.fileno()).st_size
        start = max(0, size - TAIL_BYTES)
        file.seek(start)
        tail = file.read(TAIL_BYTES)
        if tail and not tail.endswith(b"\n"):
            file.truncate(start + tail.rfind(b"\n") + 1)
    except OSError:
        file.close()
        raise
    return file
