"""Accounts of people and programs, and their tokens, as `accounts.json` of a site's runtime folder keeps them.

    {"accounts": {"ann": {"roles": ["operator"], "agent": "watcher_1", "tasks": [], "disabled": false}},
     "tokens": [{"id": "3f9c0a1b", "account": "ann", "hash": "5e...", "made": 1790000000, "expires": 1797776000}]}

A token is opaque, shown once, and kept as its SHA-256: it has 256 bits by chance, so a slow hash would protect nothing more.
The file is read anew when it has changed, so what a command changes counts at once. What cannot be used lets nobody in.
"""

import hashlib
import hmac
import json
import re
import secrets
import threading
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct, field

from formiga_bt.base.durable import write_durably
from formiga_bt.base.errors import SiteError
from formiga_bt.base.private_files import PrivateFileError, read_private
from formiga_bt.base.roles import Role

ACCOUNTS: Final = "accounts.json"
NAME: Final = re.compile(r"[a-z][a-z0-9_.-]{0,63}")
"""A name of an account. `local` is nobody's: it is who speaks on the engine's own machine."""
LOCAL: Final = "local"
MOST_BYTES: Final = 4_000_000
"""A larger file is none of ours."""
MOST_TOKENS: Final = 20
"""Of one account, those that have expired left out."""
REQUESTS: Final = 600
"""Requests a minute that an account may send, if nobody says otherwise."""
OPEN_TASKS: Final = 100
"""Tasks of an account that may be under way at once, if nobody says otherwise."""
_TOKEN: Final = re.compile(r"fbt_([0-9a-f]{8})_([A-Za-z0-9_-]{43})")


class Account(Struct, frozen=True, forbid_unknown_fields=True):
    """A person or program that the engine knows."""

    roles: tuple[Role, ...]
    agent: str = ""
    """The agent that this person is: who is asked, and tells of events. "" = none."""
    tasks: tuple[str, ...] = ()
    """Tasks that it may request; empty = every task."""
    disabled: bool = False
    requests: int = REQUESTS
    """So many a minute, at most; stops and what people tell of themselves are not counted."""
    open_tasks: int = OPEN_TASKS
    """So many tasks that it requested may be under way at once."""


class Token(Struct, frozen=True, forbid_unknown_fields=True):
    """A token of an account; instants in seconds since 1970."""

    id: str
    account: str
    hash: str
    """SHA-256 of the whole token, hexadecimal."""
    made: int
    expires: int


class Register(Struct, frozen=True, forbid_unknown_fields=True):
    """All accounts and tokens of a site."""

    accounts: dict[str, Account] = field(default_factory=dict)
    tokens: tuple[Token, ...] = ()


def new_token(account: str, now_s: int, expires_s: int) -> tuple[str, Token]:
    """Return a new token as it is shown once, and as it is kept."""
    number = secrets.token_hex(4)
    text = f"fbt_{number}_{secrets.token_urlsafe(32)}"
    return text, Token(number, account, _hash(text), now_s, expires_s)


def is_token(text: str) -> bool:
    """Return whether a text may be a token of an account; the site's token is none."""
    return _TOKEN.fullmatch(text) is not None


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def find_account(register: Register, text: str, now_s: float) -> tuple[str, Account] | None:
    """Return whose token a text is; None: nobody's, or of an account that is disabled, or it has expired."""
    found = _TOKEN.fullmatch(text)
    for token in register.tokens if found is not None else ():
        if found is not None and token.id == found[1] and hmac.compare_digest(token.hash, _hash(text)):
            account = register.accounts.get(token.account)
            return (token.account, account) if account and not account.disabled and now_s < token.expires else None
    return None


def read_register(folder: Path) -> Register:
    """Return the accounts of a site; none, if there is no file.

    Raises:
        SiteError: the file cannot be used.
    """
    file = folder / ACCOUNTS
    try:
        found = read_private(file, MOST_BYTES)
        return msgspec.json.decode(found, type=Register) if found is not None else Register()
    except (PrivateFileError, msgspec.DecodeError) as error:
        raise _unusable(file, str(error)) from error


def _unusable(file: Path, why: str) -> SiteError:
    return SiteError(f"{file} cannot be used: {why}; no account is let in", help="put the file back, or set it aside")


class AccountBook:
    """The accounts of a site as an engine reads them: anew when the file has changed. Called in many threads."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._seen: tuple[int, ...] | None = None
        self._known = Register()

    def find(self, text: str, now_s: float) -> tuple[str, Account] | None:
        """Return whose token a text is; see `find_account`.

        Raises:
            SiteError: the file cannot be used.
        """
        return find_account(self._read(), text, now_s)

    def named(self, name: str) -> Account | None:
        """Return an account by its name; None: there is none, or it is disabled.

        Raises:
            SiteError: the file cannot be used.
        """
        account = self._read().accounts.get(name)
        return account if account is not None and not account.disabled else None

    def _read(self) -> Register:
        try:
            told = (self._folder / ACCOUNTS).stat()
            seen: tuple[int, ...] | None = (told.st_mtime_ns, told.st_size, told.st_ino)
        except OSError:
            seen = None
        with self._lock:
            if seen is None or seen != self._seen:
                self._known, self._seen = read_register(self._folder), seen
            return self._known


def write_register(folder: Path, register: Register) -> None:
    """Write the accounts; they count at once. Called within `private_files.changing`.

    Raises:
        SiteError: the file cannot be written.
    """
    plain = msgspec.to_builtins(register)
    write_durably(folder / ACCOUNTS, json.dumps(plain, indent=2, sort_keys=True) + "\n")
