"""A drawing as SVG: the places of `outline`, painted without any other program. Points (1/72 inch) from the top left."""

from collections.abc import Iterator, Mapping
from typing import Final
from xml.sax.saxutils import escape

from formiga_bt.show.facts import Drawing, StepFact
from formiga_bt.show.tree.drawing import tip_of
from formiga_bt.show.tree.legend import LegendEntry, legend_of
from formiga_bt.show.tree.looks import GREY, INK, LINE_COLOUR, badge_look, step_look, tints_of
from formiga_bt.show.tree.outline import BADGE, LINE, PAD, SIZE, SMALL, OutlineRow, TreeOutline, outline_of
from formiga_bt.show.tree.shapes import DEPTH, shape_of
from formiga_bt.show.tree.textsize import FONT, TextRun, printable, text_width

MARGIN: Final = 4.0
RISE: Final = 0.36
"""From the middle of a line of text to the baseline of its letters, in sizes of the font."""
SIGN: Final = 11.0
"""Size of the sign in a badge."""
TITLE: Final = 1.5
"""Size of the title, in sizes of the other text."""

Steps = Mapping[str, StepFact]


def svg_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> str:
    """Return a picture as SVG.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    outline = outline_of(drawing, steps, title)
    return SvgPage(drawing, outline, legend_of(outline, steps is not None)).text()


class SvgPage:
    """Paints an outline and its legend."""

    def __init__(self, drawing: Drawing, outline: TreeOutline, legend: list[LegendEntry]) -> None:
        self._drawing = drawing
        self._outline = outline
        self._legend = legend
        self._tints = tints_of(drawing)
        self.width = outline.width + 2 * MARGIN
        self.height = outline.height + max((entry.y for entry in legend), default=0) + LINE + 8 + 2 * MARGIN

    def text(self) -> str:
        """Return the file's text."""
        box = f"{-MARGIN:g} {-MARGIN:g} {self.width:g} {self.height:g}"
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width:g}pt" height="{self.height:g}pt" viewBox="{box}"'
            f' font-family="{FONT}" font-size="{SIZE:g}" fill="{INK}" xml:space="preserve">\n'
            f"<title>{_escaped(self._drawing.task)}</title>\n"
            f'<rect x="{-MARGIN:g}" y="{-MARGIN:g}" width="{self.width:g}" height="{self.height:g}" fill="white"/>\n'
        )
        return head + "".join(f"{line}\n" for line in self._lines()) + "</svg>\n"

    def _lines(self) -> Iterator[str]:
        rows = self._outline.rows
        for row in rows:
            if row.box and row.box.kind == "call" and row.box.children:
                yield self._behind(row)
        stems = "".join(_stem(rows[row.parent], row) for row in rows if row.parent is not None)
        if stems:
            yield f'<path d="{stems}" fill="none" stroke="{LINE_COLOUR}" stroke-width="0.9"/>'
        for row in rows:
            yield self._row(row)
        for entry in self._legend:
            yield _entry(entry, self._outline.height)

    def _behind(self, row: OutlineRow) -> str:
        """Return what is behind a subtree; one in another shows darker, as both are painted."""
        last = self._outline.rows[row.last]
        x, y = row.x - 4, row.y - 3
        size = f'width="{self._outline.width - x:.1f}" height="{last.y + last.height + 3 - y:.1f}"'
        return (
            f'<rect x="{x:.1f}" y="{y:.1f}" {size} fill="#000" fill-opacity=".035" stroke="#000" stroke-opacity=".1"/>'
        )

    def _row(self, row: OutlineRow) -> str:
        parts = []
        box = row.box
        start, lower = row.x, 0.0
        if box is not None:
            parts.append(f"<title>{_escaped(tip_of(box))}</title>")
            start += PAD
            look = None if row.badge else step_look(box, row, self._tints)
            if row.badge:
                start += BADGE + 2
                parts.append(shape_of(badge_look(row), row.x, row.middle - BADGE / 2, BADGE, BADGE))
                parts.append(_sign(row.badge.symbol, row.x + BADGE / 2, row.middle, INK))
            elif look:
                lower = DEPTH / 2 if look.shape == "box3d" else 0.0
                parts.append(shape_of(look, row.x, row.y, row.width, row.height))
        big = TITLE if any(run.style == "title" for run in row.lines[0]) else 1.0
        first = row.y + LINE * big / 2 if box is None else row.middle - LINE * (len(row.lines) - 1) / 2
        baseline = first + SIZE * big * RISE + (-1 if row.lines[0][0].style == "heading" else lower)
        for at, line in enumerate(row.lines):
            parts.append(f'<text x="{start:.1f}" y="{baseline + at * LINE * big:.1f}">{_runs(line, row)}</text>')
        if row.place:
            x = self._outline.width - text_width(row.place, SMALL) - 1
            y = row.y + min(row.height, LINE + 2 * PAD) / 2 + SMALL * RISE
            parts.append(_words(row.place, x, y))
        return f"<g>{''.join(parts)}</g>"


def _stem(parent: OutlineRow, row: OutlineRow) -> str:
    if parent.box is None:  # of a section: nothing hangs on its heading
        return ""
    top = parent.middle + BADGE / 2 if parent.badge else parent.y + parent.height
    return f"M{parent.stem_x:.1f} {top:.1f}V{row.middle:.1f}H{row.x:.1f}"


def _entry(entry: LegendEntry, top: float) -> str:
    words, symbol, look, x, y, _ = entry
    middle = top + y + (BADGE - 4) / 2
    sign = _sign(symbol, x + BADGE / 2, middle, look.ink) if symbol else ""
    shape = shape_of(look, x, top + y, BADGE, BADGE - 4)
    return f"<g>{shape}{sign}{_words(words, x + BADGE + 5, middle + SMALL * RISE)}</g>"


def _sign(symbol: str, x: float, y: float, ink: str) -> str:
    place = f'x="{x:.1f}" y="{y + SIGN * RISE:.1f}" text-anchor="middle" font-size="{SIGN:g}"'
    return f'<text {place} fill="{ink}">{_escaped(symbol)}</text>'


def _words(text: str, x: float, y: float) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{SMALL:g}" fill="{GREY}">{_escaped(text)}</text>'


def _runs(line: list[TextRun], row: OutlineRow) -> str:
    return "".join(_run(run, row) for run in line)


def _run(run: TextRun, row: OutlineRow) -> str:
    text = _escaped(run.text)
    match run.style:
        case "title":
            return f'<tspan font-size="{SIZE * TITLE:g}" font-weight="bold">{text}</tspan>'
        case "heading":
            return f'<tspan fill="{GREY}" font-weight="bold">{text}</tspan>'
        case "bold":
            return f'<tspan font-weight="bold">{text}</tspan>'
        case "italic":
            return f'<tspan fill="{GREY}" font-style="italic">{text}</tspan>'
        case "mark" | "note":
            colour = row.mark.colour if row.mark else INK
            return f'<tspan fill="{colour}" font-weight="bold">{text}</tspan>'
    return text


def _escaped(text: str) -> str:
    return escape(printable(text))
