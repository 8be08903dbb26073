"""Which types fit, join, add, multiply and compare. Pure functions over `Type`, used by the expression checker.

Texts written in an expression have the internal type `literal` (an enum of what is written), so that they fit an enum
that lists them; `widen` turns it into text before a type leaves the compiler.
"""

from collections.abc import Mapping
from typing import Final

from formiga_bt.lang.model import AgentType
from formiga_bt.lang.types import ANY, BOOL, DISTANCE, DURATION, INT, NUMBER, SPEED, TEXT, TIME, Type, record_of

NUMBERS: Final = frozenset({"number", "int"})
QUANTITIES: Final = frozenset({"distance", "duration", "speed", "angle", "mass", "percent"})
POINTS: Final = frozenset({"place", "position"})
_TEXTS: Final = frozenset({"text", "enum", "literal"})


def literal(*values: str) -> Type:
    """Return the internal type of texts written in an expression."""
    return Type("literal", values=values)


def widen(type_: Type) -> Type:
    """Return the type with `literal` replaced by text, in lists too."""
    if type_.name == "literal":
        return TEXT
    if type_.name == "list" and type_.item is not None:
        return Type("list", item=widen(type_.item))
    if type_.name == "record":
        return record_of(**{name: widen(of) for name, of in type_.fields.items()})
    return type_


def fits(have: Type, want: Type, agent_types: Mapping[str, AgentType] | None = None) -> bool:
    """Return whether a value of type `have` may stand where `want` is due. ANY fits both ways.

    With `agent_types`, an agent also fits where a type that its own extends is due.
    """
    if have.name == "any" or want.name == "any":
        return True
    if want.name == "text":
        return have.name in _TEXTS
    if want.name in ("enum", "literal"):
        return have.name in ("enum", "literal") and (not want.values or set(have.values) <= set(want.values))
    if want.name == "number":
        return have.name in NUMBERS
    if want.name != have.name:
        return False
    if want.name == "list":
        return have.item is None or want.item is None or fits(have.item, want.item, agent_types)
    if want.name == "agent":
        return not want.of or (bool(have.of) and all(_is_one_of(of, want.of, agent_types or {}) for of in have.of))
    if want.name == "record":
        return all(
            name in have.fields and fits(have.fields[name], type_, agent_types) for name, type_ in want.fields.items()
        )
    return True


def _is_one_of(of: str, wanted: tuple[str, ...], agent_types: Mapping[str, AgentType]) -> bool:
    extends = agent_types[of].extends if of in agent_types else ()
    return of in wanted or any(parent in wanted for parent in extends)


def join(a: Type, b: Type) -> Type | None:
    """Return the narrowest type that both fit, or None."""
    if a.name == "any" or b.name == "any":
        return a if b.name == "any" and a.name != "any" else b
    if a.name in ("enum", "literal") and b.name in ("enum", "literal"):
        values = tuple(dict.fromkeys(a.values + b.values))
        return Type("literal" if a.name == b.name == "literal" else "enum", values=values)
    if a.name == b.name == "list":
        item = join(a.item or ANY, b.item or ANY)
        return None if item is None else Type("list", item=item)
    if a.name == b.name == "agent":
        of = tuple(dict.fromkeys(a.of + b.of)) if a.of and b.of else ()
        return Type("agent", of=of, foreign=a.foreign or b.foreign)
    if fits(a, b):
        return b
    return a if fits(b, a) else None


def arithmetic(op: str, a: Type, b: Type) -> Type | None:
    """Return the type of `a op b` for op in + - * / //, or None where it has no meaning."""
    if a.name == "any" or b.name == "any":
        return ANY
    if a.name in NUMBERS and b.name in NUMBERS:
        whole = a.name == b.name == "int" and op != "/"
        return INT if whole else NUMBER
    match op:
        case "+" | "-":
            return _sum(op, a, b)
        case "*":
            return _product(a, b)
        case "/":
            return _quotient(a, b)
        case _:
            return INT if a.name == b.name and a.name in QUANTITIES else None


def _sum(op: str, a: Type, b: Type) -> Type | None:
    if a.name == b.name and a.name in QUANTITIES:
        return a
    if a.name == "time" and b.name == "duration":
        return TIME
    if op == "+" and a.name == "duration" and b.name == "time":
        return TIME
    return DURATION if op == "-" and a.name == b.name == "time" else None


def _product(a: Type, b: Type) -> Type | None:
    for x, y in ((a, b), (b, a)):
        if x.name in NUMBERS and y.name in QUANTITIES:
            return y
        if x.name == "speed" and y.name == "duration":
            return DISTANCE
    return None


def _quotient(a: Type, b: Type) -> Type | None:
    if a.name in QUANTITIES and b.name in NUMBERS:
        return a
    if a.name in QUANTITIES and a.name == b.name:
        return NUMBER
    return {("distance", "duration"): SPEED, ("distance", "speed"): DURATION}.get((a.name, b.name))


def comparable(a: Type, b: Type, *, ordered: bool) -> bool:
    """Return whether `a == b` (or `a < b` if `ordered`) has a meaning; see `never_equal` for enums."""
    if a.name == "any" or b.name == "any":
        return True
    if a.name in NUMBERS and b.name in NUMBERS:
        return True
    if a.name == b.name and (a.name in QUANTITIES or a.name == "time"):
        return True
    if ordered:
        return False
    if a.name in _TEXTS and b.name in _TEXTS:
        return True
    if a.name == b.name == "list":
        return comparable(a.item or ANY, b.item or ANY, ordered=False)
    return a.name == b.name and a.name in ("bool", "agent", "place", "position", "region")


def never_equal(a: Type, b: Type) -> bool:
    """Return whether both list their values and share none."""
    closed = ("enum", "literal")
    return a.name in closed and b.name in closed and not set(a.values) & set(b.values)


def is_truth(type_: Type) -> bool:
    """Return whether the type may be a condition."""
    return type_ == BOOL or type_.name == "any"


def in_words(type_: Type) -> str:
    """Return the type with an article, as messages name it: `a distance`, `an angle`."""
    if type_.name == "literal":
        return "a text"
    if type_.name == "enum":
        return "one of " + ", ".join(type_.values) if len(type_.values) <= 8 else "one of a list of words"
    if type_.name == "bool":
        return "true or false"
    if type_.name in ("time", "record"):
        return f"a {type_.name}"
    if type_.name == "names":
        return "a part of the site"
    if type_.name == "list" and type_.item is not None and type_.item.name == "literal":
        return "a list of text"
    text = str(type_)
    return f"an {text}" if text[0] in "aeiou" else f"a {text}"
