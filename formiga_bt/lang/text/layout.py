"""What a document's nodes do not hold: its comments and blank lines, and where they belong.

Each key and each list item is an `LayoutItem`. A comment at the end of a line belongs to the outermost element that begins on
that line; one on a line of its own belongs to the next element, or, indented deeper than that, after the one it follows.
Called by `formatting`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.traps import lines_of

_HEADER = re.compile(r"[|>][0-9+-]*")


@dataclass(slots=True, eq=False)
class LayoutItem:
    """A key with its value, or a list item (`key` is None). Lines and columns are 1-based, of the source."""

    key: Scalar | None
    node: Node
    line: int
    col: int
    parent: "LayoutItem | None"
    before: list[str] = field(default_factory=list)
    """Comments above it, each with its `#`; an empty text is a blank line."""
    after: list[str] = field(default_factory=list)
    """Comments below it that are indented like it."""
    trailing: str = ""
    trailing_col: int = 0
    children: list["LayoutItem"] = field(default_factory=list)

    @property
    def open(self) -> Iterator["LayoutItem"]:
        """Iterate over this element and those around it."""
        yield self
        if self.parent is not None:
            yield from self.parent.open


@dataclass(slots=True)
class Layout:
    """A document with its comments."""

    lines: list[str]
    roots: list[LayoutItem]
    comments: dict[int, int]
    """Line -> column of the `#`, 1-based."""
    first: list[str]
    """Comments of a file whose root is no collection."""

    def raw(self, at: Scalar) -> str:
        """Return a scalar of one line as it is written."""
        return self.lines[at.mark.line - 1][at.mark.col - 1 : at.mark.end_col - 1]

    def block_of(self, at: Scalar) -> tuple[str, int, int]:
        """Return the header of a block scalar, and its first and last line (1-based; last < first: no content)."""
        found = _HEADER.match(self.lines[at.mark.line - 1][at.mark.col - 1 :])
        header = found[0] if found else "|"
        last = min(at.mark.end_line if at.mark.end_col > 1 else at.mark.end_line - 1, len(self.lines))
        while last > at.mark.line and not self.lines[last - 1].strip() and "+" not in header:
            last -= 1
        return header, at.mark.line + 1, last

    def has_comment_inside(self, node: Node) -> bool:
        """Return whether a comment stands between the first and the last line of a collection."""
        return any(line in self.comments for line in range(node.mark.line, node.mark.end_line))


def read_layout(source: str, root: Node) -> Layout:
    """Return the layout of a text whose root node was parsed from it."""
    layout = Layout(lines_of(source), [], {}, [])
    layout.roots = _elements(root, None, layout.lines)
    taken = _taken(layout, root)
    for number, line in enumerate(layout.lines, 1):
        col = _comment_at(line, taken.get(number, ()))
        if col:
            layout.comments[number] = col
    _attach(layout, taken)
    return layout


def _elements(node: Node, parent: LayoutItem | None, lines: list[str]) -> list[LayoutItem]:
    found: list[LayoutItem] = []
    if isinstance(node, Mapping_):
        for entry in node.entries:
            found.append(LayoutItem(entry.key, entry.value, entry.key.mark.line, entry.key.mark.col, parent))
    elif isinstance(node, Listing):
        for item in node.items:
            before = lines[item.mark.line - 1][: item.mark.col - 1].rstrip() if item.mark.line <= len(lines) else ""
            col = len(before) if before.endswith("-") else item.mark.col
            found.append(LayoutItem(None, item, item.mark.line, col, parent))
    for one in found:
        one.children = _elements(one.node, one, lines)
    return found


def _scalars(node: Node) -> Iterator[Scalar]:
    if isinstance(node, Scalar):
        yield node
    for entry in node.entries if isinstance(node, Mapping_) else ():
        yield entry.key
        yield from _scalars(entry.value)
    for item in node.items if isinstance(node, Listing) else ():
        yield from _scalars(item)


def _taken(layout: Layout, root: Node) -> dict[int, list[tuple[int, int]]]:
    """Return, by line, the columns (first, after last) that scalars cover."""
    found: dict[int, list[tuple[int, int]]] = {}
    for at in _scalars(root):
        mark = at.mark
        if at.block:
            header, first, last = layout.block_of(at)
            found.setdefault(mark.line, []).append((mark.col, mark.col + len(header)))
            for number in range(first, last + 1):
                found.setdefault(number, []).append((1, len(layout.lines[number - 1]) + 2))
            continue
        for number in range(mark.line, mark.end_line + 1):
            start = mark.col if number == mark.line else 1
            end = mark.end_col if number == mark.end_line else len(layout.lines[number - 1]) + 1
            found.setdefault(number, []).append((start, end))
    return found


def _comment_at(line: str, taken: "list[tuple[int, int]] | tuple[()]") -> int:
    for match in re.finditer("#", line):
        col = match.start() + 1
        if (col == 1 or line[col - 2] in " \t") and not any(start <= col < end for start, end in taken):
            return col
    return 0


def _walk(elements: list[LayoutItem]) -> Iterator[LayoutItem]:
    for one in elements:
        yield one
        yield from _walk(one.children)


def _attach(layout: Layout, taken: dict[int, list[tuple[int, int]]]) -> None:
    every = list(_walk(layout.roots))
    gap: list[tuple[str, int]] = []
    position = 0
    for number, line in enumerate(layout.lines, 1):
        col = layout.comments.get(number, 0)
        is_content = number in taken or bool(line[: col - 1 if col else None].strip(" \t-?:,[]{}"))
        is_content = is_content or (
            bool(line[: col - 1 if col else None].strip()) and not re.match("(---|[.]{3})", line)
        )
        if not is_content:
            gap.append((line[col - 1 :].rstrip() if col else "", col))
            continue
        follows = every[position - 1] if position else None
        begins = position < len(every) and every[position].line == number
        if gap and begins:
            _split(gap, follows, every[position])
            gap = []
        if col:
            owner = every[position] if begins else _ending(every[:position], number, layout.lines)
            if owner is not None and not owner.trailing:
                owner.trailing, owner.trailing_col = line[col - 1 :].rstrip(), col
            else:
                gap.append((line[col - 1 :].rstrip(), col))
        while position < len(every) and every[position].line == number:
            position += 1
    if every:
        _split(gap, every[position - 1] if position else None, None)
    else:
        layout.first = [text for text, _ in gap if text]


def _ending(before: list[LayoutItem], line: int, lines: list[str]) -> LayoutItem | None:
    """Return the outermost element that began on an earlier line and whose scalar, or `]` or `}`, ends on this one.

    A collection in block style ends with its last line only where the file does; what stands there is not about all of it.
    """
    return next((one for one in before if one.line < line == one.node.mark.end_line and _is_written(one, lines)), None)


def _is_written(one: LayoutItem, lines: list[str]) -> bool:
    """Return whether an element's value is a scalar, or stands in `[ ]` or `{ }`."""
    mark = one.node.mark
    return isinstance(one.node, Scalar) or lines[mark.line - 1][mark.col - 1 : mark.col] in ("{", "[")


def _split(gap: list[tuple[str, int]], follows: LayoutItem | None, next_: LayoutItem | None) -> None:
    """Give the lines of a gap to the elements before it, as far as they are indented like them, and to the next one.

    A comment that is indented deeper than one above it goes where that one went: they keep their order.
    """
    rest = 0
    floor = next_.col if next_ is not None else 0
    if follows is not None and (next_ is None or next_.parent is not follows):
        inmost = follows
        for index, (text, col) in enumerate(gap):
            owner = next((one for one in inmost.open if one.col <= col), None) if text and col > floor else None
            if owner is not None:
                inmost = owner
                owner.after += [said for said, _ in gap[rest : index + 1]]
                rest = index + 1
    if next_ is not None:
        next_.before += [text for text, _ in gap[rest:]]
    elif follows is not None:
        outermost = list(follows.open)[-1]
        outermost.after += [text for text, _ in gap[rest:]]
