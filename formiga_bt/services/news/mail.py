"""Mail: one message by SMTP to a mail server, over TLS unless that is in one's own net.

A double has the same Message-ID. Loaded only where a site has such a channel.
"""

import asyncio
import os
import socket
from collections.abc import Callable
from datetime import UTC, datetime
from email.message import EmailMessage
from email.utils import format_datetime
from pathlib import Path
from typing import Any, Final

import aiosmtplib
import msgspec

from formiga_bt.lang.model.news import Mail
from formiga_bt.services.news.addresses import ForbiddenAddressError, connected
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import NoSecret, Outcome, read_secret

WITHIN_S: Final = 15.0
"""Each answer of the server; the whole of a try takes twice this at most."""


class MailSender:
    """Sends each message over a connection of its own.

    Args:
        to: the server, and whom it is for.
        beside: the folder of the site file.
        wall: wall time.
    """

    def __init__(self, to: Mail, beside: Path, wall: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._to, self._beside, self._wall = to, beside, wall

    async def send(self, message: Message) -> Outcome:
        """Try once; see `Sender.send`."""
        try:
            password = read_secret(self._to.password, self._beside) if self._to.password is not None else None
        except NoSecret as error:
            return Outcome("unusable", str(error).replace("\n  help: ", "; "))
        try:
            async with asyncio.timeout(2 * WITHIN_S):
                return await self._send(letter(message, self._to, self._wall()), password)
        except TimeoutError:
            return Outcome("failed", f"it did not answer within {WITHIN_S:g} s")
        except ForbiddenAddressError as error:
            return Outcome("failed", str(error))
        except aiosmtplib.SMTPDataError as error:
            return Outcome(
                "refused" if error.code >= 500 else "failed", f"it answered {error.code}", error.message[:200]
            )
        except aiosmtplib.SMTPResponseException as error:
            return Outcome("failed", f"it answered {error.code}", error.message[:200])
        except aiosmtplib.SMTPRecipientsRefused as error:
            codes = ", ".join(sorted({str(one.code) for one in error.recipients}))
            return Outcome("failed", f"it takes nothing for some of the addresses ({codes})")
        except socket.gaierror:
            return Outcome("failed", "its name is not known")
        except (aiosmtplib.SMTPException, OSError) as error:
            why = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else type(error).__name__
            return Outcome("failed", f"it cannot be reached: {why}")

    async def close(self) -> None:
        """Do nothing: no connection is kept."""

    async def _send(self, what: EmailMessage, password: str | None) -> Outcome:
        to = self._to
        sock = await connected(to.host, to.port, private=to.private)
        client = aiosmtplib.SMTP(
            hostname=to.host, sock=sock, timeout=WITHIN_S, use_tls=to.tls == "direct", start_tls=to.tls == "starttls",
            username=to.user or None, password=password, local_hostname="formiga",
        )  # fmt: skip
        try:
            await client.connect()
            refused, said = await client.send_message(what)
        finally:
            client.close()
            sock.close()
        if refused:
            return Outcome("delivered", f"but not to {len(refused)} of {len(to.to)}", said[:200])
        return Outcome("delivered", "it took the mail", said[:200])


def letter(message: Message, to: Mail, at: datetime) -> EmailMessage:
    """Return news as a mail."""
    found: dict[str, Any] = msgspec.json.decode(message.body)
    mail = EmailMessage()
    mail["From"], mail["To"] = to.sender, ", ".join(to.to)
    mail["Subject"] = " ".join(message.subject.split())[:200]
    mail["Date"] = format_datetime(at)
    mail["Message-ID"] = f"<{message.id}@formiga.invalid>"
    mail["Auto-Submitted"] = "auto-generated"
    rows = {"type": found["type"], "timestamp": found["timestamp"], **found["data"]}
    mail.set_content("".join(f"{key}: {' '.join(str(value).split())}\n" for key, value in rows.items()))
    return mail
