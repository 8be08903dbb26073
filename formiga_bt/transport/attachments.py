"""Files that a result or an event names: a photo, a log. Their bytes pass beside the messages, under their hash.

Called by agents that make one, by the engine that reads which there are, and by the store that keeps the bytes.
"""

import re
from collections.abc import Sequence
from hashlib import sha256
from typing import Final, Protocol

from msgspec import Struct

from formiga_bt.base.errors import TransportError

MOST_BYTES: Final = 16 * 1024 * 1024
"""The most bytes of one file."""
MOST_NAMED: Final = 16
"""The most files that one event names."""

_HASH: Final = re.compile(r"[0-9a-f]{64}")
_NAME: Final = re.compile(r"[^\x00-\x1f\x7f/\\:*?\"<>|]{1,100}")
_TYPE: Final = re.compile(r"[a-z0-9][a-z0-9!#$&^_.+-]{0,60}/[a-z0-9][a-z0-9!#$&^_.+-]{0,60}")
_URI: Final = re.compile(r"(https?://[!-~]{1,1000})?")


class Attachment(Struct, frozen=True, kw_only=True):
    """A file that a result or an event names."""

    name: str
    """For people; no path."""
    media_type: str = "application/octet-stream"
    size: int
    """Bytes."""
    sha256: str
    """Of the bytes, 64 lower-case hexadecimal digits."""
    uri: str = ""
    """Where else it is to be had (http, https); empty: by its hash, here."""


class FileError(TransportError):
    """Bytes that are not taken: too many, or with another hash than said."""


class KeepsFiles(Protocol):
    """Who keeps the bytes of attachments."""

    def put(self, digest: str, data: bytes) -> None:
        """Keep bytes; the same again changes nothing.

        Raises:
            FileError: they are too many, have another hash, or cannot be written.
        """
        ...

    def get(self, digest: str) -> bytes | None:
        """Return the bytes of a hash; None: they are not here."""
        ...


def attachment_of(name: str, data: bytes, media_type: str = "application/octet-stream", uri: str = "") -> Attachment:
    """Return what names these bytes.

    Raises:
        FileError: the name, the media type or the uri cannot be used, or the bytes are too many.
    """
    made = Attachment(name=name, media_type=media_type, size=len(data), sha256=sha256(data).hexdigest(), uri=uri)
    fault = fault_of(made)
    if fault:
        raise FileError(f"{name[:100]!r}: {fault}")
    return made


def fault_of(one: Attachment) -> str:
    """Return why an attachment is refused, or ""."""
    if not _NAME.fullmatch(one.name) or one.name.startswith(".") or one.name.strip() != one.name:
        return "its name is no plain file name of at most 100 characters"
    if not _TYPE.fullmatch(one.media_type):
        return "its media type is none, such as image/jpeg"
    if not _HASH.fullmatch(one.sha256):
        return "its sha256 is not 64 lower-case hexadecimal digits"
    if not 0 <= one.size <= MOST_BYTES:
        return f"{one.size} bytes; the most is {MOST_BYTES}"
    return "" if _URI.fullmatch(one.uri) else "its uri is no http or https address of at most 1000 characters"


def check_bytes(digest: str, data: bytes) -> None:
    """Look whether bytes are those of a hash.

    Raises:
        FileError: they are too many, the hash is none, or another one than theirs.
    """
    if len(data) > MOST_BYTES:
        raise FileError(f"too_large: {len(data)} bytes; the most is {MOST_BYTES}")
    if not _HASH.fullmatch(digest):
        raise FileError(f"bad_hash: {digest[:80]!r} is not 64 lower-case hexadecimal digits")
    found = sha256(data).hexdigest()
    if found != digest:
        raise FileError(f"bad_hash: the {len(data)} bytes have the sha256 {found}, not {digest}")


def usable(given: Sequence[Attachment]) -> tuple[tuple[Attachment, ...], tuple[str, ...]]:
    """Return those attachments that are taken, and why the others are not."""
    good: list[Attachment] = []
    bad: list[str] = []
    for one in given:
        fault = fault_of(one) if len(good) < MOST_NAMED else f"an event names at most {MOST_NAMED} files"
        if fault:
            bad.append(f"{one.name[:100]!r}: {fault}")
        else:
            good.append(one)
    return tuple(good), tuple(bad)
