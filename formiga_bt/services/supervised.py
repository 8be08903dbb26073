"""What an engine tells the supervisor that started it, by the notify protocol of systemd (`sd_notify(3)`): datagrams of text.

It is ready, it works, it ends. Without `NOTIFY_SOCKET` in the environment nobody is told. The library for this is systemd's,
in C, and the protocol is one line of text; so it is spoken here.
"""

import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Final

SOCKET: Final = "NOTIFY_SOCKET"
EACH_S: Final = 1.0
"""It works: told at most this often."""


class Supervisor:
    """Whoever started this process and looks after it, or nobody.

    Args:
        environment: says where it listens.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._path = environment.get(SOCKET, "")
        self._told_at = 0.0

    def ready(self) -> None:
        """The engine is there: what waits for it may start."""
        self._tell("READY=1")

    def works(self) -> None:
        """The engine works; who does not hear this in time ends the process and starts it again."""
        now = time.monotonic()
        if now - self._told_at >= EACH_S:
            self._told_at = now
            self._tell("WATCHDOG=1")

    def ends(self) -> None:
        """The engine ends because it was asked to."""
        self._tell("STOPPING=1")

    def _tell(self, text: str) -> None:
        if not self._path:
            return
        address = "\0" + self._path[1:] if self._path.startswith("@") else self._path
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as to:
            to.setblocking(False)  # a supervisor that does not read holds nobody up
            to.sendto(text.encode(), address)
