"""Engine time for an agent that is an OS process: wall time x the engine's speed, corrected by its beats.

Why not the wall clock: at speed 10 a drone must fly ten times as fast. Why own timers: a call runs at exactly its
instant of engine time (`now()` inside it is the time it was due), so that motion is as exact as in virtual time, and a
jump of engine time (an engine that starts, or starts again) takes all timers along. For one thread.
"""

import heapq
from collections.abc import Callable
from typing import Final

from formiga_bt.base.clock import SECOND, Micros, Timer
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.base import AgentBody, AgentLink
from formiga_bt.transport.messages import AgentCard, ClockBeat

JUMP_WALL_S: Final = 2
"""A beat that differs by more than this much wall time from what was expected is a jump, else a correction."""


class PacedScheduler:
    """A `Scheduler` of engine time on a wall clock. Starts at `start` with `speed` until the first beat.

    Args:
        wall: a clock in microseconds that never goes back.
        start: the best guess of engine time now.
        speed: the best guess of the engine's speed.
    """

    def __init__(self, wall: Callable[[], Micros], start: Micros, speed: float = 1.0) -> None:
        self.speed = speed
        self.has_beat = False
        self.wall = wall
        self._heard = wall()
        self._base = start
        self._last = start
        self._instant: Micros | None = None
        self._seq = 0
        self._heap: list[tuple[Micros, int, Timer]] = []

    def now(self) -> Micros:
        """Return engine time; within a scheduled call the time it was due."""
        if self._instant is not None:
            return self._instant
        self._last = max(self._last, self._base + round((self.wall() - self._heard) * self.speed))
        return self._last

    def call_at(self, at: Micros, call: Callable[[], None]) -> Timer:
        """Schedule `call` for `at`, or for now if `at` is past."""
        timer = Timer(max(at, self.now()), call)
        self._seq += 1
        heapq.heappush(self._heap, (timer.at, self._seq, timer))
        return timer

    def run_due(self) -> None:
        """Run all calls that are due, in order, each at its own instant."""
        now = self.now()
        while self._heap and self._heap[0][0] <= now:
            at, _, timer = heapq.heappop(self._heap)
            call, timer.call = timer.call, None
            if call is None:
                continue
            self._instant = at
            try:
                call()
            finally:
                self._instant = None

    def wait_s(self, most_s: float) -> float:
        """Return how much wall time may pass before `run_due` has work, at most `most_s` seconds."""
        while self._heap and self._heap[0][2].call is None:
            heapq.heappop(self._heap)
        if not self._heap or self.speed <= 0.0:
            return most_s
        return min(most_s, max(0.0, (self._heap[0][0] - self.now()) / self.speed / SECOND))

    def on_beat(self, beat: ClockBeat) -> Micros:
        """Follow the engine's clock. Return by how much time jumped (0: a small correction); timers jump along."""
        now = self.now()
        first, self.has_beat = not self.has_beat, True
        gap = beat.engine_us - now
        self.speed, self._base, self._heard = beat.speed, beat.engine_us, self.wall()
        if not first and abs(gap) <= JUMP_WALL_S * SECOND * max(1.0, beat.speed):
            return 0
        self._last = beat.engine_us
        # All entries move alike: the heap stays one.
        self._heap = [(at + gap, seq, timer) for at, seq, timer in self._heap]
        for at, _, timer in self._heap:
            timer.at = at
        return gap


class PacedSide(AgentSide):
    """An `AgentSide` whose beats set the pace of a `PacedScheduler`; `jumped` is told of jumps of engine time."""

    def __init__(
        self,
        card: AgentCard,
        body: AgentBody,
        link: AgentLink,
        scheduler: PacedScheduler,
        jumped: Callable[[Micros], None],
    ) -> None:
        # The rules' own clock is wall time: a goal that was sent to a process that stood still is too old by then.
        super().__init__(card, body, link, now=scheduler.wall, beat_us=SECOND)
        self._scheduler = scheduler
        self._jumped = jumped

    def on_clock(self, beat: ClockBeat) -> None:
        """Take the engine's clock, unless it is an older engine's or late."""
        super().on_clock(beat)
        if (self.epoch, self.beat) != (beat.epoch, beat.beat):
            return
        by = self._scheduler.on_beat(beat)
        if by:
            self._jumped(by)

    def engine_now(self) -> Micros:
        """Return engine time as the body knows it, so that stamps and positions belong together."""
        return self._scheduler.now()
