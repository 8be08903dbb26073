"""Whether a noun of a request means an agent, and a number how many: not in a saying, in a place's name, in a guess.

`keeps an eye on the camp` is no agent of type `eye`, `scout the field` none of type `scout`; `from row 12 drones fly home` and
`up to 7 drones` say no number of drones.
"""

import re
from collections.abc import Iterable
from typing import Final

_SAYINGS: Final = re.compile(
    r"\b(?:keep\w*|kept|ha(?:ve|s|d|ving)|cast\w*|lay\w*|set\w*|with)\s+(?:(?:an?|its|their|his|her|your|our|one|two|both|"
    r"all)\s+)?(?:[\w-]+\s+)?eyes?\s+(?:on|out|open|peeled|to|for)\b"
    r"|\bbird'?s?[\s-]+eye\b|\beagle\s+eye\b|\bnaked\s+eye\b|\beye\s+to\s+eye\b|\b(?:an?\s+)?eye[\s-]+(?:level|height|contact)\b"
    r"|\b(?:keep\w*|kept|st[ao]nd\w*|stood|mount\w*|on)\s+(?:an?\s+|the\s+)?(?:guard|lookout|watch|patrol)\b"
    r"|\b(?:by|at|on|lend\w*\s+a|give\w*\s+a)\s+hand\b"
    r"|\bech\w+\s+(?:un|el)\s+ojo\b|\ba\s+ojo\b|\bojo\s+(?:con|a)\b|\bmont\w+\s+guardia\b|\bde\s+(?:guardia|patrulla)\b"
    r"|\bech\w+\s+una\s+mano\b",
    re.IGNORECASE,
)
"""Sayings in which a noun is no agent."""
_TO_DO: Final = re.compile(
    r"\b(?:to|please|not)\s+$|\w\s+(?:will|would|shall|should|must|can|could|may|might)\s+$", re.IGNORECASE
)
_DONE_TO: Final = re.compile(
    r"\s+(?:the|an?|all|every|each|both|this|that|these|those|it|them|its|their|el|la|los|las|un|una)\b", re.IGNORECASE
)
_DETERMINER: Final = re.compile(
    r"(?:\b(?:an?|the|one|two|three|four|five|each|every|any|another|all|both|other|first|second|same|nearest|free|single|"
    r"its|their|our|my|your|no|un|una|el|la|los|las|dos|tres|otro|otra|cada|su|sus)|\d)\s+$",
    re.IGNORECASE,
)
_QUOTED: Final = re.compile(r'"[^"]*"|“[^”]*”|«[^»]*»')
_FEW: Final = (
    r"(?:\d+|one|two|three|four|five|six|seven|eight|nine|ten|dos|tres|cuatro|cinco|seis|siete|ocho|nueve|diez)"
)
_NOT_SO_MANY: Final = re.compile(
    r"(?:\b(?:up to|at most|at least|(?:more|less|fewer) than|instead of|rather than|(?:maximum|minimum|most) of|about|around|"
    r"roughly|or|hasta|(?:al|por lo) menos|como (?:máximo|mínimo|mucho)|(?:más|menos) de|en (?:vez|lugar) de|unos|o|at|klo)"
    r"|\b(?:not|never|if(?!\s+so\b)|unless|whether|nunca|si)(?:\s+\w+){0,2}|n't(?:\s+\w+){0,2}"
    r"|(?<!\bon )(?<!\ba )(?<!\bun )\bno(?:\s+\w+){1,2}"
    r"|\b(?:we|(?<!can )(?<!will )(?<!could )(?<!would )you|they|i|site|there)\s+"
    r"(?:\w+\s+)?(?:have|has|had|are|were|is)|\b(?:hay|tenemos|tiene)"
    rf"|\b(?:{_FEW}|some|any|each|none|out|half|which)\s+of\s+(?:the|our|my|those|these|all)"
    r"|\b(?:groups|teams|pairs|batches)\s+of|\b(?:grupos|equipos|parejas)\s+de"
    r"|\b(?:uno|una|alguno|algunos)\s+de\s+(?:los|las|nuestros)"
    rf"|\b(?:room|space|sitio|espacio)\s+(?:for|para)|\b{_FEW}\s+(?:to|a)"
    r"|\b(?:row|plot|point|checkpoint|step|site|gate|zone|sector|area|phase|number|no\.|nr\.?|fila|hilera|parcela|punto|paso|"
    r"zona|fase|número))\s*$",
    re.IGNORECASE,
)
"""What stands before a number that is none of machines, or no certain one: `up to`, `do not send`, `five or`, `row`."""
_COMPOUND: Final = re.compile(
    r"'|\s+(?:lengths?|widths?|heights?|diameters?|spans?|flights?|trips?|hours?|minutes?|ports?|pads?|batter\w+|rotors?|"
    r"propellers?|times?)\b",
    re.IGNORECASE,
)
"""What follows a noun that only goes with another one: `7 drone lengths`."""
_NOTHING: Final = "·"


def bare(request: str, places: Iterable[str] = ()) -> str:
    """Return a request without sayings, and without the names of places that hold further words; as long as before.

    Args:
        request: in words.
        places: the words of it that name places.
    """
    for words in sorted(set(places), key=len, reverse=True):
        if re.search(r"[\W\d_]", words):
            pattern = rf"(?<!\w){re.escape(words)}(?!\w)"
            request = re.sub(pattern, _blank, request, flags=re.IGNORECASE)
    return _SAYINGS.sub(_blank, request)


def unquoted(request: str) -> str:
    """Return a request without the messages in it; as long as before."""
    return _QUOTED.sub(_blank, request)


def _blank(match: re.Match[str]) -> str:
    return _NOTHING * len(match[0])


def is_doing(request: str, start: int, end: int) -> bool:
    """Return whether a word is what is done, not who does it: `scout the field`, `flies there to scout`.

    Args:
        request: in words.
        start: where the word begins.
        end: where it ends.
    """
    before, after = request[:start], request[end:]
    if _DETERMINER.search(before) or " " in request[start:end]:
        return False
    return _TO_DO.search(before) is not None or _DONE_TO.match(after) is not None


def is_certain(request: str, start: int, end: int) -> bool:
    """Return whether a number with its noun, `7 drones`, says for certain how many take part.

    Args:
        request: in words.
        start: where the number begins.
        end: where the noun ends.
    """
    return _NOT_SO_MANY.search(request[:start]) is None and _COMPOUND.match(request, end) is None
