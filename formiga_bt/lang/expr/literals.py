"""Plain YAML text read by the type that is due: `15 s`, `camp`, `true`, `sos`, an agent's id.

Called by `values`. A text has no meaning of its own: `no` is a text where text is due, and refused where true or false
is due. Most texts that do not fit were meant as a variable (E016) or lack a unit (E017).
"""

import re
from collections.abc import Callable, Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Any, Final

from formiga_bt.base.clock import micros
from formiga_bt.base.diagnostics import About, Diagnostic, Fix, OnGround, UnknownName
from formiga_bt.base.geo import Place
from formiga_bt.base.units import LARGEST, LIKELY, UNITS, parse_quantity, too_large
from formiga_bt.lang.expr.at_run import named
from formiga_bt.lang.expr.compiling import compile_expr, poison
from formiga_bt.lang.expr.daytime import TODAY, at_site, at_site_of, time_of_day, today
from formiga_bt.lang.expr.misread import look_alike, meant_by, period_of
from formiga_bt.lang.expr.scope import BUILT_INS, Scope
from formiga_bt.lang.expr.typed import closest, constant, did_you_mean, sure_of, unit_choices
from formiga_bt.lang.expr.typing_rules import QUANTITIES, fits, in_words
from formiga_bt.lang.model import Dependency, Env, EvalError, Expr
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.types import BOOL, INT, NUMBER, POSITION, TEXT, AgentRef, Type

Result = tuple[Expr, list[Diagnostic]]

_NUMBER = re.compile(r"[+-]?(\d{1,30})(\.\d{1,30})?([eE][+-]?\d{1,3})?", re.ASCII)


def literal_expr(node: Node, type_: Type, value: Any) -> Expr:
    """Return the Expr of a literal."""
    source = node.text if isinstance(node, Scalar) else ""
    return Expr(source, type_, node.mark, constant(value), const=value)


def refuse(
    node: Node, code: str, message: str, mend: str = "", *, mended: str | None = None, about: About | None = None
) -> Result:
    """Return poison and the one problem of a node."""
    fix = Fix(node.mark, mended) if mended is not None else None
    source = node.text if isinstance(node, Scalar) else ""
    return poison(node, source), [Diagnostic(code, node.mark, message, mend, fix=fix, about=about)]


def due(what: str, expected: Type) -> str:
    """Return the beginning of a message: what is due, and for which key."""
    return f"{what} is due {in_words(expected)}" if what else f"expected {in_words(expected)}"


def read_literal(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    """Read a plain text by the type that is due."""
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
        return refuse(node, "E016", f"{due(what, expected)}, nothing is written")
    known = scope.type_of(word)
    like_code = re.search(r"^\w+\s*\(.*\)$|^\w+\.\w+$", word)
    if (known is not None or like_code) and _may_be_meant(node, word, scope, expected):
        said = f"{due(what, expected)}, got the text '{word}'; did you mean ${{{word}}}?"
        return refuse(node, "E016", said, f"write ${{{word}}}", mended=f"${{{word}}}")
    near = closest(word, scope.names)
    hint = f"; did you mean ${{{near}}}?" if near else ""
    example = EXAMPLES.get(expected.name, "")
    said = f"{due(what, expected)}, got the text '{word}'{hint}"
    return refuse(node, "E016", said, example, about=UnknownName(word, near))


def _may_be_meant(node: Scalar, word: str, scope: Scope, expected: Type) -> bool:
    """Return whether `${word}` may be proposed; to a caller from outside, only what works is."""
    return scope.built_ins == BUILT_INS or not compile_expr(word, node, 0, scope, expected)[1]


def _quantity(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    read = parse_quantity(text)
    if read is not None and read[0] == expected.name:
        return literal_expr(node, expected, read[1]), []
    if read is not None:
        said = f"{due(what, expected)}, '{text}' is {in_words(Type(read[0]))}"
        return refuse(node, "E017", said, f"for example {unit_choices(expected.name)}")
    if _NUMBER.fullmatch(text):
        choices = unit_choices(expected.name, text)
        first = f"{text} {LIKELY[expected.name][0]}" if len(LIKELY[expected.name]) == 1 else None
        return refuse(node, "E017", f"{what or text} needs a unit: {choices}?", f"write {choices}", mended=first)
    if too_large(text, expected.name):
        return refuse(node, "E013", f"{text} is too large", "at most 2**53 in SI units")
    odd = look_alike(text)
    plain = parse_quantity(odd.mended or "") if odd is not None else None
    if odd is not None and plain is not None and plain[0] == expected.name:
        return refuse(node, "E017", f"{due(what, expected)}, '{text}' {odd.said}", odd.help, mended=odd.mended)
    period = period_of(text) if expected.name == "duration" else ""
    if period:
        return refuse(node, "E017", f"{due(what, expected)}, '{text}' is a rate", f"write {period}", mended=period)
    number = re.fullmatch(rf"({_NUMBER.pattern})\s*([A-Za-z/]+)", text)
    if number is not None:
        units = [unit for unit, (name, _) in UNITS.items() if name == expected.name]
        unit = number[number.lastindex or 0]
        if unit in UNITS:
            said = f"{due(what, expected)}, '{text}' is {in_words(Type(UNITS[unit][0]))}"
            return refuse(node, "E017", said, f"for example {unit_choices(expected.name)}")
        said = f"'{unit}' is not a unit of {expected.name}{did_you_mean(unit, units)}"
        return refuse(node, "E017", said, "units: " + " ".join(units))
    meant = meant_by(text, expected.name)
    if meant is not None and scope.type_of(text) is None:
        return refuse(node, "E016", f"{due(what, expected)}, got the text '{text}'", meant.help, mended=meant.mended)
    return _not_so(node, scope, expected, what)


def _bool(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    if text in ("true", "false"):
        return literal_expr(node, BOOL, text == "true"), []
    meant = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(text.lower()) or (
        text.lower() if text.lower() in ("true", "false") else None
    )
    if meant is not None:
        said = f"{due(what, expected)}, got the text '{text}'; did you mean {meant}?"
        return refuse(node, "E016", said, f"write {meant}", mended=meant)
    return _not_so(node, scope, expected, what)


def _number(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    found = _NUMBER.fullmatch(text)
    if found is None:
        read, odd = parse_quantity(text), look_alike(text)
        if odd is not None and _NUMBER.fullmatch(odd.mended or ""):
            return refuse(node, "E016", f"{due(what, expected)}, '{text}' {odd.said}", odd.help, mended=odd.mended)
        if read is None:
            return _not_so(node, scope, expected, what)
        bare = text.rstrip("abcdefghijklmnopqrstuvwxyz%/ ")
        said = f"{what or text} is a bare number here, without a unit"
        return refuse(node, "E017", said, f"write {bare}", mended=bare)
    whole = found[2] is None and found[3] is None
    if expected.name == "int" and not whole:
        return refuse(node, "E013", f"{due(what, expected)}, {text} is not whole")
    value = int(text) if whole else float(text)
    if abs(value) > LARGEST:
        return refuse(node, "E013", f"{text} is too large", "at most 2**53")
    return literal_expr(node, INT if whole else NUMBER, value), []


def _text(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    del scope, expected, what
    return literal_expr(node, TEXT, node.text), []


def _enum(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if word in expected.values or not expected.values:
        return literal_expr(node, expected, word), []
    if scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    near = closest(word, expected.values)
    hint = f"; did you mean '{near}'?" if near else ""
    subject = f"{what} is never '{word}'" if what else f"'{word}' is never possible here"
    return refuse(
        node, "E014", f"{subject}{hint}", "one of " + ", ".join(expected.values), mended=sure_of(word, expected.values)
    )


def _agent(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if not word or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    known = scope.site.agents.get(word) if scope.site else None
    if known is not None and not fits(Type("agent", of=(known.type,)), expected, scope.agent_types):
        return refuse(node, "E013", f"{due(what, expected)}, '{word}' is a {known.type} agent")
    return literal_expr(node, expected, AgentRef(word)), []


def _time(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    text = node.text.strip()
    if time_of_day(text) is not None:
        return Expr(node.text, expected, node.mark, lambda env: today(env, text), (TODAY,)), []
    try:
        instant = datetime.fromisoformat(text)
    except ValueError:
        return _not_so(node, scope, expected, what)
    if instant.tzinfo is None and len(text) <= len("2026-08-20"):
        return refuse(node, "E013", f"'{text}' is a day, not a time", f"for example {text}T06:30")
    if instant.tzinfo is None:
        return _local(node, instant, scope, expected)
    return literal_expr(node, expected, micros(instant.timestamp())), []


def _local(node: Scalar, local: datetime, scope: Scope, expected: Type) -> Result:
    """A moment without a zone, as people at the site write it; without a site file it is found when the task runs."""
    if scope.site is None:
        run = named(lambda env: at_site_of(env, local), node.text.strip(), node.mark)
        return Expr(node.text, expected, node.mark, run, (Dependency("site"),)), []
    try:
        return literal_expr(node, expected, at_site(local, scope.site.timezone)), []
    except EvalError as error:
        return refuse(node, "E013", error.reason)


def _place_name(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    """A place of the site by its name; without a site file it is looked up when the task runs."""
    word = node.text.strip()
    if not re.fullmatch(r"[A-Za-z_][\w-]*", word) or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    if scope.site is None:
        return Expr(
            node.text, expected, node.mark, named(_lookup("places", word), word, node.mark), (Dependency("site"),)
        ), []
    if word in scope.site.places:
        return _of_site(node, expected, scope.site.places[word], word)
    if word in scope.site.ports:
        return _of_site(node, expected, scope.site.ports[word].at, word, "ports")
    return _no_such(node, scope, expected, what, (*scope.site.places, *scope.site.ports))


def _of_site(node: Scalar, expected: Type, value: Any, word: str, group: str = "places") -> Result:
    if isinstance(value, Place) and expected == POSITION:
        said = f"'{word}' is on the ground; say above(site.{group}.{word}, 60 m)"
        mend = f"write ${{above(site.{group}.{word}, 60 m)}}, at the height that you want"
        return refuse(node, "E066", said, mend, about=OnGround(f"site.{group}.{word}"))
    return literal_expr(node, expected, value), []


def _region_name(node: Scalar, scope: Scope, expected: Type, what: str) -> Result:
    word = node.text.strip()
    if not re.fullmatch(r"[A-Za-z_][\w-]*", word) or scope.type_of(word) is not None:
        return _not_so(node, scope, expected, what)
    if scope.site is None:
        return Expr(
            node.text, expected, node.mark, named(_lookup("regions", word), word, node.mark), (Dependency("site"),)
        ), []
    if word in scope.site.regions:
        return literal_expr(node, expected, scope.site.regions[word]), []
    return _no_such(node, scope, expected, what, tuple(scope.site.regions))


def _no_such(node: Scalar, scope: Scope, expected: Type, what: str, legal: tuple[str, ...]) -> Result:
    word = node.text.strip()
    near = closest(word, legal)
    variable = closest(word, scope.names)
    if not near and variable:
        return _not_so(node, scope, expected, what)
    said = f"the site has no {expected.name} '{word}'" + (f"; did you mean '{near}'?" if near else "")
    help_ = "the site has: " + ", ".join(legal[:12])
    return refuse(node, "E010", said, help_, mended=sure_of(word, legal), about=UnknownName(word, near))


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
            return literal_expr(node, Type(read[0]), read[1]), []
        if _NUMBER.fullmatch(text):
            return _number(node, scope, NUMBER, what)
        if text in ("true", "false"):
            return _bool(node, scope, BOOL, what)
    return literal_expr(node, TEXT, node.text), []


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
EXAMPLES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "bool": "write true or false",
        "position": "for example ${above(target, 60 m)}",
        "place": "{lat, lng}, {east, north}, a place of the site, or ${...}",
        "region": "a list of at least three places, a region of the site, or ${...}",
        "time": "for example 06:30 (today), or 2026-08-20T06:30+03:00",
        "list": "a list: [a, b], or ${...}",
    }
)
