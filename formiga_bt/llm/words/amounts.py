"""Amounts that a request says: a number with its unit, in digits or words, of English, Spanish and Finnish.

Feet, yards, miles and knots are read as what they are; a task has metres. A time in two parts (`1 minute and 30 seconds`) is
one amount.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from formiga_bt.base.units import UNITS
from formiga_bt.llm.words.spoken import is_english

NUMBERS: Final[Mapping[str, int]] = {
    # English
    "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12, "fifteen": 15, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60,
    "seventy": 70, "eighty": 80, "ninety": 90, "hundred": 100,
    # Finnish
    "yksi": 1, "kaksi": 2, "kolme": 3, "neljä": 4, "viisi": 5, "kuusi": 6, "seitsemän": 7, "kahdeksan": 8, "yhdeksän": 9,
    "kymmenen": 10, "kaksikymmentä": 20, "kolmekymmentä": 30, "viisikymmentä": 50, "sata": 100,
    # Spanish; not `un`, which is an article
    "dos": 2, "tres": 3, "cuatro": 4, "cinco": 5, "seis": 6, "siete": 7, "ocho": 8, "nueve": 9, "diez": 10, "doce": 12,
    "quince": 15, "veinte": 20, "treinta": 30, "cuarenta": 40, "cincuenta": 50, "sesenta": 60, "setenta": 70, "ochenta": 80,
    "noventa": 90, "cien": 100,
    "yhden": 1, "kahden": 2, "kolmen": 3, "neljän": 4, "viiden": 5, "kuuden": 6, "kymmenen metrin": 10,
}  # fmt: skip
UNIT_WORDS: Final[Mapping[str, str]] = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "kilometer": "km", "kilometers": "km", "kilometre": "km",
    "kilometres": "km", "second": "s", "seconds": "s", "sec": "s", "secs": "s", "minute": "min", "minutes": "min",
    "mins": "min", "hour": "h", "hours": "h", "percent": "%", "degree": "deg", "degrees": "deg", "°": "deg",
    "metri": "m", "metriä": "m", "metrin": "m", "kilometri": "km", "kilometriä": "km", "kilometrin": "km",
    "sekunti": "s", "sekuntia": "s", "sekunnin": "s", "minuutti": "min", "minuuttia": "min", "minuutin": "min",
    "metro": "m", "metros": "m", "kilómetro": "km", "kilómetros": "km", "segundos": "s", "minuto": "min", "minutos": "min",
    "hora": "h", "horas": "h", "por ciento": "%", "grados": "deg",
    "tunti": "h", "tuntia": "h", "tunnin": "h", "prosenttia": "%", "astetta": "deg",
}  # fmt: skip
OTHER_UNITS: Final[Mapping[str, tuple[str, float]]] = {
    "ft": ("distance", 0.3048), "foot": ("distance", 0.3048), "feet": ("distance", 0.3048), "pies": ("distance", 0.3048),
    "jalkaa": ("distance", 0.3048), "yd": ("distance", 0.9144), "yds": ("distance", 0.9144), "yards": ("distance", 0.9144),
    "-yard": ("distance", 0.9144), "yardas": ("distance", 0.9144), "mile": ("distance", 1609.344),
    "miles": ("distance", 1609.344), "mi": ("distance", 1609.344), "milla": ("distance", 1609.344),
    "millas": ("distance", 1609.344), "nautical mile": ("distance", 1852.0), "nautical miles": ("distance", 1852.0),
    "inch": ("distance", 0.0254), "inches": ("distance", 0.0254), "pulgadas": ("distance", 0.0254),
    "cm": ("distance", 0.01), "centimeters": ("distance", 0.01), "centimetres": ("distance", 0.01),
    "centímetros": ("distance", 0.01), "knot": ("speed", 0.514444), "knots": ("speed", 0.514444), "kn": ("speed", 0.514444),
    "kt": ("speed", 0.514444), "kts": ("speed", 0.514444), "nudos": ("speed", 0.514444), "mph": ("speed", 0.44704),
    "miles per hour": ("speed", 0.44704), "kph": ("speed", 1 / 3.6), "kmh": ("speed", 1 / 3.6),
    "kilometers per hour": ("speed", 1 / 3.6), "kilometres per hour": ("speed", 1 / 3.6),
    "kilómetros por hora": ("speed", 1 / 3.6), "meters per second": ("speed", 1.0), "metres per second": ("speed", 1.0),
    "metros por segundo": ("speed", 1.0),
}  # fmt: skip
"""Units that no task is written in -> (type, factor to the SI value)."""
ROUNDED: Final = 0.05
"""By so much, of 1, a value may be beside an amount of such a unit."""
_CORNER: Final = re.compile(
    r"\b(?:corners?|angles?|vertex|vertices|tri[aá]ng\w+|esquinas?|[aá]ngulos?|vértices?)\b"
    r"|(?:degrees?|deg|°|grados)\s+(?:between|apart|(?:to|from) (?:each|one an)other|entre)\b",
    re.IGNORECASE,
)
IN_FULL: Final[Mapping[str, int]] = {
    **NUMBERS,
    **{f"{few} hundred": 100 * NUMBERS[few] for few in ("one", "two", "three", "four", "five")},
    **{
        f"{ten}{link}{few}": NUMBERS[ten] + NUMBERS[few]
        for tens, fews, links in (
            (("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"),
             ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine"), ("-", " ")),
            (("treinta", "cuarenta", "cincuenta", "sesenta", "setenta", "ochenta", "noventa"),
             ("dos", "tres", "cuatro", "cinco", "seis", "siete", "ocho", "nueve"), (" y ",)),
        )
        for ten in tens for few in fews for link in links
    },
}  # fmt: skip
"""Numbers of one word, and those of two: `twenty-five`."""
OF_LARGER: Final = re.compile(
    rf"\b(?:{'|'.join(NUMBERS)}|ciento|thousand|mil)(?:\s+(?:and|y)\s+|\s+|-)$", re.IGNORECASE
)
"""What stands before the end of a number that is not known in full: `one hundred and`."""
NUMBER_WORDS: Final = "|".join(sorted(IN_FULL, key=len, reverse=True))
_ALL: Final[Mapping[str, tuple[str, float]]] = {
    **{word: UNITS[unit] for word, unit in UNIT_WORDS.items()}, **OTHER_UNITS, **UNITS
}  # fmt: skip
_LETTERS: Final = frozenset({"s", "h", "d", "g", "ms", "rad"})
"""Units that stand behind digits only: `ones` is no second."""


def _any_of(units: Iterator[str]) -> str:
    return "|".join(map(re.escape, sorted(units, key=len, reverse=True)))


_BY_DIGITS: Final = (
    rf"(?P<digits>\d{{1,3}}(?:,\d{{3}})+(?!\d)|\d{{1,3}}(?:\.\d{{3}})+(?!\d)|\d+(?:[.,]\d+)?)(?P<half>\s+and\s+a\s+half|½)?"
    rf"(?:\s*-\s*|\s*)(?P<unit>{_any_of(iter(_ALL))})"
)
_BY_WORDS: Final = (
    rf"(?P<word>{NUMBER_WORDS})(?P<and_half>\s+and\s+a\s+half)?(?:\s*-\s*|\s+)"
    rf"(?P<named>{_any_of(one for one in _ALL if one not in _LETTERS)})"
)
_HALVES: Final = rf"(?P<half_of>(?:half\s+an?|medi[oa])\s+(?P<halved>{_any_of(one for one in _ALL if len(one) > 2)}))"
_AMOUNT: Final = re.compile(
    rf"(?<![\w.,])(?:{_BY_DIGITS}|{_BY_WORDS}|{_HALVES})(?P<more>\s+and\s+a\s+half|\s+y\s+medi[oa])?(?![\w%])",
    re.IGNORECASE,
)
_TOGETHER: Final = re.compile(r"\s+(?:(?:and|y|ja|con)\s+)?", re.IGNORECASE)
"""What stands between the two parts of a time."""
_APART: Final = re.compile(r"\s*(?:later|after|afterwards|before|earlier|después|más tarde|antes)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Amount:
    """A number with its unit, as a request has it."""

    type: str
    si: float
    words: str
    at: int
    """Where it stands."""
    parts: tuple[float, ...] = ()
    """Of a time in two parts: each of them."""
    rounded: bool = False
    """It is of a unit that no task is written in."""

    def means(self, type_: str, si: float) -> bool:
        """Return whether a value is this amount."""
        near = ROUNDED * abs(self.si) if self.rounded else 1e-6 * max(1.0, abs(si))
        return self.type == type_ and abs(self.si - si) <= near


def amounts_of(request: str) -> Iterator[Amount]:
    """Yield the amounts of a request in their order."""
    found = [
        (match.span(), amount) for match in _AMOUNT.finditer(request) if (amount := _amount(match, request)) is not None
    ]
    at = 0
    while at < len(found):
        (start, end), one = found[at]
        at += 1
        if at < len(found) and _is_second(one, found[at][1]) and _TOGETHER.fullmatch(request, end, found[at][0][0]):
            (_, last), other = found[at]
            if not _APART.match(request, last):
                at += 1
                yield Amount(one.type, one.si + other.si, request[start:last], start, (one.si, other.si))
                continue
        yield one


def in_metres(request: str) -> str:
    """Return a request with metres in place of feet and the like, for whoever writes the task."""

    def plain(match: re.Match[str]) -> str:
        amount = _amount(match, request)
        if amount is None or not amount.rounded:
            return match[0]
        return f"{amount.si:.4g} {'m/s' if amount.type == 'speed' else 'm'}"

    return _AMOUNT.sub(plain, request)


def _amount(match: re.Match[str], request: str) -> Amount | None:
    if match["word"] and OF_LARGER.search(request[: match.start()]):
        return None
    unit = (match["unit"] or match["named"] or match["halved"]).casefold()
    number = (
        _number(match["digits"], request)
        if match["digits"]
        else float(IN_FULL.get((match["word"] or "").casefold(), 0))
    )
    if match["half"] or match["and_half"] or match["half_of"] or match["more"]:
        number += 0.5
    type_, factor = _ALL[unit]
    if type_ == "angle" and number == 90 and _CORNER.search(request):
        return None  # `a corner of 90 degrees`: a right angle, in other words
    return Amount(type_, number * factor, match[0], match.start(), rounded=unit in OTHER_UNITS)


def _is_second(one: Amount, other: Amount) -> bool:
    """Return whether an amount may be the second part of a time: seconds behind minutes, minutes behind hours."""
    unit = 3600.0 if one.si >= 3600.0 else 60.0
    return one.type == other.type == "duration" and other.si < unit <= one.si


def _number(digits: str, request: str) -> float:
    """Return a number in digits: `1,000` is a thousand in English, `1.000` in Spanish and Finnish; else both are points."""
    mark = "," if is_english(request) else "."
    if re.fullmatch(rf"\d{{1,3}}(?:{re.escape(mark)}\d{{3}})+", digits) or digits.count(",") + digits.count(".") > 1:
        return float(re.sub(r"[.,]", "", digits))
    return float(digits.replace(",", "."))
