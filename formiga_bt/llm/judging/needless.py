"""Questions of a model whose answer stands in the request: `Where shall it go?`, though the request names the place.

Only where every word of the request is known, so that nothing else can be meant; what points at something (`there`, `the usual
one`) may need a question.
"""

import re
from typing import Final

from formiga_bt.llm.words.gainsaid import is_flown
from formiga_bt.llm.words.wording import DRONES, Words, types_said
from formiga_bt.llm.world import RequestWorld

_WHERE: Final = re.compile(r"\bwhere (?:shall|should|is|does|must)\b|\bwhich places?\b(?! is the)", re.IGNORECASE)
_ENDS: Final = re.compile(r"\b(?:round|around|between|about) which\b", re.IGNORECASE)
_BETWEEN: Final = re.compile(r"\bbetween which\b", re.IGNORECASE)
_HAS_ENDS: Final = re.compile(
    r"\b(?:between|from|along|way|route|line|straight|zig-?zag\w*|weav\w*|back and forth|to and fro|shuttl\w*|legs?|"
    r"entre|desde|ruta|línea|tramos?|ida|ir y venir|va y viene)\b",
    re.IGNORECASE,
)
"""Words of a way that has two ends."""
_WHAT: Final = re.compile(r"\bwhat (?:shall|should|is to|must)\b", re.IGNORECASE)
_WHO: Final = re.compile(r"\bwhich (?:machine|drone|one|agent)\b", re.IGNORECASE)
_PROPOSES: Final = re.compile(r"^\W*(?:(?:how|what) about|would you like|do you want|may I|shall I)\b", re.IGNORECASE)
_POINTS: Final = re.compile(
    r"\b(?:there|that|those|these|this|them|others?|other one|one of|all of|any|some|either|next|same|which|where|who|what|"
    r"first|second|mine|ours|usual|allí|ahí|aquí|eso|esto|otro|otra|mismo|misma|ese|esa|le|lo|los)\b",
    re.IGNORECASE,
)
_DEED: Final = re.compile(
    r"\b(?:fl(?:y|ies)|goes?|look\w*|check\w*|watch\w*|inspect\w*|visit\w*|search\w*|explore\w*|scan\w*|survey\w*|hover\w*|land\w*|"
    r"circl\w+|orbit\w*|zig-?zag\w*|patrol\w*|vuel[ae]\w*|va|vaya|mir[ae]|vigil[ae]|revis[ae]|visit[ae]|explor[ae]|busc[ae]|busque|"
    r"aterri[zc]\w+|rode[ae]\w*|manda|mande|send|gather\w*|assembl\w+|park\w*|return\w*|settle\w*)\b",
    re.IGNORECASE,
)


def is_reported(words: Words, world: RequestWorld) -> bool:
    """Return whether a request says what to do and where, in words that are all known, and points at nothing else."""
    bare = _bare(words)
    said = _POINTS.search(bare) is None and _DEED.search(bare) is not None
    return said and bool(words.places) and is_flown(words, world)


def _bare(words: Words) -> str:
    """Return a request without the names of the site in it."""
    text = words.text
    for name in sorted({*words.places.values(), *words.agents.values()}, key=len, reverse=True):
        text = text.replace(name, " ")
    return text


def needless(question: str, words: Words, world: RequestWorld) -> str:
    """Return why a question need not be asked; "" = it may be.

    Args:
        question: as a model put it.
        words: the request, read.
        world: the site and its fleet.
    """
    bare = _bare(words)
    if _BETWEEN.search(question) and words.places and not _HAS_ENDS.search(bare) and is_reported(words, world):
        return "the answer asks between which places, and the request wants no way between places"
    if _POINTS.search(bare) or _ENDS.search(question) or not is_flown(words, world):
        return ""
    if _PROPOSES.search(question) and is_reported(words, world):
        return "the answer proposes something else, and the request says what to do"
    if _WHERE.search(question) and words.places:
        return f"the answer asks where, and the request names {', '.join(words.places)}"
    if _WHAT.search(question) and words.places and (deed := _DEED.search(bare)) is not None:
        return f'the answer asks what to do, and the request says "{deed[0]}"'
    types = world.catalogue.types
    named = [*words.agents, *(one for one in types_said(words, world.catalogue) if not types[one].human)]
    if _WHO.search(question) and (named or re.search(rf"\b(?:{'|'.join(DRONES)})\b", bare, re.IGNORECASE)):
        return f"the answer asks which machine, and the request names {', '.join(named) or 'a drone'}"
    return ""
