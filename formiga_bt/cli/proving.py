"""How a command learns a person's secret: at the terminal, or from a file or the environment; never as an argument.

Only verbs of people use this: nothing that serves assistants or writes drafts may (`.importlinter`).
"""

import os
import sys
from getpass import getpass
from pathlib import Path
from typing import Final
from urllib.parse import quote

from formiga_bt.base.durable import open_to_others
from formiga_bt.base.errors import FormigaError, TaskError, UnusableFile
from formiga_bt.base.person_secrets import command, find_secret, prepared, wrong

HEADER: Final = "Formiga-Secret"
OWN: Final = "FORMIGA_SECRET"
NEW: Final = "FORMIGA_NEW_SECRET"
FILE: Final = "_FILE"
"""Behind a name: the variable that names a file with it."""


def own_secret(person: str, asks: str = "Secret of") -> str:
    """Return what FORMIGA_SECRET, or the file that FORMIGA_SECRET_FILE names, or else a person at the terminal says.

    Empty: nobody is there to ask.

    Raises:
        UnusableFile: the file cannot be read, or others can.
    """
    said = _said(OWN)
    if said is None:
        said = getpass(f"{asks} {person}: ") if _is_terminal() else ""
    return said


def new_secret(person: str) -> str:
    """Return a new secret, from FORMIGA_NEW_SECRET or its file, or else asked for twice.

    Raises:
        FormigaError: it is too short, was not repeated, or nobody is there to ask.
        UnusableFile: the file cannot be read, or others can.
    """
    said = _said(NEW)
    if said is not None:
        return prepared(said)
    if not _is_terminal():
        raise FormigaError(
            "nobody is at a terminal to type a secret",
            help=f"scripts put it into a file of mode 0600, and name that in {NEW}{FILE} (the present one: {OWN}{FILE})",
        )
    first = prepared(getpass(f"New secret of {person}: "))
    if getpass("The same once more: ") != first:
        raise FormigaError("that was not the same; nothing was changed")
    return first


def as_header(secret: str) -> dict[str, str]:
    """Return a secret as a header of a request; none, if there is none."""
    return {HEADER: quote(secret, safe="")} if secret else {}


def secret_header(person: str) -> dict[str, str]:
    """Return the secret that `own_secret` gets as a header."""
    return as_header(own_secret(person))


def check_secret(folder: Path, person: str, secret: str) -> None:
    """Compare a secret where no engine does it.

    Raises:
        FormigaError: it is missing or wrong, or the file with the secrets cannot be used.
    """
    try:
        if not find_secret(folder, person, secret).fits(secret):
            raise wrong(person)
    except TaskError as error:
        raise TaskError(error.code, f"{error}", help=f"{command(person)} sets one") from None


def _is_terminal() -> bool:
    return sys.stdin is not None and sys.stdin.isatty()


def _said(name: str) -> str | None:
    """Return what a variable, or the file that another one names, holds; None: neither is there."""
    if name in os.environ:
        return os.environ[name]
    named = os.environ.get(name + FILE, "")
    if not named:
        return None
    try:
        with Path(named).open(encoding="utf-8") as file:
            if open_to_others(os.fstat(file.fileno())):
                raise UnusableFile(f"{named} can be read by others", help=f"chmod 600 {named}")
            return file.read(10_000).rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        raise UnusableFile(f"{named} cannot be read: {getattr(error, 'strerror', '') or 'no text'}") from None
