"""The process of an engine: started, killed, stopped and continued, cut off from its disk, and what each start said."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from msgspec import Struct

STARTS_S: Final = 90.0
"""A start takes at most this, on a machine that has other work."""
UNLIMITED: Final = resource.RLIM_INFINITY


class Start(Struct, frozen=True):
    """A start of an engine, and how it went."""

    number: int
    wall: float
    ok: bool
    seconds: float
    said: str = ""
    """What it printed, if it did not succeed."""
    harmed: str = ""
    """What of its folder or its disk had been harmed before."""


def pythons() -> dict[str, str]:
    """Return the environment in which processes of the tree under test run."""
    return {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"}


class Engine:
    """The engines of one site, one after another.

    Args:
        folder: the site's.
        endpoint: where it listens to agents.
        speed: engine seconds per wall second.
        prefix: words before the command, such as `prlimit --nofile=256`; they must end by becoming it.
        environment: more of it.
        options: more words for `formiga up`.
    """

    def __init__(
        self,
        folder: Path,
        endpoint: str,
        *,
        speed: float = 10.0,
        prefix: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
        options: Sequence[str] = (),
    ) -> None:
        self.folder, self.endpoint, self.speed = folder, endpoint, speed
        self.prefix, self.environment, self.options = list(prefix), dict(environment or {}), list(options)
        self.starts: list[Start] = []
        self.deaths: list[float] = []
        """When it was killed, seconds since 1970."""
        self.ended: list[str] = []
        """What it printed, each time that it ended though nobody had killed it."""
        self.away: list[tuple[float, float]] = []
        """From when to when no engine could act: dead, starting, or stopped. Seconds since 1970."""
        self.url = ""
        self.harmed = ""
        self._process: subprocess.Popen[bytes] | None = None
        self._since = time.time()
        self._stopped_at: float | None = None

    # -- how it stands -----------------------------------------------------------------------------------------------
    @property
    def pid(self) -> int:
        assert self._process is not None
        return self._process.pid

    @property
    def runs(self) -> bool:
        """Return whether its process runs; one that ended by itself is noted."""
        if self._process is None:
            return False
        if self._process.poll() is None:
            return True
        self._fell()
        return False

    @property
    def stands_still(self) -> bool:
        """Return whether it was stopped (SIGSTOP)."""
        return self._stopped_at is not None

    def log(self, number: int | None = None) -> str:
        """Return what the newest engine printed."""
        file = self.folder / f"engine-{number if number is not None else len(self.starts)}.log"
        return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""

    def _fell(self) -> None:
        assert self._process is not None
        self.ended.append(f"ended with status {self._process.returncode} by itself\n{self.log()[-3000:]}")
        self._gone()

    def _gone(self) -> None:
        self._process, self.url, self._stopped_at = None, "", None
        self._since = time.time()

    # -- start and end -----------------------------------------------------------------------------------------------
    def words(self) -> list[str]:
        """Return the command."""
        up = ["up", "--http", "127.0.0.1:0", "--speed", f"{self.speed:g}", "--actions", "actions.yaml"]
        return [*self.prefix, sys.executable, "-m", "formiga_bt", *up, "--listen", self.endpoint, *self.options]

    def start(self, within_s: float = STARTS_S) -> Start:
        """Start it, and wait until it serves or has ended."""
        assert self._process is None
        number, began = len(self.starts) + 1, time.time()
        with (self.folder / f"engine-{number}.log").open("wb") as log:
            self._process = subprocess.Popen(
                self.words(), cwd=self.folder, env={**pythons(), **self.environment},
                stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        file = self.folder / ".formiga"
        start: Start | None = None
        while start is None:
            took = time.time() - began
            if self._process.poll() is not None:
                start = Start(number, began, False, took, self.log(number), self.harmed)
                self._gone()
            elif (said := self._address(file)) is not None:
                self.url = str(said["url"])
                start = Start(number, began, True, took, "", self.harmed)
                self.away.append((self._since, time.time()))
            elif took > within_s:
                start = Start(
                    number, began, False, took, f"no word within {within_s:g} s\n{self.log(number)}", self.harmed
                )
                self.kill()
            else:
                time.sleep(0.03)
        self.starts.append(start)
        return start

    def _address(self, folder: Path) -> dict[str, Any] | None:
        for file in folder.glob("*/engine.json"):
            with suppress(OSError, ValueError):
                said = json.loads(file.read_text(encoding="utf-8"))
                if isinstance(said, dict) and said.get("pid") == self.pid:
                    return said
        return None

    def kill(self) -> None:
        """Kill -9."""
        if self._process is not None and self.runs:
            self.deaths.append(time.time())
            self._process.kill()
            self._process.wait()
            self._gone()

    def end(self, within_s: float = 30.0) -> None:
        """End it in good order (SIGTERM)."""
        if self._process is None or not self.runs:
            return
        self.go_on()
        self._process.terminate()
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            self.ended.append(f"did not end within {within_s:g} s of SIGTERM")
            self.kill()
            return
        if self._process.returncode:
            self.ended.append(f"ended with status {self._process.returncode} after SIGTERM\n{self.log()[-3000:]}")
        self._gone()

    # -- what befalls it ---------------------------------------------------------------------------------------------
    def stop(self) -> None:
        """Let it stand still (SIGSTOP)."""
        if self.runs and self._stopped_at is None:
            os.kill(self.pid, signal.SIGSTOP)
            self._stopped_at = time.time()

    def go_on(self) -> None:
        """Let it go on."""
        if self._stopped_at is not None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGCONT)
            self.away.append((self._stopped_at, time.time()))
            self._stopped_at = None

    def fill_disk(self, largest: int | None) -> None:
        """Let it write no file beyond so many bytes; None: as it likes again."""
        if self.runs:
            soft = UNLIMITED if largest is None else largest
            resource.prlimit(self.pid, resource.RLIMIT_FSIZE, (soft, UNLIMITED))

    def free(self) -> list[tuple[float, float]]:
        """Return the spans in which it could not act, up to now."""
        open_ = []
        if self._process is None:
            open_.append((self._since, time.time()))
        elif self._stopped_at is not None:
            open_.append((self._stopped_at, time.time()))
        return [*self.away, *open_]
