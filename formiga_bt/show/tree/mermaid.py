"""A drawing as a flowchart of Mermaid, which GitHub and many wikis draw by themselves.

From left to right, because trees have many leaves and few levels. Every character that could mean something to Mermaid, or to
HTML, is written by its number.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import PurePath
from textwrap import wrap
from typing import Final

from formiga_bt.show.facts import Box, Drawing, FileSpot, StepFact
from formiga_bt.show.tree.drawing import is_step, text_of
from formiga_bt.show.tree.looks import CONDITIONS, TINTS
from formiga_bt.show.tree.marks import MARKS, mark_of, note_of
from formiga_bt.show.tree.outline import BADGES

COLUMNS: Final = 36
LINES: Final = 4
PLAIN: Final = frozenset(" ,.:()=/_+'?!")
"""Characters, with letters and digits, that stand for themselves inside quotes."""
DASHES: Final[Mapping[str, str]] = {"dashed": ",stroke-dasharray:6 4", "dotted": ",stroke-dasharray:2 3"}
SHAPES: Final[Mapping[str, tuple[str, str]]] = {
    "fallback": ("{{", "}}"),
    "parallel": ("[/", "/]"),
    "race": ("[/", "/]"),
    "if": ("{{", "}}"),
    "switch": ("{{", "}}"),
    "while": ("(", ")"),
    "repeat": ("(", ")"),
    "for": ("(", ")"),
    "guard": ("(", ")"),
    "with_agents": ("(", ")"),
    "with_resource": ("(", ")"),
    "call": ("[[", "]]"),
    "ask": (">", "]"),
    "notify": (">", "]"),
    "request": ("[(", ")]"),
    "branch": ("(", ")"),
    **dict.fromkeys(CONDITIONS, ("([", "])")),
}
"""How a kind is fenced; others are boxes."""


def mermaid_of(drawing: Drawing, steps: Mapping[str, StepFact] | None = None, title: str = "") -> str:
    """Return the text of a flowchart.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    return "".join(f"{line}\n" for line in _Chart(drawing, steps, title).lines())


class _Chart:
    def __init__(self, drawing: Drawing, steps: Mapping[str, StepFact] | None, title: str) -> None:
        self._drawing = drawing
        self._steps = steps
        self._title = title or f"{drawing.task} {drawing.version}".rstrip()
        self._tints = {box.role: at % len(TINTS) for at, box in enumerate(drawing.roles)}
        self._count = 0

    def lines(self) -> Iterator[str]:
        yield from ("---", f"title: {json.dumps(self._title)}", "---", "flowchart LR")
        root = self._next()
        yield f'  {root}(["{escaped(self._title)}"])'
        roles = "<br>".join(escaped(text_of(box)) for box in self._drawing.roles)
        if roles:
            yield f'  {root} -.- roles["{roles}"]'
        for section in self._drawing.sections:
            name = self._next()
            yield f'  {root} --> {name}["{_label([text_of(section)], section.hidden, None)}"]'
            yield from self._below(section, name)
        for at in sorted(set(self._tints.values())):
            yield f"  classDef r{at} fill:{TINTS[at]},color:#202020"
        if self._steps is not None:
            for mark in MARKS:
                yield f"  classDef {mark.status} stroke:{mark.colour},stroke-width:{mark.width:g}px{DASHES.get(mark.line, '')}"

    def _below(self, box: Box, parent: str) -> Iterator[str]:
        for child in box.children:
            name = self._next()
            yield f"  {parent} --> {name}{self._node(child)}{self._classes(child)}"
            yield from self._below(child, name)

    def _next(self) -> str:
        self._count += 1
        return f"n{self._count}"

    def _node(self, box: Box) -> str:
        fact = None if self._steps is None else self._steps.get(box.path)
        badge = BADGES.get(box.kind)
        said = f"{badge.symbol} {text_of(box)}" if badge else text_of(box)
        if self._steps is not None and is_step(box):
            said = f"{mark_of(box, fact).glyph} {said}"
        more = [f"[{'; '.join(box.modifiers)}]"] if box.modifiers else []
        note = note_of(fact)
        opening, closing = SHAPES.get(box.kind, ("[", "]"))
        return f'{opening}"{_label([said, *more, *([note] if note else [])], box.hidden, box.spot)}"{closing}'

    def _classes(self, box: Box) -> str:
        """Return the classes of a node: its status, else its role; Mermaid takes one behind a node."""
        if self._steps is not None and is_step(box):
            return f":::{mark_of(box, self._steps.get(box.path)).status}"
        tint = self._tints.get(box.task_role or box.role)
        return f":::r{tint}" if tint is not None and is_step(box) else ""


def _label(texts: list[str], hidden: int, spot: FileSpot | None) -> str:
    lines: list[str] = []
    for text in texts:
        lines += wrap(text, COLUMNS, max_lines=LINES, placeholder=" …") or [text]
    lines += [f"({hidden} more)"] if hidden else []
    lines += [f"{PurePath(spot.file).name}:{spot.line}"] if spot else []
    return "<br>".join(escaped(line) for line in lines)


def escaped(text: str) -> str:
    """Return a text for inside the quotes of a label."""
    return "".join(c if c in PLAIN or (c.isascii() and c.isalnum()) else f"#{ord(c)};" for c in text)
