"""Values of the wire as runtime values of the catalogue's types, and whether they are such."""

from typing import Any

import msgspec

from formiga_bt.base.bounds import MOST, MOST_INT, MOST_RESULT, are_within, fault_of
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.types import PLACE, AgentRef, Type


def read_result(types: "dict[str, Type] | Any", raw: dict[str, Any]) -> dict[str, Any]:
    """Return a result's fields as runtime values of the catalogue's types; unknown fields are left out.

    Raises:
        ValueError: a field is of another type, or a number of it out of bounds; says which, and what came instead.
    """
    found: dict[str, Any] = {}
    for name, kind in types.items():
        if name in raw:
            try:
                found[name] = read_value(kind, raw[name])
            except (KeyError, TypeError, ValueError, OverflowError) as error:
                why = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
                raise ValueError(f"field '{name}' is to be {kind}, this came: {_shown(raw[name])} ({why})") from error
    return found


def read_value(kind: Type, raw: Any) -> Any:
    """Return a value of the wire as a runtime value.

    Raises:
        KeyError, TypeError, ValueError: it is of another type, or a number out of bounds.
    """
    match kind.name:
        case "place":
            return Place(_number(raw["east_m"], MOST), _number(raw["north_m"], MOST))
        case "position":
            return Position(_number(raw["east_m"], MOST), _number(raw["north_m"], MOST), _number(raw["up_m"], MOST))
        case "region":
            return Region(tuple(read_value(PLACE, corner) for corner in msgspec.convert(raw, list)))
        case "agent":
            return AgentRef(msgspec.convert(raw, str))
        case "bool":
            return msgspec.convert(raw, bool)
        case "int" | "time":
            return _number(raw, MOST_INT, int)
        case "enum" if kind.values and raw not in kind.values:
            raise ValueError("it is none of them")
        case "text" | "enum":
            return msgspec.convert(raw, str)
        case "list":
            assert kind.item is not None
            return tuple(read_value(kind.item, item) for item in msgspec.convert(raw, list))
        case "record" if kind.fields:
            return {name: read_value(of, raw[name]) for name, of in kind.fields.items()}
        case "any" | "record":
            if fault := fault_of(raw):
                raise ValueError(fault)
            return raw
        case _:
            return _number(raw, MOST_RESULT)


def _shown(raw: Any) -> str:
    """Return a value of the wire in short."""
    text = repr(raw)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _number(raw: Any, most: float, kind: type[float] = float) -> Any:
    number = msgspec.convert(raw, kind)
    if not are_within((number,), most):
        raise ValueError(f"{number!r} is out of bounds")
    return number
