"""Secrets of a person's own, as `secrets.json` of a site's runtime folder keeps them: never as text, only as salted hashes.

    {"people": {"ann": {"kdf": "scrypt", "n": 32768, "r": 8, "p": 1, "salt": "5e...", "hash": "a0..."}}}

The file is read anew each time, so a secret that is set counts at once. What cannot be used lets nobody in. Called by the
engine (`services.http.proving`) and by the commands (`formiga access`, `formiga approve` without an engine).
"""

import hashlib
import hmac
import json
import secrets
import unicodedata
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.durable import move_aside, write_durably
from formiga_bt.base.errors import FormigaError, SiteError, TaskError
from formiga_bt.base.private_files import PrivateFileError, read_private

SECRETS: Final = "secrets.json"
SHORTEST, LONGEST = 12, 200
"""Letters of a secret."""
MOST_BYTES: Final = 1_000_000
"""A larger file is none of ours."""
SALT, LENGTH = 16, 32
"""Bytes of a salt, and of a hash."""
COSTS: Final = (2**15, 8, 1)
"""n, r and p of scrypt for new hashes: 32 MB and about 0.1 s."""
LEAST_N, MOST_N, MOST_R, MOST_P = 2**14, 2**17, 8, 4
"""What is taken of a file: a hash that is cheaper is none, one that is dearer would stop the engine."""


@dataclass(frozen=True, slots=True, repr=False)
class Hashed:
    """The hash of a secret, with its salt and costs; both texts are hexadecimal."""

    salt: str
    hash: str
    n: int
    r: int
    p: int
    kdf: str = "scrypt"

    def fits(self, secret: str) -> bool:
        """Return whether it is of this secret. Takes about 0.1 s: never called in the engine's thread or an event loop."""
        return len(secret) <= LONGEST and hmac.compare_digest(_hash(secret, self), bytes.fromhex(self.hash))


def prepared(secret: str) -> str:
    """Return a new secret as it is hashed.

    Raises:
        FormigaError: it is too short or too long, or has letters that cannot be typed. The text does not repeat it.
    """
    text = unicodedata.normalize("NFC", secret)
    if not SHORTEST <= len(text) <= LONGEST:
        raise FormigaError(f"a secret has {SHORTEST} to {LONGEST} letters, this one {len(text)}; nothing was changed")
    if not text.isprintable() or text != text.strip():
        raise FormigaError(
            "a secret has no spaces at its ends, and no letters that cannot be seen; nothing was changed"
        )
    return text


def hashed(secret: str, costs: tuple[int, int, int] = COSTS) -> Hashed:
    """Return the hash of a secret with a new salt."""
    n, r, p = costs
    blank = Hashed(secrets.token_hex(SALT), "", n, r, p)
    return Hashed(blank.salt, _hash(secret, blank).hex(), n, r, p)


def _hash(secret: str, of: Hashed) -> bytes:
    text = unicodedata.normalize("NFC", secret).encode("utf-8", "surrogatepass")
    room = 2 * 128 * of.r * (of.n + of.p)
    return hashlib.scrypt(text, salt=bytes.fromhex(of.salt), n=of.n, r=of.r, p=of.p, maxmem=room, dklen=LENGTH)


def read_secrets(folder: Path) -> dict[str, Hashed]:
    """Return the secrets that are set, by person; none, if there is no file.

    Raises:
        SiteError: the file cannot be used.
    """
    file = folder / SECRETS
    try:
        found = read_private(file, MOST_BYTES)
        return _understood(json.loads(found)) if found is not None else {}
    except PrivateFileError as error:
        raise _unusable(file, str(error)) from error
    except (ValueError, TypeError, KeyError, RecursionError):
        raise _unusable(file, "it cannot be understood") from None


def _understood(said: Any) -> dict[str, Hashed]:
    people = said["people"]
    if not isinstance(people, dict):
        raise TypeError("people")
    found = {person: Hashed(**one) for person, one in people.items()}
    for one in found.values():
        if one.kdf != "scrypt" or not all(type(cost) is int for cost in (one.n, one.r, one.p)):
            raise ValueError("kdf")
        is_power = one.n & (one.n - 1) == 0
        if not (is_power and LEAST_N <= one.n <= MOST_N and 1 <= one.r <= MOST_R and 1 <= one.p <= MOST_P):
            raise ValueError("costs")
        if len(bytes.fromhex(one.salt)) < SALT or len(bytes.fromhex(one.hash)) != LENGTH:
            raise ValueError("salt")
    return found


def _unusable(file: Path, why: str) -> SiteError:
    return SiteError(
        f"{file} cannot be used: {why}; nobody's secret fits",
        help=f"put the file back; or set it aside, and each sets a new secret: {command('NAME')} --reset",
    )


def find_secret(folder: Path, person: str, secret: str) -> Hashed:
    """Return the hash that a person's secret must fit.

    Raises:
        TaskError: `secret_missing`: none was said, or none is set.
        SiteError: the file cannot be used.
    """
    found = read_secrets(folder).get(person)
    if found is None:
        raise TaskError(
            "secret_missing", f"no secret is set for {person}, without which nobody can say this as {person}"
        )
    if not secret:
        raise TaskError("secret_missing", f"on a real site {person} says this with a secret of {person}'s own")
    return found


def wrong(person: str) -> TaskError:
    """Return the refusal of a secret that does not fit."""
    return TaskError("secret_wrong", f"that is not the secret of {person}")


def command(person: str) -> str:
    """Return the command that sets a person's secret."""
    return f"formiga access secret {person}"


def write_secret(folder: Path, person: str, new: Hashed) -> None:
    """Set a person's secret; it counts at once. Called within `private_files.changing`.

    Raises:
        SiteError: the file cannot be used or written.
    """
    _write(folder, {**read_secrets(folder), person: new})


def set_unusable_aside(folder: Path) -> Path | None:
    """Set the file aside if it cannot be used; return the folder where it is now, or None."""
    try:
        read_secrets(folder)
    except SiteError:
        return move_aside([folder / SECRETS])
    return None


def _write(folder: Path, people: Mapping[str, Hashed]) -> None:
    text = json.dumps({"people": {name: asdict(one) for name, one in sorted(people.items())}}, indent=2)
    write_durably(folder / SECRETS, text + "\n")
