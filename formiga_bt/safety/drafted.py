"""What is known of a task that a language model wrote: who asked for it; and the line that says so in its file.

Pure functions. `services.kept.drafted` keeps what was drafted in the site's folder; the engine is told of it with each version
that it serves (`inputs.Serve`), and asks for the word of another person (`engine.tasks.authority`).

A file that a model wrote begins with a line such as

    # drafted {"by": ["eve"], "model": "local qwen"}

which is a comment to YAML. It goes where the file goes: to another name, another folder, another site.
"""

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from msgspec import Struct

UNNAMED: Final = frozenset({"", "http", "cli"})
"""Requesters of whom nobody can say who they are."""
LONGEST: Final = 80
"""Characters of a name."""
MOST: Final = 10
"""People who asked for one task."""
_LINE: Final = re.compile(r"^[ \t]*#[ \t]*drafted\b[ \t]*(\{.*)$", re.MULTILINE | re.IGNORECASE)
_HEAD: Final = re.compile(r"^[ \t]*#[ \t]*Drafted(?: by (.{1,200}?))? from the request:", re.MULTILINE | re.IGNORECASE)
_SAYS_SO: Final = re.compile(r"[\s#]*drafted\b", re.IGNORECASE)


class Drafted(Struct, frozen=True, kw_only=True):
    """A program wrote a task."""

    by: tuple[str, ...] = ()
    """Who asked for it; empty = nobody knows."""
    model: str = ""
    """Which program: a provider and a model, or an assistant."""
    also: tuple[str, ...] = ()
    """Other names of those who asked, such as who was logged in; they are not told."""

    @property
    def people(self) -> tuple[str, ...]:
        """Return all names under which those who asked are known."""
        return (*self.by, *self.also)

    @property
    def told(self) -> str:
        """Return what happened, as the end of a sentence that begins with the task."""
        model = f"a model ({self.model})" if self.model else "a model"
        return f"was written by {model}" + (f" on the request of {' and '.join(self.by)}" if self.by else "")


def drafted(by: Iterable[str], model: str = "", also: Iterable[str] = ()) -> Drafted:
    """Return a record with names on one line each, cut, and each once; of too many the first ones stay."""
    people = tuple(dict.fromkeys(one for one in map(_plain, by) if one))[:MOST]
    others = dict.fromkeys(one for one in map(_plain, also) if one and one not in people and one not in UNNAMED)
    return Drafted(by=people, model=_plain(model), also=tuple(others)[:MOST])


def read(data: Any) -> Drafted:
    """Return a record from JSON that anybody may have written; what is not understood is left out."""
    said: Mapping[str, Any] = data if isinstance(data, dict) else {}
    lists = [said.get(key) for key in ("by", "also")]
    by, also = ([one for one in names if isinstance(one, str)] if isinstance(names, list) else [] for names in lists)
    model = said.get("model")
    return drafted(by, model if isinstance(model, str) else "", also)


def written(record: Drafted) -> dict[str, Any]:
    """Return a record as JSON."""
    known = {"by": list(record.by), "model": record.model, "also": list(record.also)}
    return known if record.also else {key: one for key, one in known.items() if key != "also"}


def merged(found: Iterable[Drafted | None]) -> Drafted | None:
    """Return all who asked in one record; None if there is nothing."""
    known = [one for one in found if one is not None]
    if not known:
        return None
    models = dict.fromkeys(one.model for one in known if one.model)
    by, also = (name for one in known for name in one.by), (name for one in known for name in one.also)
    return drafted(by, ", ".join(models), also)


def stamped(text: str, record: Drafted) -> str:
    """Return a task's text with the line that says who had it written; whoever it named before is named on, behind them."""
    both = merged((record, said_in(text)))
    assert both is not None
    line = "# drafted " + json.dumps(written(both), ensure_ascii=True)
    return f"{line}\n{unstamped(text)}"


def unstamped(text: str) -> str:
    """Return a task's text without the lines that say who had it written."""
    return "".join(one for one in text.splitlines(keepends=True) if not _LINE.match(one))


def unlike_a_stamp(line: str) -> str:
    """Return words that stand in a comment of their own so that they are never read as what a file says of its origin."""
    return f"> {line.lstrip()}" if _SAYS_SO.match(line) else line


def said_in(text: str) -> Drafted | None:
    """Return what a text says of its origin; None: nothing. A line that was tampered with still says that a model wrote it."""
    found = [_read(match[1]) for match in _LINE.finditer(text)]
    found += [drafted((), match[1] or "") for match in _HEAD.finditer(text)] if not found else []
    return merged(found)


def _read(said: str) -> Drafted:
    try:
        return read(json.loads(said))
    except (ValueError, RecursionError):
        return Drafted()


def _plain(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:LONGEST]
