"""Durations with their spread as tables: numbers, and a box plot in text per row; or as CSV.

The boxes of a table share one scale from zero, so that they can be compared. `dryrun` and `stats` print them.
"""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from formiga_bt.base.clock import SECOND
from formiga_bt.show.facts import Spread, Stats
from formiga_bt.show.tree.terminal import DrawnLine, LinePiece, columns_of, cut_to, safe

TABLES: Final = (
    ("tasks", "tasks", "from the first step to the end"),
    ("waits", "waits", "from the request to the first step"),
    ("actions", "actions", "by the type of agent"),
    ("gaps", "gaps", "from the end of an agent's action to its next"),
    ("answers", "answers", "of people, from the question"),
)
"""Field of `Stats`, title, what is measured."""
CSV_HEAD: Final = ("table", "name", "group", "n", "failed", "least_s", "q1_s", "median_s", "q3_s", "most_s")
UNICODE_USED: Final = "├─▒┃┤…"
_BOX_LEAST: Final = 12
"""A box plot in fewer columns says nothing."""


@dataclass(frozen=True, slots=True)
class _Glyphs:
    left: str
    line: str
    box: str
    median: str
    right: str
    cut: str


_BOX: Final = _Glyphs("├", "─", "▒", "┃", "┤", "…")
_ASCII: Final = _Glyphs("|", "-", "=", "#", "|", "...")

_COLUMNS: Final = ("n", "failed", "least", "q1", "median", "q3", "most")
_FEWER: Final = (
    _COLUMNS,
    ("n", "failed", "least", "median", "most"),
    ("n", "failed", "median", "most"),
    ("n", "median"),
)
"""What is left out where the terminal is narrow."""


def draw(stats: Stats, *, width: int = 100, ascii_only: bool = False) -> list[DrawnLine]:
    """Return the tables as lines; tables without rows are left out.

    Args:
        stats: what was measured.
        width: columns that no line exceeds.
        ascii_only: plain ASCII.
    """
    glyphs = _ASCII if ascii_only else _BOX
    lines = [DrawnLine((LinePiece(cut_to(_over(stats), width, glyphs.cut), "dim"),))]
    for field, title, meaning in TABLES:
        spreads: Sequence[Spread] = getattr(stats, field)
        if spreads:
            lines.append(DrawnLine((LinePiece(""),)))
            lines += _table(title, meaning, spreads, width, glyphs, ascii_only)
    if len(lines) == 1:
        lines.append(DrawnLine((LinePiece("nothing has ended yet"),)))
    return lines


def as_csv(stats: Stats) -> str:
    """Return the tables as CSV with a head; seconds. What never ended well has no durations."""
    stream = io.StringIO()
    rows = csv.writer(stream, lineterminator="\n")
    rows.writerow(CSV_HEAD)
    for field, title, _ in TABLES:
        for one in getattr(stats, field):
            spans = (one.least_s, one.q1_s, one.median_s, one.q3_s, one.most_s) if one.n else ("",) * 5
            rows.writerow((title, one.name, one.group, one.n, one.failed, *spans))
    return stream.getvalue()


def is_empty(stats: Stats) -> bool:
    """Return whether nothing was measured."""
    return not any(getattr(stats, field) for field, _, _ in TABLES)


def span(seconds: float) -> str:
    """Return a duration in three digits or so: `0.5 s`, `42 s`, `4.2 min`, `1.5 h`."""
    for most, unit, by in ((100.0, "s", 1.0), (6000.0, "min", 60.0), (float("inf"), "h", 3600.0)):
        if seconds < most:
            value = seconds / by
            return f"{value:.0f} {unit}" if value >= 10 or value == int(value) else f"{value:.1f} {unit}"
    return ""


def _over(stats: Stats) -> str:
    return f"what ended in the last {span(max(0, stats.at - stats.since) / SECOND)}"


def _table(
    title: str, meaning: str, spreads: Sequence[Spread], width: int, glyphs: _Glyphs, ascii_only: bool
) -> Iterator[DrawnLine]:
    names = [safe(f"{one.group} {one.name}".strip(), ascii_only) for one in spreads]
    most = max((one.most_s for one in spreads if one.n), default=0.0)
    kept, name_width, box_width = _room(names, spreads, width)
    cells = [_cells(one, kept) for one in spreads]
    widths = [max(len(head), *(len(row[i]) for row in cells)) for i, head in enumerate(kept)]
    yield DrawnLine(
        (LinePiece(title, "title"), LinePiece(cut_to(f"  {meaning}", max(0, width - len(title)), glyphs.cut), "dim"))
    )
    head = " " * name_width + "".join(f"  {word:>{w}}" for word, w in zip(kept, widths, strict=True))
    yield DrawnLine((LinePiece(head + _scale(most, box_width), "dim"),))
    for one, name, row in zip(spreads, names, cells, strict=True):
        shown = cut_to(name, name_width, glyphs.cut)
        pieces = [LinePiece(shown + " " * (name_width - columns_of(shown)), "agent")]
        for word, text, w in zip(kept, row, widths, strict=True):
            pieces.append(LinePiece(f"  {text:>{w}}", "failure" if word == "failed" and one.failed else "plain"))
        if box_width:
            pieces.append(LinePiece(f"  {_box(one, most, box_width, glyphs)}", "kind"))
        yield DrawnLine(tuple(pieces))


def _room(names: Sequence[str], spreads: Sequence[Spread], width: int) -> tuple[Sequence[str], int, int]:
    """Return which columns are shown, and how wide names and boxes are: all numbers first, then boxes, then names."""
    wanted = max(columns_of(name) for name in names)
    for kept in _FEWER:
        numbers = sum(
            2 + max(len(head), *(len(_cells(one, kept)[i]) for one in spreads)) for i, head in enumerate(kept)
        )
        left = width - numbers - min(wanted, width // 3)
        if left >= 2 + _BOX_LEAST:
            return kept, min(wanted, width // 3), min(60, left - 2)
    return _FEWER[-1], min(wanted, max(4, width - numbers)), 0


def _cells(one: Spread, kept: Sequence[str]) -> list[str]:
    spans = {"least": one.least_s, "q1": one.q1_s, "median": one.median_s, "q3": one.q3_s, "most": one.most_s}
    counts = {"n": str(one.n), "failed": str(one.failed or "")}
    return [counts[word] if word in counts else span(spans[word]) if one.n else "" for word in kept]


def _scale(most: float, width: int) -> str:
    if not width:
        return ""
    end = span(most)
    return f"  0{' ' * max(1, width - 1 - len(end))}{end}"


def _box(one: Spread, most: float, width: int, glyphs: _Glyphs) -> str:
    """Return a box plot: whiskers from the least to the most, a box from the first to the third quartile, the median."""
    if not one.n:
        return ""
    least, q1, median, q3, end = (
        min(width - 1, int(value / most * (width - 1) + 0.5)) if most else 0
        for value in (one.least_s, one.q1_s, one.median_s, one.q3_s, one.most_s)
    )
    cells = [" "] * width
    cells[least : end + 1] = glyphs.line * (end + 1 - least)
    if one.n > 1:
        cells[q1 : q3 + 1] = glyphs.box * (q3 + 1 - q1)
    cells[least], cells[end] = glyphs.left, glyphs.right
    cells[median] = glyphs.median
    return "".join(cells).rstrip()
