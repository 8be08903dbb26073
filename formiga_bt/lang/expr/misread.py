"""Quantities as people write them elsewhere, and what was meant: `1,5 h`, `.5 h`, `1h30m`, `00:30`, `2 Hz`, an odd space.

Called by `literals` for a text that is no quantity of the type that is due.
"""

import re
import unicodedata
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from msgspec import Struct

from formiga_bt.base.units import NUMBER, UNITS, format_quantity, parse_quantity
from formiga_bt.lang.expr.typed import unit_choices

_COMMA: Final = re.compile(r"([+-]?\d+),(\d+)\s*(\S+)", re.ASCII)
_BARE_POINT: Final = re.compile(r"([+-]?)(\d*)\.(\d*)\s*(\S+)", re.ASCII)
_CLOCK: Final = re.compile(r"(\d{1,3}):(\d{2})", re.ASCII)
_PART: Final = re.compile(r"(\d+(?:\.\d+)?)\s*([A-Za-z]+)\s*", re.ASCII)
_PARTS: Final = re.compile(rf"(?:{_PART.pattern}){{2,}}", re.ASCII)
_RATE: Final = re.compile(rf"({NUMBER})\s*hz", re.ASCII | re.IGNORECASE)
_MINUTES: Final[Mapping[str, str]] = MappingProxyType({"m": "min"})
_DASHES: Final = str.maketrans({"\u2212": "-", "\u2013": "-", "\u2010": "-"})


class Meant(Struct, frozen=True):
    """What a text was meant to be."""

    said: str
    """What is wrong, to put behind the text; may be empty."""
    help: str
    mended: str | None = None
    """The one text that can have been meant."""


def look_alike(text: str) -> Meant | None:
    """Return what a text is without letters that only look like those of the language, or None if it has none."""
    plain = "".join(_plain(char) for char in text)
    odd = next((char for char in text if _plain(char) != char), "")
    if not odd or not plain.isascii():
        return None
    name = unicodedata.name(odd, "a sign without a name").lower()
    plain = " ".join(plain.split())
    return Meant(f"has a {name} (U+{ord(odd):04X})", f"write {plain}", plain)


def meant_by(text: str, kind: str) -> Meant | None:
    """Return what a text with digits was meant to be, as a quantity of this kind; None if it has none."""
    if not re.search(r"\d", text, re.ASCII):
        return None
    comma = _COMMA.fullmatch(text)
    if comma is not None and _is(f"{comma[1]}.{comma[2]} {comma[3]}", kind):
        point = f"{comma[1]}.{comma[2]} {comma[3]}"
        if len(comma[2]) == 3:
            return Meant("", f"a number has a point, and no comma: {comma[1]}{comma[2]} {comma[3]}, or {point}?")
        return Meant("", f"a number has a point, and no comma: {point}", point)
    bare = _BARE_POINT.fullmatch(text)
    if bare is not None and (bare[2] or bare[3]) and _is(f"{bare[2] or '0'} {bare[4]}", kind):
        whole = f"{bare[1]}{bare[2] or '0'}" + (f".{bare[3]}" if bare[3] else "") + f" {bare[4]}"
        return Meant("", f"write {whole}", whole)
    clock = _CLOCK.fullmatch(text)
    if clock is not None and kind == "duration":
        long, short = (format_quantity(kind, (int(clock[1]) * 60 + int(clock[2])) * unit) for unit in (60.0, 1.0))
        return Meant("", f"a duration is a number with its unit: {long}, or {short}?")
    total = _sum(text, kind)
    if total is not None:
        one = format_quantity(kind, total)
        return Meant("", f"a {kind} is one number with its unit: {one}", one)
    return Meant("", f"a {kind} is a number with its unit, for example {unit_choices(kind)}")


def period_of(text: str) -> str:
    """Return the duration that a rate in hertz means, `500 ms` of `2 Hz`; "" if the text is none."""
    rate = _RATE.fullmatch(text.strip())
    hertz = float(rate[1]) if rate is not None else 0.0
    return format_quantity("duration", round(1.0 / hertz, 6)) if 0.001 <= hertz <= 1000.0 else ""


def _is(text: str, kind: str) -> bool:
    found = parse_quantity(text)
    return found is not None and found[0] == kind


def _sum(text: str, kind: str) -> float | None:
    """Return the sum of several quantities in a row, in SI: `1 h 30 min`."""
    if not _PARTS.fullmatch(text) or kind not in ("duration", "distance"):
        return None
    total = 0.0
    for number, word in _PART.findall(text):
        unit = _MINUTES.get(word, word) if kind == "duration" else word
        if UNITS.get(unit, ("", 0.0))[0] != kind:
            return None
        total += float(number) * UNITS[unit][1]
    return total


def _plain(char: str) -> str:
    if char.isascii():
        return char
    if unicodedata.category(char) == "Cf":
        return ""
    return " " if char.isspace() else unicodedata.normalize("NFKC", char).translate(_DASHES)
