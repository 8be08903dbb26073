"""Whether a distance of a request is a height for certain."""

import re
from typing import Final

from formiga_bt.llm.shaping.teams import gap_of
from formiga_bt.llm.words.amounts import Amount
from formiga_bt.llm.words.wording import Words

_HIGH: Final = re.compile(
    r"\s*(?:high\b|above\b|up\b(?!\s+to)|of (?:height|altitude)|altitude|in (?:height|altitude)|over the ground|"
    r"de alt(?:ura|o)|sobre el suelo)",
    re.IGNORECASE,
)
_HEIGHT_OF: Final = re.compile(r"\b(?:(?:height|altitude|altura|altitud)(?:\s+(?:of|is|at|de))?)\s*$", re.IGNORECASE)
_AT: Final = re.compile(r"\b(?:at|from|desde|up at|a)\s+(?:about\s+|unos\s+)?$", re.IGNORECASE)
_NO_MORE: Final = re.compile(
    r"\s*(?:$|[.,;:)]|(?:and|then|over|for|while|during|all|the whole|y|luego|durante|sobre|mientras)\b)", re.IGNORECASE
)
_NO_HEIGHT: Final = re.compile(
    r"\b(?:lands?|landing|aterri\w+|apart|radius|away|distance|gap|spacing|side|legs?|wide|long|separation|separad\w+|radio|distancia|lado)\b",
    re.IGNORECASE,
)


def is_height(words: Words, amount: Amount) -> bool:
    """Return whether an amount says how high a machine flies: `at a height of 20 m`, `20 m up`, `at 20 m and ...`.

    Args:
        words: the request.
        amount: one of its distances.
    """
    before, behind = words.text[: amount.at], words.text[amount.at + len(amount.words) :]
    is_gap = gap_of(words) == f"{amount.si:g} m"
    if is_gap or _NO_HEIGHT.search(before[-24:]) or _NO_HEIGHT.match(behind.lstrip()):
        return False
    return bool(_HIGH.match(behind) or _HEIGHT_OF.search(before) or (_AT.search(before) and _NO_MORE.match(behind)))
