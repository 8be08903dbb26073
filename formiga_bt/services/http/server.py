"""The HTTP servers: uvicorn in a thread of its own, on a socket opened before, so that a taken port is an error at once.

An engine has two: one on TCP, and one on a Unix socket (`local`). Each has its own thread, event loop, places and threads for
urgent requests, so that a crowd at one of them does not hold up the other.
"""

import asyncio
import errno
import os
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

import uvicorn

from formiga_bt.base.errors import SiteError
from formiga_bt.services.http.connection import HEAD_LIMIT, Connection, PhaseLimits, connection_class
from formiga_bt.services.http.crowd import AT_ONCE, Crowd, descriptors, http_places
from formiga_bt.services.http.urgent import THREADS

DEFAULT_HTTP: Final = "127.0.0.1:8420"
START_S: Final = 10.0
QUEUE: Final = 512
"""So many connections wait in the system, where they cost this process nothing."""
SPARE: Final = 8
"""Descriptors that a door keeps for when the process has none left: then it lets them go, and takes callers in with them."""
SPARE_FOR_S: Final = 2.5


def read_address(text: str) -> tuple[str, int]:
    """Read `host:port`.

    Raises:
        SiteError: it is something else.
    """
    host, colon, port = text.rpartition(":")
    if not colon or not host or not port.isdigit() or int(port) > 65535:
        raise SiteError(f"'{text}' is not HOST:PORT, for example {DEFAULT_HTTP}; port 0 takes a free one")
    return host.strip("[]"), int(port)


def listen(address: str) -> socket.socket:
    """Open the socket.

    Raises:
        SiteError: the port is taken, or is not ours to open.
    """
    host, port = read_address(address)
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        return socket.create_server((host, port), family=family, backlog=128)
    except OSError as error:
        raise SiteError(
            f"cannot serve the API at {address}: {error.strerror or error}",
            help="is another engine running there? Choose another port with --http HOST:PORT, or --http 127.0.0.1:0",
        ) from error


class Spares:
    """Descriptors kept for a need."""

    def __init__(self, count: int = SPARE) -> None:
        self._count = count
        self._kept: list[int] = []

    def keep(self) -> None:
        """Take what lacks, as far as there is any."""
        while len(self._kept) < self._count:
            try:
                self._kept.append(os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
            except OSError:
                return

    def let_go(self) -> None:
        """Give all back; may be called twice."""
        while self._kept:
            os.close(self._kept.pop())


class HttpServer:
    """An ASGI app, served until `stop`.

    Args:
        app: what is served.
        sock: a listening socket, TCP or Unix; it is closed with the server.
        crowd: the places of this door; default: those of an HTTP door.
        times: how long the phases of a connection may take.
    """

    def __init__(
        self,
        app: Callable[..., Any],
        sock: socket.socket,
        crowd: Crowd[Connection] | None = None,
        times: PhaseLimits | None = None,
    ) -> None:
        self._socket = sock
        self._is_local = sock.family == socket.AF_UNIX
        crowd = crowd if crowd is not None else Crowd(http_places(descriptors()))
        times = times or PhaseLimits()
        config = uvicorn.Config(
            app,
            http=connection_class(crowd, times, own_only_=self._is_local),
            h11_max_incomplete_event_size=HEAD_LIMIT,
            backlog=AT_ONCE,
            log_config=None,
            access_log=False,
            lifespan="off",
            ws="none",
            server_header=False,
            timeout_graceful_shutdown=2,
            timeout_keep_alive=round(times.idle_s),
        )
        self._server = uvicorn.Server(config)
        self._spares = Spares()
        self._thread = threading.Thread(
            target=self._serve, name="formiga-local" if self._is_local else "formiga-http", daemon=True
        )

    @property
    def url(self) -> str:
        """Return the base address of a TCP socket."""
        host, port = self._socket.getsockname()[:2]
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
        return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

    def start(self) -> None:
        """Serve.

        Raises:
            SiteError: it does not come up.
        """
        self._thread.start()
        until = time.monotonic() + START_S
        while not self._server.started:
            if not self._thread.is_alive() or time.monotonic() > until:
                raise SiteError(f"the API at {self._socket.getsockname()} did not come up")
            time.sleep(0.005)
        self._socket.listen(QUEUE)

    def ask_to_stop(self) -> None:
        """Begin to end, and wait for nothing."""
        self._server.should_exit = True

    def stop(self) -> None:
        """End within some seconds; may be called twice."""
        self.ask_to_stop()
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def _serve(self) -> None:
        asyncio.run(self._run())

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        loop.set_default_executor(ThreadPoolExecutor(THREADS, thread_name_prefix="formiga-urgent"))
        loop.set_exception_handler(self._on_error)
        self._spares.keep()
        try:
            await self._server.serve(sockets=[self._socket])
        finally:
            self._spares.let_go()

    def _on_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Help out when the process has no descriptor left; asyncio tries again to take callers in after a second."""
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
            self._spares.let_go()
            loop.call_later(SPARE_FOR_S, self._spares.keep)
            return
        loop.default_exception_handler(context)
