"""The shapes of boxes as elements of SVG. Points from the top left."""

from collections.abc import Iterable
from typing import Final, assert_never

from formiga_bt.show.tree.looks import THIN, BoxLook
from formiga_bt.show.tree.outline import Shape

CORNER: Final = 6.0
"""Folded down from a note, points."""
DEPTH: Final = 4.0
"""Of a box in three dimensions, points."""
DASHES: Final = {"dashed": "5,2", "dotted": "1,4"}


def shape_of(look: BoxLook, x: float, y: float, width: float, height: float) -> str:
    """Return a box as an element, or as two: its outline, and the lines inside it."""
    paint = _paint(look)
    right, bottom, middle = x + width, y + height, y + height / 2
    shape: Shape = look.shape
    match shape:
        case "box":
            round_ = f' rx="{min(8.0, height / 2.5):g}"' if look.rounded else ""
            return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"{round_}{paint}/>'
        case "circle":
            centre = f'cx="{x + width / 2:.1f}" cy="{middle:.1f}"'
            return f'<circle {centre} r="{max(width, height) / 2:.1f}"{paint}/>'
        case "octagon":
            w, h = width * 0.29, height * 0.29
            upper = ((x + w, y), (right - w, y), (right, y + h), (right, bottom - h))
            return _polygon((*upper, (right - w, bottom), (x + w, bottom), (x, bottom - h), (x, y + h)), paint)
        case "parallelogram":
            w = width * 0.25
            return _polygon(((x + w, y), (right, y), (right - w, bottom), (x, bottom)), paint)
        case "diamond":
            centre_x = x + width / 2
            return _polygon(((centre_x, y), (right, middle), (centre_x, bottom), (x, middle)), paint)
        case "note":
            c = min(CORNER, height / 2)
            sheet = ((x, y), (right - c, y), (right, y + c), (right, bottom), (x, bottom))
            return _polygon(sheet, paint) + _line(((right - c, y), (right - c, y + c), (right, y + c)), look)
        case "box3d":
            d = DEPTH
            block = ((x, y + d), (x + d, y), (right, y), (right, bottom - d), (right - d, bottom), (x, bottom))
            front = ((x, y + d), (right - d, y + d), (right - d, bottom))
            return _polygon(block, paint) + _line(front, look) + _line(((right - d, y + d), (right, y)), look)
        case _:
            assert_never(shape)


def _paint(look: BoxLook) -> str:
    dashes = f' stroke-dasharray="{DASHES[look.line]}"' if look.line in DASHES else ""
    return f' fill="{look.fill}" stroke="{look.colour}" stroke-width="{look.width:g}"{dashes}'


def _points(points: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _polygon(points: Iterable[tuple[float, float]], paint: str) -> str:
    return f'<polygon points="{_points(points)}"{paint}/>'


def _line(points: Iterable[tuple[float, float]], look: BoxLook) -> str:
    return f'<polyline points="{_points(points)}" fill="none" stroke="{look.colour}" stroke-width="{THIN:g}"/>'
