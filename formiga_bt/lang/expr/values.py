"""YAML values read by the type that is due: plain text, `${expr}`, `{east: 10 m, north: -4 m}`, lists.

Called through `expressions.compile_value`; plain text goes on to `literals`, what is in `${}` to `compiling`.
"""

import re
from itertools import pairwise
from typing import Any, Final

from formiga_bt.base.diagnostics import Diagnostic, Fix
from formiga_bt.base.geo import Frame, Place, Position, Region, mm
from formiga_bt.lang.expr.at_run import named
from formiga_bt.lang.expr.compiling import compile_expr, poison
from formiga_bt.lang.expr.interpolation import holes, joined, shown
from formiga_bt.lang.expr.literals import EXAMPLES, Result, due, literal_expr, read_literal, refuse
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.tokens import is_readable
from formiga_bt.lang.expr.typed import did_you_mean, sure_of
from formiga_bt.lang.expr.typing_rules import fits, in_words, join, literal
from formiga_bt.lang.model import Dependency, Env, Expr
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import quoted_list
from formiga_bt.lang.types import ANY, DISTANCE, NUMBER, PLACE, POSITION, TEXT, Type, list_of, record_of


def read_value(node: Node, scope: Scope, expected: Type, *, what: str = "", optional: bool = False) -> Result:
    """Compile a value of an expected type; see `expressions.compile_value`."""
    if isinstance(node, Listing):
        return _listing(node, scope, expected, what)
    if isinstance(node, Mapping_):
        return _mapping(node, scope, expected, what)
    if "${" in node.text:
        return _with_holes(node, scope, expected, what, optional)
    return read_literal(node, scope, expected, what)


def read_words(node: Node, scope: Scope, what: str) -> Result:
    """Compile a text that people read; see `expressions.compile_words`."""
    spans = holes(node.text) if isinstance(node, Scalar) else 0
    if isinstance(node, Scalar) and isinstance(spans, list) and spans:
        return _interpolation(node, spans, scope)
    return read_value(node, scope, TEXT, what=what)


def _with_holes(node: Scalar, scope: Scope, expected: Type, what: str, optional: bool) -> Result:
    text = node.text
    spans = holes(text)
    if isinstance(spans, int):
        mark = node.mark_at(spans, spans + 2)
        return poison(node, text), [Diagnostic("E009", mark, "'${' is never closed", "close it with }")]
    if spans == [(0, len(text))]:
        return compile_expr(text[2:-1], node, 2, scope, expected, what=what, optional=optional)
    if not fits(TEXT, expected):
        start, end = spans[0]
        said = f"{due(what, expected)}; text with ${{...}} in it is a text"
        return poison(node, text), [Diagnostic("E013", node.mark_at(start, end), said, _one_hole(text, spans))]
    return _interpolation(node, spans, scope)


def _one_hole(text: str, spans: list[tuple[int, int]]) -> str:
    if len(spans) == 1 and not re.search(r"\w", text[: spans[0][0]] + text[spans[0][1] :]):
        return f"write {text[spans[0][0] : spans[0][1]]}"
    return "write the whole value as one ${...}"


def _interpolation(node: Scalar, spans: list[tuple[int, int]], scope: Scope) -> Result:
    text = node.text
    found: list[Diagnostic] = []
    pieces: list[str | Expr] = []
    at = 0
    for start, end in spans:
        expr, problems = compile_expr(text[start + 2 : end - 1], node, start + 2, scope, None)
        found += problems
        pieces += [text[at:start], expr]
        at = end
    pieces.append(text[at:])
    exprs = [piece for piece in pieces if isinstance(piece, Expr)]
    reads = tuple(dict.fromkeys(read for expr in exprs for read in expr.reads))
    if found:
        return poison(node, text, reads), found

    def run(env: Env) -> str:
        parts = [piece if isinstance(piece, str) else shown(piece.run(env), piece.type, env) for piece in pieces]
        return joined(parts)

    return Expr(text, TEXT, node.mark, named(run, text, node.mark), reads), []


_POINT_KEYS: Final = ("lat", "lng", "east", "north", "height")


def _mapping(node: Mapping_, scope: Scope, expected: Type, what: str) -> Result:
    if expected.name == "any" and any(entry.key.text in ("lat", "east") for entry in node.entries):
        expected = POSITION if node.get("height") else PLACE
    if expected.name in ("record", "any"):
        return _record(node, scope, expected, what)
    if expected.name not in ("place", "position"):
        return refuse(node, "E013", f"{due(what, expected)}, this is a mapping", EXAMPLES.get(expected.name, ""))
    problem = _point_keys(node, expected)
    if problem is not None:
        return poison(node), [problem]
    degrees = node.get("lat") is not None
    first, second = ("lat", "lng") if degrees else ("east", "north")
    found: list[Diagnostic] = []
    parts: list[Expr] = []
    for key in (first, second, "height")[: 3 if expected == POSITION else 2]:
        entry = node.get(key)
        assert entry is not None, "_point_keys found every key"
        type_ = NUMBER if key in ("lat", "lng") else DISTANCE
        part, problems = read_value(entry.value, scope, type_, what=key)
        found += problems or _out_of_range(key, part, entry)
        parts.append(part)
    reads = tuple(dict.fromkeys(read for part in parts for read in part.reads))
    if found:
        return poison(node, "", reads), found
    return _point(node, expected, parts, reads, scope, degrees=degrees), []


def _record(node: Mapping_, scope: Scope, expected: Type, what: str) -> Result:
    """Read a record field by field; where none is due, its fields are those that are written."""
    found: list[Diagnostic] = []
    parts: dict[str, Expr] = {}
    for entry in node.entries:
        name = entry.key.text
        if expected.name == "record" and name not in expected.fields:
            near = sure_of(name, expected.fields)
            said = f"{what or 'the record'} has no field '{name}'{did_you_mean(name, expected.fields)}"
            fix = Fix(entry.key.mark, near) if near else None
            found.append(Diagnostic("E011", entry.key.mark, said, "fields: " + ", ".join(expected.fields), fix=fix))
            continue
        if not is_readable(name, field=True):
            said = f"no expression can read '{name}': it is a word of expressions"
            found.append(Diagnostic("E018", entry.key.mark, said, f"call it {name}_"))
            continue
        parts[name], problems = read_value(entry.value, scope, expected.fields.get(name, ANY), what=name)
        found += problems
    missing = [name for name in expected.fields if node.get(name) is None]
    if missing and not found:
        need = quoted_list(missing)
        found.append(
            Diagnostic(
                "E013", node.mark, f"{due(what, expected)}, this has no {need}", f"fields: {', '.join(expected.fields)}"
            )
        )
    reads = tuple(dict.fromkeys(read for part in parts.values() for read in part.reads))
    if found:
        return poison(node, "", reads), found
    written = {name: _as_written(part) for name, part in parts.items()}
    type_ = expected if expected.name == "record" else record_of(**written)
    if all(part.is_const for part in parts.values()):
        return literal_expr(node, type_, {name: part.const for name, part in parts.items()}), []
    return Expr("", type_, node.mark, lambda env: {name: part.run(env) for name, part in parts.items()}, reads), []


def _as_written(part: Expr) -> Type:
    """Return the type of a field that nobody declares: a word may be one of an enum where the record is handed on."""
    return literal(str(part.const)) if part.is_const and part.type == TEXT else part.type


def _point(
    node: Node, type_: Type, parts: list[Expr], reads: tuple[Dependency, ...], scope: Scope, *, degrees: bool
) -> Expr:
    frame = Frame(scope.site.lat, scope.site.lng) if degrees and scope.site is not None else None

    def run(env: Env) -> Any:
        x, y = parts[0].run(env), parts[1].run(env)
        if not degrees:
            place = Place(mm(x), mm(y))
        else:
            place = frame.place(x, y) if frame is not None else env.place(x, y)
        return place if len(parts) == 2 else Position(place.east_m, place.north_m, mm(parts[2].run(env)))

    if all(part.is_const for part in parts) and (frame is not None or not degrees):
        return literal_expr(node, type_, run(_NO_ENV))
    return Expr("", type_, node.mark, run, reads)


def _point_keys(node: Mapping_, expected: Type) -> Diagnostic | None:
    for entry in node.entries:
        key = entry.key.text
        if key not in _POINT_KEYS:
            said = f"{in_words(expected)} has no '{key}'{did_you_mean(key, _POINT_KEYS)}"
            return Diagnostic("E004", entry.key.mark, said, "{lat, lng} or {east: 10 m, north: -4 m}")
    pairs = [pair for pair in (("lat", "lng"), ("east", "north")) if node.get(pair[0]) or node.get(pair[1])]
    if len(pairs) != 1:
        said = f"{in_words(expected)} is written either with lat and lng or with east and north"
        return Diagnostic("E008", node.mark, said, "{lat, lng} or {east: 10 m, north: -4 m}")
    for key in pairs[0]:
        if node.get(key) is None:
            return Diagnostic("E008", node.mark, f"'{key}' is missing", f"write {pairs[0][0]} and {pairs[0][1]}")
    height = node.get("height")
    if height is not None and expected == PLACE:
        said = "a place is on the ground; this has a height"
        return Diagnostic("E066", height.key.mark, said, "remove height")
    if height is None and expected == POSITION:
        said = "this is on the ground, a position has a height"
        return Diagnostic("E066", node.mark, said, "add height: 60 m, or say above(..., 60 m)")
    return None


def _out_of_range(key: str, part: Expr, entry: Entry) -> list[Diagnostic]:
    limit = {"lat": 90.0, "lng": 180.0}.get(key)
    if limit is None or not part.is_const or abs(part.const) <= limit:
        return []
    said = f"{key} lies between -{limit:g} and {limit:g}"
    return [Diagnostic("E062", entry.value.mark, said, "are lat and lng swapped?" if key == "lat" else "")]


def _listing(node: Listing, scope: Scope, expected: Type, what: str) -> Result:
    if expected.name == "region":
        return _region(node, scope, what)
    if expected.name not in ("list", "any"):
        return refuse(node, "E013", f"{due(what, expected)}, this is a list", EXAMPLES.get(expected.name, ""))
    parts, found = _items(node, scope, expected.item or ANY, what)
    reads = tuple(dict.fromkeys(read for part in parts for read in part.reads))
    if found:
        return poison(node, "", reads), found
    type_ = expected
    if (expected.item or ANY).name == "any":
        item: Type | None = parts[0].type if parts else ANY
        for before, part in pairwise(parts):
            item = join(item or ANY, part.type)
            if item is None:
                said = (
                    f"the items of a list are of one type, these are {in_words(before.type)} and {in_words(part.type)}"
                )
                return poison(node, "", reads), [Diagnostic("E013", part.mark, said)]
        type_ = list_of(item or ANY)
    if all(part.is_const for part in parts):
        return literal_expr(node, type_, tuple(part.const for part in parts)), []
    return Expr("", type_, node.mark, lambda env: tuple([part.run(env) for part in parts]), reads), []


def _items(node: Listing, scope: Scope, type_: Type, what: str) -> tuple[list[Expr], list[Diagnostic]]:
    found: list[Diagnostic] = []
    parts: list[Expr] = []
    for item in node.items:
        part, problems = read_value(item, scope, type_, what=what)
        parts.append(part)
        found += problems
    return parts, found


def _region(node: Listing, scope: Scope, what: str) -> Result:
    if len(node.items) < 3:
        return refuse(node, "E013", f"a region needs three corners, this has {len(node.items)}")
    parts, found = _items(node, scope, PLACE, what)
    reads = tuple(dict.fromkeys(read for part in parts for read in part.reads))
    if found:
        return poison(node, "", reads), found
    region = Type("region")
    if all(part.is_const for part in parts):
        return literal_expr(node, region, Region(tuple(part.const for part in parts))), []
    return Expr("", region, node.mark, lambda env: Region(tuple([part.run(env) for part in parts])), reads), []


_NO_ENV: Final[Any] = None
"""Stands for the environment while constants are folded; nothing constant reads it."""
