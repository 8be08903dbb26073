"""Time as an argument: integer microseconds, and schedulers that own the flow of time.

Nothing from `lang` to `engine` reads a clock; drivers, transports and simulated agents are handed a `Scheduler`.
`VirtualScheduler` is a discrete-event clock (tests, dry runs); a realtime scheduler lives with the process that needs it.
"""

import heapq
from collections.abc import Callable
from typing import Protocol

Micros = int
"""Engine time or wall time, integer microseconds. Engine time starts at the wall clock and never goes back."""

SECOND: Micros = 1_000_000


def micros(seconds: float) -> Micros:
    """Convert seconds to whole microseconds, rounding half to even."""
    return round(seconds * SECOND)


def seconds(us: Micros) -> float:
    """Convert microseconds to seconds."""
    return us / SECOND


class Timer:
    """A scheduled call; `cancel()` is idempotent and may be called after it ran."""

    __slots__ = ("at", "call")

    def __init__(self, at: Micros, call: Callable[[], None]) -> None:
        self.at = at
        self.call: Callable[[], None] | None = call

    def cancel(self) -> None:
        """Forget the call if it has not run yet."""
        self.call = None


class Scheduler(Protocol):
    """What a simulated body, an agent's rules or an in-process transport know of time."""

    def now(self) -> Micros:
        """Return the current time of this scheduler in microseconds."""
        ...

    def call_at(self, at: Micros, call: Callable[[], None]) -> Timer:
        """Run `call` once at time `at` (at once, after what is already due, if `at` is past)."""
        ...


class VirtualScheduler:
    """Discrete-event time: it jumps to the next scheduled call. Equal times run in the order of scheduling."""

    def __init__(self, start: Micros = 0) -> None:
        self._now = start
        self._seq = 0
        self._heap: list[tuple[Micros, int, Timer]] = []

    def now(self) -> Micros:
        """Return the virtual time in microseconds."""
        return self._now

    def call_at(self, at: Micros, call: Callable[[], None]) -> Timer:
        """Schedule `call` for `at`, or for now if `at` is past."""
        timer = Timer(max(at, self._now), call)
        self._seq += 1
        heapq.heappush(self._heap, (timer.at, self._seq, timer))
        return timer

    def next_time(self) -> Micros | None:
        """Return the time of the earliest live call, or None when nothing is scheduled."""
        while self._heap and self._heap[0][2].call is None:
            heapq.heappop(self._heap)
        return self._heap[0][0] if self._heap else None

    def run_next(self) -> bool:
        """Advance to the earliest call and run it; return False if there was none."""
        if self.next_time() is None:
            return False
        at, _, timer = heapq.heappop(self._heap)
        self._now = at
        call, timer.call = timer.call, None
        if call is not None:
            call()
        return True

    def advance_to(self, at: Micros) -> None:
        """Move time forward to `at` without running anything; `at` must not lie beyond the next call."""
        due = self.next_time()
        assert due is None or due >= at, "advance_to would jump over a scheduled call"
        self._now = max(self._now, at)
