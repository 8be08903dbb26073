"""Quantities as authors write them: `15 s`, `3.5 km`, `30 %`. Pure text to SI value and back.

Ground floor: the expression compiler, the literals of YAML values, forms and the display all read and write the same
units. `percent` is 0..100, angles are degrees, masses are kilograms; a duration is seconds.
"""

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

UNITS: Final[Mapping[str, tuple[str, float]]] = MappingProxyType(
    {
        "ms": ("duration", 0.001),
        "s": ("duration", 1.0),
        "min": ("duration", 60.0),
        "h": ("duration", 3600.0),
        "d": ("duration", 86400.0),
        "m": ("distance", 1.0),
        "km": ("distance", 1000.0),
        "%": ("percent", 1.0),
        "deg": ("angle", 1.0),
        "rad": ("angle", 180.0 / math.pi),
        "m/s": ("speed", 1.0),
        "km/h": ("speed", 1.0 / 3.6),
        "g": ("mass", 0.001),
        "kg": ("mass", 1.0),
    }
)
"""Unit -> (type name, factor to the SI value of that type)."""

LIKELY: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "duration": ("s", "min"),
        "distance": ("m",),
        "percent": ("%",),
        "angle": ("deg",),
        "speed": ("m/s", "km/h"),
        "mass": ("kg",),
    }
)
"""The units to suggest for a type when one is missing, the likeliest first."""

LARGEST: Final = 2.0**53
"""No number or quantity may exceed this, in the type's SI unit."""

NUMBER = r"\d{1,30}(?:\.\d{1,30})?(?:[eE][+-]?\d{1,3})?"
UNIT = r"m/s|km/h|ms|min|km|kg|deg|rad|s|h|d|m|g|%"
_QUANTITY = re.compile(rf"([+-]?{NUMBER})\s*({UNIT})", re.ASCII)
_LADDERS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"duration": ("d", "h", "min", "s"), "distance": ("km", "m")}
)


def parse_quantity(text: str) -> tuple[str, float] | None:
    """Read a number with its unit.

    Args:
        text: for example `15 s`, `15s`, `-3.5 km`, `30 %`.

    Returns:
        The type's name and the value in its SI unit, or None if the text is not a number with a known unit, or exceeds
        `LARGEST` (`too_large` tells which).
    """
    read = _read(text)
    return read if read is not None and abs(read[1]) <= LARGEST else None


def too_large(text: str, type_name: str) -> bool:
    """Return whether a text is a quantity of this type that exceeds `LARGEST`."""
    read = _read(text)
    return read is not None and read[0] == type_name and abs(read[1]) > LARGEST


def _read(text: str) -> tuple[str, float] | None:
    found = _QUANTITY.fullmatch(text.strip())
    if found is None:
        return None
    type_name, factor = UNITS[found[2]]
    return type_name, to_si(float(found[1]), factor)


def to_si(number: float, factor: float) -> float:
    """Scale a number by a unit's factor without leaving dust in the last digit (`1.1 km` is exactly 1100 m)."""
    return float(f"{number * factor:.15g}") + 0.0


def format_quantity(type_name: str, si: float) -> str:
    """Write a quantity in the largest unit in which it is a whole number, else in the type's SI unit.

    Args:
        type_name: duration, distance, percent, angle, speed or mass; any other name gives the bare number.
        si: the value in the type's SI unit.
    """
    if type_name not in LIKELY:
        return format_number(si)
    unit = LIKELY[type_name][0]
    ladder = _LADDERS.get(type_name, ())
    for candidate in ladder:
        scaled = si / UNITS[candidate][1]
        if si and scaled == int(scaled) and (candidate not in ("min", "h", "d") or abs(scaled) >= 2 or scaled == 1):
            return f"{format_number(scaled)} {candidate}"
    if type_name == "duration" and 0 < abs(si) < 1:
        return f"{format_number(to_si(si, 1000.0))} ms"
    return f"{format_number(si)} {unit}"


def format_number(value: float) -> str:
    """Write a number without a needless fraction: `60`, `2.5`."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))
