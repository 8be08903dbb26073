"""Sizes of figures: what a request says of a radius, a leg or a swing is used for it, and nothing is assumed in its stead."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.heights import is_height
from formiga_bt.llm.judging.plain import code_of
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.shaping.teams import gap_of
from formiga_bt.llm.words.amounts import Amount
from formiga_bt.llm.words.triangles import TRIANGLE
from formiga_bt.llm.words.wording import Words

_ROUND: Final = (
    r"\bcircl\w+|\borbit\w*|\b(?:a)?round\b|\brings?\b|\bloops?\b|\brode\w+|\balrededor\b|\b[oó]rbita\b|\bc[ií]rculo\b"
)
_FEW: Final = (
    r"(?:(?!\b(?:at(?! (?:its|the)\b)|from|over|above|up|high|height|altitude|fl(?:y|ies|own|ying)|sobre|altura|altitud)\b)"
    r"[^.,;:\d])"
)


@dataclass(frozen=True, slots=True)
class _Size:
    """How a request says the size of a figure."""

    figure: str
    before: re.Pattern[str]
    behind: re.Pattern[str]
    about: re.Pattern[str]
    """What the request speaks of; of a ring, in the same clause."""


_SIZES: Final = {
    "radius": _Size(
        "circle",
        re.compile(
            r"\b(?:(?:distance|radius|distancia|radio)(?:\s+(?:of|is|de))?"
            r"|(?:circle|ring|orbit|c[ií]rculo|anillo)\s+(?:of|de))(?:\s+(?:about|unos))?\s*$"
        ),
        re.compile(r"\W*(?:(?:of |de )?(?:distance|radius|distancia|radio)|away)\b"),
        re.compile(_ROUND),
    ),
    "leg": _Size(
        "triangle",
        re.compile(rf"\b(?:sides?|legs?|edges?|lados?|catetos?)\b{_FEW}{{0,40}}$"),
        re.compile(r"\W*(?:long\s+)?(?:sides?|legs?|edges?|lados?|catetos?)\b"),
        re.compile(TRIANGLE + r"|\btri[aá]ngulo"),
    ),
    "amplitude": _Size(
        "zigzag",
        re.compile(r"\b(?:amplitude|amplitud|swings?)(?:\s+(?:of|is|de))?\s*$"),
        re.compile(r"\W*(?:to|on|a|hacia)\s+(?:each|either|every|both|cada|ambos)\s+(?:sides?|lados?)\b"),
        re.compile(r"\bzig-?zag"),
    ),
}
"""A param's name -> what says that amount."""
_CLAUSE: Final = re.compile(r"[.,;:()!?](?!\d)|\b(?:and|then|while|whereas|y|luego|mientras)\b")
_ELSE: Final = re.compile(
    r"\b(?:(?:north|south|east|west)\w*|norte|sur|oeste|left|right|beside|behind|ahead|towards?|point|spot|punto|hacia|"
    r"between|among|apart|each other|one another|neighbou?rs?|entre|two|three|both|all|they|them|drones|lwds|hwds|uavs|dos|"
    r"tres|ambos|diameter|across|di[aá]metro|circumference|perimeter|hypotenuse|hipotenusa|longest|opposite|third|"
    r"higher|lower|height|altitude|altura|altitud|every|within|further|forward)\b"
)
"""What a distance of the clause may be instead: a way, a gap, a place beside, another part of the figure."""
_HIGH: Final = re.compile(r"\W*(?:high|tall|up|above|over|de alt\w+|sobre)\b")
_FROM: Final = re.compile(r"\W*(?:distance |away |de distancia )?(?:from(?! it\b| (?:the |its )?cent)|of|del?)\b")
_OTHER_USES: Final = ("height", "altitude", "east", "north", "up", "gap")


def assumed_sizes(words: Words, task: Task, text: str) -> Iterator[Shortfall]:
    """Find figures with a size that nobody gave, although the request gives it.

    Args:
        words: the request, as read.
        task: the checked task.
        text: its YAML.
    """
    code = code_of(text)
    for name, param in task.params.items():
        size = _SIZES.get(re.sub(r"_\d+$", "", name))
        is_assumed = re.search(rf"^  {name}: .*# assumed$", text, re.MULTILINE) is not None
        if size is None or not is_assumed or re.search(rf"\b{size.figure}\(.*\b{name}\b", code) is None:
            continue
        given = f"{param.default.const:g} m" if param.default is not None and param.default.is_const else "something"
        for amount in words.amounts:
            if amount.type == "distance" and _is_size(words, amount, size) and not _is_used(words, task, amount):
                yield Shortfall(
                    "size_assumed",
                    f'the request says "{amount.words}" of the {size.figure}, and the task assumes its {name}: {given}',
                    help=f"{size.figure}(..., {amount.si:g} m)",
                    about=amount.words,
                )


def _is_size(words: Words, amount: Amount, size: _Size) -> bool:
    """Return whether an amount is the size of such a figure, for certain."""
    if is_height(words, amount) or gap_of(words) == f"{amount.si:g} m" or words.text.count(amount.words) != 1:
        return False
    text = words.text.casefold()
    for said in words.places.values():
        text = text.replace(said.casefold(), "_" * len(said))
    begin = text.find(amount.words.casefold())
    before, behind = text[:begin], text[begin + len(amount.words) :]
    if _HIGH.match(behind) or (size.before.search(before) is None and size.behind.match(behind) is None):
        return False
    own = _CLAUSE.split(before)[-1] + _CLAUSE.split(behind)[0]
    if size.figure == "circle":
        return size.about.search(own) is not None and _ELSE.search(own) is None
    own = re.sub(r"\b(?:right (?:angles?|corners?)|two|three|both|all|beside|dos|tres|ambos)\b", " ", own)  # sides
    return size.about.search(text) is not None and _ELSE.search(own) is None


def _is_used(words: Words, task: Task, amount: Amount) -> bool:
    """Return whether a task uses an amount as more than a height or the way to a place beside."""
    uses = {
        re.sub(r"_\d+$", "", one.name)
        for one in task.params.values()
        if one.type.name == "distance" and one.default is not None and one.default.is_const
        if amount.means("distance", float(one.default.const))
    }
    at = amount.at + len(amount.words)
    is_beside = bool(uses & {"east", "north", "gap"}) and _FROM.match(words.text.casefold(), at) is not None
    return is_beside or not uses <= set(_OTHER_USES)
