"""Find the colon that is missing where YAML cannot be read (E001), or reads one key for another.

A slip of a first file: `- do drone.TakeOff`, `finally` alone on its line, `with {to: camp}`. The parser stumbles over what
follows and says nothing of it. A place is named only if the text can be read further with a colon there: `traps` has words for
all else. Called by `document`.
"""

import re
from collections.abc import Callable, Iterator
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Fix, Mark
from formiga_bt.lang.kinds import (
    CLEARS,
    COUNT,
    ENVELOPE,
    KINDS,
    LIBRARY,
    MODIFIERS,
    PARAM,
    RETRY,
    ROLE,
    SUBTREE,
    TASK,
    TRACK,
)

Reads = Callable[[str], int]
"""Text -> the line, from 1, at which reading it as YAML ends; after the last line if all of it can be read."""

WORDS: Final = frozenset(KINDS) | {
    option.name
    for options in (
        TASK, LIBRARY, SUBTREE, PARAM, ROLE, COUNT, ENVELOPE, MODIFIERS, RETRY, CLEARS, TRACK,
        *(k.options for k in KINDS.values())
    )
    for option in options
}  # fmt: skip
"""All that may stand before a colon in a task."""
_LINE: Final = re.compile(r"^(\s*(?:- +)*)([A-Za-z_]\w*)(:(?=[^\s:/])| +(?=[^\s#:])|(?= *(?:#|$)))([^#]*)")
_IN_KEY: Final = re.compile(r"([A-Za-z_]\w*)( +)[\[{]")
_TEXT: Final = re.compile(r"\s*(?:- +)*(?:notify|ask|fail|note|name|description|label|help): +[^\s\"'|>]")
"""A text without quotes, which may go on below."""
_LOOKED_AT: Final = 3
"""So many lines with content, up from where the parser stumbled."""


def missing_colon(lines: list[str], file: str, line: int, said: str, reads: Reads) -> Diagnostic | None:
    """Return E001 where a colon is missing, if the text can be read further with it.

    Args:
        lines: of the text.
        file: its name in marks.
        line: where the parser stumbled, from 1.
        said: its words.
        reads: tells how far a text can be read.
    """
    for number in _upwards(lines, min(line, len(lines))):
        found = _LINE.match(lines[number - 1])
        if found is None or (said != "could not find expected ':'" and not _is_key(found, lines, number)):
            continue
        mended = _with_colon(found, lines[number - 1])
        if reads("\n".join([*lines[: number - 1], mended, *lines[number:]])) > line:
            whole = Mark(file, number, 1, number, len(lines[number - 1]) + 1)
            above = next((lines[n - 1] for n in _upwards(lines, number - 1)), "")
            is_sure = not found[4].strip() or (found[2] in WORDS and _TEXT.match(above) is None)
            return _told(found, mended, whole, is_sure=is_sure)
    return None


def colon_in_key(key: str, line: str, mark: Mark) -> Diagnostic | None:
    """Return E001 for a key that has taken the bracket of its value in: `with {to` of `with {to: camp}`.

    Args:
        key: as written.
        line: in which it stands.
        mark: of the key.
    """
    found = _IN_KEY.match(key)
    if found is None or not line.startswith(key, mark.col - 1):
        return None
    at = mark.col - 1 + found.end(1)
    return _missing(found[1], f"{line[:at]}:{line[at:]}", mark, Mark(mark.file, mark.line, 1, mark.line, len(line) + 1))


def in_text(text: str) -> tuple[str, str]:
    """Return what is missing in a text that was meant as a key with its value, and how to write it; empty: nothing is known."""
    found = _LINE.match(text)
    if found is None or found[2] not in WORDS or not found[4].strip():
        return "", ""
    return _what(found), _with_colon(found, text)


def _upwards(lines: list[str], line: int) -> Iterator[int]:
    """Iterate over the numbers of the nearest lines with content, this one first."""
    full = [number for number in range(line, 0, -1) if lines[number - 1].split("#", 1)[0].strip()]
    yield from full[:_LOOKED_AT]


def _is_key(found: re.Match[str], lines: list[str], number: int) -> bool:
    """Return whether a word begins a line as only a key does: a known one, or one alone with deeper lines below it."""
    if found[2] in WORDS:
        return True
    below = next((text for text in lines[number:] if text.strip()), "")
    return not found[4].strip() and len(below) - len(below.lstrip()) > len(found[1])


def _with_colon(found: re.Match[str], line: str) -> str:
    rest = line[found.end(3) :]
    return f"{line[: found.end(2)]}:{' ' if rest.strip() else ''}{rest}"


def _what(found: re.Match[str]) -> str:
    if found[3] == ":":
        return f"a space is missing after '{found[2]}:'"
    return f"a colon is missing after '{found[2]}'"


def _told(found: re.Match[str], mended: str, whole: Mark, *, is_sure: bool) -> Diagnostic:
    mark = Mark(whole.file, whole.line, found.start(2) + 1, whole.line, found.end(2) + 1)
    if not is_sure:
        other = "; or, if it goes on with the text above, indent it deeper"
        return Diagnostic("E001", mark, f"{_what(found)}{other}", f"write: {mended.strip()}")
    return Diagnostic("E001", mark, _what(found), f"write: {mended.strip()}", fix=Fix(whole, mended))


def _missing(word: str, mended: str, mark: Mark, whole: Mark) -> Diagnostic:
    at = Mark(mark.file, mark.line, mark.col, mark.line, mark.col + len(word))
    return Diagnostic(
        "E001", at, f"a colon is missing after '{word}'", f"write: {mended.strip()}", fix=Fix(whole, mended)
    )
