"""A drawing as lines of text for a terminal.

Each line is a list of styled pieces with the place in the file at its right edge; no line is wider than asked for. What is
too long is cut, arguments first: who does what, how it stands and what it does now stay.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from textwrap import wrap
from typing import Final

from formiga_bt.show.facts import Box, Drawing, FileSpot, StepFact
from formiga_bt.show.tree.drawing import is_step
from formiga_bt.show.tree.marks import MARKS, mark_of, note_of

SGR: Final[Mapping[str, str]] = {
    "plain": "",
    "title": "1",
    "kind": "36",
    "agent": "32",
    "dim": "2",
    "warn": "33",
    "note": "1",
    **{mark.status: mark.sgr for mark in MARKS},
}
"""Terminal colours of each style (ISO 6429 select graphic rendition)."""


@dataclass(frozen=True, slots=True)
class LinePiece:
    """A piece of a line in one style: one of spans, of a status, or `note`."""

    text: str
    style: str = "plain"


@dataclass(frozen=True, slots=True)
class DrawnLine:
    """One line of the drawing."""

    pieces: tuple[LinePiece, ...]
    path: str = ""
    """Of the step or section that it shows."""

    def plain(self) -> str:
        """Return the text without colours."""
        return "".join(piece.text for piece in self.pieces).rstrip()

    def styled(self) -> str:
        """Return the text with terminal colours."""
        return "".join(f"\x1b[{SGR[p.style]}m{p.text}\x1b[0m" if SGR[p.style] else p.text for p in self.pieces).rstrip()


@dataclass(frozen=True, slots=True)
class _Glyphs:
    tee: str
    corner: str
    bar: str
    cut: str


BOX: Final = _Glyphs("├─ ", "└─ ", "│  ", "…")
ASCII: Final = _Glyphs("|- ", "`- ", "|  ", "...")
UNICODE_USED: Final = "├─└│…°" + "".join(mark.glyph for mark in MARKS)
"""A terminal that cannot show these gets ASCII."""

NARROW: Final = 72
"""Below so many columns, places in the task's own file are a line number only."""


def draw(
    drawing: Drawing,
    steps: Mapping[str, StepFact] | None = None,
    *,
    width: int = 100,
    ascii_only: bool = False,
    head: bool = True,
) -> list[DrawnLine]:
    """Return the lines of a task.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run, no statuses are shown.
        width: columns that no line exceeds.
        ascii_only: draw with `|-` and `...`, and escape what is not ASCII.
        head: whether name, description, params, vars and roles come before the steps.
    """
    layout = _Layout(drawing, steps, width, ascii_only)
    lines: list[DrawnLine] = []
    if head:
        name = f"{drawing.task} {drawing.version}".rstrip()
        facts = LinePiece(", ".join(drawing.facts), "dim")
        lines.append(layout.line("", [LinePiece(name, "title")], facts=[facts], spot=drawing.spot))
        lines += [DrawnLine((LinePiece(text),)) for text in wrap(layout.safe(drawing.description), width)]
        for title, boxes in (("params", drawing.params), ("vars", drawing.vars), ("agents", drawing.roles)):
            if boxes:
                lines.append(layout.line("", [LinePiece(title, "title")]))
                lines += layout.rows(boxes, "")
    for section in drawing.sections:
        lines.append(layout.box("", section))
        lines += layout.rows(section.children, "")
    return lines


def titled(title: str, *, width: int, ascii_only: bool = False) -> list[DrawnLine]:
    """Return the line above a task that runs."""
    text = safe(title, ascii_only)
    return [DrawnLine((LinePiece(cut_to(text, width, (ASCII if ascii_only else BOX).cut), "title"),))]


def legend(ascii_only: bool = False) -> str:
    """Return what the statuses' marks mean, on one line."""
    return "  ".join(f"{mark.letter if ascii_only else mark.glyph} {mark.words}" for mark in MARKS)


def columns_of(text: str) -> int:
    """Return how many columns a terminal needs for a text."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)


def cut_to(text: str, room: int, mark: str) -> str:
    """Return a text cut to so many columns, with a mark where it was cut; a bracket at its end stays."""
    if columns_of(text) <= room:
        return text
    tail = text[-1] if text[:1] + text[-1:] in ("()", "[]") else ""
    if room < len(mark) + 2 * len(tail):
        return "" if tail else mark[: max(0, room)]
    room -= len(mark) + len(tail)
    kept = text[:room]
    while columns_of(kept) > room:
        kept = kept[:-1]
    return kept + mark + tail


class _Layout:
    """Turns boxes into lines of at most `width` columns."""

    def __init__(self, drawing: Drawing, steps: Mapping[str, StepFact] | None, width: int, ascii_only: bool) -> None:
        glyphs = ASCII if ascii_only else BOX
        deepest = _depth(drawing.sections)
        each = 3 if deepest * 3 <= max(30, width // 3) else 2 if deepest * 2 <= width // 2 else 1
        self._tee, self._corner, self._bar = (text[:each] for text in (glyphs.tee, glyphs.corner, glyphs.bar))
        if each == 2:  # a branch needs air before its text
            self._tee, self._corner = glyphs.tee[0] + " ", glyphs.corner[0] + " "
        self._blank = " " * each
        self._mark = glyphs.cut
        self._steps = steps
        self._width = width
        self._ascii = ascii_only
        self._file = drawing.spot.file

    def rows(self, boxes: Sequence[Box], prefix: str) -> Iterator[DrawnLine]:
        for box in boxes:
            last = box is boxes[-1]
            yield self.box(prefix + (self._corner if last else self._tee), box)
            if box.children:
                yield from self.rows(box.children, prefix + (self._blank if last else self._bar))

    def box(self, prefix: str, box: Box) -> DrawnLine:
        fact = None if self._steps is None else self._steps.get(box.path)
        state: list[LinePiece] = []
        style = ""
        if self._steps is not None and is_step(box):
            mark = mark_of(box, fact)
            state = [LinePiece(f"{mark.letter if self._ascii else mark.glyph} ", mark.status)]
            style = "dim" if mark.status in ("waiting", "skipped") else ""
        head: list[LinePiece] = []
        arguments: list[LinePiece] = []
        for span in box.label:
            (arguments if span.style in ("plain", "dim") else head).append(LinePiece(span.text, style or span.style))
        facts = [LinePiece(f"[{'; '.join(box.modifiers)}]", style or "warn")] if box.modifiers else []
        note = note_of(fact)
        if box.hidden:
            note = f"({box.hidden} more)" + (f" {note}" if note else "")
        return self.line(prefix, [*state, *head], arguments, facts, note, box.spot, box.path)

    def line(
        self,
        prefix: str,
        head: Iterable[LinePiece],
        arguments: Sequence[LinePiece] = (),
        facts: Sequence[LinePiece] = (),
        note: str = "",
        spot: FileSpot | None = None,
        path: str = "",
    ) -> DrawnLine:
        heads = [LinePiece(self.safe(piece.text), piece.style) for piece in head]
        needed = sum(columns_of(piece.text) for piece in heads)
        place = self._place(spot, needed + min(len(prefix), self._width // 2))
        room = self._width - (len(place) + 2 if place else 0)
        prefix = self._shortened(prefix, room - needed)
        room -= len(prefix)
        shown = [LinePiece(prefix, "dim")] if prefix else []
        for piece in heads:
            shown.append(LinePiece(cut_to(piece.text, room, self._mark), piece.style))
            room -= columns_of(shown[-1].text)
        tails = self._fitted(arguments, facts, note, room)
        room -= sum(columns_of(piece.text) for piece in tails)
        shown += tails
        if place:
            shown.append(LinePiece(" " * (room + 2) + place, "dim"))
        return DrawnLine(tuple(shown), path)

    def _fitted(
        self, arguments: Sequence[LinePiece], facts: Sequence[LinePiece], note: str, room: int
    ) -> list[LinePiece]:
        """Return what stands behind a step's name, cut to the room: its note last of all.

        Arguments make room for modifiers until two fifths of it are left to them.
        """
        args = self.safe("".join(piece.text for piece in arguments))
        extra = self.safe(" ".join(piece.text.strip() for piece in facts))
        told = cut_to(self.safe(note), max(0, room - 2), self._mark)
        room -= columns_of(told) + 2 if told else 0
        args = cut_to(args, max(room * 2 // 5, room - columns_of(extra) - 2 if extra else room), self._mark)
        extra = cut_to(extra, max(0, room - columns_of(args) - 2), self._mark)
        pieces = [LinePiece(args, arguments[0].style)] if args else []
        pieces += [LinePiece(f"  {extra}", facts[0].style)] if extra else []
        return [*pieces, LinePiece(f"  {told}", "note")] if told else pieces

    def _shortened(self, prefix: str, room: int) -> str:
        """Return the lines that lead to a step, without those furthest left where there is no room for all."""
        room = max(room, len(self._tee) + len(self._mark))
        if len(prefix) <= room:
            return prefix
        return self._mark + prefix[len(prefix) - room + len(self._mark) :]

    def _place(self, spot: FileSpot | None, needed: int) -> str:
        """Return `file:line`, or less of it where the width does not allow it beside what the line needs."""
        if spot is None:
            return ""
        short = f":{spot.line}"
        name = self.safe(PurePath(spot.file).name) + short
        if (self._width < NARROW and spot.file == self._file) or columns_of(name) >= self._width // 2:
            name = short
        return next((one for one in (name, short) if columns_of(one) + 2 + needed <= self._width), "")

    def safe(self, text: str) -> str:
        return safe(text, self._ascii)


def safe(text: str, ascii_only: bool = False) -> str:
    """Return a text without control characters, which could command the terminal."""
    if ascii_only and not text.isascii():
        text = text.encode("ascii", "backslashreplace").decode()
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)


def _depth(boxes: Iterable[Box]) -> int:
    return max((1 + _depth(box.children) if box.children else 0 for box in boxes), default=0)
