"""The realtime driver's inbox: one place where inputs wait, in lanes.

Orders of people come first, then news of the goals of HIGH tasks, then other news, then requests of high priority, then other
requests, then telemetry. Within a lane, first come first served. Telemetry is latest-wins per agent; nothing else is ever
dropped. Under overload no lane starves: after so many inputs in a row that went before one of a lower lane, that lane has its
turn, so that agents which report are not taken for silent ones.
"""

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel import inputs as inp

ORDERS, URGENT_HIGH, URGENT, HIGH, NORMAL, TELEMETRY = range(6)
LANES: Final = ("orders", "news of HIGH tasks", "news", "HIGH requests", "requests", "telemetry")
"""The lanes by number, as people are told of them."""

TURN_AFTER: Final = 16
"""So many inputs of a lane go before one of a lane below it that waits; orders of people are not counted."""

MOST_REQUESTS: Final = 10_000
"""So many requests wait in the inbox; who sends more is told `busy`."""


class InboxLoad(Struct, frozen=True):
    """How much waits in an inbox."""

    waiting: dict[str, int]
    """Lane -> inputs that wait, for lanes in which some do."""
    most: int
    """The most that ever waited at once, all lanes together."""
    replaced: int
    """Statuses that something newer of the same agent replaced before they were handled."""


def lane_of(given: inp.Input, is_high: Callable[[str], bool] = lambda _: False) -> int:
    """Return the lane of an input; `is_high` tells whether a task is of high priority."""
    match given:
        case inp.AgentStatusInput():
            return TELEMETRY
        case inp.GoalEventInput(event):
            return URGENT_HIGH if is_high(event.goal_id.partition("/")[0]) else URGENT
        case inp.Submit(_, _, "high"):
            return HIGH
        case inp.Submit() | inp.Serve() | inp.AgentSeenInput() | inp.AgentGoneInput() | inp.NewsDelivered():
            return NORMAL  # coming and going in one lane: who came and went is gone
        case inp.Abort() | inp.Operator() | inp.LockdownOrder() | inp.Started():
            return ORDERS
        case _:
            return URGENT


class Inbox:
    """Inputs that wait, each with whoever wants to know its reply. Filled from any thread, emptied by one.

    Args:
        is_high: whether a task, by its id, is of high priority; asked in the thread that puts an input.
    """

    def __init__(self, is_high: Callable[[str], bool] = lambda _: False) -> None:
        self._is_high = is_high
        self._lanes: tuple[deque[tuple[inp.Input, Any]], ...] = tuple(deque() for _ in LANES[:-1])
        self._telemetry: dict[str, inp.AgentStatusInput] = {}
        self._lock = threading.Lock()
        self._wake = threading.Event()
        self._passed = [0] * len(LANES)
        """Lane -> inputs that went before it while it waited, since its last turn."""
        self._most = 0
        self.replaced = 0
        """Statuses that something newer of the same agent replaced before they were handled."""

    def put(self, given: inp.Input, waiter: Any = None) -> None:
        """Add an input; `waiter` is handed back with it."""
        lane = lane_of(given, self._is_high)
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
            self._most = max(self._most, sum(map(len, self._lanes), len(self._telemetry)))
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
            waiting = [lane for lane, inputs in enumerate(self._lanes) if inputs]
            if self._telemetry:
                waiting.append(TELEMETRY)
            if not waiting:
                return None
            lane = waiting[0]
            if lane != ORDERS:
                lane = next((one for one in reversed(waiting) if self._passed[one] >= TURN_AFTER), lane)
                for other in waiting:
                    self._passed[other] += other > lane
            self._passed[lane] = 0
            if lane == TELEMETRY:
                return self._telemetry.pop(next(iter(self._telemetry))), None
            return self._lanes[lane].popleft()

    def heard(self, agent: str) -> Micros:
        """Return when the status of an agent came in that waits here; 0 = none does."""
        waiting = self._telemetry.get(agent)
        return waiting.wall if waiting is not None else 0

    @property
    def is_full(self) -> bool:
        """Return whether no more requests should be taken in."""
        return len(self._lanes[HIGH]) + len(self._lanes[NORMAL]) >= MOST_REQUESTS

    def statistics(self) -> InboxLoad:
        """Return how much waits."""
        with self._lock:
            counts = [*map(len, self._lanes), len(self._telemetry)]
            waiting = {name: count for name, count in zip(LANES, counts, strict=True) if count}
            return InboxLoad(waiting, self._most, self.replaced)

    def wake(self) -> None:
        """End a `wait`."""
        self._wake.set()

    def wait(self, seconds: float) -> None:
        """Sleep until something arrives, or for so long."""
        self._wake.wait(seconds)
        self._wake.clear()
