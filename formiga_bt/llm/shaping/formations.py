"""What a request says of machines that stand as a figure: how long its legs are, and that each lands below where it hovers."""

import re
from typing import Final

from formiga_bt.llm.words.spoken import is_english
from formiga_bt.llm.words.triangles import PERHAPS_TRIANGLE
from formiga_bt.llm.words.wording import Words

_TRIANGLE: Final = re.compile(PERHAPS_TRIANGLE, re.IGNORECASE)
_LEGS_BEFORE: Final = re.compile(r"\b(?:legs?|catetos?)\W*(?:(?:of|are|is|both|each|de|:)\s*)*$", re.IGNORECASE)
_LEGS_AFTER: Final = re.compile(
    r"\W*(?:long )?(?:legs|catetos)\b"
    r"|\s+(?:away|off|out)?\s*from (?:it|that(?: one)?|the first(?: one)?|the lead|lead)\b",
    re.IGNORECASE,
)
_HIGH: Final = re.compile(r"\W*(?:high|up|above|(?:of|in|de) (?:height|altitude|alto|altura))\b", re.IGNORECASE)
_LEGS_IN: Final = re.compile(r"triangle\((?:[^()]|\([^()]*\))*,\s*(\d+(?:\.\d+)?\s*k?m)\s*\)")
_BELOW: Final = re.compile(
    r"\b(?:land|lands|landing|touch(?:es)? down|come down|comes down)\b(?P<en>[^.;]{0,50}?)"
    r"(?:\b(?:below|beneath|underneath)\b(?!\s+(?:the|a|an|it to|\d))|\b(?:straight|right|vertically) down\b"
    r"|\bwhere (?:it|they|each|each one|each of them) (?:is|are|hovers?|stands?|floats?)\b(?! told| sent| to)"
    r"|\b(?:under|below) (?:it|them|itself|themselves)\b|\bon the spot\b|\bright there\b)"
    r"|\b(?:straight|vertically) down (?:to land|and land)\b"
    r"|\baterri\w+(?P<es>[^.;]{0,50}?)(?:\b(?:debajo|abajo|en vertical|ahí mismo|allí mismo|en el sitio)\b(?! de\b)"
    r"|\bdonde (?:está|están|se encuentran?)\b)",
    re.IGNORECASE,
)
_LANDS_AT: Final = re.compile(
    r"\b(?:land(?:s|ing)?|touch(?:es)? down|aterri\w+)\s+(?:all\s+|each\s+|both\s+|together\s+|juntos\s+|todos\s+)*"
    r"(?:at|in|on|by|near|beside|next to|en|junto a|cerca de)\b"
    r"(?!\s+(?:once|the same time|(?:the )?spot|their|its|turn|vertical|su|arrival|the ground|(?:the )?(?:end|last)|"
    r"destination|pairs?|an? (?:row|line|column|circle|triangle)|formation|order|parallel|succession|both|each|all|signal|"
    r"command|\d+|"
    r"(?:that|this|the)(?: same| very)* (?:place|spot|point|position|location))\b)",
    re.IGNORECASE,
)
_LANDING: Final = re.compile(
    r"\b(?:land(?:s|ing)?|touch(?:es|ing)? down|(?:sets?|puts?)(?: itself| themselves)? down|comes? down|alights?|aterri\w+|"
    r"se posan?|toman? tierra)\b",
    re.IGNORECASE,
)
_TO: Final = r"\b(?:to|towards?|a|al|hasta)\s+(?:the\s+|el\s+|la\s+)?"
_AND_LAND: Final = r",?\s+(?:and|to|y|para)\s+(?:then\s+|luego\s+)?(?:lands?|aterri\w+)\b"
_OTHERWISE: Final = re.compile(
    r"\b(?:rows?|lines?|columns?|side by side|beside each other|next to each other|fila|línea|hilera|columna)\b",
    re.IGNORECASE,
)


def leg_of(words: Words) -> str:
    """Return how long the legs of a triangle are to be, as the request says it, or ""."""
    if _TRIANGLE.search(words.text) is None:
        return ""
    found = set()
    for amount in words.amounts:
        before, after = words.text[: amount.at], words.text[amount.at + len(amount.words) :]
        if amount.type != "distance" or _HIGH.match(after) is not None:
            continue
        if _LEGS_BEFORE.search(before) or _LEGS_AFTER.match(after):
            found.add(f"{amount.si:g} m")
    return found.pop() if len(found) == 1 else ""


def legs_in(text: str) -> str:
    """Return the legs of the triangle that a value of the short form is, as they are written, or ""."""
    found = _LEGS_IN.fullmatch(text.strip())
    return found[1] if found is not None else ""


def lands_below(words: Words) -> bool:
    """Return whether a request says that machines land below where they hover, and nothing of a place to land at."""
    found = _BELOW.search(words.text)
    if found is None or _LANDS_AT.search(words.text) is not None:
        return False
    between = f"{found['en'] or ''}{found['es'] or ''}".casefold()
    return not any(said.casefold() in between for said in words.places.values())


def can_land_at(text: str, words: Words) -> bool:
    """Return whether a place or a list may be where a request wants a landing: it names that place, or none to land at."""
    names = sorted(words.places.items(), key=lambda one: len(one[1]), reverse=True)
    listed = "|".join(f"(?P<p{i}>{re.escape(said)})" for i, (_, said) in enumerate(names)) or "(?!)"
    there: set[str] = set()
    number = 0
    for way in (rf"{_LANDS_AT.pattern}\s+(?:the\s+|el\s+|la\s+)?(?:{listed})(?!\w)", rf"{_TO}(?:{listed}){_AND_LAND}"):
        for match in re.finditer(way, words.text, re.IGNORECASE):
            there |= {name for i, (name, _) in enumerate(names) if match[f"p{i}"]}
            number += 1
    if len(_LANDING.findall(words.text)) > max(number, len(_LANDS_AT.findall(words.text))):
        return True  # a landing without a place
    if not there:
        return _LANDS_AT.search(words.text) is None or not is_english(words.text)
    return any(re.search(rf"\b{re.escape(name)}\b", text) for name in there)


def is_reported_once(text: str, places: str, words: Words) -> bool:
    """Return whether places to land at can only be those of a figure in the air: the request names them once, for that.

    Args:
        text: where a model has machines land, a place or a list.
        places: where they hover.
        words: the request.
    """
    names = {one for one in re.findall(r"[A-Za-z_]\w*", text) if one in words.places}
    if not names or not all(re.search(rf"\b{re.escape(one)}\b", places) for one in names):
        return False
    if _OTHERWISE.search(words.text) or _LANDS_AT.search(words.text):
        return False
    return all(len(words.spans(one)) == 1 for one in names)
