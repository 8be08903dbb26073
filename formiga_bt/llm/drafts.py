"""Where drafts wait for a person: `.formiga/<site>/drafts/<n>/`, a folder each.

| file | what |
|---|---|
| `task.yaml` | the task, to be read, checked and drawn like any other |
| `origin.json` | who asked, in which words, through which model or assistant; who approved (`records.Origin`) |
| `draft.json` | the whole draft (`records.Draft`); written last, so that a folder without it is no draft |

Numbers only grow, and a folder is never written twice by two programs. Nothing here starts anything. What a model wrote is
known for good from another file (`services.kept.drafted`), so that drafts may be removed.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.site_folder import FOLDER, write_durably
from formiga_bt.llm.letters import whole
from formiga_bt.llm.records import Draft, Origin

DRAFTS: Final = "drafts"
TASK: Final = "task.yaml"
ORIGIN: Final = "origin.json"
DRAFT: Final = "draft.json"
PROPOSED: Final = "mcp:"
"""Before the name of an assistant, as the provider of its proposals."""


class KeptDraft(msgspec.Struct, frozen=True):
    """A draft that waits."""

    number: int
    folder: Path
    draft: Draft
    origin: Origin


class Brief(msgspec.Struct, frozen=True):
    """A line of the list of drafts."""

    number: int
    folder: Path
    kind: str
    task: str
    origin: Origin

    @property
    def is_proposal(self) -> bool:
        """Return whether an assistant left it (`formiga mcp`)."""
        return self.origin.provider.startswith(PROPOSED)


class _Head(msgspec.Struct):
    """What the list needs of a draft, which is large."""

    kind: str = ""
    task: str = ""


def drafts_folder(site_file: Path | None, site: str) -> Path:
    """Return the folder of a site's drafts.

    Args:
        site_file: the site file; None = the demo site, whose drafts lie below the current folder.
        site: the site's name.
    """
    beside = site_file.resolve().parent if site_file is not None else Path.cwd()
    return beside / FOLDER / site / DRAFTS


def keep(folder: Path, draft: Draft, origin: Origin) -> KeptDraft:
    """Write a draft under the next number.

    Raises:
        SiteError: it cannot be written.
        UnusableFile: the folder cannot be made.
    """
    try:
        number, place = _next(folder)
    except OSError as error:
        raise UnusableFile(f"cannot write {folder}: {error.strerror or error}") from error
    write_durably(place / TASK, whole(draft.yaml if draft.yaml.endswith("\n") else draft.yaml + "\n"))
    write_durably(place / ORIGIN, _json(origin))
    write_durably(place / DRAFT, _json(draft))
    return KeptDraft(number, place, draft, origin)


def read_draft(folder: Path, number: int) -> KeptDraft:
    """Return a draft that waits. Its task is what `task.yaml` says now: a person may have mended it.

    Raises:
        UnusableFile: there is no such draft, or it cannot be read.
    """
    place = folder / str(number)
    try:
        draft = msgspec.json.decode((place / DRAFT).read_bytes(), type=Draft)
        origin = msgspec.json.decode((place / ORIGIN).read_bytes(), type=Origin)
        yaml = (place / TASK).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        there = ", ".join(str(one) for one in numbers(folder)) or "none"
        raise UnusableFile(f"there is no draft {number} in {folder}; drafts: {there}") from error
    except (OSError, UnicodeDecodeError, msgspec.DecodeError) as error:
        raise UnusableFile(
            f"draft {number} cannot be read: {error}", help=f"remove {place}, and draft it again"
        ) from error
    return KeptDraft(number, place, msgspec.structs.replace(draft, yaml=yaml), origin)


def numbers(folder: Path) -> list[int]:
    """Return the numbers of the drafts of a folder, oldest first."""
    return sorted(n for n in _numbered(folder) if (folder / str(n) / DRAFT).is_file())


def briefs(folder: Path) -> list[Brief]:
    """Return the drafts of a folder, oldest first; those that cannot be read are left out."""
    found = []
    for number in numbers(folder):
        place = folder / str(number)
        with suppress(OSError, UnicodeDecodeError, msgspec.DecodeError):
            head = msgspec.json.decode((place / DRAFT).read_bytes(), type=_Head)
            origin = msgspec.json.decode((place / ORIGIN).read_bytes(), type=Origin)
            found.append(Brief(number, place, head.kind, head.task, origin))
    return found


def delete(folder: Path, number: int) -> None:
    """Remove a draft. What was started from it goes on: the engine has a copy of its own.

    Raises:
        UnusableFile: there is none of that number, or it cannot be removed.
    """
    place = folder / str(number)
    if number not in numbers(folder):
        there = ", ".join(str(one) for one in numbers(folder)) or "none"
        raise UnusableFile(f"there is no draft {number} in {folder}; drafts: {there}")
    if place.is_symlink():
        raise UnusableFile(f"cannot remove {place}: it is a link")
    try:
        (place / DRAFT).unlink()  # first: what is left after a power cut is no draft
        shutil.rmtree(place)
        if number > max(_numbered(folder), default=0):
            place.mkdir()  # numbers only grow
    except OSError as error:
        raise UnusableFile(f"cannot remove {place}: {error.strerror or error}") from error


def _numbered(folder: Path) -> Iterator[int]:
    with suppress(FileNotFoundError, NotADirectoryError):
        yield from (int(name) for name in os.listdir(folder) if name.isascii() and name.isdigit() and len(name) < 10)


def _next(folder: Path) -> tuple[int, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    number = max(_numbered(folder), default=0)
    while True:
        number += 1
        with suppress(FileExistsError):
            place = folder / str(number)
            place.mkdir()
            return number, place


def _json(value: Any) -> str:
    try:
        encoded = msgspec.json.encode(value)
    except (UnicodeEncodeError, OverflowError):  # half a letter of a command line, or of a chat of somebody's own
        encoded = msgspec.json.encode(whole(msgspec.to_builtins(value)))
    return msgspec.json.format(encoded, indent=2).decode() + "\n"
