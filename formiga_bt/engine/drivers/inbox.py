"""The realtime driver's inbox: one place where inputs wait, in lanes.

Goal events and orders of people come first, then requests of high priority, then other requests, then telemetry. Within a
lane, first come first served. Telemetry is latest-wins per agent; nothing else is ever dropped.
"""

import threading
from collections import deque
from typing import Any, Final

from formiga_bt.engine import inputs as inp

URGENT, HIGH, NORMAL, TELEMETRY = range(4)
LANES: Final = (URGENT, HIGH, NORMAL, TELEMETRY)


def lane_of(given: inp.Input) -> int:
    """Return the lane of an input."""
    match given:
        case inp.AgentStatusInput():
            return TELEMETRY
        case inp.Submit(_, _, "high"):
            return HIGH
        case inp.Submit() | inp.Serve() | inp.AgentSeenInput() | inp.AgentGoneInput():
            return NORMAL  # coming and going in one lane: who came and went is gone
        case _:
            return URGENT


class Inbox:
    """Inputs that wait, each with whoever wants to know its reply. Filled from any thread, emptied by one."""

    def __init__(self) -> None:
        self._lanes: tuple[deque[tuple[inp.Input, Any]], ...] = tuple(deque() for _ in LANES[:-1])
        self._telemetry: dict[str, inp.AgentStatusInput] = {}
        self._lock = threading.Lock()
        self._wake = threading.Event()
        self.replaced = 0
        """Statuses that something newer of the same agent replaced before they were handled."""

    def put(self, given: inp.Input, waiter: Any = None) -> None:
        """Add an input; `waiter` is handed back with it."""
        lane = lane_of(given)
        with self._lock:
            if lane == TELEMETRY:
                assert isinstance(given, inp.AgentStatusInput)
                self.replaced += given.status.id in self._telemetry
                self._telemetry.pop(given.status.id, None)
                self._telemetry[given.status.id] = given
            else:
                if isinstance(given, inp.AgentSeenInput):
                    self._forget_former(given.card.id, given.card.boot_id)
                self._lanes[lane].append((given, waiter))
        self._wake.set()

    def _forget_former(self, agent: str, boot_id: str) -> None:
        # Telemetry is taken last: what the agent's former process said must not come after its new card.
        waiting = self._telemetry.get(agent)
        if waiting is not None and waiting.status.boot_id not in ("", boot_id):
            del self._telemetry[agent]
            self.replaced += 1

    def take(self) -> tuple[inp.Input, Any] | None:
        """Return the next input, or None."""
        with self._lock:
            for lane in self._lanes:
                if lane:
                    return lane.popleft()
            if self._telemetry:
                return self._telemetry.pop(next(iter(self._telemetry))), None
        return None

    def wake(self) -> None:
        """End a `wait`."""
        self._wake.set()

    def wait(self, seconds: float) -> None:
        """Sleep until something arrives, or for so long."""
        self._wake.wait(seconds)
        self._wake.clear()
