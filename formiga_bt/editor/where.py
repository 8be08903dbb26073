"""In which mapping or list of a file a position is, read from the indentation around it.

Works on text that is being typed and is no YAML at the moment, and looks at the lines around the position only: the time
it takes does not grow with the steps of a file. Lines and columns are 0-based here, columns count characters.
Called for completion, hover and definitions; `document` reads whole files that are well-formed.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, Literal

from formiga_bt.editor.flow import FlowPosition, read_flow

_DASHES: Final = re.compile(r"\s*((?:-(?:\s+|$))*)")
_KEY: Final = re.compile(r"(\"[^\"]*\"|'[^']*'|[^\s\-#'\"{}\[\],|>&*!%@`][^:#]*?)\s*:(?=\s|$)")
_COMMENT: Final = re.compile(r"(?:^|\s)#")
_BLOCK: Final = re.compile(r"[|>][-+0-9]*\Z")
_MOST_FLOW_LINES: Final = 60


@dataclass(slots=True)
class Level:
    """A mapping or list around a position; the outermost comes first."""

    kind: Literal["map", "list"]
    keys: dict[str, str] = field(default_factory=dict)
    """Of a mapping: its keys, each with the scalar behind it as written ("" for anything else)."""
    under: str = ""
    """Of a mapping: the key that leads further in, or whose value the position is in."""
    line: int = 0
    """Where it begins."""


@dataclass(frozen=True, slots=True)
class EditorPosition:
    """What is at a position."""

    levels: tuple[Level, ...]
    slot: Literal["key", "value", "word", "item"]
    """In a key; in a value; in a first word that may become either; or where the dash of a list item would stand."""
    text: str
    """The key or scalar at the position, without quotes; of a scalar of several lines, this line."""
    line: int
    start: int
    """Column at which `text` begins."""
    offset: int
    """Of the position in `text`."""
    colon: bool = False
    """Of a key: whether its colon is there."""
    quoted: bool = False
    flow: bool = False
    column: int = 0
    """At which the keys of the innermost mapping stand (block style)."""

    @property
    def end(self) -> int:
        """Return the column behind `text`."""
        return self.start + len(self.text)

    @property
    def key(self) -> str:
        """Return the key whose value the position is in; "" in a key or in a list at the top."""
        inner = next((level for level in reversed(self.levels) if level.kind == "map"), None)
        return inner.under if inner is not None and self.slot == "value" else ""


@dataclass(frozen=True, slots=True)
class LineShape:
    """A line of block style: its dashes, its key, its value."""

    dashes: tuple[int, ...]
    start: int
    """Column of the key, or of the text, behind the dashes."""
    key: str
    key_end: int
    value_start: int
    value: str
    """Without its comment."""
    comment: int
    """Column of the comment; the line's length without one."""


@lru_cache(maxsize=4096)
def shape(line: str) -> LineShape:
    """Return the parts of a line of block style; kept, because each request looks at the lines around it again."""
    led = _DASHES.match(line)
    assert led is not None, "it also matches nothing"
    dashes = tuple(index for index in range(led.start(1), led.end(1)) if line[index] == "-")
    start = led.end()
    if dashes and start == dashes[-1] + 1:
        start += 1  # the blank behind the dash is not typed yet
    comment = _comment(line, min(start, len(line)))
    found = _KEY.match(line, start)
    if found is None or found.end() > comment:
        return LineShape(dashes, start, "", start, start, line[start:comment].rstrip(), comment)
    value_start = found.end()
    while value_start < comment and line[value_start].isspace():
        value_start += 1
    key = found[1].strip("'\"") if found[1][0] in "'\"" else found[1]
    return LineShape(dashes, start, key, found.end(1), value_start, line[value_start:comment].rstrip(), comment)


def _comment(line: str, start: int) -> int:
    """Return where the comment of a line begins; a '#' in quotes is none."""
    if "#" not in line:
        return len(line)
    quote = ""
    for index in range(start, len(line)):
        char = line[index]
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"" and (index == start or line[index - 1] in " \t[{,:("):
            quote = char
        elif char == "#" and (index == 0 or line[index - 1].isspace()):
            return index
    return len(line)


def where(lines: Sequence[str], line: int, col: int) -> EditorPosition | None:
    """Return what is at a position; None in a comment and in the blanks before a line's text.

    Args:
        lines: of the file.
        line: 0-based; one beyond the last line is an empty line.
        col: 0-based, in characters.
    """
    text = lines[line] if 0 <= line < len(lines) else ""
    col = min(col, len(text))
    here = shape(text)
    if not text.strip():
        here = LineShape((), col, "", col, col, "", len(text))
    if col > here.comment and here.comment < len(text):
        return None
    around = _Around(lines)
    flow = around.flow_above(line, col)
    if flow is not None:
        return flow
    if here.dashes and not here.key and not here.value and col <= here.dashes[-1]:
        return None
    if col < here.start and text.strip() and not (here.dashes and col > here.dashes[-1]):
        return None
    if here.key and col > here.key_end:
        return around.value(line, col, here)
    return around.first_word(line, col, here)


class _Around:
    """Looks at the lines around a position."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = lines

    def _shape(self, line: int) -> LineShape | None:
        """Return the shape of a line; None if it is blank or a comment."""
        text = self.lines[line]
        stripped = text.lstrip()
        return shape(text) if stripped and not stripped.startswith("#") else None

    # --- the mappings and lists above --------------------------------------------------------------------------

    def levels(self, line: int, column: int, dashes: tuple[int, ...], *, mapping: bool) -> list[Level]:
        """Return the levels around the text that begins at `column` of a line, the outermost first.

        Args:
            line: the line.
            column: where its text begins.
            dashes: columns of the dashes before it.
            mapping: whether the text is a key.
        """
        found: list[Level] = []
        at, kind = column, "map" if mapping else "scalar"
        if mapping:
            found.append(Level("map", line=line))
            self._below(found[0], line, column)
        for dash in reversed(dashes):
            found.append(Level("list", line=line))
            at, kind = dash, "list"
        for above in range(min(line, len(self.lines)) - 1, -1, -1):
            text = self.lines[above]
            if len(text) - len(text.lstrip()) > at:
                continue
            seen = self._shape(above)
            if seen is None:
                continue
            at, kind = self._climb(found, above, seen, at, kind)
            if at == 0 and kind == "map" and not seen.dashes:
                self._gather(found[-1], above)
                break
        return found[::-1]

    def _climb(self, found: list[Level], above: int, seen: LineShape, at: int, kind: str) -> tuple[int, str]:
        """Take account of a line above; return the column and kind of the collection reached."""
        dashes = list(seen.dashes)
        if kind == "map" and seen.key and seen.start == at:
            _note(found[-1], seen)
        elif kind == "list" and at in dashes:
            dashes = [dash for dash in dashes if dash < at]
            if not dashes:
                return at, kind
            found.append(Level("list", line=above))
            at = dashes.pop()
        elif seen.key and (seen.start < at or (kind == "list" and seen.start == at and not dashes)):
            found.append(Level("map", under=seen.key, line=above))
            _note(found[-1], seen)
            self._below(found[-1], above, seen.start)
            at, kind = seen.start, "map"
        elif kind != "list" and dashes and dashes[-1] < at and not seen.key and seen.start >= at:
            pass  # a dash alone, the mapping begins below it
        elif kind != "list" and dashes and dashes[-1] < at <= seen.start and seen.key:
            if kind == "map":
                _note(found[-1], seen)
        else:
            return at, kind
        for dash in reversed(dashes):
            if dash < at:
                found.append(Level("list", line=above))
                at, kind = dash, "list"
        if kind == "map" and found:
            found[-1].line = above
        return at, kind

    def _below(self, level: Level, line: int, column: int) -> None:
        """Note the keys of a mapping that stand below a line."""
        for below in range(line + 1, len(self.lines)):
            text = self.lines[below]
            stripped = text.lstrip()
            indent = len(text) - len(stripped)
            if indent > column or not stripped or stripped[0] in "#-":
                if stripped and indent < column and stripped[0] == "-":
                    return
                continue
            if indent < column:
                return
            seen = shape(text)
            if seen.key and seen.start == column:
                _note(level, seen)

    def _gather(self, level: Level, line: int) -> None:
        """Note the keys at the left margin above a line."""
        for above in range(line - 1, -1, -1):
            text = self.lines[above]
            if text and text[0] not in " #-\t":
                _note(level, shape(text))

    # --- positions ----------------------------------------------------------------------------------------------

    def value(self, line: int, col: int, here: LineShape) -> EditorPosition | None:
        """Return the place of a position behind a key and its colon."""
        levels = self.levels(line, here.start, here.dashes, mapping=True)
        levels[-1].under = here.key
        _note(levels[-1], here)
        start = max(here.value_start, here.key_end + 1)
        if here.value[:1] in ("{", "["):
            return self._in_flow(levels, line, here.value_start, line, col, column=here.start)
        return _scalar(levels, line, col, start, here.value, here.start)

    def first_word(self, line: int, col: int, here: LineShape) -> EditorPosition | None:
        """Return the place of a position in the first word of a line."""
        if not here.key and here.value[:1] in ("{", "["):
            levels = self.levels(line, here.start, here.dashes, mapping=False)
            return self._in_flow(levels, line, here.start, line, col, column=here.start)
        parent = None if here.dashes else self._scalar_above(line, here.start)
        if parent is not None:
            above, seen = parent
            levels = self.levels(above, seen.start, seen.dashes, mapping=bool(seen.key))
            if seen.key:
                levels[-1].under = seen.key
                _note(levels[-1], seen)
            return _scalar(levels, line, col, here.start, self.lines[line][here.start :].rstrip(), seen.start)
        text = here.key or here.value
        levels = self.levels(line, here.start, here.dashes, mapping=True)
        if here.key:
            levels[-1].under = here.key
            _note(levels[-1], here)
            quoted = self.lines[line][here.start] in "'\""
            start = here.start + quoted
            offset = min(max(0, col - start), len(text))
            return EditorPosition(
                tuple(levels), "key", text, line, start, offset, colon=True, quoted=quoted, column=here.start
            )
        if not here.value and not here.dashes and self._at_dash(line, here.start):
            levels = self.levels(line, here.start, (here.start,), mapping=False)
            return EditorPosition(tuple(levels), "item", "", line, col, 0, column=here.start)
        quoted = text[:1] in ("'", '"') and bool(text)
        text = text[1:].removesuffix(text[0]) if quoted else text
        start = here.start + quoted
        offset = min(max(0, col - start), len(text))
        return EditorPosition(tuple(levels), "word", text, line, start, offset, quoted=quoted, column=here.start)

    def _scalar_above(self, line: int, column: int) -> tuple[int, LineShape] | None:
        """Return the line on which the scalar begins that goes on here (a block, or text of several lines)."""
        at = column
        for above in range(line - 1, -1, -1):
            text = self.lines[above]
            if not text.strip() or len(text) - len(text.lstrip()) >= at:
                continue
            seen = shape(text)
            begins = seen.start if seen.key else (seen.dashes[-1] if seen.dashes else seen.start)
            if _BLOCK.search(seen.value) and begins < column:
                return above, seen
            if not seen.key and not seen.dashes:
                at = len(text) - len(text.lstrip())
                continue
            if begins >= column:
                at = min(at, begins)
                if not seen.key:
                    continue
                return None
            goes_on = seen.value and seen.value[0] not in "{[" and self.lines[line].strip()
            plain = seen.value[:1] not in ("'", '"') or seen.value[:1] != seen.value[-1:] or len(seen.value) == 1
            return (above, seen) if goes_on and plain and (seen.key or seen.dashes) else None
        return None

    def _at_dash(self, line: int, column: int) -> bool:
        """Return whether the items of a list around here have their dashes at this column."""
        for above in range(line - 1, -1, -1):
            text = self.lines[above]
            indent = len(text) - len(text.lstrip())
            if not text.strip() or indent > column:
                continue
            seen = shape(text)
            return column in seen.dashes
        return False

    # --- flow style -----------------------------------------------------------------------------------------------

    def flow_above(self, line: int, col: int) -> EditorPosition | None:
        """Return the place of a position in a flow collection that begins on a line above; None if there is none."""
        at = len(self.lines[line]) - len(self.lines[line].lstrip()) if line < len(self.lines) else col
        if line < len(self.lines) and not self.lines[line].strip():
            at = col
        for above in range(line - 1, max(-1, line - _MOST_FLOW_LINES), -1):
            text = self.lines[above]
            indent = len(text) - len(text.lstrip())
            if not text.strip() or indent >= at:
                continue
            at = indent
            seen = shape(text)
            if seen.value[:1] in ("{", "["):
                mapping = bool(seen.key)
                levels = self.levels(above, seen.start, seen.dashes, mapping=mapping)
                if mapping:
                    levels[-1].under = seen.key
                    _note(levels[-1], seen)
                return self._in_flow(levels, above, seen.value_start, line, col, column=seen.start, open_only=True)
            if seen.key:
                return None
        return None

    def _in_flow(
        self, levels: list[Level], first: int, start: int, line: int, col: int, *, column: int, open_only: bool = False
    ) -> EditorPosition | None:
        """Return the place of a position in the flow collection that begins at `start` of the line `first`."""
        rows = [self.lines[first][start:], *self.lines[first + 1 : first + _MOST_FLOW_LINES]]
        offset = col - start if line == first else sum(len(row) + 1 for row in rows[: line - first]) + col
        if offset < 0:
            return None
        flow: FlowPosition | None = read_flow("\n".join(rows), offset)
        if flow is None or (open_only and flow.closed):
            return None
        if flow.closed:
            return None
        for level in flow.levels:
            levels.append(Level(level.kind, level.keys, level.under, first))
        begins = flow.start - offset + col
        return EditorPosition(
            tuple(levels),
            flow.slot,
            flow.text,
            line,
            begins,
            offset - flow.start,
            flow.colon,
            flow.quoted,
            True,
            column,
        )


def _note(level: Level, seen: LineShape) -> None:
    if seen.key:
        plain = seen.value if seen.value[:1] not in ("{", "[") else ""
        if plain[:1] in ("'", '"') and plain[-1:] == plain[:1] and len(plain) > 1:
            plain = plain[1:-1]
        level.keys.setdefault(seen.key, plain)


def _scalar(levels: list[Level], line: int, col: int, start: int, text: str, column: int) -> EditorPosition | None:
    quoted = text[:1] in ("'", '"') and bool(text)
    if quoted:
        inner = text[1:]
        text = inner[:-1] if inner.endswith(text[0]) else inner
        start += 1
    if not text:
        start = max(start, col) if not quoted else start
    offset = col - start
    if offset > len(text):
        if not text or quoted:
            return None if quoted else EditorPosition(tuple(levels), "value", "", line, col, 0, column=column)
        return EditorPosition(
            tuple(levels), "value", text + " " * (offset - len(text)), line, start, offset, column=column
        )
    return EditorPosition(tuple(levels), "value", text, line, start, max(0, offset), quoted=quoted, column=column)
