"""Threads on the virtual clock: one runs at a time, in a fixed order, and time passes only when all of them wait.

So a program runs the same way every time, `time.sleep(15)` takes no time, and a loop that polls costs what it polls.
"""

import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

POLL_S: Final = 0.5
"""A poll that finds nothing waits so long at most, so that loops which look at several things go round."""
LEAST_S: Final = 0.001
"""No wait is shorter, so that time passes."""
IDLE_LOOPS: Final = 1000
"""After so many rounds without a wait a `while` loop waits as if it had polled."""
MOST_THREADS: Final = 32

Advance = Callable[[float | None], float]
"""Let time pass until something happens or until a time; return the time."""


class Strand:
    """One thread: where it is held, and what it waits for."""

    def __init__(self) -> None:
        self.gate = threading.Semaphore(0)
        self.ready: Callable[[], bool] = lambda: False
        self.until_s: float | None = None
        self.started = self.ended = self.daemon = False


class Turns:
    """Hands the one turn from strand to strand."""

    def __init__(self, advance: Advance) -> None:
        self.now_s = 0.0
        self.errors: list[BaseException] = []
        """Of threads that ended by one."""
        self._advance = advance
        self._main = Strand()
        self._strands = [self._main]
        self._at = self._main
        self._loops = 0

    def pause(self, ready: Callable[[], bool] = lambda: False, seconds: float | None = None) -> None:
        """Wait until something is so, or so many seconds."""
        me = self._at
        me.ready, me.until_s = ready, None
        if seconds is not None:
            me.until_s = round(self.now_s + max(LEAST_S, float(seconds)), 6)
        self._loops = 0
        following = self._next()
        if following is not me:
            self._at = following
            following.gate.release()
            me.gate.acquire()

    def turn(self) -> None:
        """Count a round of a `while` loop."""
        self._loops += 1
        if self._loops > IDLE_LOOPS:
            self.pause(seconds=POLL_S)

    def start(self, strand: Strand, call: Callable[[], None]) -> None:
        """Start a thread; it runs when it is its turn."""
        if strand.started:
            raise RuntimeError("threads can only be started once")
        if len(self._strands) > MOST_THREADS:
            raise RuntimeError(f"more than {MOST_THREADS} threads")
        strand.started, strand.ready = True, lambda: True

        def body() -> None:
            strand.gate.acquire()
            try:
                call()
            except BaseException as error:  # noqa: BLE001
                self.errors.append(error)
            strand.ended = True
            self._strands.remove(strand)
            self._at = self._next()
            self._at.gate.release()

        threading.Thread(target=body, daemon=True).start()
        self._strands.append(strand)

    def finish(self) -> None:
        """Wait for all threads but daemons, as a program does at its end."""
        self.pause(lambda: all(one.daemon for one in self._strands if one is not self._main))

    def _next(self) -> Strand:
        order = self._strands
        first = order.index(self._at) + 1 if self._at in order else 0
        while True:
            for strand in [*order[first:], *order[:first]]:
                if strand.ready() or (strand.until_s is not None and strand.until_s <= self.now_s):
                    return strand
            ends = [one.until_s for one in order if one.until_s is not None]
            self.now_s = self._advance(min(ends, default=None))


def fake_time(turns: Turns) -> SimpleNamespace:
    """Return the module `time` for programs."""
    now = lambda: turns.now_s  # noqa: E731
    return SimpleNamespace(sleep=lambda seconds: turns.pause(seconds=seconds), time=now, monotonic=now)


def fake_threading(turns: Turns) -> SimpleNamespace:
    """Return the module `threading` for programs."""

    class Thread:
        def __init__(
            self,
            group: None = None,  # noqa: ARG002
            target: Callable[..., Any] | None = None,
            name: str | None = None,
            args: Any = (),
            kwargs: Any = None,
            *,
            daemon: bool | None = None,
        ) -> None:
            self._target, self._args, self._kwargs = target, tuple(args), dict(kwargs or {})
            self._strand = Strand()
            self.name, self.daemon = name or "Thread", bool(daemon)

        def run(self) -> None:
            if self._target is not None:
                self._target(*self._args, **self._kwargs)

        def start(self) -> None:
            self._strand.daemon = self.daemon
            turns.start(self._strand, self.run)

        def join(self, timeout: float | None = None) -> None:
            if not self._strand.started:
                raise RuntimeError("cannot join thread before it is started")
            turns.pause(lambda: self._strand.ended, timeout)

        def is_alive(self) -> bool:
            if self._strand.started and not self._strand.ended:
                turns.pause(lambda: self._strand.ended, POLL_S)
            return self._strand.started and not self._strand.ended

    class Semaphore:
        def __init__(self, value: int = 1) -> None:
            self._value = value

        def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
            if self._value <= 0 and blocking:
                turns.pause(lambda: self._value > 0, None if timeout is None or timeout < 0 else timeout)
            if self._value <= 0:
                return False
            self._value -= 1
            return True

        def release(self) -> None:
            self._value += 1

        def locked(self) -> bool:
            return self._value <= 0

        def __enter__(self) -> bool:
            return self.acquire()

        def __exit__(self, *_: object) -> None:
            self.release()

    class Event:
        def __init__(self) -> None:
            self._set = False

        def set(self) -> None:
            self._set = True

        def clear(self) -> None:
            self._set = False

        def is_set(self) -> bool:
            if not self._set:
                turns.pause(lambda: self._set, POLL_S)
            return self._set

        def wait(self, timeout: float | None = None) -> bool:
            turns.pause(lambda: self._set, timeout)
            return self._set

    class Barrier:
        def __init__(self, parties: int) -> None:
            self._parties, self._waiting, self._round = parties, 0, 0

        def wait(self, timeout: float | None = None) -> int:
            mine, place = self._round, self._waiting
            self._waiting += 1
            if self._waiting == self._parties:
                self._waiting, self._round = 0, mine + 1
            turns.pause(lambda: self._round > mine, timeout)
            return place

    return SimpleNamespace(
        Thread=Thread, Lock=Semaphore, RLock=Semaphore, Event=Event, Barrier=Barrier, Semaphore=Semaphore
    )
