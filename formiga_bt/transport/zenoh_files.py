"""Bytes of attachments on the Zenoh wire: queries of `engine/attachments/<sha256>`, answered in a thread of their own.

With a payload the bytes are to be kept; without one they are asked for. An error reply says why not.
"""

import queue
import threading
from typing import Any, Final

from formiga_bt.transport.attachments import MOST_BYTES, FileError, KeepsFiles

WAITING: Final = 4
"""So many queries wait at most; more are told to ask again."""


class FileDesk:
    """Takes queries from Zenoh's threads and answers them in its own, which begins with the first one."""

    def __init__(self) -> None:
        self.store: KeepsFiles | None = None
        self._queue: queue.Queue[Any] = queue.Queue(WAITING)
        self._thread: threading.Thread | None = None

    def take(self, query: Any) -> None:
        """Take a query; on a thread of Zenoh's."""
        size = len(query.payload) if query.payload is not None else 0
        if self.store is None or size > MOST_BYTES:
            text = (
                "not_kept: nobody keeps attachments" if self.store is None else f"too_large: the most is {MOST_BYTES}"
            )
            with query:
                query.reply_err(text.encode())
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="formiga-attachments", daemon=True)
            self._thread.start()
        try:
            self._queue.put_nowait(query)
        except queue.Full:
            with query:
                query.reply_err(b"busy: ask again")

    def close(self) -> None:
        """Stop; what waits goes unanswered."""
        if self._thread is not None:
            while not self._queue.empty():
                self._queue.get_nowait()
            self._queue.put(None)
            self._thread.join(2.0)
            self._thread = None

    def _run(self) -> None:
        while (query := self._queue.get()) is not None:
            with query:
                self._answer(query)

    def _answer(self, query: Any) -> None:
        store, key = self.store, str(query.key_expr)
        digest = key.rpartition("/")[2]
        assert store is not None
        try:
            if query.payload is not None and len(query.payload):
                store.put(digest, query.payload.to_bytes())
                query.reply(key, b"")
                return
            data = store.get(digest)
        except FileError as error:
            query.reply_err(str(error).encode())
            return
        if data is None:
            query.reply_err(b"unknown: no attachment with this hash is here")
        else:
            query.reply(key, data)
