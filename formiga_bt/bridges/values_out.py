"""Values of the model as text: as the author wrote them, and as ports of BT.CPP take them.

Called by `steps_out` and `btcpp_out`. A list or mapping has no source text in the model; it is found again in the file.
"""

import re
from collections.abc import Mapping
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.bridges.scripts import ScriptNames, number
from formiga_bt.bridges.yaml_text import flow
from formiga_bt.lang.model import Expr
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse

_NAME: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_FIELD: Final = re.compile(r"([A-Za-z_]\w*)\.([A-Za-z_]\w*)", re.ASCII)
QUANTITIES: Final = frozenset({"number", "int", "percent", "distance", "duration", "speed", "angle", "mass"})
"""Types whose values are numbers on the blackboard, in SI units."""


class Texts:
    """Finds the source text of expressions."""

    def __init__(self, sources: Mapping[str, str]) -> None:
        self.lines = {file: text.splitlines() for file, text in sources.items()}
        self.sources = sources
        self.nodes: dict[str, dict[tuple[int, int], Node]] = {}

    def is_literal(self, expr: Expr) -> bool:
        """Return whether an expression was written as a literal, not in `${}`."""
        return expr.is_const and not self._before(expr.mark).endswith("${")

    def structure(self, expr: Expr) -> "str | list[object] | dict[str, object]":
        """Return a value that is a list or a mapping as such, any other like `value`."""
        node = self._node(expr.mark)
        return plain(node) if node is not None else self.value(expr)

    def value(self, expr: Expr) -> str:
        """Return a value as YAML has it: `60 m`, `${target}`, `Alarm ${x}`, `{east: 10 m, north: -4 m}`; "" = not found."""
        node = self._node(expr.mark)
        if node is not None or not expr.source:
            return flow(plain(node)) if node is not None else ""
        if self.is_literal(expr) or "${" in expr.source:
            return expr.source
        return "${" + expr.source + "}"

    def port(self, expr: Expr, names: ScriptNames) -> str:
        """Return a value as a port has it: `{target}` for a name, else like `value`; "" = it cannot be written."""
        text = self.value(expr)
        if text.startswith("${") and text.endswith("}") and text.count("${") == 1:
            entry = self.entry(expr.source, names)
            return "{" + entry + "}" if entry else text
        if text.startswith("{") and text.endswith("}"):
            if not expr.source:
                return "${" + text + "}"  # a pair of braces is the name of an entry in BT.CPP
            return "${'" + text + "'}" if "'" not in text else ""
        return text

    def number_port(self, expr: Expr, names: ScriptNames) -> str:
        """Return a value as an entry of the blackboard has it: numbers in SI units, else like `port`."""
        if self.is_literal(expr) and expr.type.name in QUANTITIES:
            return number(float(expr.const))
        return self.port(expr, names)

    def entry(self, source: str, names: ScriptNames) -> str:
        """Return the blackboard entry that an expression is, or ""."""
        source = source.strip()
        if _NAME.fullmatch(source):
            return "" if source in ("base", "task", "now", "site", "error", "abort", "true", "false") else source
        found = _FIELD.fullmatch(source)
        if found and found[1] in names.records and f"{found[1]}_{found[2]}" not in names.taken:
            return f"{found[1]}_{found[2]}"
        return ""

    def _before(self, mark: Mark) -> str:
        lines = self.lines.get(mark.file, [])
        return lines[mark.line - 1][: mark.col - 1].rstrip() if 1 <= mark.line <= len(lines) else ""

    def _node(self, mark: Mark) -> Node | None:
        if mark.file not in self.nodes:
            root, _ = parse(self.sources.get(mark.file, ""), mark.file)
            self.nodes[mark.file] = _by_place(root) if root is not None else {}
        return self.nodes[mark.file].get((mark.line, mark.col))


def _by_place(root: Node) -> dict[tuple[int, int], Node]:
    found: dict[tuple[int, int], Node] = {}
    stack = [root]
    while stack:
        node = stack.pop()
        if isinstance(node, Mapping_):
            stack += [entry.value for entry in node.entries]
        elif isinstance(node, Listing):
            stack += node.items
        if not isinstance(node, Scalar):
            found.setdefault((node.mark.line, node.mark.col), node)
    return found


def plain(node: Node) -> "str | list[object] | dict[str, object]":
    """Return a node as text, lists and mappings."""
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, Listing):
        return [plain(item) for item in node.items]
    return {entry.key.text: plain(entry.value) for entry in node.entries}
