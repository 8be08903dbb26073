"""Applies the fixes that diagnostics carry: what `formiga fix` does to one file.

A fix replaces a span that was flagged, nothing else. After each round the file is checked anew, because one mend often brings
the next problem to light, until no fix is left.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Fix
from formiga_bt.lang.text.document import parse
from formiga_bt.lang.text.traps import lines_of

MOST_ROUNDS: Final = 50

Check = Callable[[str], Iterable[Diagnostic]]
"""Text of the file -> its problems; those of other files are passed over."""


@dataclass(frozen=True, slots=True)
class FixedFile:
    """What became of a file."""

    text: str
    applied: tuple[Diagnostic, ...]
    """What was mended, in order."""
    left: tuple[Diagnostic, ...]
    """The problems that the new text has."""


def mend(text: str, file: str, check: Check) -> FixedFile:
    """Apply fixes until there is none.

    Args:
        text: of the file.
        file: its name in the marks of the diagnostics.
        check: reads a text and returns its problems.
    """
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    original = text = text.removeprefix("\ufeff")
    first = left = _of(check(mark + text), file)
    applied: list[Diagnostic] = []
    seen = {text}
    for _ in range(MOST_ROUNDS):
        now, done = _round(text, left)
        if not done or now in seen:
            break
        text = now
        seen.add(text)
        applied += done
        left = _of(check(mark + text), file)
    if parse(original, file)[0] is not None and parse(text, file)[0] is None:  # a mend that nobody foresaw: let it be
        return FixedFile(mark + original, (), tuple(first))
    return FixedFile(mark + text, tuple(applied), tuple(left))


def _of(found: Iterable[Diagnostic], file: str) -> list[Diagnostic]:
    return [d for d in found if d.mark.file == file]


def _round(text: str, problems: Iterable[Diagnostic]) -> tuple[str, list[Diagnostic]]:
    """Apply the fixes of one check that do not touch one another; return the new text and what was mended."""
    starts = [0]
    for line in lines_of(text)[:-1]:
        starts.append(_after_break(text, starts[-1] + len(line)))
    mended: list[tuple[int, int, str]] = []
    done: list[Diagnostic] = []
    for problem in problems:
        span = _span(problem.fix, starts, len(text)) if problem.fix is not None else None
        if span is None or problem.fix is None or text[slice(*span)] == problem.fix.text:
            continue
        if all(span[1] < start or end < span[0] for start, end, _ in mended):
            mended.append((*span, problem.fix.text))
            done.append(problem)
        elif (*span, problem.fix.text) in mended:
            done.append(problem)
    for start, end, new in sorted(mended, reverse=True):
        text = text[:start] + new + text[end:]
    return text, done


def _after_break(text: str, at: int) -> int:
    return at + (2 if text[at : at + 2] == "\r\n" else 1)


def _span(fix: Fix, starts: list[int], length: int) -> tuple[int, int] | None:
    """Return the offsets of a fix, or None if they lie outside the text."""
    mark = fix.mark
    if not (1 <= mark.line <= len(starts) and 1 <= (mark.end_line or mark.line) <= len(starts)):
        return None
    start = starts[mark.line - 1] + mark.col - 1
    end = starts[mark.end_line - 1] + mark.end_col - 1 if mark.end_line else start
    return (start, end) if 0 <= start <= end <= length else None
