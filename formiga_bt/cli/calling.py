"""How the verbs find a running engine and call its API: `.formiga/<site>/engine.json`, or an address; then plain HTTP.

An engine of this machine is called by its local door, a Unix socket that no crowd of HTTP clients can fill, and over TCP if
that does not answer.

An engine elsewhere is named by `--url`, or by the environment for every verb: FORMIGA_URL, with FORMIGA_TOKEN, or
FORMIGA_TOKEN_FILE, the file that holds it. A token is never an argument, which other users of the machine can read.

The standard library's client is enough here, and it starts fast. Nothing here imports the command line library: an order in
a hurry (`formiga hold --all`) does without it. What the verbs' options and tables need is in `client`.
"""

import http.client
import json
import os
import pwd
import socket
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlencode, urlsplit

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.visible import visible, visible_json

TIMEOUT_S: Final = 30.0
MOST_NEXT: Final = 3
"""So many commands are suggested."""
LOCAL_S: Final = 0.5
"""So long a full local door is tried before the other one is."""
STOPS: Final = ("hold", "return", "land", "cut")
FULL: Final = frozenset({"crowded", "too_many_streams"})
"""Codes of a door that takes no more callers."""


class NoEngine(FormigaError):  # noqa: N818 - it names what is wrong
    """No engine runs where it was looked for, or it does not answer."""


class ApiError(FormigaError):
    """The engine said no. `code` is a stable word."""

    def __init__(self, code: str, text: str, hint: str, status: int) -> None:
        super().__init__(text + (f"\n  help: {hint}" if hint else ""))
        self.code = code
        self.status = status


@dataclass(frozen=True, slots=True)
class ServerSentEvent:
    """A server-sent event, or (type "") a sign of life."""

    type: str
    data: dict[str, Any]


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


class Client:
    """One engine's API."""

    def __init__(self, address: EngineAddress, token: str | None = None) -> None:
        self.address = address
        self.ahead_us = 0
        """By how much the engine's clock was ahead of its wall clock at the last answer; below 0: behind."""
        self._token = _token(address) if token is None else token

    def get(self, path: str, **query: Any) -> Any:
        """Return what a GET answers.

        Raises:
            ApiError: the engine said no.
            NoEngine: it does not answer.
        """
        return self._call("GET", path, query)

    def post(self, path: str, body: Any = None, *, key: str = "", headers: Mapping[str, str] | None = None) -> Any:
        """Return what a POST answers; `key` is its Idempotency-Key."""
        return self._call("POST", path, {}, body, {**(headers or {}), **({"Idempotency-Key": key} if key else {})})

    def events(self, after: str = "", task: str = "") -> Iterator[ServerSentEvent]:
        """Yield what happens, and signs of life in between; ends with the engine."""
        query = {"after": after, "task": task}
        with self._answer("GET", "/v1/events", query) as answer:
            kind, data = "", ""
            for line in answer:
                text = line.decode("utf-8").rstrip("\r\n")
                name, _, value = text.partition(":")
                if not text and kind:
                    yield ServerSentEvent(kind, visible(json.loads(data)))
                    kind, data = "", ""
                elif name == "event":
                    kind = value.strip()
                elif name == "data":
                    data = value.strip()
                elif not name and value == "":
                    yield ServerSentEvent("", {})

    def _call(
        self, method: str, path: str, query: Mapping[str, Any], body: Any = None, more: Mapping[str, str] | None = None
    ) -> Any:
        with self._answer(method, path, query, body, more) as answer:
            try:
                return json.loads(visible_json(answer.read()))
            except ValueError as error:
                raise self._stranger() from error

    def read(self, path: str, query: Mapping[str, Any]) -> bytes:
        """Return what a GET answers, as it came."""
        with self._answer("GET", path, query) as answer:
            return visible_json(answer.read())

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
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
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
            said = "refuses the token that was sent" if self._token else "wants its site's token"
            hint = "FORMIGA_TOKEN=..., or --token-file FILE: a copy of `token` of the site's runtime folder"
            return ApiError("unauthorized", f"the engine at {self.address.url} {said}", hint, answer.status)
        return error

    def _stranger(self) -> NoEngine:
        return NoEngine(
            f"what answers at {self.address.url} is no formiga engine\n"
            "  help: name the address that formiga up prints, for example --url http://127.0.0.1:8420"
        )

    def _silent(self, error: Exception) -> NoEngine:
        why = f"{self.address.url}: {error or type(error).__name__}"
        if self.address.pid:
            return NoEngine(
                f"the engine of site '{self.address.site}' (process {self.address.pid}) does not answer at {why}"
            )
        return NoEngine(
            f"no engine answers at {why}\n"
            "  help: does it run there, and may it be reached? formiga up --http HOST:PORT lets it listen beyond its machine"
        )


def _error(answer: http.client.HTTPResponse) -> ApiError:
    try:
        said = json.loads(visible_json(answer.read()))
        text, more = said["text"], said.get("problems", ())
        if len(more) > 1 or (more and said["code"] in ("bad_params", "bad_task")):
            text = "\n\n".join([*more, "nothing was started" if said["code"] == "bad_params" else text])
            return ApiError(said["code"], text, "", answer.status)
        return ApiError(said["code"], text, said.get("hint", ""), answer.status)
    except (ValueError, KeyError, TypeError):
        return ApiError("http", f"{answer.status} {answer.reason}", "", answer.status)


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


def _base(url: str) -> str:
    """Return the address of an engine, without what is after it.

    Raises:
        UnusableFile: it is no address.
    """
    example = "for example http://127.0.0.1:8420"
    try:
        parts = urlsplit(url.strip())
        port = parts.port
    except ValueError as error:
        raise UnusableFile(f"--url: {error}; {example}") from error
    if "@" in parts.netloc:  # the text is not repeated: it may hold a password
        raise UnusableFile(f"--url: names and passwords do not belong into an address; {example}, with FORMIGA_TOKEN")
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise UnusableFile(f"--url: '{url}' is no address of an engine; {example}")
    if not all(letter.isascii() and letter.isprintable() and letter != " " for letter in url.strip()):
        raise UnusableFile(f"--url: the address has letters that no address has; {example}")
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    path = parts.path.rstrip("/").removesuffix("/v1")
    return f"{parts.scheme}://{host}{f':{port}' if port is not None else ''}{path}"


def _own_token(file: Path | None) -> str:
    """Return the token for an engine elsewhere, or an empty text. It is never shown.

    Raises:
        UnusableFile: the file cannot be read, or what is there is no token.
    """
    named = os.environ.get("FORMIGA_TOKEN_FILE", "")
    path = file if file is not None else Path(named) if named and "FORMIGA_TOKEN" not in os.environ else None
    if path is None:
        text, where = os.environ.get("FORMIGA_TOKEN", ""), "FORMIGA_TOKEN"
    else:
        where = str(path)
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise UnusableFile(
                f"{path}: the token cannot be read: {getattr(error, 'strerror', '') or 'no text'}"
            ) from None
    token = text.strip()
    if not token.isascii() or not token.isprintable() or " " in token:
        raise UnusableFile(f"{where} holds no token: it is one word of plain letters and digits")
    return token


def connect(site: Path | None = None, url: str = "", token_file: Path | None = None) -> Client:
    """Return a client of the engine at an address, or of the one of this folder.

    Args:
        site: a site file; without it the current folder and those above it are looked at.
        url: an engine's address; without it and `site`, FORMIGA_URL.
        token_file: holds the token for `url`; without it FORMIGA_TOKEN, or the file that FORMIGA_TOKEN_FILE names.

    Raises:
        NoEngine: none runs, or several do.
        UnusableFile: `url` is no address, both are given, or the token cannot be used.
    """
    if url and site is not None:
        raise UnusableFile("--url and --site name two engines; leave one out")
    named_url = url or ("" if site is not None else os.environ.get("FORMIGA_URL", ""))
    if named_url:
        place = EngineAddress(site="", pid=0, epoch=0, url=_base(named_url), endpoint="")
        return Client(place, _own_token(token_file))
    if token_file is not None:
        raise UnusableFile("--token-file goes with --url; an engine of this machine's own has its token in its folder")
    if site is not None:
        folder = site if site.is_dir() else site.parent
        found = [a for a in find_engines(folder) if Path(a.folder).parent.parent == folder.resolve()]
    else:
        folder = Path.cwd()
        found = find_engines(folder)
    named = os.environ.get("FORMIGA_SITE", "")
    if named:
        found = [address for address in found if address.site == named]
    if len(found) == 1:
        return Client(found[0])
    if found:
        sites = ", ".join(address.site for address in found)
        raise NoEngine(f"several engines run here: {sites}\n  help: choose one: FORMIGA_SITE=NAME formiga ...")
    raise NoEngine(
        f"no engine runs for {'the site ' + named + ' in ' if named else ''}{folder.resolve()}, or a folder above it\n"
        "  help: start one in the folder of your site.yaml: formiga up (formiga init makes such a folder);\n"
        "        an engine of another folder: --site FILE"
    )


def segment(word: str) -> str:
    """Return a word as one part of a path."""
    return quote(word, safe="")


def user() -> str:
    """Return who gives orders from this terminal."""
    name = os.environ.get("USER") or os.environ.get("LOGNAME") or ""
    if not name:
        with suppress(KeyError, OSError):  # a service or a container may have a number only
            name = pwd.getpwuid(os.getuid()).pw_name
    return f"{name}@{socket.gethostname()}" if name else "cli"


def show_next(*commands: str, said: str = "") -> None:
    """Suggest what comes next, each command once, and none that the answer has proposed already.

    Args:
        commands: what may come next, best first.
        said: the answer; what stands behind `->` in it is not said again.
    """
    fresh = following(commands, said)
    if fresh:
        print(f"next: {fresh}", file=sys.stderr)


def following(commands: Iterable[str], said: str = "") -> str:
    """Return some commands as one line; see `show_next`."""
    hints = [line.partition("-> ")[2] for line in said.splitlines() if line.lstrip().startswith("-> ")]
    known = {one for hint in hints for one in hint.split(" | ")}
    fresh = [one for one in dict.fromkeys(commands) if one not in known]
    return "    or: ".join(fresh[:MOST_NEXT]) + ("    ..." if len(fresh) > MOST_NEXT else "")


def print_json(value: Any) -> None:
    """Print a value as JSON."""
    print(json.dumps(value, indent=2, ensure_ascii=False))
