"""Says values and fills blanks in one language: numbers in words or digits, units, places, slips of the pen."""

import random
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm.train.phrases import Both

_NUMBERS: Final[Mapping[str, Mapping[int, str]]] = {
    "en": {
        1: "one",
        2: "two",
        3: "three",
        4: "four",
        5: "five",
        6: "six",
        7: "seven",
        8: "eight",
        9: "nine",
        10: "ten",
        12: "twelve",
        15: "fifteen",
        20: "twenty",
        30: "thirty",
        40: "forty",
        50: "fifty",
        60: "sixty",
    },
    "es": {
        2: "dos",
        3: "tres",
        4: "cuatro",
        5: "cinco",
        6: "seis",
        7: "siete",
        8: "ocho",
        9: "nueve",
        10: "diez",
        12: "doce",
        15: "quince",
        20: "veinte",
        30: "treinta",
        40: "cuarenta",
        50: "cincuenta",
        60: "sesenta",
    },
}
_TIMES: Final[Mapping[str, Mapping[int, str]]] = {
    "en": {1: "once", 2: "twice", 3: "three times", 4: "four times", 5: "five times", 6: "six times"},
    "es": {1: "una vez", 2: "dos veces", 3: "tres veces", 4: "cuatro veces", 5: "cinco veces", 6: "seis veces"},
}
_SIDES: Final = {"north": "norte", "south": "sur", "east": "este", "west": "oeste"}
_FORM: Final = re.compile(r"\[([^\[\]|]*(?:\|[^\[\]|]*)+)\]")
_BLANK: Final = re.compile(r"\{(\w+)\}")
_WORD: Final = re.compile(r"(?<![\w.\"])[a-z]{5,}(?![\w\"])")


class Spot(Struct, frozen=True):
    """A place as a tree has it, and what people call it."""

    value: str
    en: str
    es: str
    names: tuple[str, ...] = ()
    """Names of the site in it."""


class Metres(Struct, frozen=True):
    """A length."""

    m: int

    @property
    def value(self) -> str:
        """Return it as a tree has it."""
        return f"{self.m} m"


class Time(Struct, frozen=True):
    """A duration."""

    s: int

    @property
    def value(self) -> str:
        """Return it as a tree has it."""
        return f"{self.s // 60} min" if self.s % 60 == 0 else f"{self.s} s"


class Times(Struct, frozen=True):
    """How often."""

    n: int

    @property
    def value(self) -> str:
        """Return it as a tree has it."""
        return str(self.n)


PLAIN_SHARE: Final = 0.3
"""Of the parts of a wide wording, so many are said as in plain ones."""


def widened(tables: Mapping[str, Both], more: Mapping[str, Both]) -> dict[str, Both]:
    """Return tables with the wide wordings of others behind the plain ones."""
    return {key: (*both, *more.get(key, ((), ()))) for key, both in tables.items()}


class Speaker:
    """Words a request.

    Args:
        rng: of this wording.
        language: `en` or `es`.
        held: whether wordings that training never has may be used.
        wide: whether it speaks as people do whom the product's own reading of words need not understand.
    """

    def __init__(self, rng: random.Random, language: str, *, held: bool = False, wide: bool = False) -> None:
        self.rng, self.language, self.held, self.wide = rng, language, held, wide
        self._index = int(language == "es")
        self.has_slip = False

    def pick(self, both: Both) -> str:
        """Return one of the wordings."""
        return str(self.of(both[self._index], both[self._index + 2] if len(both) > 2 else ()))

    def of(self, options: Sequence[Any], more: Sequence[Any] = ()) -> Any:
        """Return one of the options; the last of four or more is for held-out pairs only.

        Args:
            options: plain ones.
            more: wide ones, which are taken most of the time by who speaks so.
        """
        if self.wide and more and self.rng.random() >= PLAIN_SHARE:
            options = more
        return self.rng.choice(options if self.held or len(options) < 4 else options[:-1])

    def say(self, value: Any) -> str:
        """Return a value in words."""
        match value:
            case Spot():
                return value.es if self.language == "es" else value.en
            case Metres():
                return self._metres(value.m)
            case Time():
                return self._time(value.s)
            case Times():
                return _TIMES[self.language][value.n]
            case tuple() if value and isinstance(value[0], str):
                return str(value[self._index])
            case tuple():
                return self._listed([self.say(one) for one in value])
            case int():
                return self.number(value)
        return str(value)

    def number(self, n: int) -> str:
        """Return a number in words or digits."""
        words = _NUMBERS[self.language].get(n)
        return words if words is not None and n > 1 and self.rng.random() < 0.35 else str(n)

    def _metres(self, m: int) -> str:
        if self.language == "es":
            return self.of((f"{m} m", f"{m} metros", f"{self.number(m)} metros"))
        return self.of((f"{m} m", f"{m} metres", f"{m} meters", f"{self.number(m)} metres", f"{m}m"))

    def _time(self, s: int) -> str:
        n, unit = (s // 60, 1) if s % 60 == 0 else (s, 0)
        if self.language == "es":
            word = ("segundos", "minuto" if n == 1 else "minutos")[unit]
            return (
                f"un {word}" if unit and n == 1 else self.of((f"{n} {('s', 'min')[unit]}", f"{self.number(n)} {word}"))
            )
        word = ("seconds", "minute" if n == 1 else "minutes")[unit]
        if unit and n == 1 and self.rng.random() < 0.5:
            return self.of(("a minute", "one minute", "60 seconds"))
        return self.of((f"{n} {('s', 'min')[unit]}", f"{n} {word}", f"{self.number(n)} {word}"))

    def _listed(self, parts: list[str]) -> str:
        last = " y " if self.language == "es" else self.of((" and ", " and then ", ", then "))
        return ", ".join(parts[:-1]) + last + parts[-1] if len(parts) > 1 else parts[0]

    def filled(self, text: str, values: Mapping[str, Any], form: int = 0) -> str:
        """Return a wording with its blanks filled and its verbs in one form."""
        said = _BLANK.sub(lambda m: self._blank(m[1], values), text)
        return _FORM.sub(lambda m: m[1].split("|")[min(form, m[1].count("|"))], said)

    def _blank(self, name: str, values: Mapping[str, Any]) -> str:
        if name in values:
            return self.say(values[name])
        text = self.say(values[name.lower()])
        return text[:1].upper() + text[1:]

    def finished(self, text: str, keep: Sequence[str]) -> str:
        """Return a sentence as it is written down: contractions, capitals; now and then telegraphic, small, or with a slip.

        Args:
            text: the sentence.
            keep: words in which nobody slips: names.
        """
        if self.language == "es":
            text = re.sub(r"\b([Aa]|[Dd]e) el ", lambda m: m[1] + "l ", text)
            text = re.sub(r"\ben (?=\d+ m al \w+ de)", "a ", text)
        text = re.sub(r"\bat (?=\d+ m (?:north|south|east|west) of )", "", text)
        text = re.sub(r"\s+", " ", text).replace("..", ".").strip()
        text = text[:1].upper() + text[1:]
        dice = self.rng.random()
        if dice < 0.06 and self.language == "en":
            text = re.sub(r"\b(?:the|a|an|its) (?=\w)", "", text, flags=re.IGNORECASE)
        elif dice < 0.12:
            text = text[:1].lower() + text[1:].rstrip(".")
        elif dice < 0.18:
            text = self._slipped(text, {part.casefold() for one in keep for part in re.split(r"[_\W]+", one)})
        return text

    def _slipped(self, text: str, keep: set[str]) -> str:
        spots = [m for m in _WORD.finditer(text) if m[0] not in keep]
        if not spots:
            return text
        self.has_slip = True
        match = self.rng.choice(spots)
        word, at = match[0], self.rng.randrange(1, len(match[0]) - 2)
        swapped = word[:at] + word[at + 1] + word[at] + word[at + 2 :]
        new = self.rng.choice((swapped, word[:at] + word[at + 1 :], word[:at] + word[at] + word[at:]))
        return text[: match.start()] + new + text[match.end() :]


def side_in(language: str, side: str) -> str:
    """Return a side of the compass in a language."""
    return _SIDES[side] if language == "es" else side
