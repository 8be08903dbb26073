"""Whether a request wants machines in the air at one time: `meanwhile`, `while that goes on`, `mientras tanto`.

`At once` is `without delay`, too; what is said of all days (`every day at the same time`) or of lines (`in parallel rows`) is
another matter.
"""

import re
from typing import Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import Words

_OTHER: Final = r"(?:another|the\s+other|a\s+second|the\s+second|otr[oa]|(?:el|la)\s+otr[oa]|un\s+segundo|el\s+segundo)"
_NOW: Final = re.compile(
    rf"\b(?:meanwhile|(?:in\s+the\s+)?meantime|simultaneous(?:ly)?|while\s+{_OTHER}"
    r"|(?:the\s+)?same\s+(?:time|moment|instant)(?!\s+(?:as\s+(?:yesterday|before|always|usual)|of\s+(?:the\s+)?day|every|each|"
    r"tomorrow|daily|next))"
    r"|while\s+(?:that|this|it)\s+(?:goes|is\s+going|happens|is\s+happening|lasts|is\s+on)(?:\s+on)?"
    rf"|during\s+(?:it|that|this)(?=\s*(?:[,.;:]|$)|\s+{_OTHER})"
    r"|in\s+parallel(?!\s+(?:lines?|rows?|tracks?|lanes?|strips?|paths?|legs?|to\b|with\s+the))"
    r"|(?:al|en\s+el)\s+mismo\s+(?:tiempo|momento|instante)|a\s+la\s+vez|mientras\s+tanto|entretanto|simultáne(?:o|a)(?:mente|s)?"
    rf"|en\s+paralelo(?!\s+(?:al?|con)\b)|mientras\s+(?:que\s+)?{_OTHER})\b",
    re.IGNORECASE,
)
_SOON: Final = re.compile(r"\bat\s+once\b", re.IGNORECASE)
_ALL_SOON: Final = re.compile(
    r"\b(?:both|together|all\s+of\s+them)\b[^.;:,]*\bat\s+once\b|\b(?:airborne|in\s+the\s+air|flying)\s+at\s+once\b",
    re.IGNORECASE,
)
_LATER: Final = re.compile(
    r"\b(?:after\s+(?:that|it|this)|only\s+then|one\s+(?:after|by\s+one)|one\s+at\s+a\s+time|in\s+turns?|by\s+turns|"
    r"(?:not|never|without|n't|cannot|nobody|no\s+two)\b[^.;:]*\b(?:at\s+once|same\s+(?:time|moment|instant)|simultaneous\w*|"
    r"in\s+parallel)|(?:un[oa]|de\s+un[oa]\s+en\s+un[oa])\s+(?:tras|después\s+de|detrás\s+de)\s+(?:el\s+|la\s+)?otr[oa]|"
    r"(?:de\s+)?un[oa]\s+(?:en\s+un[oa]|a\s+la\s+vez)|por\s+turnos|(?:sólo|solo)\s+entonces|después\s+de\s+(?:eso|ello|esto)|"
    r"(?:no|nunca|jamás|ni|sin)\b[^.;:]*\b(?:a\s+la\s+vez|mismo\s+(?:tiempo|momento|instante)|simultáne\w*|en\s+paralelo))\b"
    r"|n't\b[^.;:]*\b(?:at\s+once|same\s+time|simultaneous\w*|in\s+parallel)",
    re.IGNORECASE,
)
_IN_TURN: Final = re.compile(
    r"\b(?:then|afterwards|later|subsequently|luego|después)[\s,]+(?:the\s+|an?\s+|el\s+|la\s+|un\s+)?"
    r"(?:other|another|second|third|last|heavy|light|small|big|hwd|lwd|otr[oa]|segund[oa]|tercer[oa]?)\b"
    r"|\b(?:after|before|once|when|until|as\s+soon\s+as|cuando|después\s+de(?:\s+que)?|tras|antes\s+de(?:\s+que)?|hasta\s+que)\s+"
    r"(?:the\s+|el\s+|la\s+)?(?:first|one|other|second|last|primer[oa]?|un[oa]|otr[oa]|segund[oa])\b"
    r"|\b(?:relay|reliev\w+|replac\w+|swap\w*|hand\w*\s+over|takes?\s+over|in\s+(?:its|his)\s+place|relev\w+|sustitu\w+|reemplaz\w+)\b"
    r"|\b(?:if|unless|otherwise|depend\w*|whichever|si|salvo|según|depende\w*)\b",
    re.IGNORECASE,
)
"""One flies after the other, or only in a certain case."""
_WAITS: Final = re.compile(
    r"\b(?:other|another|second|otr[oa]|segund[oa])\s+(?:[\w-]+\s+){0,3}?"
    r"(?:waits?|waiting|stays?|remains?|stands?|rests?|sits?|espera\w*|se\s+queda|permanece)\b"
    r"|\b(?:stand(?:s|ing)?[\s-]?by|in\s+reserve|grounded|de\s+reserva)\b",
    re.IGNORECASE,
)
_RESTS: Final = re.compile(
    r"\b(?:stands?|stays?|remains?|rests?|sits?|waits?|parks?|parked|on\s+the\s+ground|se\s+queda|permanece|espera\w*|"
    r"en\s+(?:tierra|el\s+suelo))\b",
    re.IGNORECASE,
)


def at_once(words: Words) -> bool:
    """Return whether a request says that machines fly at the same time, and nothing of one after the other."""
    text = unquoted(words.text)
    now = _NOW.search(text) is not None or _SOON.search(text) is not None
    return now and _LATER.search(text) is None


def certainly_at_once(words: Words) -> bool:
    """Return whether a task in which one machine flies after the other is wrong for certain.

    It is not where `at once` may mean `soon`, nor where a condition, an answer or a turn keeps the machines apart.
    """
    text = unquoted(words.text)
    now = _NOW.search(text) is not None or _ALL_SOON.search(text) is not None
    apart = _IN_TURN.search(text) is not None or _WAITS.search(text) is not None or words.means("ask")
    return now and at_once(words) and not apart


def may_rest(words: Words) -> bool:
    """Return whether a machine may stand on the ground while another one flies."""
    return _RESTS.search(unquoted(words.text)) is not None
