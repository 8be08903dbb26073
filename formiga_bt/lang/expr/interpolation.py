"""`${...}` in texts: find the holes, and show values as people read them.

Called by `values` for texts with holes, and by whatever shows a value of a running tree (notes, questions).
"""

from datetime import UTC, datetime
from typing import Any, Final

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, Region, horizontal_m
from formiga_bt.base.units import LIKELY, format_number, format_quantity
from formiga_bt.lang.model import Env, EvalError, Unset
from formiga_bt.lang.types import AgentRef, Type

MAX_TEXT: Final = 10_000
SAME_PLACE_M: Final = 1.0
"""So near to a place of the site is that place, to people."""


def holes(text: str) -> list[tuple[int, int]] | int:
    """Return the spans of every `${...}` in a text (with the braces), or the start of one that is never closed."""
    found: list[tuple[int, int]] = []
    at = text.find("${")
    while at >= 0:
        end = _close(text, at + 2)
        if end < 0:
            return at
        found.append((at, end))
        at = text.find("${", end)
    return found


def _close(text: str, start: int) -> int:
    """Return the end of the hole whose expression begins at `start`; a brace inside quotes is text. -1 if none."""
    quote = ""
    for index in range(start, len(text)):
        char = text[index]
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"":
            quote = char
        elif char == "}":
            return index + 1
    plain = text.find("}", start)
    return plain + 1 if quote and plain >= 0 else -1


def shown(value: Any, type_: Type, env: Env) -> str:
    """Return a value as people read it: `60 m`, `camp`, `60.45100, 22.26700`, `yes`, an agent's id."""
    match value:
        case bool():
            return "yes" if value else "no"
        case str():
            return value
        case AgentRef():
            return value.id
        case Place() | Position():
            return _point(value, env)
        case Region():
            return f"a region with {len(value.corners)} corners"
        case tuple():
            item = type_.item or type_
            return ", ".join(shown(part, item, env) for part in value)
        case int() | float():
            return _number(value, type_)
        case dict():
            return ", ".join(f"{key}: {shown(part, type_.fields.get(key, type_), env)}" for key, part in value.items())
    return str(value)


def _named(place: Place, env: Env) -> str:
    """Return the name of the site's place that this is, within 1 m; else ""."""
    try:
        site = env.name("site")
    except Unset:
        return ""
    places = site.get("places", {}) if isinstance(site, dict) else {}
    near = [(horizontal_m(place, at), name) for name, at in places.items() if isinstance(at, Place)]
    away, name = min(near, default=(SAME_PLACE_M + 1.0, ""))
    return name if away <= SAME_PLACE_M else ""


def _point(point: Place | Position, env: Env) -> str:
    name = _named(point, env) if isinstance(point, Place) else ""
    if name:
        return name
    lat, lng = env.lat_lng(point)
    text = f"{lat:.5f}, {lng:.5f}"
    return f"{text}, {format_quantity('distance', point.up_m)} high" if isinstance(point, Position) else text


def _number(value: float, type_: Type) -> str:
    if type_.name == "time":
        return datetime.fromtimestamp(value / SECOND, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    rounded = round(value, 3)
    return format_quantity(type_.name, rounded) if type_.name in LIKELY else format_number(rounded)


def joined(pieces: list[str]) -> str:
    """Join the pieces of a text, which may not grow without end."""
    text = "".join(pieces)
    if len(text) > MAX_TEXT:
        raise EvalError(f"the text is longer than {MAX_TEXT} characters")
    return text
