"""The feed of events: what happened, numbered, the last 10,000 of it. Server-sent events are read from here.

An id is `<epoch>.<n>`: after a restart of the engine old ids are recognised, and their reader is told that it missed something.
"""

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.clock import Micros

KEPT: Final = 10_000


class FeedEvent(Struct, frozen=True, kw_only=True):
    """One thing that happened."""

    n: int
    type: str
    """task, goal, agent, order, lockdown, question, notice, alarm, engine, or gap (older events are gone)."""
    at: Micros
    text: str
    task: str = ""
    agent: str = ""
    data: dict[str, Any] = {}


class Feed:
    """Events in order. Written by one thread, read by any."""

    def __init__(self, epoch: int, kept: int = KEPT) -> None:
        self.epoch = epoch
        self._events: deque[FeedEvent] = deque(maxlen=kept)
        self._n = 0
        self._lock = threading.Lock()
        self._listeners: dict[int, Callable[[], None]] = {}
        self._next_listener = 0
        self.closed = False

    def add(
        self, type_: str, at: Micros, text: str, *, task: str = "", agent: str = "", data: dict[str, Any] | None = None
    ) -> None:
        """Add an event; `announce` tells the readers."""
        with self._lock:
            self._n += 1
            self._events.append(
                FeedEvent(n=self._n, type=type_, at=at, text=text, task=task, agent=agent, data=data or {})
            )

    def announce(self) -> None:
        """Tell the readers that there may be something new."""
        with self._lock:
            listeners = list(self._listeners.values())
        for listener in listeners:
            listener()

    def close(self) -> None:
        """Tell the readers that nothing more will come."""
        self.closed = True
        self.announce()

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after additions, from any thread; return the function that ends it."""
        with self._lock:
            self._next_listener += 1
            mine = self._next_listener
            self._listeners[mine] = listener

        def end() -> None:
            with self._lock:
                self._listeners.pop(mine, None)

        return end

    @property
    def newest(self) -> int:
        """Return the number of the newest event; 0 = none yet."""
        return self._n

    def id_of(self, n: int) -> str:
        """Return the id of an event for the outside."""
        return f"{self.epoch}.{n}"

    def after(self, n: int) -> tuple[list[FeedEvent], bool]:
        """Return the events after number `n`, and whether some of them are gone already."""
        with self._lock:
            oldest = self._n - len(self._events)
            skip = max(0, n - oldest)
            return [event for index, event in enumerate(self._events) if index >= skip], n < oldest

    def read_id(self, text: str) -> int | None:
        """Return the number in an id of this start of the engine, or None: it is of another one, or no id."""
        epoch, dot, n = text.partition(".")
        if dot and epoch == str(self.epoch) and n.isdigit() and int(n) <= self._n:
            return int(n)
        return None
