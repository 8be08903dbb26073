"""Who may call, how much they may send, and how many at once: checked before any route is looked for.

On the loopback no token is needed in mode simulation, but a web page that the user happens to look at must not be able to fly
drones: requests from other origins, and for other host names (DNS rebinding), are refused. Beyond the loopback, and in mode
real everywhere, every request needs a token: of an account, whose roles say what it may do (`speaking`), or the site's, which
is for who owns its files. A token that is sent is always compared. At the local door the system
itself says whose process calls (`connection`), so what stops something is taken there without a token.

A request that changes something has a `Caller`: if its client goes away, what it asked for is dropped, unless it is a stop.
"""

import asyncio
import contextlib
import hmac
import logging
import time
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, Final

from formiga_bt.base.accounts import AccountBook, is_token
from formiga_bt.base.endpoints import is_loopback
from formiga_bt.base.errors import SiteError
from formiga_bt.engine.drivers.waiting import CALLER, Caller, since_boot
from formiga_bt.services.http.audit import Audit
from formiga_bt.services.http.crowd import Crowd
from formiga_bt.services.http.speaking import ALL, SPEAKER, Principal
from formiga_bt.services.http.urgent import is_urgent
from formiga_bt.services.pace import LATER, Pace
from formiga_bt.transport.attachments import MOST_BYTES

log = logging.getLogger("formiga.door")

BODY_LIMIT: Final = 1_000_000
"""Bytes of a request's body."""
FILE_LIMIT: Final = MOST_BYTES
"""The same of an attachment."""
FILES: Final = "/v1/attachments/"
DROP_LIMIT: Final = 20 * BODY_LIMIT
GONE: Final = b"gone"
"""Stands for a body that did not come to its end; compared by identity."""
TURNS: Final = 4
"""Turns of the event loop in which it sees that a connection is closed already."""

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
Answer = Callable[[int, str, str, str], App]
"""Makes the app that answers a refusal: status, code, text, hint."""


FULL: Final = {
    "crowded": ("this door of the engine is full", "try again in some seconds; stops get through"),
    "too_many_streams": ("too many read the events already", "end some of them, or try again later"),
}
STREAM: Final = "/v1/events"
ALIVE: Final = "/healthz"
LOOKS: Final = ("GET", "HEAD", "OPTIONS")
"""Methods that change nothing."""


class Door:
    """ASGI middleware.

    Args:
        app: what is behind it.
        token: the site's token.
        needs_token: whether each request must bring it.
        refusal: how a refusal is written.
        accounts: whose tokens are taken besides.
        audit: is told who asked for what.
        pace: counts what accounts send; one for all doors of an engine.
        crowd: the places at this door.
        is_local: it is the Unix socket.
        alive: answers `ALIVE`, which everybody may ask without a token: whoever restarts an engine that hangs has none.
    """

    def __init__(
        self,
        app: App,
        *,
        token: str,
        needs_token: bool,
        refusal: Answer,
        accounts: AccountBook | None = None,
        audit: Audit | None = None,
        pace: Pace | None = None,
        crowd: Crowd[Any] | None = None,
        is_local: bool = False,
        alive: Callable[[], App] | None = None,
    ) -> None:
        self._app = app
        self._token = token
        self._needs_token = needs_token
        self._refusal = refusal
        self._accounts = accounts
        self._audit = audit
        self._pace = pace or Pace()
        self._crowd = crowd
        self._is_local = is_local
        self._alive = alive

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request in, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if self._alive is not None and scope["path"] == ALIVE and scope["method"] in LOOKS:
            await self._alive()(scope, receive, send)
            return
        caller = Caller(since_boot())
        urgent = is_urgent(scope["method"], scope["path"])
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        found = self._check(scope, headers, urgent=urgent)
        who = found.name if isinstance(found, Principal) else ""
        send = self._noted(scope, who, send)
        if not isinstance(found, Principal):
            await found(scope, receive, send)
            return
        if not (urgent or found.is_local or self._pace.takes(found.name, found.requests)):
            text = f"{found.name} sent more than {found.requests} requests within a minute"
            await self._refusal(429, "too_many_requests", text, LATER)(scope, receive, send)
            return
        before = SPEAKER.set(found)
        try:
            await self._serve(scope, receive, send, caller, urgent=urgent)
        finally:
            SPEAKER.reset(before)

    async def _serve(self, scope: Scope, receive: Receive, send: Send, caller: Caller, *, urgent: bool) -> None:
        limit = FILE_LIMIT if scope["method"] == "PUT" and scope["path"].startswith(FILES) else BODY_LIMIT
        body = await _read(receive, limit)
        if body is None:
            await self._too_large(limit)(scope, receive, send)
        elif body is not GONE:
            await self._let_in(scope, body, receive, send, caller, urgent=urgent)

    async def _let_in(
        self, scope: Scope, body: bytes, receive: Receive, send: Send, caller: Caller, *, urgent: bool
    ) -> None:
        crowd, stream = self._crowd, scope["path"] == STREAM
        full = crowd.begin(urgent=urgent, stream=stream) if crowd is not None else ""
        if full:
            await self._refusal(503, full, *FULL[full])(scope, receive, send)
            return
        try:
            if scope["method"] in LOOKS:
                await self._app(scope, _replayed(body, receive), send)
            else:
                await self._attended(scope, body, receive, send, caller)
        finally:
            if crowd is not None:
                crowd.end(urgent=urgent, stream=stream)

    async def _attended(self, scope: Scope, body: bytes, receive: Receive, send: Send, caller: Caller) -> None:
        """Let a request in whose client is watched while it waits."""
        watch = asyncio.create_task(_watch(receive, caller))
        for _ in range(TURNS):  # a client that has gone already is seen before its order is given
            await asyncio.sleep(0)
        before = CALLER.set(caller)
        try:
            await self._app(scope, _replayed(body, receive), send)
        finally:
            CALLER.reset(before)
            watch.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await watch

    def _noted(self, scope: Scope, who: str, send: Send) -> Send:
        """Return `send`, with what the answer is noted in the audit: of what changes something, and of refusals."""
        audit = self._audit
        if audit is None:
            return send

        async def sent(message: Message) -> None:
            status = message.get("status", 0)
            if message["type"] == "http.response.start" and (scope["method"] not in LOOKS or status in (401, 403)):
                whence = (scope.get("client") or ("local",))[0] or "local"
                audit.note(who, str(whence), scope["method"], scope["path"], status)
            await send(message)

        return sent

    def _known(self, word: str) -> Principal | None:
        """Return whose token a word is."""
        if hmac.compare_digest(word.encode(), self._token.encode()):
            return ALL
        if self._accounts is None or not is_token(word):
            return None
        try:
            found = self._accounts.find(word, time.time())
        except SiteError as error:
            log.warning("%s", error)
            return None
        return Principal.of(*found) if found is not None else None

    def _check(self, scope: Scope, headers: dict[str, str], *, urgent: bool) -> App | Principal:
        """Return who calls, or the refusal."""
        scheme, _, word = headers.get("authorization", "").partition(" ")
        if word or (self._needs_token and not (self._is_local and urgent)):
            found = self._known(word.strip()) if scheme.lower() == "bearer" else None
            if found is not None:
                return found
            hint = (
                "send it as 'Authorization: Bearer ...': the token of an account (formiga access token NAME), or of the site, "
                "in the file `token` of its runtime folder"
            )
            return self._refusal(401, "unauthorized", "this engine wants a token that it knows", hint)
        if self._is_local:
            return ALL  # no web page reaches it
        if not is_loopback(headers.get("host", "").rsplit(":", 1)[0]):
            return self._refusal(403, "wrong_host", "call this engine by 127.0.0.1 or localhost", "")
        origin = headers.get("origin")
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") or (
            origin is not None and origin != f"{scope.get('scheme', 'http')}://{headers.get('host', '')}"
        ):
            return self._refusal(403, "other_origin", "a page of another origin may not call this engine", "")
        return ALL

    def _too_large(self, limit: int) -> App:
        return self._refusal(413, "too_large", f"the body is larger than {limit:,} bytes", "")


async def _read(receive: Receive, limit: int) -> bytes | None:
    """Return the whole body, None if it is too large, `GONE` if the client went away in the middle of it.

    What is too much is read and dropped, up to a bound: a client that is still sending would not see the answer.
    """
    parts: list[bytes] = []
    got = 0
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            return GONE
        part = bytes(message.get("body", b""))
        got += len(part)
        if got <= limit:
            parts.append(part)
        else:
            parts.clear()
        if not message.get("more_body", False):
            return b"".join(parts) if got <= limit else None
        if got > max(DROP_LIMIT, 2 * limit):
            return None


async def _watch(receive: Receive, caller: Caller) -> None:
    """Wait until the client has gone, or has its answer."""
    while (await receive())["type"] != "http.disconnect":
        pass
    caller.leave()


def _replayed(body: bytes, receive: Receive) -> Receive:
    given = False

    async def replay() -> Message:
        nonlocal given
        if given:
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return replay
