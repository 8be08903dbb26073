"""The seam between channels and ways: a sender tries once, and says what became of it. No text of it has a secret in it."""

import os
import stat
from pathlib import Path
from typing import Final, Literal, Protocol

from msgspec import Struct

from formiga_bt.base.durable import open_to_others
from formiga_bt.base.errors import FormigaError
from formiga_bt.lang.model.news import SecretAt
from formiga_bt.services.news.message import Message

MOST_SECRET: Final = 4096
"""Bytes of a file with a secret."""


class Outcome(Struct, frozen=True):
    """What became of one try."""

    how: Literal["delivered", "failed", "refused", "unusable"]
    """`refused`: the receiver cannot take this message, whatever it takes else. `unusable`: it was not even tried."""
    text: str = ""
    """For people."""
    said: str = ""
    """The beginning of the answer's body: for whoever tests the channel, and nobody else."""
    after_s: float | None = None
    """The receiver asks not to be tried sooner."""


class Sender(Protocol):
    """A way to a receiver. Used by one task at a time."""

    async def send(self, message: Message) -> Outcome:
        """Try once, for a bounded time."""
        ...

    async def close(self) -> None:
        """Give back what it holds; it may be used again afterwards."""
        ...


class NoSecret(FormigaError):  # noqa: N818 - it names what is wrong
    """A secret cannot be read."""


def read_secret(at: SecretAt, beside: Path) -> str:
    """Return a secret of the site.

    Args:
        at: where it stands.
        beside: the folder of the site file.

    Raises:
        NoSecret: it is not there, or others can read it.
    """
    if at.env:
        found = os.environ.get(at.env, "").strip()
        if not found:
            raise NoSecret(f"the environment has no {at.env}", help=f"start the engine with {at.env}=...")
        return found
    path = beside / at.file
    try:
        with path.open("rb") as file:
            told = os.fstat(file.fileno())
            if not stat.S_ISREG(told.st_mode) or told.st_size > MOST_SECRET:
                raise NoSecret(f"{at.file} is no file with a secret")
            if open_to_others(told):
                raise NoSecret(f"{at.file} can be read by others", help=f"chmod 600 {at.file}")
            found = file.read(MOST_SECRET).decode("utf-8").strip()
    except OSError as error:
        fix = f"put it there, with the mode 0600: (umask 077; cat > {at.file})"
        raise NoSecret(f"{at.file} cannot be read: {error.strerror or error}", help=fix) from None
    except UnicodeDecodeError:
        raise NoSecret(f"{at.file} is no text") from None
    if not found:
        raise NoSecret(f"{at.file} is empty")
    return found
