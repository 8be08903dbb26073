"""Where each step of a drawing stands in a picture: an indented outline, a step a row, that is never wider than a page.

Trees laid out level by level grow as wide as they have leaves; an outline grows downwards only, so that three hundred steps
are as readable as ten. Points (1/72 inch) from the top left.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Final, Literal

from formiga_bt.show.facts import Box, Drawing, FileSpot, StepFact
from formiga_bt.show.tree.drawing import is_step, walk
from formiga_bt.show.tree.marks import StatusMark, mark_of, note_of
from formiga_bt.show.tree.textsize import Lines, TextRun, flow, run_width, text_width

WIDTH: Final = 500.0
SIZE: Final = 9.5
"""Of the font."""
SMALL: Final = 8.0
LINE: Final = 12.0
PAD: Final = 4.0
GAP: Final = 6.0
INDENT: Final = 24.0
BADGE: Final = 20.0
LEAST: Final = 150.0
"""Narrowest room for a step's text: beyond that the picture grows wider."""


Shape = Literal["box", "octagon", "parallelogram", "diamond", "circle", "note", "box3d"]
"""Of what is painted, as graphviz calls them."""


@dataclass(frozen=True, slots=True)
class Badge:
    """The small shape before a step that has others inside."""

    symbol: str
    shape: Shape
    words: str


BADGES: Final[Mapping[str, Badge]] = {
    "sequence": Badge("→", "box", "one after another"),
    "fallback": Badge("?", "octagon", "the first that succeeds"),
    "parallel": Badge("⇉", "parallelogram", "at the same time"),
    "race": Badge("⇶", "parallelogram", "the first that ends"),
    "if": Badge("◇", "diamond", "choice"),
    "switch": Badge("◇", "diamond", "choice"),
    "while": Badge("↻", "circle", "again and again"),
    "repeat": Badge("↻", "circle", "again and again"),
    "for": Badge("↻", "circle", "for each of a list"),
    "guard": Badge("⚑", "circle", "as long as a condition holds"),
    "with_agents": Badge("+", "circle", "with more agents"),
    "with_resource": Badge("#", "circle", "with resources of the site"),
}
"""Kinds with steps inside, as the field draws them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutlineRow:
    """A step, a branch, a section or a row of the head, with its place."""

    box: Box | None
    lines: Lines
    x: float
    y: float
    """Of the top."""
    width: float
    height: float
    badge: Badge | None = None
    parent: int | None = None
    """Number of the row that it hangs on."""
    place: str = ""
    mark: StatusMark | None = None
    last: int = 0
    """Number of the last row below it."""

    @property
    def stem_x(self) -> float:
        """Return where the line to the rows below leaves."""
        return self.x + BADGE / 2

    @property
    def middle(self) -> float:
        """Return the height at which the line from above arrives."""
        return self.y + self.height / 2


@dataclass(frozen=True, slots=True)
class TreeOutline:
    """A drawing with places."""

    rows: tuple[OutlineRow, ...]
    width: float
    height: float


def outline_of(drawing: Drawing, steps: Mapping[str, StepFact] | None = None, title: str = "") -> TreeOutline:
    """Return a drawing with a place for each step.

    Args:
        drawing: the task.
        steps: how its steps stand; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    return _Pen(drawing, steps).all(title)


class _Pen:
    """Goes down the page."""

    def __init__(self, drawing: Drawing, steps: Mapping[str, StepFact] | None) -> None:
        self._drawing = drawing
        self._steps = steps
        deepest = _depth(drawing.sections)
        self._indent = INDENT if deepest <= 8 else max(14.0, 8 * INDENT / deepest)
        places = [self._place(box.spot) for box in _boxes(drawing)]
        self._places = max((text_width(place, SMALL) for place in places), default=0.0) + 6
        self._right = max(WIDTH - self._places, deepest * self._indent + LEAST)
        self._y = 0.0
        self._rows: list[OutlineRow] = []

    def all(self, title: str) -> TreeOutline:
        drawing = self._drawing
        self._text([TextRun(title or f"{drawing.task} {drawing.version}".rstrip(), "title")], drawing.spot, 1.5)
        self._text([TextRun(drawing.description)])
        self._text([TextRun(", ".join(drawing.facts), "italic")])
        for word, boxes in (("params", drawing.params), ("vars", drawing.vars), ("agents", drawing.roles)):
            if boxes and not title:
                self._heading(word)
                for box in boxes:
                    self._head_row(box)
        for section in drawing.sections:
            at = len(self._rows)
            self._heading("".join(span.text for span in section.label))
            self._y += GAP / 2
            for box in section.children:
                self._step(box, 0, at)
            if section.hidden:
                self._text([TextRun(f"({section.hidden} more)", "italic")])
        return TreeOutline(tuple(self._rows), self._right + self._places, self._y)

    def _text(self, runs: list[TextRun], spot: FileSpot | None = None, scale: float = 1.0) -> None:
        if not "".join(run.text for run in runs):
            return
        lines = flow(runs, self._right / scale - 2 * PAD, SIZE)
        height = LINE * scale * len(lines)
        place = f"{PurePath(spot.file).name}:{spot.line}" if spot else ""
        self._put(OutlineRow(box=None, lines=lines, x=0, y=self._y, width=self._right, height=height, place=place))

    def _heading(self, word: str) -> None:
        self._y += GAP
        runs = [[TextRun(word, "heading")]]
        self._put(OutlineRow(box=None, lines=runs, x=0, y=self._y, width=self._right, height=LINE + 2))

    def _head_row(self, box: Box) -> None:
        runs = [TextRun(span.text, "bold" if span.style == "agent" else "plain") for span in box.label]
        lines = flow(runs, self._right - 12 - 2 * PAD, SIZE)
        width = self._right - 12
        if box.kind == "role":
            width = _widest(lines) + 2 * PAD
        height = LINE * len(lines) + 3
        self._put(
            OutlineRow(box=box, lines=lines, x=12, y=self._y, width=width, height=height, place=self._place(box.spot))
        )

    def _step(self, box: Box, depth: int, parent: int) -> None:
        at = len(self._rows)
        x = 4 + depth * self._indent
        badge = BADGES.get(box.kind)
        mark = mark_of(box, self._steps.get(box.path)) if self._steps is not None and is_step(box) else None
        start = x + (BADGE + 2 if badge else 0)
        corner = 8.0 if box.kind in ("ask", "notify") else 0.0  # folded down
        lines = flow(self._runs(box, mark), self._right - start - corner - 2 * PAD, SIZE)
        height = max(LINE * len(lines) + 2 * PAD - 1, BADGE if badge else 0)
        width = min(_widest(lines) + corner + 2 * PAD + 1, self._right - start)
        self._put(
            OutlineRow(
                box=box,
                lines=lines,
                x=x,
                y=self._y,
                width=width,
                height=height,
                badge=badge,
                parent=parent,
                place=self._place(box.spot),
                mark=mark,
            )
        )
        for child in box.children:
            self._step(child, depth + 1, at)
        if box.kind == "call" and box.children:
            self._y += GAP / 2
        self._rows[at] = replace(self._rows[at], last=len(self._rows) - 1)

    def _runs(self, box: Box, mark: StatusMark | None) -> list[TextRun]:
        runs = [TextRun(f"{mark.glyph} ", "mark")] if mark else []
        for span in box.label:
            bold = span.style in ("title", "agent", "kind")
            runs.append(TextRun(span.text, "bold" if bold else "plain"))
        if box.modifiers:
            runs.append(TextRun(f" [{'; '.join(box.modifiers)}]", "italic"))
        if box.hidden:
            runs.append(TextRun(f" ({box.hidden} more)", "italic"))
        note = note_of(self._steps.get(box.path)) if self._steps is not None else ""
        return [*runs, TextRun(f" {note}", "note")] if note else runs

    def _put(self, row: OutlineRow) -> None:
        self._rows.append(row)
        self._y += row.height + (GAP if row.parent is not None else 3 if row.box and row.box.kind == "role" else 0)

    def _place(self, spot: FileSpot | None) -> str:
        if spot is None:
            return ""
        if spot.file == self._drawing.spot.file:
            return f":{spot.line}"
        name = PurePath(spot.file).name
        return f"{name if len(name) <= 18 else '…' + name[-17:]}:{spot.line}"


def _widest(lines: Lines) -> float:
    return max((sum(run_width(run, SIZE) for run in line) for line in lines), default=0.0)


def _depth(boxes: tuple[Box, ...]) -> int:
    return max((1 + _depth(box.children) if box.children else 1 for box in boxes), default=0)


def _boxes(drawing: Drawing) -> Iterator[Box]:
    return walk((*drawing.params, *drawing.vars, *drawing.roles, *drawing.sections))
