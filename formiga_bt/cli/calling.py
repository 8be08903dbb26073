"""How the verbs find a running engine and call its API: `.formiga/<site>/engine.json`, then plain HTTP.

The standard library's client is enough here, and it starts fast. Nothing here imports the command line library: an order in
a hurry (`formiga hold --all`) does without it. What the verbs' options and tables need is in `client`.
"""

import http.client
import json
import os
import pwd
import socket
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlencode, urlsplit

from formiga_bt.errors import FormigaError
from formiga_bt.site_folder import EngineAddress, find_engines

TIMEOUT_S: Final = 30.0


class NoEngine(FormigaError):  # noqa: N818 - it names what is wrong
    """No engine runs where it was looked for, or it does not answer."""


class ApiError(FormigaError):
    """The engine said no. `code` is a stable word."""

    def __init__(self, code: str, text: str, hint: str, status: int) -> None:
        super().__init__(text + (f"\n  help: {hint}" if hint else ""))
        self.code = code
        self.status = status


@dataclass(frozen=True, slots=True)
class Event:
    """A server-sent event, or (type "") a sign of life."""

    type: str
    data: dict[str, Any]


class Client:
    """One engine's API."""

    def __init__(self, address: EngineAddress) -> None:
        self.address = address
        self._token = _token(address)

    def get(self, path: str, **query: Any) -> Any:
        """Return what a GET answers.

        Raises:
            ApiError: the engine said no.
            NoEngine: it does not answer.
        """
        return self._call("GET", path, query)

    def post(self, path: str, body: Any = None, *, key: str = "") -> Any:
        """Return what a POST answers; `key` is its Idempotency-Key."""
        return self._call("POST", path, {}, body, {"Idempotency-Key": key} if key else {})

    def events(self, after: str = "", task: str = "") -> Iterator[Event]:
        """Yield what happens, and signs of life in between; ends with the engine."""
        query = {"after": after, "task": task}
        with self._answer("GET", "/v1/events", query) as answer:
            kind, data = "", ""
            for line in answer:
                text = line.decode("utf-8").rstrip("\r\n")
                name, _, value = text.partition(":")
                if not text and kind:
                    yield Event(kind, json.loads(data))
                    kind, data = "", ""
                elif name == "event":
                    kind = value.strip()
                elif name == "data":
                    data = value.strip()
                elif not name and value == "":
                    yield Event("", {})

    def _call(
        self, method: str, path: str, query: Mapping[str, Any], body: Any = None, more: Mapping[str, str] | None = None
    ) -> Any:
        with self._answer(method, path, query, body, more) as answer:
            return json.loads(answer.read())

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
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=TIMEOUT_S)
        words = urlencode({name: value for name, value in query.items() if value not in ("", None)})
        headers = {"Accept": "application/json", **(more or {})}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        if method != "GET":
            headers["Content-Type"] = "application/json"
        try:
            text = None if body is None else json.dumps(body).encode()
            connection.request(method, f"{path}?{words}" if words else path, text, headers)
            answer = connection.getresponse()
            if answer.status >= 400:
                raise _error(answer)
            yield answer
        except (OSError, http.client.HTTPException) as error:
            raise NoEngine(
                f"the engine of site '{self.address.site}' (process {self.address.pid}) does not answer at"
                f" {self.address.url}: {error or type(error).__name__}"
            ) from error
        finally:
            connection.close()


def _error(answer: http.client.HTTPResponse) -> ApiError:
    try:
        said = json.loads(answer.read())
        text, more = said["text"], said.get("problems", ())
        if len(more) > 1 or (more and said["code"] == "bad_params"):
            text = "\n\n".join([*more, "nothing was started" if said["code"] == "bad_params" else text])
            return ApiError(said["code"], text, "", answer.status)
        return ApiError(said["code"], text, said.get("hint", ""), answer.status)
    except (ValueError, KeyError, TypeError):
        return ApiError("http", f"{answer.status} {answer.reason}", "", answer.status)


def _token(address: EngineAddress) -> str:
    try:
        return address.token_file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def connect(site: Path | None = None) -> Client:
    """Return a client of the engine of this folder.

    Args:
        site: a site file; without it the current folder and those above it are looked at.

    Raises:
        NoEngine: none runs, or several do.
    """
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


def show_next(*commands: str) -> None:
    """Suggest what comes next."""
    if commands:
        print("next: " + "    or: ".join(commands), file=sys.stderr)


def print_json(value: Any) -> None:
    """Print a value as JSON."""
    print(json.dumps(value, indent=2, ensure_ascii=False))
