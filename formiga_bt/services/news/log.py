"""The news that were not told yet: the newest in memory, so that they leave at once, all others in the journal's outbox."""

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import Final

from formiga_bt.journal.outbox import NewsItem

KEPT: Final = 2000
"""So many of the newest are at hand."""
PAGE: Final = 100
"""So many are read at once."""

Read = Callable[[int, bool, int], Sequence[NewsItem]]
"""Reads the outbox: news of steps after one, urgent ones or not, so many at most and the rest of the last step."""


class NewsLog:
    """News in order. `add` is called in the driver's thread, `after` in the loop that delivers.

    Args:
        began: `seq` of the last step before those that are added.
        read: reads the outbox; None: there is no journal, and what is no more at hand is lost.
        kept: so many are at hand.
    """

    def __init__(self, began: int, read: Read | None, kept: int = KEPT) -> None:
        self._read = read
        self._items: deque[NewsItem] = deque()
        self._kept = kept
        self._complete_after = began
        """Of later steps all news are at hand."""
        self._lock = threading.Lock()

    def add(self, items: Sequence[NewsItem]) -> None:
        """Take the news of a step."""
        with self._lock:
            self._items.extend(items)
            while len(self._items) > self._kept:
                self._complete_after = self._items.popleft().seq

    async def after(self, seq: int, *, urgent: bool) -> list[NewsItem]:
        """Return the oldest news of steps after one, whole steps; none: there are no others.

        Raises:
            JournalError: the outbox cannot be read now.
        """
        while True:
            with self._lock:
                floor = self._complete_after
                if seq >= floor:
                    return _page([one for one in self._later(seq) if one.urgent is urgent])
            found = await asyncio.to_thread(self._read, seq, urgent, PAGE) if self._read is not None else ()
            if found:
                return list(found)
            seq = floor

    def _later(self, seq: int) -> list[NewsItem]:
        """Return what is at hand of steps after one; the driver's thread waits meanwhile, so only that is looked at."""
        return list(takewhile(lambda one: one.seq > seq, reversed(self._items)))[::-1]


def _page(items: list[NewsItem]) -> list[NewsItem]:
    if len(items) <= PAGE:
        return items
    last = items[PAGE - 1].seq
    return [one for one in items if one.seq <= last]
