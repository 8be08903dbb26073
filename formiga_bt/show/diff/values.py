"""What is compared: the value of a field as a flat row of atoms, in which equal meanings are equal, and its words.

Units, spaces, quotes and the order of keys leave the row as it is: `60 m` and `0.06 km` are one atom. Names are atoms of
their own, so that a renamed role can be renamed in a row.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity, parse_quantity
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.tokens import ExprSyntax, Token, parse_expression
from formiga_bt.lang.model import Expr
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse
from formiga_bt.lang.types import AgentRef

Atom = tuple[str, str]
"""Sort and text: (`name`, `drone`), (`subtree`, `Fetch`), (`distance`, `60`), (`text`, ...), (`sign`, `+`)."""

NAME: Final = "name"
SUBTREE: Final = "subtree"
QUANTITIES: Final = ("duration", "distance", "percent", "angle", "speed", "mass")


@dataclass(frozen=True, slots=True)
class FieldValue:
    """What a field has: what is compared, and how people read it."""

    atoms: tuple[Atom, ...]
    words: str

    def renamed(self, new: Callable[[Atom], Atom]) -> "FieldValue":
        """Return the value with other names."""
        atoms = tuple([new(atom) if atom[0] in (NAME, SUBTREE) else atom for atom in self.atoms])
        return self if atoms == self.atoms else FieldValue(atoms, self.words)


def text(words: object) -> FieldValue:
    """Return the value of a plain word or text."""
    return FieldValue((("text", str(words)),), str(words))


def name(of: str) -> FieldValue:
    """Return the value of a name."""
    return FieldValue(((NAME, of),), of)


def defining(of: str, joint: str, value: FieldValue) -> FieldValue:
    """Return the value of a field that defines or sets a name."""
    return FieldValue(((NAME, of), ("sign", joint), *value.atoms), value.words)


def names(of: Iterable[str]) -> FieldValue:
    """Return the value of several names in an order."""
    listed = tuple(of)
    return FieldValue(tuple([(NAME, one) for one in listed]), ", ".join(listed))


def source_of(expr: Expr) -> str:
    """Return an expression as the author wrote it, on one line and without `${ }` around the whole."""
    written = " ".join(expr.source.split())
    whole = written.startswith("${") and written.endswith("}") and "${" not in written[2:]
    return written[2:-1].strip() if whole else written


def value_of(expr: Expr, texts: Mapping[str, str]) -> FieldValue:
    """Return what an expression says.

    Args:
        expr: of a checked task.
        texts: of the files, for points and lists, which have no source of their own.
    """
    if expr.is_const:
        return FieldValue(tuple(_const(expr.const, expr.type.name)), source_of(expr) or _const_words(expr.const))
    if expr.source.strip():
        return FieldValue(tuple(_source(expr.source)), source_of(expr))
    node = _node_at(expr.mark, texts.get(expr.mark.file, ""))
    return FieldValue(tuple(_node(node)), " ".join(_node_words(node).split())) if node is not None else text("")


def _const(value: Any, type_: str) -> Iterator[Atom]:
    match value:
        case bool() | str():
            yield "text", str(value).lower() if isinstance(value, bool) else value
        case int() | float():
            yield (type_ if type_ in QUANTITIES else "number"), f"{value + 0.0:.12g}"
        case AgentRef():
            yield "text", value.id
        case tuple():
            yield "sign", "["
            for one in value:
                yield from _const(one, "")
                yield "sign", ","
            yield "sign", "]"
        case _:
            yield "value", repr(value)


def _const_words(value: Any) -> str:
    match value:
        case tuple():
            return f"[{', '.join(_const_words(one) for one in value)}]"
        case float():
            return format_quantity("distance", value)
        case AgentRef():
            return value.id
    east, north, up = (getattr(value, key, None) for key in ("east_m", "north_m", "up_m"))
    if east is None:
        corners = getattr(value, "corners", None)
        return f"{len(corners)} corners" if corners is not None else str(value)
    return f"{{east: {east:g} m, north: {north:g} m" + (f", height: {up:g} m}}" if up is not None else "}")


def _source(written: str) -> Iterator[Atom]:
    """Iterate over the atoms of `${expr}`, of a text with holes, or of a condition."""
    spans = holes(written) if "${" in written else []
    if not isinstance(spans, list) or not spans:
        yield from _expression(written)
        return
    if spans == [(0, len(written))] or (len(spans) == 1 and written.strip() == written[slice(*spans[0])]):
        yield from _expression(written.strip()[2:-1])
        return
    at = 0
    for start, end in spans:
        yield "text", " ".join(written[at:start].split())
        yield from _expression(written[start + 2 : end - 1])
        at = end
    yield "text", " ".join(written[at:].split())


def _expression(written: str) -> Iterator[Atom]:
    try:
        tokens = parse_expression(written.strip()).tokens
    except ExprSyntax:
        yield "text", " ".join(written.split())
        return
    for at, token in enumerate(tokens):
        yield _atom(token, tokens[at - 1].text if at else "", tokens[at + 1].text if at + 1 < len(tokens) else "")


def _atom(token: Token, before: str, after: str) -> Atom:
    match token.kind:
        case "name":
            return (NAME if before != "." and after not in ("(", "=") else "sign"), token.text
        case "quantity":
            return token.unit_type, f"{float(token.value):.12g}"
        case "number":
            return "number", f"{float(token.value):.12g}"
        case "text":
            return "text", str(token.value)
        case "bool":
            return "text", str(token.value).lower()
    return "sign", token.text


def _node_at(mark: Mark, written: str) -> Node | None:
    """Return the YAML that stands at a place."""
    lines = written.splitlines()[mark.line - 1 : max(mark.line, mark.end_line)]
    if not lines:
        return None
    if mark.end_col:
        lines[-1] = lines[-1][: mark.end_col - 1]
    lines[0] = " " * (mark.col - 1) + lines[0][mark.col - 1 :]
    return parse("\n".join(lines), mark.file)[0]


def _node(node: Node) -> Iterator[Atom]:
    match node:
        case Scalar():
            quantity = parse_quantity(node.text)
            if "${" in node.text:
                yield from _source(node.text)
            elif quantity is not None:
                yield quantity[0], f"{quantity[1]:.12g}"
            else:
                yield "text", node.text
        case Mapping_():
            for entry in sorted(node.entries, key=lambda one: one.key.text):
                yield "sign", entry.key.text
                yield from _node(entry.value)
        case Listing():
            yield "sign", "["
            for item in node.items:
                yield from _node(item)
                yield "sign", ","
            yield "sign", "]"


def _node_words(node: Node) -> str:
    match node:
        case Scalar():
            return node.text
        case Mapping_():
            return f"{{{', '.join(f'{entry.key.text}: {_node_words(entry.value)}' for entry in node.entries)}}}"
        case Listing():
            return f"[{', '.join(_node_words(item) for item in node.items)}]"
