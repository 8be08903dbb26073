"""Queries that are answered in threads of their own: Zenoh's threads only put them into a bounded queue."""

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable
from typing import Any, Final

log = logging.getLogger("formiga.zenoh")

CLOSE_S: Final = 2.0
"""So long the threads may take to end; those that are stuck are left, as daemons."""


class QueryWorkers:
    """Takes queries from Zenoh's threads and answers them in its own, which begin with the first one.

    Args:
        name: of the threads.
        answer: answers one query; what it raises is a bug, which is logged and told to whoever asked.
        threads: so many are answered at once.
        waiting: so many wait at most; more are told `full`.
        full: the error reply then.
        bug: the error reply to whoever met a bug.
    """

    def __init__(
        self,
        name: str,
        answer: Callable[[Any], None],
        *,
        threads: int = 1,
        waiting: int,
        full: bytes,
        bug: bytes = b"bug",
    ) -> None:
        self._name = name
        self._answer = answer
        self._count = threads
        self._full = full
        self._bug = bug
        self._queue: queue.Queue[Any] = queue.Queue(waiting)
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._is_open = True

    def open(self) -> None:
        """Take queries again, after an end."""
        with self._lock:
            self._is_open = True

    def take(self, query: Any) -> None:
        """Take a query; on a thread of Zenoh's."""
        with self._lock:
            if not self._is_open:
                refuse(query, self._full)
                return
            if not self._threads:
                made = [threading.Thread(target=self._run, name=self._name, daemon=True) for _ in range(self._count)]
                for thread in made:
                    thread.start()
                self._threads = made
            try:
                self._queue.put_nowait(query)
            except queue.Full:
                refuse(query, self._full)

    def close(self) -> None:
        """Stop; what waits goes unanswered. May be called twice."""
        with self._lock:
            threads, self._threads, self._is_open = self._threads, [], False
            with contextlib.suppress(queue.Empty):
                while threads:
                    self._queue.get_nowait()
            for _ in threads:
                self._queue.put(None)
        until = time.monotonic() + CLOSE_S
        for thread in threads:
            thread.join(max(0.0, until - time.monotonic()))

    def _run(self) -> None:
        while (query := self._queue.get()) is not None:
            with query:
                try:
                    self._answer(query)
                except Exception:  # of this query only: others wait
                    log.exception("a query of %s could not be answered", query.key_expr)
                    query.reply_err(self._bug)


def refuse(query: Any, text: bytes) -> None:
    """Answer a query with an error, and let it go."""
    with query:
        query.reply_err(text)
