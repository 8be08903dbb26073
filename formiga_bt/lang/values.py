"""YAML values read by the type that is due: `15 s`, `camp`, `{east: 10 m, north: -4 m}`, `${expr}`, lists.

Called through `expressions.compile_value`. A plain text has no meaning of its own: `no` is a text where text is due,
and refused where true or false is due.
"""

import re
from collections.abc import Callable, Mapping
from datetime import datetime
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Final

from formiga_bt.clock import micros
from formiga_bt.diagnostics import Diagnostic, Fix
from formiga_bt.geo import Frame, Place, Position, Region, mm
from formiga_bt.lang.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.expressions import compile_expr, poison
from formiga_bt.lang.interpolation import holes, joined, shown
from formiga_bt.lang.model import NOT_CONST, Env, EvalError, Expr, Read
from formiga_bt.lang.scope import Scope
from formiga_bt.lang.typed import closest, constant, did_you_mean, unit_choices
from formiga_bt.lang.types import (
    ANY,
    BOOL,
    DISTANCE,
    INT,
    NUMBER,
    PLACE,
    POSITION,
    TEXT,
    AgentRef,
    Type,
    list_of,
)
from formiga_bt.lang.typing_rules import QUANTITIES, fits, in_words, join
from formiga_bt.units import LARGEST, LIKELY, UNITS, parse_quantity

Result = tuple[Expr, list[Diagnostic]]

_NUMBER = re.compile(r"[+-]?(\d{1,30})(\.\d{1,30})?([eE][+-]?\d{1,3})?", re.ASCII)


def read_value(node: Node, scope: Scope, expected: Type, *, what: str = "", optional: bool = False) -> Result:
    """Compile a value of an expected type; see `expressions.compile_value`."""
    if isinstance(node, Listing):
        return _listing(node, scope, expected, what)
    if isinstance(node, Mapping_):
        return _mapping(node, scope, expected, what)
    if "${" in node.text:
        return _with_holes(node, scope, expected, what, optional)
    return _literal(node, scope, expected, what)


def _literal_expr(node: Node, type_: Type, value: Any) -> Expr:
    source = node.text if isinstance(node, Scalar) else ""
    return Expr(source, type_, node.mark, constant(value), const=value)


def _refuse(node: Node, code: str, message: str, mend: str = "", *, mended: str | None = None) -> Result:
    fix = Fix(node.mark, mended) if mended is not None else None
    source = node.text if isinstance(node, Scalar) else ""
    return poison(node, source), [Diagnostic(code, node.mark, message, mend, fix=fix)]


def _due(what: str, expected: Type) -> str:
    return f"{what} is due {in_words(expected)}" if what else f"expected {in_words(expected)}"


# -- ${...}


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
        said = f"{_due(what, expected)}; text with ${{...}} in it is a text"
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

    return Expr(text, TEXT, node.mark, run, reads), []


# -- plain text


def _literal(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    name = expected.name
    if name in QUANTITIES:
        return _quantity(node, scope, expected, what)
    reader = _READERS.get(name)
    if reader is not None:
        return reader(node, scope, expected, what)
    return _not_so(node, scope, expected, what)


def _not_so(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    """Refuse a text that cannot be read as the type; most often a variable was meant (E016)."""
    word = node.text.strip()
    if not word:
        return _refuse(node, "E016", f"{_due(what, expected)}, nothing is written")
    known = scope.type_of(word)
    if known is not None:
        said = f"{_due(what, expected)}, got the text '{word}'; did you mean ${{{word}}}?"
        return _refuse(node, "E016", said, f"write ${{{word}}}", mended=f"${{{word}}}")
    if re.search(r"^\w+\s*\(.*\)$|^\w+\.\w+$", word):
        said = f"{_due(what, expected)}, got the text '{word}'; did you mean ${{{word}}}?"
        return _refuse(node, "E016", said, f"write ${{{word}}}", mended=f"${{{word}}}")
    near = closest(word, scope.names)
    hint = f"; did you mean ${{{near}}}?" if near else ""
    example = _EXAMPLES.get(expected.name, "")
    return _refuse(node, "E016", f"{_due(what, expected)}, got the text '{word}'{hint}", example)


def _quantity(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    read = parse_quantity(text)
    if read is not None and read[0] == expected.name:
        return _literal_expr(node, expected, read[1]), []
    if read is not None:
        said = f"{_due(what, expected)}, '{text}' is {in_words(Type(read[0]))}"
        return _refuse(node, "E017", said, f"for example {unit_choices(expected.name)}")
    if _NUMBER.fullmatch(text):
        choices = unit_choices(expected.name, text)
        first = f"{text} {LIKELY[expected.name][0]}"
        return _refuse(node, "E017", f"{what or text} needs a unit: {choices}?", f"write {choices}", mended=first)
    number = re.fullmatch(rf"({_NUMBER.pattern})\s*([A-Za-z/]+)", text)
    if number is not None:
        units = [unit for unit, (name, _) in UNITS.items() if name == expected.name]
        unit = number[number.lastindex or 0]
        said = f"'{unit}' is not a unit of {expected.name}{did_you_mean(unit, units)}"
        return _refuse(node, "E017", said, "units: " + " ".join(units))
    return _not_so(node, scope, expected, what)


def _bool(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    if text in ("true", "false"):
        return _literal_expr(node, BOOL, text == "true"), []
    meant = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(text.lower()) or (
        text.lower() if text.lower() in ("true", "false") else None
    )
    if meant is not None:
        said = f"{_due(what, expected)}, got the text '{text}'; did you mean {meant}?"
        return _refuse(node, "E016", said, f"write {meant}", mended=meant)
    return _not_so(node, scope, expected, what)


def _number(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    found = _NUMBER.fullmatch(text)
    if found is None:
        read = parse_quantity(text)
        if read is None:
            return _not_so(node, scope, expected, what)
        bare = text.rstrip("abcdefghijklmnopqrstuvwxyz%/ ")
        said = f"{what or text} is a bare number here, without a unit"
        return _refuse(node, "E017", said, f"write {bare}", mended=bare)
    whole = found[2] is None and found[3] is None
    if expected.name == "int" and not whole:
        return _refuse(node, "E013", f"{_due(what, expected)}, {text} is not whole")
    value = int(text) if whole else float(text)
    if abs(value) > LARGEST:
        return _refuse(node, "E013", f"{text} is too large", "at most 2**53")
    return _literal_expr(node, INT if whole else NUMBER, value), []


def _text(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    del scope, expected, what
    return _literal_expr(node, TEXT, node.text), []


def _enum(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if word in expected.values or not expected.values:
        return _literal_expr(node, expected, word), []
    if scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    near = closest(word, expected.values)
    hint = f"; did you mean '{near}'?" if near else ""
    subject = f"{what} is never '{word}'" if what else f"'{word}' is never possible here"
    return _refuse(node, "E014", f"{subject}{hint}", "one of " + ", ".join(expected.values), mended=near or None)


def _agent(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if not word or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    known = scope.site.agents.get(word) if scope.site else None
    if known is not None and not fits(Type("agent", of=(known.type,)), expected, scope.agent_types):
        return _refuse(node, "E013", f"{_due(what, expected)}, '{word}' is a {known.type} agent")
    return _literal_expr(node, expected, AgentRef(word)), []


def _time(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    if re.fullmatch(r"\d{1,2}:\d{2}(:\d{2})?", text):
        said = f"{_due(what, expected)}; a time of day needs its date and zone"
        return _refuse(node, "E013", said, f"for example 2026-08-20T{text:0>5}+03:00")
    try:
        instant = datetime.fromisoformat(text)
    except ValueError:
        return _not_so(node, scope, expected, what)
    if instant.tzinfo is None:
        return _refuse(node, "E013", f"the time '{text}' needs a zone", f"for example {text}+03:00")
    return _literal_expr(node, expected, micros(instant.timestamp())), []


def _place_name(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    """A place of the site by its name; without a site file it is looked up when the task runs."""
    word = node.text.strip()
    if not re.fullmatch(r"[A-Za-z_][\w-]*", word) or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    if scope.site is None:
        return Expr(node.text, expected, node.mark, _lookup("places", word), (Read("site"),)), []
    if word in scope.site.places:
        return _of_site(node, expected, scope.site.places[word], word)
    if word in scope.site.ports:
        return _of_site(node, expected, scope.site.ports[word].at, word)
    return _no_such(node, scope, expected, what, (*scope.site.places, *scope.site.ports))


def _of_site(node: Scalar, expected: Type, value: Any, word: str) -> Result:
    if isinstance(value, Place) and expected == POSITION:
        said = f"'{word}' is on the ground; say above(site.places.{word}, 60 m)"
        mended = f"${{above(site.places.{word}, 60 m)}}"
        return _refuse(node, "E066", said, f"write {mended}", mended=mended)
    return _literal_expr(node, expected, value), []


def _region_name(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if not re.fullmatch(r"[A-Za-z_][\w-]*", word) or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    if scope.site is None:
        return Expr(node.text, expected, node.mark, _lookup("regions", word), (Read("site"),)), []
    if word in scope.site.regions:
        return _literal_expr(node, expected, scope.site.regions[word]), []
    return _no_such(node, scope, expected, what, tuple(scope.site.regions))


def _no_such(node: Scalar, scope: Scope, expected: Type, what: str, legal: tuple[str, ...]) -> Result:
    word = node.text.strip()
    near = closest(word, legal)
    variable = closest(word, scope.names)
    if not near and variable:
        return _not_so(node, scope, expected, what)
    said = f"the site has no {expected.name} '{word}'" + (f"; did you mean '{near}'?" if near else "")
    return _refuse(node, "E010", said, "the site has: " + ", ".join(legal[:12]), mended=near or None)


def _lookup(group: str, word: str) -> Callable[[Env], Any]:
    def run(env: Env) -> Any:
        site = env.name("site")
        found = site.get(group, {}).get(word) if isinstance(site, dict) else None
        if found is None and group == "places" and isinstance(site, dict):
            found = site.get("ports", {}).get(word)
        if found is None:
            raise EvalError(f"the site has no '{word}' among its {group}")
        return found

    return run


def _position_name(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if scope.site is not None and (word in scope.site.places or word in scope.site.ports):
        return _place_name(node, scope, expected, what)
    return _not_so(node, scope, expected, what)


def _inferred(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    """A literal whose type nobody expects (a var): a quantity, a number, true or false, else text."""
    del expected
    text = node.text.strip()
    if not node.quoted and not node.block:
        read = parse_quantity(text)
        if read is not None:
            return _literal_expr(node, Type(read[0]), read[1]), []
        if _NUMBER.fullmatch(text):
            return _number(node, scope, NUMBER, what)
        if text in ("true", "false"):
            return _bool(node, scope, BOOL, what)
    return _literal_expr(node, TEXT, node.text), []


_READERS: Final[Mapping[str, Callable[[Scalar, Scope, Type, str], Result]]] = MappingProxyType(
    {
        "any": _inferred,
        "text": _text,
        "enum": _enum,
        "bool": _bool,
        "int": _number,
        "number": _number,
        "agent": _agent,
        "time": _time,
        "place": _place_name,
        "position": _position_name,
        "region": _region_name,
    }
)
_EXAMPLES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "bool": "write true or false",
        "position": "for example ${above(target, 60 m)}",
        "place": "{lat, lng}, {east, north}, a place of the site, or ${...}",
        "region": "a list of at least three places, a region of the site, or ${...}",
        "time": "for example 2026-08-20T06:30+03:00",
        "list": "a list: [a, b], or ${...}",
    }
)


# -- mappings and lists

_POINT_KEYS: Final = ("lat", "lng", "east", "north", "height")


def _mapping(node: Mapping_, scope: Scope, expected: Type, what: str) -> Result:
    if expected.name == "any" and any(entry.key.text in ("lat", "east") for entry in node.entries):
        expected = POSITION if node.get("height") else PLACE
    if expected.name not in ("place", "position"):
        return _refuse(node, "E013", f"{_due(what, expected)}, this is a mapping", _EXAMPLES.get(expected.name, ""))
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


def _point(node: Node, type_: Type, parts: list[Expr], reads: tuple[Read, ...], scope: Scope, *, degrees: bool) -> Expr:
    frame = Frame(scope.site.lat, scope.site.lng) if degrees and scope.site is not None else None

    def run(env: Env) -> Any:
        x, y = parts[0].run(env), parts[1].run(env)
        if not degrees:
            place = Place(mm(x), mm(y))
        else:
            place = frame.place(x, y) if frame is not None else env.place(x, y)
        return place if len(parts) == 2 else Position(place.east_m, place.north_m, mm(parts[2].run(env)))

    if all(part.is_const for part in parts) and (frame is not None or not degrees):
        return _literal_expr(node, type_, run(_NO_ENV))
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
        return _refuse(node, "E013", f"{_due(what, expected)}, this is a list", _EXAMPLES.get(expected.name, ""))
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
        return _literal_expr(node, type_, tuple(part.const for part in parts)), []
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
        return _refuse(node, "E013", f"a region needs three corners, this has {len(node.items)}")
    parts, found = _items(node, scope, PLACE, what)
    reads = tuple(dict.fromkeys(read for part in parts for read in part.reads))
    if found:
        return poison(node, "", reads), found
    region = Type("region")
    if all(part.is_const for part in parts):
        return _literal_expr(node, region, Region(tuple(part.const for part in parts))), []
    return Expr("", region, node.mark, lambda env: Region(tuple([part.run(env) for part in parts])), reads), []


_NO_ENV: Final[Any] = NOT_CONST
"""Stands for the environment while constants are folded; nothing constant reads it."""
