"""Types of an agent's fields as Python annotations: what stands on the card, and how values of the wire become Python's.

| annotation | in the language | value |
|---|---|---|
| `float`, `int`, `bool`, `str` | number, int, bool, text | the same |
| `Metres`, `MetresPerSecond`, `Seconds`, `Degrees`, `Kilograms`, `Percent` | distance, speed, duration, ... | float, SI |
| `Time` | time | int, microseconds of engine time |
| `Place`, `Position`, `Region` | place, position, region | `base.geo` |
| `AgentId` | agent | str |
| `Literal["a", "b"]` | enum | str |
| `list[T]`, `tuple[T, ...]` | list of T | list |
| `T | None` | T, optional | None where it is not given |

`Annotated[Metres, Between(0.5, 20), "how far"]` adds limits and a line of help.
"""

import inspect
import math
import types
import typing
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.transport.cards import UNITS, CardField, Fields, fault_of_type
from formiga_bt.transport.messages import to_wire

Metres = Annotated[float, CardField(type="distance", unit="m")]
MetresPerSecond = Annotated[float, CardField(type="speed", unit="m/s")]
Seconds = Annotated[float, CardField(type="duration", unit="s")]
Degrees = Annotated[float, CardField(type="angle", unit="deg")]
Kilograms = Annotated[float, CardField(type="mass", unit="kg")]
Percent = Annotated[float, CardField(type="percent", unit="%")]
Time = Annotated[int, CardField(type="time", unit="us")]
AgentId = Annotated[str, CardField(type="agent")]

_P = TypeVar("_P", Place, Position)

_SIMPLE: Final[Mapping[Any, str]] = {
    bool: "bool", int: "int", float: "number", str: "text", Place: "place", Position: "position", Region: "region",
}  # fmt: skip
_LIST: Final = "list of "


class UnfitError(ValueError):
    """A value does not fit the type of its field."""


class Between(Struct, frozen=True):
    """The least and the greatest value of a number, in the unit of its type."""

    min: float
    max: float


def field_of(annotation: Any, default: Any = inspect.Parameter.empty) -> CardField:
    """Return the field of a card that an annotation (and a default) means.

    Raises:
        TypeError: there is no such type in the language.
    """
    field = _field(annotation)
    if default is not inspect.Parameter.empty:
        optional = field.optional or default is None
        field = replace(field, default=to_wire(default), optional=optional)
    fault = fault_of_type(field)
    if fault:
        raise TypeError(fault)
    return field


def fields_of(annotations: Mapping[str, Any]) -> Fields:
    """Return the fields of a mapping of names to annotations.

    Raises:
        TypeError: one of them is no type of the language; the text names it.
    """
    found: Fields = {}
    for name, annotation in annotations.items():
        try:
            found[name] = field_of(annotation)
        except TypeError as error:
            raise TypeError(f"{name}: {error}") from error
    return found


def _field(annotation: Any) -> CardField:
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return _annotated(arguments[0], arguments[1:])
    if origin in (typing.Union, types.UnionType):
        rest = [one for one in arguments if one is not type(None)]
        if len(rest) == 1 and len(rest) < len(arguments):
            return replace(_field(rest[0]), optional=True)
    if origin is Literal and all(isinstance(one, str) for one in arguments):
        return CardField(type="enum", values=arguments)
    if origin in (list, tuple) and arguments and (origin is list or arguments[1:] == (...,)):
        item = _field(arguments[0])
        return replace(item, type=_LIST + item.type, unit="", optional=False)
    if annotation in _SIMPLE:
        return CardField(type=_SIMPLE[annotation])
    raise TypeError(
        f"{annotation!r} is no type of the task language; use bool, int, float, str, Place, Position, Region, Metres, Seconds,"
        " Literal[...], list[...], or one of them | None"
    )


def _annotated(inner: Any, metadata: tuple[Any, ...]) -> CardField:
    known = next((one for one in metadata if isinstance(one, CardField)), None)
    field = known if known is not None else _field(inner)
    for one in metadata:
        if isinstance(one, Between):
            field = replace(field, min=one.min, max=one.max)
        elif isinstance(one, str):
            field = replace(field, help=one)
    return field


def read_value(field: CardField, value: Any) -> Any:
    """Return a value of the wire as Python's.

    Raises:
        UnfitError: it is of another type, or out of the field's limits.
    """
    if value is None and field.optional:
        return None
    made = _read(field.type, value)
    if field.values and not all(one in field.values for one in (made if isinstance(made, list) else (made,))):
        raise UnfitError(f"{made!r} is none of {', '.join(field.values)}")
    if isinstance(made, int | float) and not isinstance(made, bool):
        if field.min is not None and made < field.min:
            raise UnfitError(f"{made:g} is below {field.min:g}")
        if field.max is not None and made > field.max:
            raise UnfitError(f"{made:g} is above {field.max:g}")
    return made


def _read(kind: str, value: Any) -> Any:
    if kind.startswith(_LIST):
        if not isinstance(value, list | tuple):
            raise UnfitError(f"{value!r} is no list")
        return [_read(kind[len(_LIST) :], one) for one in value]
    match kind:
        case "bool" if isinstance(value, bool):
            return value
        case "int" | "time" if isinstance(value, int) and not isinstance(value, bool):
            return value
        case "text" | "enum" if isinstance(value, str):
            return value
        case "agent" if isinstance(value, str):
            return value
        case "agent" if isinstance(value, dict) and isinstance(value.get("id"), str):
            return value["id"]
        case "place" if isinstance(value, dict | Place | Position):
            return _point(value, Place)
        case "position" if isinstance(value, dict | Position):
            return _point(value, Position)
        case "region" if isinstance(value, Region):
            return value
        case "region" if isinstance(value, list | tuple):
            return Region(tuple(_point(corner, Place) for corner in value))
        case _ if kind in UNITS and kind not in _NO_NUMBERS and isinstance(value, int | float):
            if isinstance(value, bool) or not math.isfinite(value):
                raise UnfitError(f"{value!r} is no {kind}")
            return float(value)
    raise UnfitError(f"{value!r} is no {kind}")


_NO_NUMBERS: Final = frozenset({"bool", "int", "time", "text", "enum", "agent", "place", "position", "region"})


def _point(value: Any, kind: type[_P]) -> _P:
    if isinstance(value, kind):
        return value
    if isinstance(value, Position):
        return value.ground  # type: ignore[return-value]  # where a place is wanted
    try:
        return msgspec.convert({**value, "is": kind.__struct_config__.tag}, kind)
    except (msgspec.ValidationError, TypeError) as error:
        raise UnfitError(f"{value!r} is no {kind.__struct_config__.tag}: {error}") from error


def write_value(field: CardField, value: Any) -> Any:
    """Return Python's value as the wire's.

    Raises:
        UnfitError: it is of another type, or out of the field's limits.
    """
    return to_wire(read_value(field, value))


def write_values(fields: Fields, values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Return named values as the wire's, each by its field.

    Raises:
        UnfitError: one does not fit, is missing, or has no field.
    """
    unknown = sorted(values.keys() - fields.keys())
    if unknown:
        raise UnfitError(f"{what} has no {unknown[0]!r}; it has: {', '.join(fields) or 'no fields'}")
    made: dict[str, Any] = {}
    for name, field in fields.items():
        if name not in values:
            if field.is_needed:
                raise UnfitError(f"{what} needs {name!r}")
            continue
        try:
            made[name] = write_value(field, values[name])
        except UnfitError as error:
            raise UnfitError(f"{name!r} of {what}: {error}") from error
    return made
