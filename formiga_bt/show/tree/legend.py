"""What the shapes of a picture mean: of those that it has, one entry each."""

from typing import NamedTuple

from formiga_bt.show.tree.looks import CONDITIONS, SUBTREE_WIDTH, BoxLook
from formiga_bt.show.tree.marks import MARKS
from formiga_bt.show.tree.outline import BADGE, BADGES, GAP, SMALL, TreeOutline
from formiga_bt.show.tree.textsize import text_width


class LegendEntry(NamedTuple):
    """One entry with its place, points from the top left of the legend."""

    words: str
    symbol: str
    look: BoxLook
    x: float
    y: float
    width: float
    """Of the words."""


def legend_of(outline: TreeOutline, runs: bool) -> list[LegendEntry]:
    """Return the legend of a picture, in lines as wide as it.

    Args:
        outline: the picture.
        runs: whether statuses are shown.
    """
    x, y = 0.0, GAP * 2
    entries = []
    for words, symbol, look in dict.fromkeys(_needed(outline, runs)):
        width = text_width(words, SMALL) + 4
        if x and x + BADGE + 3 + width > outline.width:
            x, y = 0.0, y + BADGE + 3
        entries.append(LegendEntry(words, symbol, look, x, y, width))
        x += BADGE + 3 + width + 10
    return entries


def _needed(outline: TreeOutline, runs: bool) -> list[tuple[str, str, BoxLook]]:
    kinds = {row.box.kind for row in outline.rows if row.box and row.parent is not None}
    found = [(badge.words, badge.symbol, BoxLook(shape=badge.shape)) for kind, badge in BADGES.items() if kind in kinds]
    leaves = (
        ("goal of an agent", {"do"}, BoxLook()),
        ("people", {"ask", "notify"}, BoxLook(shape="note")),
        ("another task", {"request"}, BoxLook(shape="box3d")),
        ("condition", CONDITIONS, BoxLook(rounded=True)),
        ("subtree", {"call"}, BoxLook(width=SUBTREE_WIDTH)),
    )
    found += [(words, "", look) for words, of, look in leaves if kinds & of]
    if runs:
        used = {row.mark.status for row in outline.rows if row.mark}
        for mark in MARKS:
            look = BoxLook(line=mark.line, colour=mark.colour, width=mark.width, ink=mark.colour)
            found += [(mark.words, mark.glyph, look)] if mark.status in used else []
    return found
