"""HTTP clients that begin to speak and fall silent, or speak and never listen."""

import socket
from contextlib import suppress
from typing import Final
from urllib.parse import urlsplit

_HOST: Final = b"HTTP/1.1\r\nHost: 127.0.0.1\r\n"
HALF: Final = (
    b"",
    b"GET /v1/health HT",
    b"POST /v1/orders " + _HOST + b"Content-Le",
    b"POST /v1/tasks " + _HOST + b"Content-Type: application/json\r\nContent-Length: 900\r\n\r\n{",
)
DEAF: Final = b"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


class Crowd:
    """A context manager: so many connections stand while inside."""

    def __init__(self, url: str, number: int, *, deaf: bool = False) -> None:
        self._at = (urlsplit(url).hostname or "127.0.0.1", urlsplit(url).port or 80)
        self._number, self._deaf = number, deaf
        self._sockets: list[socket.socket] = []

    def __enter__(self) -> "Crowd":
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self) -> int:
        """Open them; return how many stand."""
        for i in range(self._number):
            with suppress(OSError):
                one = socket.socket()
                one.settimeout(0.3)
                self._sockets.append(one)
                if self._deaf:
                    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                one.connect(self._at)
                one.send(DEAF if self._deaf else HALF[i % len(HALF)])
        return len(self._sockets)

    def close(self) -> None:
        """Close them."""
        for one in self._sockets:
            one.close()
        self._sockets.clear()
