"""Who waits for the reply to an order, and how long an order is good for.

Stops, the press of lockdown and aborts never expire: once the driver has them they are carried out, also when their caller gave
up or has gone. Any other order is dropped with its caller. What lets a machine or a task go on says how the site looked when a
person gave it: older than `AGE_S` it is refused.
"""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextvars import ContextVar
from typing import Final

from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Refusal, Reply

AGE_S: Final = 30.0
"""Seconds that an order may be old which lets something go on."""
STOPS: Final = frozenset({"hold", "return", "land", "cut"})
CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""It goes on while the machine sleeps: the age of an order that waited behind a closed lid is told rightly."""


def since_boot() -> float:
    """Return the seconds of a clock that never goes back."""
    return time.clock_gettime(CLOCK)


class Caller:
    """Who waits for an answer, and may go away before it comes.

    Args:
        since: when the request came in, as `since_boot` tells.
    """

    def __init__(self, since: float) -> None:
        self.since = since
        self._lock = threading.Lock()
        self._gone = False
        self._drops: list[Callable[[], object]] = []

    def leave(self) -> None:
        """The caller has gone: what still waits for it is dropped. From any thread; may be called twice."""
        with self._lock:
            self._gone, drops, self._drops = True, self._drops, []
        for drop in drops:
            drop()

    def when_gone(self, drop: Callable[[], object]) -> None:
        """Have `drop` called once the caller has gone; at once, if that is so already."""
        with self._lock:
            if not self._gone:
                self._drops.append(drop)
                return
        drop()


CALLER: ContextVar[Caller | None] = ContextVar("formiga_caller", default=None)
"""Who waits for what this thread asks the engine; None: the process itself, which stays."""


class Waiter(Future[Reply | None]):
    """The reply to an order, once it is there.

    Args:
        since: when the order came in, as `since_boot` tells.
    """

    def __init__(self, since: float) -> None:
        super().__init__()
        self.since = since


def never_expires(given: inp.Input) -> bool:
    """Return whether an order is carried out whoever still waits for it: it stops something."""
    match given:
        case inp.Abort():
            return True
        case inp.LockdownOrder(how):
            return how != "release"
        case inp.Operator(order):
            return order in STOPS
        case _:
            return False


def refusal_of_old(given: inp.Input, age_s: float) -> Refusal | None:
    """Return the refusal of an order that came in so many seconds ago, or None: it is good."""
    match given:
        case inp.LockdownOrder("release"):
            what = "lockdown release"
        case inp.Operator(order) if order not in STOPS:
            what = order.replace("_", " ")
        case inp.OpenRegion(name):
            what = f"zone open {name}"
        case inp.Assign() | inp.Unassign():
            what = type(given).__name__.lower()
        case _:
            return None
    if age_s <= AGE_S:
        return None
    return Refusal("too_old", f"`{what}` was given {age_s:.0f} s ago, and things may have changed since")
