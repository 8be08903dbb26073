"""The canonical layout of a file: block style, two spaces a level, comments kept where they belong.

What stays as the author wrote it: the order of keys, words and their quotes, comments, single blank lines, the columns of
comments at the ends of lines, and lists and mappings in `[ ]` or `{ }` that fit one line. Steps, and mappings with `${}` that
need quotes there, are written out. Works on any file of the language: tasks, libraries, sites, catalogues, scenarios. Called
by `formiga fmt`. The result is parsed again and compared: a file whose meaning would change is a bug, never written.
"""

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.units import parse_quantity
from formiga_bt.lang.kinds import KINDS, LIBRARY, MODIFIERS, SUBTREE, TASK
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse
from formiga_bt.lang.text.layout import Layout, LayoutItem, read_layout
from formiga_bt.lang.text.reading import IDENTIFIER

WIDTH: Final = 128
"""Columns that a list or mapping in `[ ]` or `{ }` may reach."""

_STEPS: Final = frozenset(
    option.name
    for options in (TASK, LIBRARY, SUBTREE, MODIFIERS, *(kind.options for kind in KINDS.values()))
    for option in options
    if option.form == "steps"
) | {kind.name for kind in KINDS.values() if kind.form == "steps"}
"""Keys whose value is a list of steps."""

_DECLARED: Final = ("params", "fields")
"""Sections whose entries may hold `${}` in flow style."""

_NUMBER: Final = re.compile(r"[+-]?[\d.]+([eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class Formatted:
    """The canonical text, or None with the reasons why the file cannot be read."""

    text: str | None
    diagnostics: list[Diagnostic]


def format_text(text: str, file: str) -> Formatted:
    """Return the canonical text of a file.

    Args:
        text: of the file.
        file: its name in marks.
    """
    source = text.removeprefix("\ufeff")
    root, found = parse(text, file)
    if found:
        return Formatted(None, found)
    if root is None or isinstance(root, Scalar):
        return Formatted(text, [])
    layout = read_layout(source, root)
    writer = _Writer(layout)
    lines = writer.flow_root(root) or writer.block(layout.roots, 0, (), first=True)
    while lines and not lines[-1]:
        lines.pop()
    result = "\n".join(lines) + "\n"
    again = parse(result, file)[0]
    if again is None or not _same(root, again) or _comments(layout) != _comments(read_layout(result, again)):
        raise AssertionError(f"formatting {file} would change it")
    return Formatted(result, [])


class _Writer:
    """Writes elements as lines."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout

    def flow_root(self, root: Node) -> list[str]:
        """Return the one line of an empty file of `{}` or `[]`."""
        return [] if _size(root) else [*self._layout.first, "{}" if isinstance(root, Mapping_) else "[]"]

    def block(
        self, elements: list[LayoutItem], indent: int, path: tuple[str, ...], *, first: bool = False
    ) -> list[str]:
        """Return the lines of the entries or items of one collection."""
        lines: list[str] = []
        for index, one in enumerate(elements):
            before = self._before(one)
            lines += _comment_lines(before, indent, fresh=index == 0, at_top=first and index == 0)
            lines += self._element(one, indent, path)
            lines += _comment_lines(one.after, indent)
        return lines

    def _before(self, one: LayoutItem) -> list[str]:
        """Return the comments above an element: of an item, also those above its first key."""
        if one.key is None and one.children and not self._stays(one, 0, ()):
            inner = one.children[0]
            more, inner.before = inner.before, []
            return [*one.before, *more]
        return one.before

    def _element(self, one: LayoutItem, indent: int, path: tuple[str, ...]) -> list[str]:
        pad = " " * indent
        if one.key is not None:
            path = (*path, one.key.text)
            lines = self._value(one, indent, path)
            head = f"{pad}{self._key(one.key)}:"
            lines[0] = head + (f" {lines[0]}" if lines[0] else "")
        elif isinstance(one.node, Scalar) or self._stays(one, indent + 2, (*path, "-")) or not one.children:
            lines = self._value(one, indent, (*path, "-"))
            lines[0] = f"{pad}-" + (f" {lines[0]}" if lines[0] else "")
        else:
            lines = self.block(one.children, indent + 2, (*path, "-"))
            lines[0] = f"{pad}- {lines[0][indent + 2 :]}"
        if one.trailing:
            lines[0] = lines[0].ljust(max(len(lines[0]) + 2, one.trailing_col - 1)) + one.trailing
        return lines

    def _value(self, one: LayoutItem, indent: int, path: tuple[str, ...]) -> list[str]:
        """Return the lines of a value; the first is what follows `key:` or `-`."""
        node = one.node
        if isinstance(node, Scalar):
            return self._block_scalar(node, indent + 2) if node.block else self._scalar(node, indent + 2)
        if not _size(node):
            return ["{}" if isinstance(node, Mapping_) else "[]"]
        if self._stays(one, indent, path):
            return [self._flow(node)]
        return ["", *self.block(one.children, indent + 2, path)]

    # --- flow style ----------------------------------------------------------------------------------------------

    def _stays(self, one: LayoutItem, indent: int, path: tuple[str, ...]) -> bool:
        """Return whether a collection in `[ ]` or `{ }` stays as it is, on one line."""
        node = one.node
        if isinstance(node, Scalar) or not self._is_flow(node) or self._layout.has_comment_inside(node):
            return False
        if any(_has_after(child) for child in one.children):
            return False
        if path and (path[-1] in _STEPS or (path[-1] == "-" and path[-2:-1] and path[-2] in _STEPS)):
            return False
        if (
            "cases" in path[-2:]
            or (path[-1:] == ("-",) and "cases" in path[-3:-1])
            or _has_steps(node)
            or _has_gap(node)
        ):
            return False
        if _has_holes(node) and not any(key in _DECLARED for key in path):
            return False
        head = len(self._key(one.key)) + 2 if one.key is not None else 2
        return indent + head + len(self._flow(node)) <= WIDTH

    def _is_flow(self, node: Node) -> bool:
        return self._layout.lines[node.mark.line - 1][node.mark.col - 1 : node.mark.col] in ("{", "[")

    def _flow(self, node: Node) -> str:
        if isinstance(node, Scalar):
            return self._word(node)
        if isinstance(node, Listing):
            return f"[{', '.join(map(self._item, node.items))}]"
        return f"{{{self._pairs(node)}}}"

    def _item(self, node: Node) -> str:
        """Return an item of a flow list; a name with a number has no braces, as in `[lift_1, dock_bay: 2]`."""
        if isinstance(node, Mapping_) and len(node.entries) == 1:
            number = node.entries[0].value
            if isinstance(number, Scalar) and number.text.isdigit():
                return self._pairs(node)
        return self._flow(node)

    def _pairs(self, node: Mapping_) -> str:
        return ", ".join(f"{self._key(e.key)}: {self._flow(e.value)}" for e in node.entries)

    # --- scalars -------------------------------------------------------------------------------------------------

    def _key(self, at: Scalar) -> str:
        return at.text if IDENTIFIER.match(at.text) else self._word(at)

    def _word(self, at: Scalar) -> str:
        """Return a scalar on one line, with the quotes that it has."""
        if at.block or at.mark.line != at.mark.end_line:
            return json.dumps(at.text, ensure_ascii=False)
        raw = self._layout.raw(at)
        plain = raw[1:-1]
        return f'"{plain}"' if raw[:1] == "'" and not re.search(r"[\"'\\]", plain) else raw

    def _scalar(self, at: Scalar, indent: int) -> list[str]:
        text = at.text
        if at.quoted and text.startswith("${") and text.endswith("}") and _plain(text):
            return [text]
        if at.mark.line == at.mark.end_line:
            return [self._word(at)]
        one = text if not at.quoted and _plain(text) else json.dumps(text, ensure_ascii=False)
        if indent + len(one) <= 100 or "\n" in text or text != " ".join(text.split()):
            return [one]
        lines = [""]
        for word in text.split(" "):
            if lines[-1] and indent + len(lines[-1]) + len(word) >= 100:
                lines.append("")
            lines[-1] += f" {word}" if lines[-1] else word
        return [">-", *(" " * indent + line for line in lines)]

    def _block_scalar(self, at: Scalar, indent: int) -> list[str]:
        header, first, last = self._layout.block_of(at)
        content = self._layout.lines[first - 1 : last]
        shown = next((line for line in content if line.strip()), "")
        text = next((line for line in at.text.split("\n") if line.strip()), "")
        cut = _margin(shown) - _margin(text)
        style = re.sub(r"\d", "", header) + ("2" if at.text.lstrip("\n").startswith(" ") else "")
        return [style, *(" " * indent + line[cut:] if len(line) > cut else "" for line in content)]


def _comment_lines(said: Iterable[str], indent: int, *, fresh: bool = False, at_top: bool = False) -> list[str]:
    """Return comments at an indentation; several blank lines are one, and a block does not begin with one."""
    lines: list[str] = []
    for text in said:
        if text:
            lines.append(" " * indent + text)
        elif (lines and lines[-1]) or not (lines or fresh or at_top):
            lines.append("")
    return lines


def _margin(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _plain(text: str) -> bool:
    """Return whether a text can stand without quotes in block style."""
    node, found = parse(f"k: {text}\n", "")
    value = node.entries[0].value if isinstance(node, Mapping_) and len(node.entries) == 1 else None
    return not found and isinstance(value, Scalar) and value.text == text and not value.quoted and not value.block


def _size(node: Node) -> int:
    return len(node.entries) if isinstance(node, Mapping_) else len(node.items) if isinstance(node, Listing) else 1


def _inside(node: Node) -> Iterable[Node]:
    if isinstance(node, Mapping_):
        return [entry.value for entry in node.entries]
    return node.items if isinstance(node, Listing) else ()


def _has_holes(node: Node) -> bool:
    return "${" in node.text if isinstance(node, Scalar) else any(map(_has_holes, _inside(node)))


def _has_gap(node: Node) -> bool:
    """Return whether a key has nothing after it, which flow style cannot write safely."""
    if isinstance(node, Scalar):
        return not node.text and not node.quoted
    return any(map(_has_gap, _inside(node)))


def _has_after(one: LayoutItem) -> bool:
    """Return whether a comment belongs behind an element or one inside it."""
    return bool(one.after) or any(_has_after(child) for child in one.children)


def _has_steps(node: Node) -> bool:
    own = isinstance(node, Mapping_) and any(
        e.key.text in _STEPS and not isinstance(e.value, Scalar) for e in node.entries
    )
    return own or any(map(_has_steps, _inside(node)))


def _comments(layout: Layout) -> list[str]:
    return sorted(layout.lines[line - 1][col - 1 :].rstrip() for line, col in layout.comments.items())


def _same(a: Node, b: Node) -> bool:
    """Return whether two documents say the same: structure, order, words, and what is a text because of its quotes."""
    if isinstance(a, Scalar):
        return isinstance(b, Scalar) and a.text == b.text and (_as_text(a) == _as_text(b) or not _special(a.text))
    if isinstance(a, Listing):
        return isinstance(b, Listing) and len(a.items) == len(b.items) and all(map(_same, a.items, b.items))
    if not isinstance(b, Mapping_) or [e.key.text for e in a.entries] != [e.key.text for e in b.entries]:
        return False
    return all(_same(x.value, y.value) for x, y in zip(a.entries, b.entries, strict=True))


def _as_text(at: Scalar) -> bool:
    return at.quoted or at.block


def _special(text: str) -> bool:
    """Return whether quotes make a text of what would be a value without them."""
    word = text.strip()
    return not word or word in ("true", "false") or parse_quantity(word) is not None or bool(_NUMBER.fullmatch(word))
