"""Bytes of attachments on the Zenoh wire: queries of `engine/attachments/<sha256>`, answered in a thread of their own.

With a payload the bytes are to be kept; without one they are asked for. An error reply says why not.
"""

from typing import Any, Final

from formiga_bt.transport.attachments import MOST_BYTES, FileError, KeepsFiles
from formiga_bt.transport.zenoh_queries import QueryWorkers, refuse

WAITING: Final = 4
"""So many queries wait at most; more are told to ask again."""


class FileDesk:
    """Keeps and gives the bytes."""

    def __init__(self) -> None:
        self.store: KeepsFiles | None = None
        self._workers = QueryWorkers("formiga-attachments", self._answer, waiting=WAITING, full=b"busy: ask again")

    def take(self, query: Any) -> None:
        """Take a query; on a thread of Zenoh's."""
        size = len(query.payload) if query.payload is not None else 0
        if self.store is None:
            refuse(query, b"not_kept: nobody keeps attachments")
        elif size > MOST_BYTES:
            refuse(query, f"too_large: the most is {MOST_BYTES}".encode())
        else:
            self._workers.take(query)

    def open(self) -> None:
        """Take queries again, after an end."""
        self._workers.open()

    def close(self) -> None:
        """Stop; what waits goes unanswered."""
        self._workers.close()

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
