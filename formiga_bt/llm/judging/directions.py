"""Sides of a place: `60 m south of the camp` is no spot 60 m north or east of it."""

import re
from collections.abc import Iterator, Mapping
from typing import Final

from formiga_bt.base.units import parse_quantity
from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.plain import code_of, is_refused
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.words.amounts import Amount
from formiga_bt.llm.words.wording import Words

_SIDES: Final[Mapping[str, tuple[str, int]]] = {
    "north": ("north", 1), "south": ("north", -1), "east": ("east", 1), "west": ("east", -1),
    "norte": ("north", 1), "sur": ("north", -1), "este": ("east", 1), "oeste": ("east", -1),
}  # fmt: skip
"""A side -> the argument of `offset`, and its sign."""
_SIDE: Final = r"\s+(?:to\s+the\s+|due\s+|al\s+)?(?P<side>north|south|east|west|norte|sur|este|oeste)\s+(?:of|del?)\s+"
_ARGUMENT: Final = re.compile(r"\b(north|east)\s*=\s*(-?)\s*(?:(-?\d+)\s*\*\s*)?(\w+(?:\.\d+)?(?:\s*k?m)?)")


def directions(words: Words, task: Task, text: str) -> Iterator[Shortfall]:
    """Find spots beside a place that lie on another side of it than the request says, as far from it.

    Args:
        words: the request, as read.
        task: the checked task.
        text: its YAML.
    """
    code = code_of(text)
    for amount in words.amounts:
        for name, said in words.places.items():
            match = _told(words, amount, name)
            if match is None or is_refused(words.text, said):
                continue
            side = match["side"].casefold()
            axis, sign = _SIDES[side]
            far = [one for one in _beside(code, task, name) if amount.means("distance", abs(one[1]))]
            if far and not any(way == axis and metres * sign > 0 for way, metres in far):
                yield Shortfall(
                    "wrong_side",
                    f'the request says "{match[0]}", and the task goes to another side of {name}',
                    help=f"offset({name}, {axis}={'-' if sign < 0 else ''}{amount.si:g} m)",
                    about=name,
                )


def _told(words: Words, amount: Amount, name: str) -> re.Match[str] | None:
    """Return where a request says on which side of a place something so far off is."""
    there = rf"(?<![\w.,]){re.escape(amount.words)}{_SIDE}(?:the\s+|el\s+|la\s+)?{re.escape(words.places[name])}(?!\w)"
    found = list(re.finditer(there, words.alone(name), re.IGNORECASE)) if amount.type == "distance" else []
    return found[0] if len(found) == 1 else None


def _beside(code: str, task: Task, name: str) -> Iterator[tuple[str, float]]:
    """Yield the argument and the metres of each spot beside a place."""
    for spot in re.finditer(rf"\boffset\(\s*{re.escape(name)}\s*,([^()]*)\)", code):
        for way, minus, times, value in _ARGUMENT.findall(spot[1]):
            metres = _metres(value, task)
            if metres is not None:
                yield way, metres * (int(times) if times else 1) * (-1 if minus else 1)


def _metres(value: str, task: Task) -> float | None:
    """Return how far a value is: an amount, or the default of a param."""
    amount = parse_quantity(value)
    if amount is not None:
        return amount[1]
    param = task.params.get(value)
    if param is None or param.type.name != "distance" or param.default is None or not param.default.is_const:
        return None
    return float(param.default.const)
