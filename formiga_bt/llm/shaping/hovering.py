"""Landings that nobody asked for: `over the camp at 40 m` is a flight to there at that height."""

import re
from typing import Final

from formiga_bt.llm.words.landings import DELIVERS
from formiga_bt.llm.words.wording import Words

_ARTICLE: Final = r"(?:the\s+|el\s+|la\s+|los\s+|las\s+)?"
_OVER: Final = r"\b(?:over|above|sobre|encima\s+del?)\s+"
_AND: Final = r"(?:\s*,\s*(?:and\s+|y\s+)?|\s+and\s+|\s+y\s+)"
_DOWN: Final = re.compile(
    r"\b(?:land\w*|ground|touch\w*|down|put\w*|set|sets|deliver\w*|drop\w*|unload\w*|park\w*|leave\w*|pick\w*|fetch\w*|"
    r"aterri\w+|suelo|tierra|pos[ae]\w*|baj\w+|entreg\w+|dej\w+|recog\w+)\b",
    re.IGNORECASE,
)
_BEFORE: Final = re.compile(r"\b(?:at|from|height(?: of)?|altitude(?: of)?|a|desde|altura(?: de)?)\s*$", re.IGNORECASE)
_AFTER: Final = re.compile(r"\s*(?:high|height|of height|up|altitude|de alt\w+)\b", re.IGNORECASE)


def height_over(text: str, words: Words) -> str:
    """Return at which height a request wants machines over places, if it wants nothing on the ground; else "".

    Args:
        text: the places, in the short form.
        words: the request.
    """
    if (
        _DOWN.search(words.text) is not None
        or re.search(DELIVERS, words.text, re.IGNORECASE) is not None
        or not over(words) >= _places(text, words)
    ):
        return ""
    far = [one for one in words.amounts if one.type == "distance"]
    if len(far) != 1 or not _places(text, words):
        return ""
    at = far[0].at
    before, after = words.text[:at], words.text[at + len(far[0].words) :]
    is_height = _BEFORE.search(before) is not None or _AFTER.match(after) is not None
    return f"{far[0].si:g} m" if is_height else ""


def over(words: Words) -> set[str]:
    """Return the places that a request wants machines over: `over the camp and the lake shore`."""
    names = {said.casefold(): name for name, said in words.places.items()}
    if not names:
        return set()
    one = rf"{_ARTICLE}(?:{'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))})(?!\w)"
    found = " ".join(match[0] for match in re.finditer(rf"{_OVER}{one}(?:{_AND}{one})*", words.text, re.IGNORECASE))
    return {name for said, name in names.items() if re.search(rf"(?<!\w){re.escape(said)}(?!\w)", found.casefold())}


def _places(text: str, words: Words) -> set[str]:
    return {name for name in re.findall(r"[A-Za-z_]\w*", text) if name in words.places}
