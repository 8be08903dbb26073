"""How much each account asks for: requests a minute, and the tasks that it has under way."""

import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

LATER: Final = "wait; stops get through. An administrator sets it: formiga access limits NAME REQUESTS"
"""What helps whoever sent too much."""


class Pace:
    """Counts requests by account, in a window of a minute that goes with the time; for the event loops of all doors."""

    def __init__(self) -> None:
        from limits.storage import MemoryStorage
        from limits.strategies import SlidingWindowCounterRateLimiter

        self._limiter = SlidingWindowCounterRateLimiter(MemoryStorage())

    def takes(self, name: str, most: int) -> bool:
        """Count a request of an account; return whether it is within its `most` a minute."""
        from limits import RateLimitItemPerMinute

        return self._limiter.hit(RateLimitItemPerMinute(most), name)


class Turns:
    """Lets each account request one task at a time, so that what it has under way is counted rightly."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._turns: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)

    @contextmanager
    def of(self, name: str) -> Iterator[None]:
        """Wait for the turn of an account."""
        with self._lock:
            turn = self._turns[name]
        with turn:
            yield
