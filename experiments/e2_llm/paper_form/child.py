"""This end of the pipe to the child process, with limits on all that comes through it."""

import json
import os
import select
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any, Final

from msgspec import Struct

_MAIN: Final = Path(__file__).parent / "inside" / "child.py"
LONGEST_LINE: Final = 64 << 10


class Limits(Struct, frozen=True, kw_only=True):
    """How much a program may use."""

    cpu_s: int = 20
    wall_s: float = 60.0
    memory_mb: int = 512
    calls: int = 200_000
    """Questions to the fleet."""


class NoSandboxError(Exception):
    """The child cannot be locked up on this machine; nothing was run."""


class GoneError(Exception):
    """The child says nothing more: it ended, was killed by a limit, or said what is no answer."""


class TooLongError(Exception):
    """The wall time is over."""


def check_sandbox() -> None:
    """Lock up an empty program.

    Raises:
        NoSandboxError: this machine cannot lock up programs.
    """
    with suppress(GoneError, TooLongError), Child("", Limits(wall_s=20.0)) as child:
        child.hear()


class Child:
    """A child process with one program. A context: entering gives it the program, leaving kills it.

    Raises:
        GoneError, TooLongError: on entering: it does not take the program.
    """

    def __init__(self, code: str, limits: Limits, *, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._ends = clock() + limits.wall_s
        self._buffer = b""
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-B", str(_MAIN)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={},
            cwd="/",
            close_fds=True,
            start_new_session=True,
            bufsize=0,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._in, self._out = self._process.stdin.fileno(), self._process.stdout.fileno()
        os.set_blocking(self._in, False)
        self._order = {"code": code, "cpu_s": limits.cpu_s, "memory_mb": limits.memory_mb}

    def __enter__(self) -> "Child":
        try:
            self.say(self._order)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def say(self, value: dict[str, Any]) -> None:
        """Send a line. A program that has ended is found out by `hear`, after what it said before.

        Raises:
            GoneError, TooLongError: it is not taken.
        """
        left = json.dumps(value).encode() + b"\n"
        while left:
            self._wait([], [self._in])
            try:
                left = left[os.write(self._in, left) :]
            except BrokenPipeError:
                return
            except OSError as error:
                raise GoneError(self._why()) from error

    def hear(self) -> dict[str, Any]:
        """Return the next line.

        Raises:
            GoneError: there is none.
            TooLongError: there was none in time.
            NoSandboxError: the child was not locked up.
        """
        while b"\n" not in self._buffer:
            if len(self._buffer) > LONGEST_LINE:
                raise GoneError("it said a line without an end")
            self._wait([self._out], [])
            part = os.read(self._out, LONGEST_LINE)
            if not part:
                raise GoneError(self._why())
            self._buffer += part
        line, self._buffer = self._buffer.split(b"\n", 1)
        if len(line) > LONGEST_LINE:
            raise GoneError(f"it said a line of {len(line)} bytes")
        try:
            found = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise GoneError("it said what is no JSON") from error
        if not isinstance(found, dict) or not isinstance(found.get("do"), str):
            raise GoneError("it said what is no question")
        if found["do"] == "no_jail":
            raise NoSandboxError(f"{found.get('text')}\n  help: run the column paper-form on a Linux machine")
        return found

    def _wait(self, read: list[int], write: list[int]) -> None:
        left = self._ends - self._clock()
        if left <= 0 or not any(select.select(read, write, [], left)[:2]):
            raise TooLongError("the program took too long")

    def _why(self) -> str:
        try:
            code = self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            return "the program's process closed its output"
        return (
            f"the program's process was ended by signal {-code}"
            if code < 0
            else f"the program's process ended ({code})"
        )
