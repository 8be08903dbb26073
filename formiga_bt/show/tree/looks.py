"""What the boxes of a picture look like: shape, fill and outline, whoever paints them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from formiga_bt.show.facts import Box, Drawing
from formiga_bt.show.tree.marks import StatusMark
from formiga_bt.show.tree.outline import OutlineRow, Shape

TINTS: Final = ("#d5e8f7", "#fde3c8", "#d6efe1", "#f5dbe8", "#fbf3c0", "#e4dff2", "#dcefef", "#ece4d8")
"""Of the roles, in the order of the file."""
INK: Final = "#202020"
GREY: Final = "#6a6a6a"
LINE_COLOUR: Final = "#9a9a9a"
CONDITIONS: Final = frozenset({"check", "wait_until", "break_if"})
"""Kinds that have round corners."""
SHAPES: Final[Mapping[str, Shape]] = {"ask": "note", "notify": "note", "request": "box3d"}
"""Kinds without steps inside that are no plain box."""
THIN: Final = 0.8
SUBTREE_WIDTH: Final = 1.8
"""Of the outline of a call, points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxLook:
    """How a box is painted."""

    shape: Shape = "box"
    fill: str = "white"
    rounded: bool = False
    line: str = "solid"
    """Of the outline: solid, bold, dashed, dotted."""
    colour: str = GREY
    """Of the outline."""
    width: float = THIN
    """Of the outline, points."""
    ink: str = INK
    """Of a sign inside."""


def tints_of(drawing: Drawing) -> dict[str, str]:
    """Return the colour of each role."""
    return {box.role: TINTS[at % len(TINTS)] for at, box in enumerate(drawing.roles)}


def step_look(box: Box, row: OutlineRow, tints: Mapping[str, str]) -> BoxLook | None:
    """Return how a step without a badge, or a role of the head, looks; None = its text stands without a box."""
    if box.kind in ("section", "branch", "param", "var"):
        return None
    look = BoxLook(
        shape=SHAPES.get(box.kind, "box"),
        fill=tints.get(box.task_role or box.role.partition(",")[0], "white"),
        rounded=box.kind in CONDITIONS,
        width=SUBTREE_WIDTH if box.kind == "call" else THIN,
    )
    return _marked(look, row.mark)


def badge_look(row: OutlineRow) -> BoxLook:
    """Return how the sign before a step with others inside looks."""
    assert row.badge is not None
    return _marked(BoxLook(shape=row.badge.shape), row.mark)


def _marked(look: BoxLook, mark: StatusMark | None) -> BoxLook:
    if mark is None:
        return look
    return BoxLook(
        shape=look.shape, fill=look.fill, rounded=look.rounded, line=mark.line, colour=mark.colour, width=mark.width
    )
