"""What the process of an agent does all the time: timers, statuses, and the watch over itself and its link.

Used by agents of one's own (`process.py`) and by the simulated ones (`agents_sim.process`). One thread: the owner
calls `turn` in its loop, and may wait for as long as that says, or until its link wakes it.
"""

import os
import time
from collections.abc import Callable
from typing import Final

from formiga_bt.agent.pacing import PacedScheduler
from formiga_bt.base.clock import SECOND, Micros, monotonic_us
from formiga_bt.transport.agent_side import AgentSide

STATUS_EVERY_US: Final[Micros] = SECOND // 2
STANDSTILL_US: Final[Micros] = SECOND
"""A loop that was away for longer stood still (frozen, or a machine under load)."""
LONGEST_WAIT_S: Final = 0.2
"""After a signal the loop goes on within this."""


def new_boot_id(agent: str) -> str:
    """Return what tells this start of an agent's process from every other."""
    return f"{agent}-{time.time_ns() // 1000:x}-{os.getpid()}"


class Pulse:
    """The regular work of one agent's process.

    Args:
        side: its rules.
        scheduler: its timers and engine time.
        report: publishes the status, twice a second.
        watch_link: looks whether the engine was silent for too long.
    """

    def __init__(
        self,
        side: AgentSide,
        scheduler: PacedScheduler,
        report: Callable[[], None],
        watch_link: Callable[[], None],
    ) -> None:
        self._side, self._scheduler = side, scheduler
        self._report, self._watch_link = report, watch_link
        self._looked_at = self._next_status = monotonic_us()

    def turn(self) -> float:
        """Do what is due. Return after how many seconds something is again, at most `LONGEST_WAIT_S`."""
        self._scheduler.run_due()
        now = monotonic_us()
        stood_still, self._looked_at = now - self._looked_at > STANDSTILL_US, now
        if stood_still:
            self._side.excuse_silence()  # what was said meanwhile is yet to be heard
        self._watch_link()
        if now >= self._next_status:
            self._next_status = max(self._next_status + STATUS_EVERY_US, now)
            self._report()
        wait_s = min(LONGEST_WAIT_S, max(0.0, (self._next_status - monotonic_us()) / SECOND))
        return self._scheduler.wait_s(wait_s)
