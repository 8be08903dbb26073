"""A drawing as text for graphviz, with places of its own, and as the SVG and PNG that graphviz makes of it.

The layout is that of `outline`; graphviz only paints (`neato -n2`; `dot` does, too: the graph says `layout=nop2`), so that
2,000 steps take a moment.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Final
from xml.sax.saxutils import escape

from formiga_bt.errors import FormigaError
from formiga_bt.show.drawing import text_of
from formiga_bt.show.facts import Box, Drawing, StepFact
from formiga_bt.show.legend import CONDITIONS, SHAPES, legend_of
from formiga_bt.show.outline import BADGE, LINE, PAD, SIZE, SMALL, Outline, Row, outline_of
from formiga_bt.show.textsize import FONT, Lines, Run, text_width

TINTS: Final = ("#d5e8f7", "#fde3c8", "#d6efe1", "#f5dbe8", "#fbf3c0", "#e4dff2", "#dcefef", "#ece4d8")
"""Of the roles, in the order of the file."""
SUBTREE: Final = "#f6f6f6"
INK: Final = "#202020"
GREY: Final = "#6a6a6a"
LINE_COLOUR: Final = "#9a9a9a"
TALLEST_PX: Final = 32_000
"""Painters of PNG take no more."""
PNG_DPI: Final = 144
LEAST_DPI: Final = 60

Steps = Mapping[str, StepFact]


class NoGraphviz(FormigaError):  # noqa: N818 - it names what is wrong
    """The programs of graphviz are missing, or fail."""


def dot_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> str:
    """Return the text of a graph: `dot -Tsvg` paints it.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    return _Graph(drawing, outline_of(drawing, steps, title), steps is not None).text()


def svg_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> str:
    """Return a picture as SVG.

    Raises:
        NoGraphviz: graphviz is not there.
    """
    return slim(painted(dot_of(drawing, steps, title), "svg").decode())


def png_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> bytes:
    """Return a picture as PNG.

    Raises:
        NoGraphviz: graphviz is not there.
        FormigaError: the tree is too long for a PNG.
    """
    graph = _Graph(drawing, outline_of(drawing, steps, title), steps is not None)
    text = graph.text()
    dpi = min(PNG_DPI, int(TALLEST_PX * 72 / graph.height))
    if dpi < LEAST_DPI:
        raise FormigaError(
            f"the tree is too long for a PNG: {graph.height / 72:.0f} inches\n"
            "  help: draw an svg or html, or less of it: --depth N, --collapse NAME"
        )
    return painted(text, "png", dpi)


def painted(text: str, form: str, dpi: int = 72) -> bytes:
    """Return what graphviz makes of a graph with places.

    Raises:
        NoGraphviz: graphviz is not there, or fails.
    """
    import graphviz

    text = text.replace("graph [", f"graph [dpi={dpi} ", 1)
    try:
        found: bytes = graphviz.pipe("neato", form, text.encode(), neato_no_op=2, quiet=True)
    except graphviz.ExecutableNotFound as error:
        raise NoGraphviz(
            f"cannot draw {form}: the programs of graphviz are missing\n"
            "  help: install the package graphviz (Debian, Ubuntu: apt install graphviz; macOS: brew install graphviz);\n"
            "        html, mermaid, dot, json and terminal work without it"
        ) from error
    except graphviz.CalledProcessError as error:
        said = (error.stderr or b"").decode(errors="replace").strip()
        raise NoGraphviz(f"graphviz cannot draw the {form}: {said}") from error
    return found


def slim(svg: str) -> str:
    """Return a picture without what each of its texts repeats; what shows when pointing at a step is a title, not a link."""
    svg = re.sub(r"<!--.*?-->\n?", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<title>[nptlw]\d+(?:&#45;&gt;n\d+)?</title>\n|<title>(?:corner|cluster_\d+)</title>\n", "", svg)
    svg = re.sub(r'<g id="a_\w+"><a xlink:title="([^"]*)">', r"<g><title>\1</title>", svg).replace("</a>\n</g>", "</g>")
    svg = re.sub(r' id="(?:node|edge|clust)\d+"| text-anchor="start"', "", svg)
    font = f' font-family="{FONT}"'
    return svg.replace(font, "").replace("<svg ", f"<svg{font} ", 1)


class _Graph:
    """Writes an outline as a graph."""

    def __init__(self, drawing: Drawing, outline: Outline, runs: bool) -> None:
        self._drawing = drawing
        self._outline = outline
        self._tints = {box.role: TINTS[at % len(TINTS)] for at, box in enumerate(drawing.roles)}
        self._legend = legend_of(outline, runs)
        self.height = outline.height + (max((entry.y for entry in self._legend), default=0) + LINE + 8)
        self._width = outline.width

    def text(self) -> str:
        """Return the graph's text."""
        head = (
            f"digraph {_quoted(self._drawing.task)} {{\n"
            f'  graph [layout=nop2 bb="0,0,{self._width:.0f},{self.height:.0f}" fontname="{FONT}" bgcolor=white]\n'
            f'  node [shape=plaintext fixedsize=true margin=0 fontname="{FONT}" fontsize={SIZE:g} fontcolor="{INK}"'
            f' color="{GREY}" penwidth=0.8 label=""]\n'
            f'  edge [dir=none color="{LINE_COLOUR}" penwidth=0.9]\n'
        )
        return head + "".join(f"  {line}\n" for line in self._lines()) + "}\n"

    def _lines(self) -> Iterator[str]:
        rows = self._outline.rows
        for at, row in enumerate(rows):
            if row.box and row.box.kind == "call" and row.box.children:
                yield self._cluster(at, row)
        yield f'corner [pos="{self._width:.1f},0" width=0.01 height=0.01]'  # keeps the page's width
        for at, row in enumerate(rows):
            yield from self._row(at, row)
        for at, row in enumerate(rows):
            if row.parent is not None:
                yield self._edge(rows[row.parent], row, f"n{row.parent}", f"n{at}")
        yield from self._legend_lines()

    def _cluster(self, at: int, row: Row) -> str:
        bottom = self._outline.rows[row.last]
        box = (row.x - 4, row.y - 3, self._outline.width, bottom.y + bottom.height + 3)
        bb = f"{box[0]:.1f},{self.height - box[3]:.1f},{box[2]:.1f},{self.height - box[1]:.1f}"
        # a graph's ancestors are drawn first, so a subtree in a subtree shows as a darker one
        return (
            f'subgraph cluster_{at} {{ graph [bb="{bb}" style=filled fillcolor="#00000009" color="#00000018"] n{at} }}'
        )

    def _row(self, at: int, row: Row) -> Iterator[str]:
        box = row.box
        if box is None:
            yield self._node(f"n{at}", row.x, row.y, row.width, row.height, _table(row.lines, row.width))
        elif row.badge is not None:
            yield self._badge(f"n{at}", row)
            start = row.x + BADGE + 2
            yield self._node(
                f"t{at}", start, row.y, row.width, row.height, _table(row.lines, row.width, row), _tip(box)
            )
        else:
            look = self._look(box, row)
            yield self._node(
                f"n{at}", row.x, row.y, row.width, row.height, _table(row.lines, row.width, row), _tip(box) + look
            )
        if row.place:
            width = text_width(row.place, SMALL) + 2
            label = f'<<font point-size="{SMALL:g}" color="{GREY}">{escape(row.place)}</font>>'
            y = row.y + min(row.height, LINE + 2 * PAD) / 2 - LINE / 2
            yield self._node(f"p{at}", self._outline.width - width, y, width, LINE, label)

    def _badge(self, name: str, row: Row) -> str:
        badge = row.badge
        assert badge is not None
        y = row.middle - BADGE / 2
        return self._node(
            name, row.x, y, BADGE, BADGE, _quoted(badge.symbol), f" shape={badge.shape} fontsize=11{_outline(row)}"
        )

    def _look(self, box: Box, row: Row) -> str:
        if box.kind in ("section", "branch"):
            return ""
        if box.kind in ("param", "var"):
            return ""
        shape = SHAPES.get(box.kind, "box")
        fill = self._tints.get(box.task_role or box.role.partition(",")[0], "white")
        style = "rounded,filled" if box.kind in CONDITIONS else "filled"
        thick = " penwidth=1.8" if box.kind == "call" and row.mark is None else ""
        return f' shape={shape} fillcolor="{fill}"{_outline(row, style)}{thick}'

    def _node(self, name: str, x: float, y: float, width: float, height: float, label: str, more: str = "") -> str:
        centre = f"{x + width / 2:.1f},{self.height - y - height / 2:.1f}"
        return f'{name} [pos="{centre}" width={width / 72:.3f} height={height / 72:.3f} label={label}{more}]'

    def _edge(self, parent: Row, row: Row, start: str, end: str) -> str:
        if parent.box is None:  # of a section: nothing hangs on its heading
            return ""
        top = parent.middle + BADGE / 2 if parent.badge else parent.y + parent.height
        x, y = parent.stem_x, self.height - row.middle
        from_y = self.height - top
        points = [(x, from_y), (x, from_y), (x, y), (x, y), (x, y), (row.x, y), (row.x, y)]
        return f'{start} -> {end} [pos="{" ".join(f"{a:.1f},{b:.1f}" for a, b in points)}"]'

    def _legend_lines(self) -> Iterator[str]:
        top = self._outline.height
        for at, (words, symbol, look, x, y, width) in enumerate(self._legend):
            yield self._node(f"l{at}", x, top + y, BADGE, BADGE - 4, _quoted(symbol), f" {look}")
            label = f'<<font point-size="{SMALL:g}" color="{GREY}">{escape(words)}</font>>'
            yield self._node(f"w{at}", x + BADGE + 3, top + y + 2, width, LINE, label)


def _outline(row: Row, style: str = "filled") -> str:
    """Return how a node's outline says its status."""
    if row.mark is None:
        return f' style="{style}"' + (' fillcolor="white"' if row.badge else "")
    fill = ' fillcolor="white"' if row.badge else ""
    return f' style="{style},{row.mark.line}" color="{row.mark.colour}" penwidth={row.mark.width:g}{fill}'


def _tip(box: Box) -> str:
    where = f"{box.spot.file}:{box.spot.line}" if box.spot else ""
    words = " ".join(part for part in (where, text_of(box), *box.modifiers) if part)
    return f" tooltip={_quoted(words)}"


def _table(lines: Lines, width: float, row: Row | None = None) -> str:
    rows = "".join(
        f'<tr><td align="left">{"".join(_run(run, row) for run in line)}</td></tr>' for line in lines if line
    )
    room = max(1, int(width - (2 * PAD if row else 0)))
    return f'<<table border="0" cellborder="0" cellspacing="0" cellpadding="0" width="{room}">{rows}</table>>'


def _run(run: Run, row: Row | None) -> str:
    inner = _printable(run.text)
    bare = inner.strip(" ")
    if bare:  # SVG drops a space at the end of a piece
        before, _, after = inner.partition(bare)
        inner = before.replace(" ", "\u00a0") + bare + after.replace(" ", "\u00a0")
    text = escape(inner)
    match run.style:
        case "title":
            return f'<font point-size="{SIZE * 1.5:g}"><b>{text}</b></font>'
        case "heading":
            return f'<font color="{GREY}"><b>{text}</b></font>'
        case "bold":
            return f"<b>{text}</b>"
        case "italic":
            return f'<font color="{GREY}"><i>{text}</i></font>'
        case "mark" | "note":
            colour = row.mark.colour if row and row.mark else INK
            return f'<font color="{colour}"><b>{text}</b></font>'
    return text


def _printable(text: str) -> str:
    """Return a text without the characters that XML has no place for."""
    return text if text.isprintable() else "".join(c if c.isprintable() else " " for c in text)


def _quoted(text: str) -> str:
    """Return a text as a quoted string of the language."""
    clean = _printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{clean}"'
