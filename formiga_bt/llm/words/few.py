"""How many machines are meant, where no number stands right before them: `a couple of drones`, `three of the`, `drones, two`.

What could be a part of more (`two of the drones land, the third hovers`) is none.
"""

import re
from collections.abc import Iterator
from typing import Final

from formiga_bt.llm.words.mentions import is_certain

_TWO: Final = r"(?:(?:an?|the|una?|el|la)\s+)?(?:pair|couple|par|pareja)(?=\s+(?:of|de)\b)"
_OF: Final = r"(?:\s*[x×]\s*|\s+(?:of\s+|de\s+)?)"
_OF_THE: Final = r"\s+(?:of\s+(?:the|our|your|these|those)|de\s+(?:los|las|nuestros|estos|esos))\s+"
_TO_BEGIN: Final = re.compile(
    r"(?:^|[.;:,(–—]|\b(?:and|plus|y|use|using|take|send|with|usa|manda|con))\s*(?:the\s+)?$", re.IGNORECASE
)
"""What stands before a list of machines and numbers: `LWDs, two; HWD, one`."""
_EACH_OF: Final = r"(?:each|every\s+one|cada\s+un[oa])\s+(?:of\s+(?:the|our|these|those)|de\s+l[oa]s)\s+"
_BESIDE: Final = re.compile(
    r"\b(?:from|over|above|round|around|about|between|near|than|for|by|behind|beside|to|at|watch\w*|circl\w+|escort\w*|follow\w*|"
    r"sobre|entre|de|a)\s+$",
    re.IGNORECASE,
)
"""What stands before machines that something is done to: they may be none of the task."""
_BEGINS: Final = r"(?:^|[.;:,!?]\s*|\b(?:and|then|with|send|take|use|let|have|y|luego|con|que)\s+)"
_EVERY: Final = re.compile(
    rf"{_BEGINS}(?:all(?:\s+of)?(?:\s+(?:the|our))?|every|each|tod[oa]s\s+l[oa]s|cada)\s+$", re.IGNORECASE
)
_FLEET: Final = re.compile(rf"{_BEGINS}(?:the|our)\s+(?:whole|entire|complete)\s+fleet\b", re.IGNORECASE)
_NO_PART: Final = re.compile(
    r"\s*,?\s*(?:(?:stay|remain|keep|wait|permanece)\w*|are|is|that|which|who|whose|with|of|except|but|save|other|not|do|does|must|"
    r"may|can|could|will|should|shall|in|on|at|near|se\s+quedan?|que|con|excepto|salvo|menos|no)\b",
    re.IGNORECASE,
)
"""What follows machines that take no part, or that are only some of them."""
_SHIP: Final = r"[\s-]+ships?\b(?:\s+(?:formation|flight|team|group))?(?:\s+of|\s*[,:])?\s+"
_REST: Final = re.compile(
    r"\b(?:others?|rest|remaining|third|fourth|fifth|last|all|every|otr[oa]s?|demás|resto|tercer[oa]?|cuart[oa]|últim[oa]|"
    r"tod[oa]s)\b",
    re.IGNORECASE,
)
_EACH_OTHER: Final = re.compile(
    r"\b(?:each other|one another|(?:from|off|beside) the other|un[oa]s? de(?:l| la)? otr[oa]s?)\b", re.IGNORECASE
)
_BESIDES: Final = re.compile(
    r"\b(?:another|other|further|second|otr[oa]s|segund[oa]|each|every|cada)\s+$", re.IGNORECASE
)
_THIRD: Final = re.compile(
    r"\b(?:third|tercer[oa]?|yet another|(?:two|three|dos|tres)\s+(?:more|others|más|otros)|others|otros|rest)\b",
    re.IGNORECASE,
)
_OTHER: Final = r"\b(?:the\s+other|el\s+otro)\s+"
_DOES: Final = (
    r"(?:ones?|drone?|lwd|hwd|uav|of\s+(?:the|them)|goes|flies|hovers|lands|circles|looks|stays|waits|watches|zigzags|does|is|"
    r"va|vuela|aterriza|rodea|regresa|vuelve|espera|se)\b"
)


def numbers(request: str, nouns: str, words: str) -> Iterator[tuple[int, int, str]]:
    """Yield where a number of machines begins, where it ends with its noun, and the word of the number.

    Args:
        request: in words.
        nouns: a pattern of what the machines are called.
        words: a pattern of numbers.
    """
    number = rf"(?<![\w.:,/–-])(\d+|{words})"
    end = r"(?!\w)"
    every = (
        rf"(?<![\w.:,/–-])({_TWO}|\d+|{words}){_OF}(?:{nouns}){end}",
        rf"{number}{_SHIP}(?:{nouns}){end}",
    )
    for pattern in every:
        for match in re.finditer(pattern, request, re.IGNORECASE):
            yield match.start(1), match.end(), match[1].casefold()
    for match in re.finditer(rf"\b{_EACH_OF}(\d+|{words})\s+(?:{nouns}){end}", request, re.IGNORECASE):
        if _BESIDE.search(request[: match.start()]) is None:
            yield match.start(), match.end(), match[1].casefold()
    both = rf"\bboth\s+(?:of\s+)?(?:the\s+|our\s+)?(?:{nouns}){end}(?!\s+and\b)"
    for match in re.finditer(both, request, re.IGNORECASE):
        if _BESIDE.search(request[: match.start()]) is None:
            yield match.start(), match.end(), "2"
    partial = _REST.search(_EACH_OTHER.sub(" ", request)) is not None
    for match in re.finditer(rf"(?<![\w.:,/–-])({_TWO}|\d+|{words}){_OF_THE}(?:{nouns}){end}", request, re.IGNORECASE):
        if not partial and match[1].casefold() not in ("1", "one", "uno", "una"):
            yield match.start(1), match.end(), match[1].casefold()
    listed = rf",\s*(?:and\s+|y\s+)?(?:\d|{words})"
    behind = rf"(?<!\w)(?:{nouns})\s*[,:(x×]\s*(\d+|{words})(?=\s*(?:[;:)]|,(?!\d)|\.(?!\d)|$))(?!\s*{listed})"
    for match in re.finditer(behind, request, re.IGNORECASE):
        if _TO_BEGIN.search(request[: match.start()]) is not None and match[1].casefold() not in ("1", "one"):
            yield match.start(1), match.end(), match[1].casefold()


def is_every(request: str, nouns: str) -> bool:
    """Return whether a request speaks of some machines only as all of them that there are: `all light drones fly ..`."""
    mentions = list(re.finditer(rf"(?<!\w)(?:{nouns})(?!\w)", request, re.IGNORECASE))
    return bool(mentions) and all(
        _EVERY.search(request[: one.start()]) is not None and not _NO_PART.match(request, one.end()) for one in mentions
    )


def is_fleet(request: str) -> bool:
    """Return whether a request speaks of the whole fleet, and has it do something."""
    return any(not _NO_PART.match(request, one.end()) for one in _FLEET.finditer(request))


def is_besides(request: str, start: int) -> bool:
    """Return whether a number counts machines besides those that were spoken of: `another two drones`."""
    return _BESIDES.search(request[:start]) is not None


def one_and_one(request: str, nouns: str) -> bool:
    """Return whether just two machines are spoken of, one by one: `a drone ... one more drone`, `one of the two ... the other`.

    Args:
        request: in words.
        nouns: a pattern of what they are called.
    """
    of_two = rf"\b(?:one\s+of\s+(?:the|our|these|those)|uno\s+de\s+(?:los|nuestros|estos))\s+(?:two|2|dos)\s+(?:{nouns})(?!\w)"
    first = re.search(of_two, request, re.IGNORECASE)
    if first is not None:
        return is_other_told(request[first.end() :])
    more = rf"\bone\s+more\s+(?:{nouns})(?!\w)|\bun\s+(?:{nouns})\s+más\b"
    ones = rf"\b(?:an?|one|uno?)\s+(?:{nouns})(?!\w)(?!\s+más\b)"
    first_ones, others = (list(re.finditer(one, request, re.IGNORECASE)) for one in (ones, more))
    sure = all(is_certain(request, *one.span()) for one in (*first_ones, *others))
    return sure and len(first_ones) == len(others) == 1 and _THIRD.search(request) is None


def is_other_told(request: str) -> bool:
    """Return whether something is said of the other one of two: `the other lands`."""
    return re.search(_OTHER + _DOES, request, re.IGNORECASE) is not None
