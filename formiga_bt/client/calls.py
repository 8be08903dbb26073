"""Calls of an engine's API over plain HTTP, and how it says no.

An engine of this machine is called by its local door, a Unix socket that no crowd of HTTP clients can fill, and over TCP if
that does not answer.

The standard library's client is enough here, and it starts fast: an order in a hurry (`formiga hold --all`) waits for no other.
"""

import http.client
import json
import socket
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final
from urllib.parse import quote, urlencode, urlsplit

from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.base.visible import visible_json

TIMEOUT_S: Final = 30.0
LOCAL_S: Final = 0.5
"""So long a full local door is tried before the other one is."""
STOPS: Final = ("hold", "return", "land", "cut")
UNKNOWN: Final = frozenset({"unknown_task", "unknown_agent"})
FULL: Final = frozenset({"crowded", "too_many_streams"})
"""Codes of a door that takes no more callers."""


class NoEngine(FormigaError):  # noqa: N818 - it names what is wrong
    """No engine runs where it was looked for, or it does not answer."""


class ApiError(FormigaError):
    """The engine said no.

    Args:
        code: a stable word.
        text: what is wrong; `help` and `near` as of every error.
        status: of HTTP.
    """

    def __init__(self, code: str, text: str, *, help: str = "", near: Iterable[str] = (), status: int = 409) -> None:
        FormigaError.__init__(self, text, help=help, near=near)  # not that of the next class in line
        self.code = code
        self.status = status


class UnknownId(ApiError, TaskError):  # noqa: N818 - it names what is wrong
    """The engine has no task or agent of this id."""


class LocalConnection(http.client.HTTPConnection):
    """A connection to the local door of an engine; `path` is that of the Unix socket."""

    def __init__(self, path: str) -> None:
        super().__init__("localhost", timeout=TIMEOUT_S)
        self._path = path

    def connect(self) -> None:
        """Connect.

        Raises:
            OSError: nobody listens there, or too many do not let us in for `LOCAL_S`.
        """
        until = time.monotonic() + LOCAL_S
        while True:
            self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self.sock.settimeout(TIMEOUT_S)
            try:
                self.sock.connect(self._path)
            except BlockingIOError:  # its queue is full
                self.sock.close()
                if time.monotonic() > until:
                    raise
                time.sleep(0.02)
            else:
                return


class Calls:
    """Requests to one engine, and its answers as bytes.

    Args:
        address: of the engine.
        token: of its site; without it the file in its folder tells.
    """

    def __init__(self, address: EngineAddress, token: str | None = None) -> None:
        self.address = address
        self.ahead_us = 0
        """By how much the engine's clock was ahead of its wall clock at the last answer; below 0: behind."""
        self.token = _token(address) if token is None else token

    def read(self, path: str, query: Mapping[str, Any]) -> bytes:
        """Return what a GET answers.

        Raises:
            ApiError: the engine said no.
            NoEngine: it does not answer.
        """
        with self._answer("GET", path, query) as answer:
            return visible_json(answer.read())

    def raw(self, path: str) -> bytes:
        """Return what a GET answers, byte for byte.

        Raises:
            ApiError: the engine said no.
            NoEngine: it does not answer.
        """
        with self._answer("GET", path, {}) as answer:
            return bytes(answer.read())

    def send(self, path: str, body: Any = None, *, key: str = "", headers: Mapping[str, str] | None = None) -> bytes:
        """Return what a POST answers; `key` is its Idempotency-Key.

        Raises:
            ApiError: the engine said no.
            NoEngine: it does not answer.
        """
        more = {**(headers or {}), **({"Idempotency-Key": key} if key else {})}
        with self._answer("POST", path, {}, body, more) as answer:
            return visible_json(answer.read())

    def stream(self, after: str = "", task: str = "") -> Iterator[bytes]:
        """Yield events as JSON, and nothing (b"") as signs of life in between; ends with the engine."""
        with self._answer("GET", "/v1/events", {"after": after, "task": task}) as answer:
            data = b""
            for line in answer:
                name, _, value = line.rstrip(b"\r\n").partition(b":")
                if not name and not value:
                    yield visible_json(data)
                    data = b""
                elif name == b"data":
                    data = value.strip()

    @contextmanager
    def _answer(
        self,
        method: str,
        path: str,
        query: Mapping[str, Any],
        body: Any = None,
        more: Mapping[str, str] | None = None,
    ) -> Iterator[http.client.HTTPResponse]:
        parts = urlsplit(self.address.url)
        words = urlencode({name: value for name, value in query.items() if value not in ("", None)}, doseq=True)
        path = parts.path + path
        headers = {"Accept": "application/json", **(more or {})}
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        if method != "GET":
            headers["Content-Type"] = "application/json"
        text = None if body is None else json.dumps(body).encode()
        target = f"{path}?{words}" if words else path
        again = method == "GET" or _stops(path, body)
        connection, answer = self._begin(method, target, text, headers, again=again)
        try:
            self.ahead_us = _ahead(answer)
            if answer.status >= 400:
                raise self._no(answer)
            if answer.status >= 300:
                raise self._stranger()
            yield answer
        except (OSError, http.client.HTTPException) as error:
            raise self._silent(error) from error
        finally:
            connection.close()

    def _begin(
        self, method: str, target: str, text: bytes | None, headers: Mapping[str, str], *, again: bool
    ) -> tuple[http.client.HTTPConnection, http.client.HTTPResponse]:
        """Send a request by the first way on which it is taken, and return its answer.

        `again`: it may be sent by another way when no answer came, because a second one changes nothing.
        """
        ways = self._ways()
        for connection in ways:
            is_last = connection is ways[-1]
            try:
                connection.connect()
            except OSError as error:
                connection.close()
                if is_last:
                    raise self._silent(error) from error
                continue
            try:
                connection.request(method, target, text, dict(headers))
                answer = connection.getresponse()
            except (OSError, http.client.HTTPException) as error:
                connection.close()
                if is_last or not again:
                    raise self._silent(error) from error
                continue
            if answer.status == 503 and not is_last:  # a full door may stand beside one that is not
                refused = self._no(answer)
                connection.close()
                if isinstance(refused, ApiError) and refused.code in FULL:
                    continue
                raise refused
            return connection, answer
        raise AssertionError("there is a way")

    def _ways(self) -> list[http.client.HTTPConnection]:
        """Return the connections to try, in this order; none of them is open yet."""
        parts = urlsplit(self.address.url)
        kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        ways: list[http.client.HTTPConnection] = [kind(parts.hostname or "", parts.port, timeout=TIMEOUT_S)]
        if self.address.socket:
            ways.insert(0, LocalConnection(self.address.socket))
        return ways

    def _no(self, answer: http.client.HTTPResponse) -> FormigaError:
        """Return the error of an answer that says no."""
        error = _error(answer)
        if error.code == "http" and not self.address.pid:
            return self._stranger()
        if error.code == "unauthorized":
            said = "refuses the token that was sent" if self.token else "wants a token"
            hint = (
                "FORMIGA_TOKEN=..., or --token-file FILE: a token of your account (formiga access token NAME, said where the "
                "engine runs), or a copy of `token` of the site's runtime folder"
            )
            return ApiError("unauthorized", f"the engine at {self.address.url} {said}", help=hint, status=answer.status)
        return error

    def _stranger(self) -> NoEngine:
        return NoEngine(
            f"what answers at {self.address.url} is no formiga engine",
            help="name the address that formiga up prints, for example --url http://127.0.0.1:8420",
        )

    def _silent(self, error: Exception) -> NoEngine:
        why = f"{self.address.url}: {error or type(error).__name__}"
        if self.address.pid:
            return NoEngine(
                f"the engine of site '{self.address.site}' (process {self.address.pid}) does not answer at {why}"
            )
        return NoEngine(
            f"no engine answers at {why}",
            help="does it run there, and may it be reached? formiga up --http HOST:PORT lets it listen beyond its machine",
        )


def _error(answer: http.client.HTTPResponse) -> ApiError:
    try:
        said = json.loads(visible_json(answer.read()))
        code, text, help_, more = said["code"], said["text"], said.get("help", ""), said.get("problems", ())
        if len(more) > 1 or (more and code in ("bad_params", "bad_task")):
            text, help_ = "\n\n".join([*more, "nothing was started" if code == "bad_params" else text]), ""
        kind = UnknownId if code in UNKNOWN else ApiError
        return kind(code, text, help=help_, near=said.get("near", ()), status=answer.status)
    except (ValueError, KeyError, TypeError):
        return ApiError("http", f"{answer.status} {answer.reason}", status=answer.status)


def _ahead(answer: http.client.HTTPResponse) -> int:
    try:
        return round(float(answer.headers.get("Formiga-Ahead-S", "0")) * 1e6)
    except (ValueError, OverflowError):  # of something else than an engine
        return 0


def _stops(path: str, body: Any) -> bool:
    """Return whether a request stops something; the same once more changes nothing."""
    said = body if isinstance(body, dict) else {}
    if path.endswith("/lockdown"):
        return said.get("how") != "release"
    return path.endswith("/abort") or (path.endswith("/orders") and said.get("order") in STOPS)


def _token(address: EngineAddress) -> str:
    try:
        return address.token_file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def segment(word: str) -> str:
    """Return a word as one part of a path."""
    return quote(word, safe="")
