"""A drawing as text for graphviz, with places of its own: `dot -Tsvg` paints it as the graph says `layout=nop2`.

The layout is that of `outline`. Pictures are not made from it (see `svg`): it is for those who go on with graphviz.
"""

from collections.abc import Iterator, Mapping
from xml.sax.saxutils import escape

from graphviz.quoting import escape as as_word
from graphviz.quoting import quote

from formiga_bt.show.facts import Box, Drawing, StepFact
from formiga_bt.show.tree.drawing import tip_of
from formiga_bt.show.tree.legend import legend_of
from formiga_bt.show.tree.looks import GREY, INK, LINE_COLOUR, BoxLook, badge_look, step_look, tints_of
from formiga_bt.show.tree.outline import BADGE, LINE, PAD, SIZE, SMALL, OutlineRow, TreeOutline, outline_of
from formiga_bt.show.tree.textsize import FONT, Lines, TextRun, printable, text_width

Steps = Mapping[str, StepFact]


def dot_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> str:
    """Return the text of a graph: `dot -Tsvg` paints it.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.
    """
    return _Graph(drawing, outline_of(drawing, steps, title), steps is not None).text()


class _Graph:
    """Writes an outline as a graph."""

    def __init__(self, drawing: Drawing, outline: TreeOutline, runs: bool) -> None:
        self._drawing = drawing
        self._outline = outline
        self._tints = tints_of(drawing)
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

    def _cluster(self, at: int, row: OutlineRow) -> str:
        bottom = self._outline.rows[row.last]
        box = (row.x - 4, row.y - 3, self._outline.width, bottom.y + bottom.height + 3)
        bb = f"{box[0]:.1f},{self.height - box[3]:.1f},{box[2]:.1f},{self.height - box[1]:.1f}"
        # a graph's ancestors are drawn first, so a subtree in a subtree shows as a darker one
        return (
            f'subgraph cluster_{at} {{ graph [bb="{bb}" style=filled fillcolor="#00000009" color="#00000018"] n{at} }}'
        )

    def _row(self, at: int, row: OutlineRow) -> Iterator[str]:
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
            look = step_look(box, row, self._tints)
            more = _tip(box) + (_attributes(look) if look else "")
            yield self._node(f"n{at}", row.x, row.y, row.width, row.height, _table(row.lines, row.width, row), more)
        if row.place:
            width = text_width(row.place, SMALL) + 2
            label = f'<<font point-size="{SMALL:g}" color="{GREY}">{escape(row.place)}</font>>'
            y = row.y + min(row.height, LINE + 2 * PAD) / 2 - LINE / 2
            yield self._node(f"p{at}", self._outline.width - width, y, width, LINE, label)

    def _badge(self, name: str, row: OutlineRow) -> str:
        badge = row.badge
        assert badge is not None
        y = row.middle - BADGE / 2
        more = f" fontsize=11{_attributes(badge_look(row))}"
        return self._node(name, row.x, y, BADGE, BADGE, _quoted(badge.symbol), more)

    def _node(self, name: str, x: float, y: float, width: float, height: float, label: str, more: str = "") -> str:
        centre = f"{x + width / 2:.1f},{self.height - y - height / 2:.1f}"
        return f'{name} [pos="{centre}" width={width / 72:.3f} height={height / 72:.3f} label={label}{more}]'

    def _edge(self, parent: OutlineRow, row: OutlineRow, start: str, end: str) -> str:
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
            yield self._node(f"l{at}", x, top + y, BADGE, BADGE - 4, _quoted(symbol), _attributes(look))
            label = f'<<font point-size="{SMALL:g}" color="{GREY}">{escape(words)}</font>>'
            yield self._node(f"w{at}", x + BADGE + 3, top + y + 2, width, LINE, label)


def _attributes(look: BoxLook) -> str:
    """Return a look as graphviz says it, where it is not that of every node."""
    style = ",".join(["rounded"] * look.rounded + ["filled", look.line])
    ink = f' fontcolor="{look.ink}"' if look.ink != INK else ""
    return f' shape={look.shape} fillcolor="{look.fill}" style="{style}" color="{look.colour}" penwidth={look.width:g}{ink}'


def _tip(box: Box) -> str:
    return f" tooltip={_quoted(tip_of(box))}"


def _table(lines: Lines, width: float, row: OutlineRow | None = None) -> str:
    rows = "".join(
        f'<tr><td align="left">{"".join(_run(run, row) for run in line)}</td></tr>' for line in lines if line
    )
    room = max(1, int(width - (2 * PAD if row else 0)))
    return f'<<table border="0" cellborder="0" cellspacing="0" cellpadding="0" width="{room}">{rows}</table>>'


def _run(run: TextRun, row: OutlineRow | None) -> str:
    inner = printable(run.text)
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


def _quoted(text: str) -> str:
    """Return a text as a word of the language, in quotes where it needs them."""
    return str(quote(as_word(printable(text))))
