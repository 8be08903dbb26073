"""A webhook: one POST, signed as standardwebhooks.com says, to an address that is looked at before anything is sent.

No redirect is followed, no proxy of the environment is used, no cookie is kept, and little is read of the answer. Loaded only
where a site has a webhook, before the first news are on their way: its libraries take long.
"""

import asyncio
import os
import socket
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import aiohttp
from standardwebhooks import Webhook as Signer

from formiga_bt import __version__
from formiga_bt.lang.model.news import Webhook
from formiga_bt.services.news.addresses import ForbiddenAddressError, why_not
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import NoSecret, Outcome, read_secret

WITHIN_S: Final = 15.0
"""The whole of one try."""
CONNECT_S: Final = 5.0
MOST_ANSWER: Final = 1024
"""Bytes of an answer that are read."""
REFUSED: Final = frozenset({400, 413, 422})
"""Statuses that say that this very message cannot be taken."""
BUSY: Final = frozenset({429, 503})


class WebhookSender:
    """Sends to one URL; the connection is kept open between messages.

    Args:
        to: where its URL and its secret stand.
        beside: the folder of the site file.
        wall: wall time.
    """

    def __init__(self, to: Webhook, beside: Path, wall: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._to, self._beside, self._wall = to, beside, wall
        self._session: aiohttp.ClientSession | None = None
        self._url = ""
        self._signer: Signer | None = None

    async def send(self, message: Message) -> Outcome:
        """Try once; see `Sender.send`."""
        try:
            session, signer = self._open()
        except NoSecret as error:
            return Outcome("unusable", str(error).replace("\n  help: ", "; "))
        at = self._wall()
        headers = {
            "webhook-id": message.id,
            "webhook-timestamp": str(int(at.timestamp())),
            "webhook-signature": signer.sign(message.id, at, message.body.decode()),
            "content-type": "application/json",
            "user-agent": f"formiga_bt/{__version__}",
        }
        outcome = await self._post(session, message.body, headers)
        if outcome.how == "failed":
            await self.close()  # the URL or the secret may be another one by now
        return outcome

    async def close(self) -> None:
        """Close the connection."""
        session, self._session = self._session, None
        if session is not None:
            await session.close()

    async def _post(self, session: aiohttp.ClientSession, body: bytes, headers: dict[str, str]) -> Outcome:
        try:
            async with session.post(self._url, data=body, headers=headers, allow_redirects=False) as answer:
                after = answer.headers.get("retry-after", "") if answer.status in BUSY else ""
                said = await answer.content.read(MOST_ANSWER)
                if not answer.content.at_eof():
                    answer.close()
                return _outcome(answer.status, said, after)
        except TimeoutError:
            return Outcome("failed", f"it did not answer within {WITHIN_S:g} s")
        except aiohttp.InvalidURL:
            return Outcome("unusable", "its URL is none")
        except aiohttp.ClientConnectorCertificateError:
            return Outcome("failed", "its certificate is not trusted")
        except aiohttp.ClientConnectorDNSError:
            return Outcome("failed", "its name is not known")
        except aiohttp.ClientConnectorError as error:
            cause = error.os_error
            return Outcome("failed", str(cause) if isinstance(cause, ForbiddenAddressError) else _of_os(cause))
        except (aiohttp.ClientError, OSError, asyncio.IncompleteReadError, ValueError) as error:
            return Outcome("failed", f"the connection broke ({type(error).__name__})")

    def _open(self) -> tuple[aiohttp.ClientSession, Signer]:
        """Return the session and what signs; the URL and the secret are read when it is opened.

        Raises:
            NoSecret: one of them cannot be used.
        """
        if self._session is not None and self._signer is not None:
            return self._session, self._signer
        self._url = _checked(read_secret(self._to.url, self._beside), private=self._to.private)
        try:
            self._signer = Signer(read_secret(self._to.secret, self._beside))
        except NoSecret:
            raise
        except Exception:  # noqa: BLE001 - of a library; what it says may hold the secret
            raise NoSecret("its secret is none: whsec_ and base64") from None
        connector = aiohttp.TCPConnector(limit=1, socket_factory=self._socket)
        self._session = aiohttp.ClientSession(
            connector=connector, timeout=aiohttp.ClientTimeout(total=WITHIN_S, sock_connect=CONNECT_S),
            cookie_jar=aiohttp.DummyCookieJar(), auto_decompress=False, trust_env=False,
        )  # fmt: skip
        return self._session, self._signer

    def _socket(self, info: Any) -> socket.socket:
        """Return a socket for a connection; the only place where one is made.

        Raises:
            ForbiddenAddressError: nothing may be sent there.
        """
        family, kind, proto, _, at = info
        why = why_not(str(at[0]), private=self._to.private)
        if why:
            raise ForbiddenAddressError(why)
        return socket.socket(family=family, type=kind, proto=proto)


def _checked(url: str, *, private: bool) -> str:
    """Return a URL that may be called.

    Raises:
        NoSecret: it is none, or of another scheme; the text does not repeat it.
    """
    try:
        parts = urlsplit(url)
        host, _ = parts.hostname, parts.port
    except ValueError:
        raise NoSecret("its URL is none") from None
    if parts.scheme not in ("https", "http") or not host or any(letter.isspace() for letter in url):
        raise NoSecret("its URL is none", help="such as https://example.org/hook")
    if parts.scheme == "http" and not private:
        raise NoSecret("its URL is plain http", help="https, or private: true where it never leaves your own net")
    return url


def _outcome(status: int, said: bytes, after: str) -> Outcome:
    words = "".join(letter if letter.isprintable() else " " for letter in said[:200].decode("utf-8", "replace")).strip()
    text = f"it answered {status}"
    if 200 <= status < 300:
        return Outcome("delivered", text, words)
    if 300 <= status < 400:
        return Outcome("failed", f"it answered {status}: it sends elsewhere, which is not followed")
    if status in REFUSED:
        return Outcome("refused", text, words)
    after_s = float(after) if after.isascii() and after.isdigit() and len(after) < 6 else None
    return Outcome("failed", text, words, after_s)


def _of_os(error: OSError) -> str:
    """Return why there is no connection; the library's own text has the address."""
    return f"it cannot be reached: {os.strerror(error.errno) if error.errno else type(error).__name__}"
