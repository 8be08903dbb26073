"""Who may call, and how much they may send: checked before any route is looked for.

On the loopback no token is needed, but a web page that the user happens to look at must not be able to fly drones: requests
from other origins, and for other host names (DNS rebinding), are refused. Beyond the loopback every request needs the site's
token. A token that is sent is always compared.
"""

import hmac
import ipaddress
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, Final

BODY_LIMIT: Final = 1_000_000
"""Bytes of a request's body."""
DROP_LIMIT: Final = 20 * BODY_LIMIT

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
Answer = Callable[[int, str, str, str], App]
"""Makes the app that answers a refusal: status, code, text, hint."""


class Door:
    """ASGI middleware.

    Args:
        app: what is behind it.
        token: the site's token.
        needs_token: whether each request must bring it.
        refusal: how a refusal is written.
    """

    def __init__(self, app: App, *, token: str, needs_token: bool, refusal: Answer) -> None:
        self._app = app
        self._token = token
        self._needs_token = needs_token
        self._refusal = refusal

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request in, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._check(scope, headers)
        if refusal is not None:
            await refusal(scope, receive, send)
            return
        body = await _read(receive)
        if body is None:
            await self._too_large()(scope, receive, send)
        else:
            await self._app(scope, _replayed(body, receive), send)

    def _check(self, scope: Scope, headers: dict[str, str]) -> App | None:
        scheme, _, word = headers.get("authorization", "").partition(" ")
        if word or self._needs_token:
            if scheme.lower() == "bearer" and hmac.compare_digest(word.strip().encode(), self._token.encode()):
                return None
            hint = "send it as 'Authorization: Bearer ...'; it is in the file `token` of the site's runtime folder"
            return self._refusal(401, "unauthorized", "this engine wants its site's token", hint)
        if not is_loopback(headers.get("host", "").rsplit(":", 1)[0]):
            return self._refusal(403, "wrong_host", "call this engine by 127.0.0.1 or localhost", "")
        origin = headers.get("origin")
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") or (
            origin is not None and origin != f"{scope.get('scheme', 'http')}://{headers.get('host', '')}"
        ):
            return self._refusal(403, "other_origin", "a page of another origin may not call this engine", "")
        return None

    def _too_large(self) -> App:
        return self._refusal(413, "too_large", f"the body is larger than {BODY_LIMIT:,} bytes", "")


def is_loopback(host: str) -> bool:
    """Return whether a host name or address is this machine's own."""
    bare = host.strip("[]")
    if bare == "localhost":
        return True
    try:
        return ipaddress.ip_address(bare).is_loopback
    except ValueError:
        return False


async def _read(receive: Receive) -> bytes | None:
    """Return the whole body, or None if it is too large.

    What is too much is read and dropped, up to a bound: a client that is still sending would not see the answer.
    """
    body, got = b"", 0
    while True:
        message = await receive()
        part = bytes(message.get("body", b""))
        got += len(part)
        body = body + part if got <= BODY_LIMIT else b""
        if not message.get("more_body", False):
            return body if got <= BODY_LIMIT else None
        if got > DROP_LIMIT:
            return None


def _replayed(body: bytes, receive: Receive) -> Receive:
    given = False

    async def replay() -> Message:
        nonlocal given
        if given:
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return replay
