"""Of how many legs a zigzag is to be, as a request says it."""

import re
from typing import Final

from formiga_bt.llm.words import plain_words
from formiga_bt.llm.words.amounts import NUMBERS
from formiga_bt.llm.words.wording import Words

_NUMBER: Final = rf"(\d{{1,2}}|{'|'.join(word for word, number in NUMBERS.items() if number > 1)})"
_LEGS: Final = re.compile(
    rf"\b{_NUMBER}\s+(?:(?:straight|equal|zig-?zag|diagonal|slanting|oblique|rectos?|oblicuos?)\s+)*"
    r"(?:legs|stretches|segments|strokes|tramos|segmentos)\b"
    rf"|\b(?:legs|tramos)\s*[:=]\s*{_NUMBER}\b",
    re.IGNORECASE,
)
_ZIGZAG: Final = re.compile(rf"\bzig-?zag\w*|{plain_words.pattern_of('zigzag')}", re.IGNORECASE)
_IN_TREE: Final = re.compile(r"(\bzigzag\((?:[^()]|\([^()]*\))*,\s*)(\d+)(\s*\))")


def legs_of(words: Words) -> int:
    """Return how many legs the zigzag of a request is to have; 0 = it says nothing for certain."""
    if _ZIGZAG.search(words.text) is None:
        return 0
    said = {(match[1] or match[2]).casefold() for match in _LEGS.finditer(words.text)}
    found = {int(one) if one.isdecimal() else NUMBERS[one] for one in said}
    return found.pop() if len(found) == 1 else 0


def legs_in(code: str) -> set[int]:
    """Return the numbers of legs of the zigzags in a task, or in a value of the short form."""
    return {int(match[2]) for match in _IN_TREE.finditer(code)}


def with_legs(value: str, legs: int) -> str:
    """Return a value of the short form with so many legs in its zigzag."""
    return _IN_TREE.sub(lambda match: f"{match[1]}{legs}{match[3]}", value)
