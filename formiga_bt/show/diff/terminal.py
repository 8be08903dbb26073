"""A difference as lines of text: the tree of the new task, marked where something changed, what did not folded.

`+` added, `-` removed, `~` changed or renamed, `>` moved here. A removed step stands where it stood.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import PurePath
from textwrap import wrap
from typing import Final

from formiga_bt.lang import model
from formiga_bt.lang.model import Param, Role, Step
from formiga_bt.show.diff.caution import Caution
from formiga_bt.show.diff.changes import Change, Difference
from formiga_bt.show.diff.outline import OutlineNode
from formiga_bt.show.facts import FileSpot
from formiga_bt.show.tree import phrases
from formiga_bt.show.tree.terminal import DrawnLine, LinePiece, columns_of, cut_to, safe

_STYLES: Final = {"+": "success", "-": "failure", "~": "warn", ">": "kind", " ": "plain"}
_SIGNS: Final = {"added": "+", "removed": "-", "changed": "~", "renamed": "~", "moved": ">"}
_NARROW: Final = 72


@dataclass(frozen=True, slots=True)
class _Glyphs:
    tee: str
    corner: str
    bar: str
    cut: str
    arrow: str


_BOX: Final = _Glyphs("├─ ", "└─ ", "│  ", "…", "→")
_ASCII: Final = _Glyphs("|- ", "`- ", "|  ", "...", "->")


@dataclass(slots=True)
class _Row:
    """A line of the tree before layout, with what is under it."""

    sign: str
    pieces: list[LinePiece]
    spot: FileSpot | None = None
    details: list[str] = field(default_factory=list)
    inside: list["_Row"] = field(default_factory=list)
    fold: str = ""
    """What many of it are called where it is folded; "" = it changed, or something in it."""
    count: int = 0


def draw(
    difference: Difference, look_at: Sequence[Caution] = (), *, width: int = 100, ascii_only: bool = False
) -> list[DrawnLine]:
    """Return the lines of a difference; none if nothing changed.

    Args:
        difference: of two tasks.
        look_at: what may be less safe.
        width: columns that no line exceeds.
        ascii_only: draw with `|-` and `->`, and escape what is not ASCII.
    """
    if not difference.changes:
        return []
    lines = list(_Layout(width, ascii_only).lines(_Rows(difference, "->" if ascii_only else "→").top()))
    if look_at:
        lines += [DrawnLine((LinePiece(""),)), DrawnLine((LinePiece("look at", "title"),))]
        for caution in look_at:
            where = f"  ({PurePath(caution.spot.file).name}:{caution.spot.line})" if caution.spot else ""
            text = caution.text if ascii_only else caution.text.replace("->", "→")
            said = wrap(safe(f"! {text}{where}", ascii_only), width, subsequent_indent="  ")
            lines += [DrawnLine((LinePiece(line, "warn"),)) for line in said]
    return [
        *lines,
        DrawnLine((LinePiece(""),)),
        *(DrawnLine((LinePiece(line, "title"),)) for line in wrap(difference.in_words(), width)),
    ]


class _Rows:
    """Makes the rows of a difference."""

    def __init__(self, difference: Difference, arrow: str) -> None:
        self.of = difference.of
        self.new, self.old = difference.new, difference.old
        self.to_old, self.to_new = difference.matching.to_old, difference.matching.to_new
        self.arrow = arrow

    def top(self) -> list[_Row]:
        thing = self.new.thing
        version = thing.version if isinstance(thing, model.Task) else ""
        head = self.row(self.new, [LinePiece(f"{self.new.sub} {version}".rstrip(), "title")])
        head.inside = []
        groups = [row for row in self.inside(self.new) if not row.fold]
        return [head, *groups]

    def row(self, node: OutlineNode, pieces: list[LinePiece]) -> _Row:
        changes = self.of.get(node, ())
        inside = self.inside(node)
        sign = next((_SIGNS[c.what] for c in changes), " " if node in self.to_old else "+")
        spot = FileSpot(node.mark.file, node.mark.line, node.mark.col)
        row = _Row(sign, pieces, spot if node.kind not in ("group", "branch") else None, inside=inside)
        row.details = [text for change in changes for text in self.details(change)]
        if sign == " " and all(one.fold for one in inside):
            row.fold = "step" if node.is_step else node.kind
            row.count = (1 if node.is_step or not inside else 0) + sum(one.count for one in inside)
        return row

    def inside(self, node: OutlineNode) -> list[_Row]:
        """Return the rows under a node, with what was removed there at its old place."""
        was = self.to_old.get(node)
        gone: dict[OutlineNode | None, list[OutlineNode]] = {}
        last: OutlineNode | None = None
        for child in was.children if was is not None else ():
            there = self.to_new.get(child)
            if there is None:
                gone.setdefault(last, []).append(child)
            elif there in node.children:
                last = there
        rows = [row for one in gone.get(None, ()) for row in self.removed(one)]
        for child in node.children:
            if child in self.to_old or child.kind != "subtree" or child in self.of:
                rows.append(self.row(child, _label(child)))
            rows += [row for one in gone.get(child, ()) for row in self.removed(one)]
        if node.kind == "if" and len(rows) == 1 and node.children[0] not in self.of:
            return rows[0].inside
        return rows

    def removed(self, node: OutlineNode) -> list[_Row]:
        """Return the row of what is no more; of its inside what went with it."""
        if node.kind == "subtree" and not self.of.get(node):
            return []
        kept = sum(1 for one in node.below() if one.is_step and one in self.to_new)
        spot = FileSpot(node.mark.file, node.mark.line, node.mark.col)
        row = _Row("-", _label(node), spot if node.kind != "branch" else None)
        if kept:
            row.details.append(f"{kept} of the steps inside stay" if kept > 1 else "a step inside stays")
        row.inside = [one for child in node.children if child not in self.to_new for one in self.removed(child)]
        return [row] if row.inside or node.kind != "group" else []

    def details(self, change: Change) -> Iterator[str]:
        if change.what == "moved" and change.before is not None and change.after is not None:
            same = change.before.file == change.after.file
            name = "" if same else f"{PurePath(change.before.file).name}:"
            where = f"line {change.before.line}" if not name else f"{name}{change.before.line}"
            out = f", out of {change.from_title}" if change.from_title != change.to_title and change.from_title else ""
            yield f"moved from {where}{out}"
        elif change.what == "renamed":
            one = change.fields[0]
            kind = "" if change.kind in ("param", "var", "role", "subtree") else f"{change.kind} name "
            yield f"{kind}renamed: {one.before} {self.arrow} {one.after}"
        elif change.what == "changed":
            yield from (one.in_words(self.arrow) for one in change.fields)


def _label(node: OutlineNode) -> list[LinePiece]:
    thing = node.thing
    if isinstance(thing, Step):
        spans = [*phrases.label_of(thing)]
        pieces = [LinePiece(span.text, span.style) for span in spans]
        words = phrases.modifiers_of(thing)
        return [*pieces, LinePiece(f"  [{'; '.join(words)}]", "warn")] if words else pieces
    if isinstance(thing, Param):
        return [LinePiece(span.text, span.style) for span in phrases.param_label(thing)]
    if isinstance(thing, Role):
        return [LinePiece(span.text, span.style) for span in phrases.role_label(thing)]
    if node.kind == "var":
        return [LinePiece(node.sub, "agent"), LinePiece(f" = {node.fields['value'].words}")]
    if node.kind == "subtree":
        return [LinePiece(node.sub, "agent"), LinePiece(f"  {PurePath(node.mark.file).name}", "dim")]
    return [LinePiece(node.sub, "title" if node.kind == "group" else "kind")]


class _Layout:
    """Turns rows into lines of at most `width` columns."""

    def __init__(self, width: int, ascii_only: bool) -> None:
        self.width, self.ascii = width, ascii_only
        self.glyphs = _ASCII if ascii_only else _BOX

    def lines(self, rows: Sequence[_Row]) -> Iterator[DrawnLine]:
        for row in rows:
            yield from self.line(row, "", "")
            yield from self.below(row.inside, "")

    def below(self, rows: Sequence[_Row], prefix: str) -> Iterator[DrawnLine]:
        shown = list(self.folded(rows))
        for at, row in enumerate(shown):
            last = at == len(shown) - 1
            under = prefix + ("   " if last else self.glyphs.bar)
            lead = under + (self.glyphs.bar if row.inside else "   ")
            yield from self.line(row, prefix + (self.glyphs.corner if last else self.glyphs.tee), lead)
            yield from self.below(row.inside, under)

    def folded(self, rows: Sequence[_Row]) -> Iterator[_Row]:
        """Iterate over rows, with each run of those that did not change as one."""
        run: list[_Row] = []
        for row in [*rows, None]:
            if row is not None and row.fold:
                run.append(row)
                continue
            count = sum(one.count for one in run)
            if count == 1 and len(run) == 1 and not run[0].inside:
                yield run[0]
            elif run:
                kinds = {one.fold for one in run}
                word = kinds.pop() if len(kinds) == 1 else "step"
                word = {"branch": "step"}.get(word, word)
                yield _Row(" ", [LinePiece(f"... {count} {word}{'s' if count != 1 else ''}", "dim")])
            run = []
            if row is not None:
                yield row

    def line(self, row: _Row, prefix: str, lead: str) -> Iterator[DrawnLine]:
        place = ""
        if row.spot is not None:
            name = f"{PurePath(row.spot.file).name}:{row.spot.line}"
            place = name if self.width >= _NARROW and len(name) < self.width // 3 else f":{row.spot.line}"
            place = safe(place, self.ascii)
        style = _STYLES[row.sign]
        prefix, lead = self.short(prefix), self.short(lead)
        room = self.width - 2 - len(prefix) - (len(place) + 2 if place else 0)
        shown = [LinePiece(f"{row.sign} ", style), LinePiece(prefix, "dim")]
        for piece in row.pieces:
            text = cut_to(safe(piece.text, self.ascii), max(0, room), self.glyphs.cut)
            shown.append(LinePiece(text, style if row.sign in "+-" else piece.style))
            room -= columns_of(text)
        if place:
            shown.append(LinePiece(" " * max(0, room + 2) + place, "dim"))
        yield DrawnLine(tuple(shown))
        inner = self.width - 4 - len(lead)
        for detail in row.details:
            for text in wrap(safe(detail, self.ascii), inner, subsequent_indent="  "):
                yield DrawnLine((LinePiece("  "), LinePiece(lead, "dim"), LinePiece(f"  {text}", style)))

    def short(self, prefix: str) -> str:
        """Return the lines that lead to a row, without those furthest left where they would fill half of the width."""
        most = self.width // 2 - 3
        return prefix if len(prefix) <= most else self.glyphs.cut + prefix[len(prefix) - most + len(self.glyphs.cut) :]
