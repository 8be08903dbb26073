"""The HTTP server: uvicorn in a thread of its own, on a socket opened before, so that a taken port is an error at once."""

import socket
import threading
import time
from collections.abc import Callable
from typing import Any, Final

import uvicorn

from formiga_bt.errors import SiteError

DEFAULT_HTTP: Final = "127.0.0.1:8420"
START_S: Final = 10.0


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
            f"cannot serve the API at {address}: {error.strerror or error}\n"
            "  help: is another engine running there? Choose another port with --http HOST:PORT, or --http 127.0.0.1:0"
        ) from error


class HttpServer:
    """An ASGI app, served until `stop`."""

    def __init__(self, app: Callable[..., Any], sock: socket.socket) -> None:
        self._socket = sock
        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            lifespan="off",
            ws="none",
            server_header=False,
            timeout_graceful_shutdown=2,
            timeout_keep_alive=30,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._serve, name="formiga-http", daemon=True)

    @property
    def url(self) -> str:
        """Return the base address."""
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
                raise SiteError(f"the API at {self.url} did not come up")
            time.sleep(0.005)

    def stop(self) -> None:
        """End within some seconds; may be called twice."""
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def _serve(self) -> None:
        self._server.run(sockets=[self._socket])
