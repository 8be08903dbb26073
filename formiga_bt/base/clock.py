"""Time as an argument: integer microseconds, and schedulers that own the flow of time.

Nothing from `lang` to `engine` reads a clock; drivers, transports and simulated agents are handed a `Scheduler`.
`VirtualScheduler` is a discrete-event clock (tests, dry runs); a realtime scheduler lives with the process that needs it.
`EngineClock` is the engine time of a process that runs (ADR 15).
"""

import heapq
import time
from collections.abc import Callable
from typing import Final, Protocol

Micros = int
"""Engine time or wall time, integer microseconds. Engine time starts at the wall clock and never goes back."""

SECOND: Micros = 1_000_000
MOST_SLEW: Final = 0.01
"""Engine time that follows the wall clock runs at most so much slower or faster: 60 s of a clearance are off by 0.6 s."""
SLEW_OVER: Final = 60 * SECOND
"""A small difference is made up over about so long."""
MOST_AHEAD: Final = 300 * SECOND
"""In mode real an engine whose time would begin further ahead of the wall clock does not start."""
OFF: Final = 2 * SECOND
"""In mode real a larger difference between engine time and the wall clock, or of that and the true time, is an alarm."""
LATEST: Final = 4_102_444_800 * SECOND
"""The year 2100: a later instant in a file is damage, not time."""


def micros(seconds: float) -> Micros:
    """Convert seconds to whole microseconds, rounding half to even."""
    return round(seconds * SECOND)


def seconds(us: Micros) -> float:
    """Convert microseconds to seconds."""
    return us / SECOND


def wall_clock_us() -> Micros:
    """Return the wall clock, microseconds since 1970. A person or NTP may set it, also back."""
    return time.time_ns() // 1000


def passed_us() -> Micros:
    """Return microseconds of a clock that never goes back and that nobody sets; a suspended machine's sleep counts."""
    clock = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
    return time.clock_gettime_ns(clock) // 1000


def monotonic_us() -> Micros:
    """Return microseconds of a clock that never goes back and that nobody sets; it stands while the machine is suspended."""
    return time.monotonic_ns() // 1000


class EngineClock:
    """The engine time of a running process: any thread reads it, one thread steers it. It never goes back and never jumps.

    In a simulation it is `start` plus the time that passed, times the speed. Where it follows the wall clock (mode real), it
    approaches the wall clock at a rate between 1 - `MOST_SLEW` and 1 + `MOST_SLEW`, whatever is done to the wall clock.

    Args:
        start: engine time now.
        speed: engine seconds per second; 1 where it follows the wall clock.
        follows_wall: approach the wall clock.
        passed: a clock that nobody sets, microseconds; default: one that fits.
        wall: the wall clock, microseconds.
    """

    def __init__(
        self,
        start: Micros,
        speed: float = 1.0,
        *,
        follows_wall: bool = False,
        passed: Callable[[], Micros] | None = None,
        wall: Callable[[], Micros] = wall_clock_us,
    ) -> None:
        self.follows_wall = follows_wall
        self._passed = passed or (passed_us if follows_wall else monotonic_us)
        self._wall = wall
        self._anchor = (self._passed(), start, speed)
        """Time passed, engine time and rate since the last change of the rate; replaced whole."""

    def now(self) -> Micros:
        """Return the engine time."""
        passed, engine, rate = self._anchor
        return engine + round((self._passed() - passed) * rate)

    @property
    def rate(self) -> float:
        """Return engine seconds per second now: the speed, or what approaches the wall clock."""
        return self._anchor[2]

    @property
    def ahead_us(self) -> Micros:
        """Return by how much engine time is ahead of the wall clock; below 0: behind it."""
        return self.now() - self._wall()

    def steer(self) -> None:
        """Approach the wall clock if it is followed; called about once a second."""
        if self.follows_wall:
            wanted = -self.ahead_us / SLEW_OVER
            self.set_rate(1.0 + max(-MOST_SLEW, min(MOST_SLEW, wanted)))

    def set_rate(self, rate: float) -> None:
        """Go on at another rate from now on, without a jump."""
        passed, engine, before = self._anchor
        now = self._passed()
        self._anchor = (now, engine + round((now - passed) * before), rate)


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
        while self._heap:
            at, _, timer = heapq.heappop(self._heap)
            call, timer.call = timer.call, None
            if call is not None:
                self._now = at
                call()
                return True
        return False

    def advance_to(self, at: Micros) -> None:
        """Move time forward to `at` without running anything; `at` must not lie beyond the next call."""
        due = self.next_time()
        assert due is None or due >= at, "advance_to would jump over a scheduled call"
        self._now = max(self._now, at)
