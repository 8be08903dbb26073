"""What a request says of landings: those that it wants, those that it rules out, and the words that only sound like one.

`lands` may be one below; `without landing` is none; `the landing lights` and `the land around the camp` are things to see.
"""

import re
from typing import Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import INTENTS, Words

NO_LANDING: Final = re.compile(
    r"(?<!as its )(?<!as the )(?<!as a )\b(?:landing|touch-?down)[ -](?:sites?|places?|pads?|zones?|areas?|strips?|lights?|"
    r"gears?|spots?|mats?|grounds?|beacons?|"
    r"stages?|marks?|markers?|craft)\b"
    r"|\b(?:lugar|zona|pista|sitio|plataforma|punto|luz|luc)(?:es|s)? de aterrizaje\b"
    r"|\b(?:the|dry|on|of|this|that|open|flat|a|over|our|your|farm|waste|burnt|private|public|wet|marshy|fallow) land\b"
)
"""What has the word, and is no landing."""
HOME: Final = re.compile(
    r"\b(?:home|ports?|back|return\w*|rtbs?|base|nests?|casa|puertos?|nido|vuelv\w*|volver|regres\w*|retorn\w*|"
    r"palaa\w*|kotiin|asemalle|took off (?:from|at)|lifted off|starting (?:points?|places?|positions?)|"
    r"(?:where|from which|to which) (?:it|they|each) (?:started|took off|came from|lives?|belongs?|departed|set out)|"
    r"(?:it|they|each) (?:came|started|set out|departed|left) from|(?:point|pad|place) of (?:departure|origin)|"
    r"chargers?|(?:re)?charging (?:\w+)|docks?|docking \w+|hangars?|garages?|(?:heli)?pads?|cargador(?:es)?|helipuertos?|"
    r"(?:de |desde )?donde (?:salió|despegó|partió|estaba|vino)|punto de (?:partida|salida))\b"
    r"|\b(?:land(?:s|ing)?|touch(?:es|ing)? down|aterri\w+)(?: \w+){0,2}? (?:at|in|on|onto|by|en) (?:its|their|his|her|sus?) "
    r"(?!own\s*(?:[.,;:)]|$|and\b)|(?:own )?(?:place|spot|corner|point|position|side|end|target|turn|"
    r"destination|goal|sitio|lugar|puesto|esquina|"
    r"punto|posici|destino))"
)
"""Words of a way home, however it is said."""
DELIVERS: Final = (
    r"\b(?:takes?|brings?|carr(?:y|ies)|delivers?|transports?|llev[ae]n?|llevar|tra(?:e|iga|er)|transporta\w*|entrega\w*)\s+"
    r"(?:[\w-]+\s+){0,3}?(?:kits?|parcels?|packages?|packets?|box(?:es)?|crates?|baskets?|bags?|medicines?|supplies|food|water|"
    r"blankets?|tools?|equipment|cargo|something|paquetes?|botiqu[ií]n(?:es)?|cajas?|cestas?|medicinas?|suministros|comida|agua|"
    r"mantas?|carga|algo)\s+"
)
"""What is brought that no machine can let down from the air."""
DELIVERS_TO: Final = DELIVERS + r"(?:[\w-]+\s+){0,3}?(?:to|into|al?|hasta)\s+(?:the\s+|el\s+|la\s+)?"
_RULED_OUT: Final = re.compile(
    r"(?:\b(?:not|never|nor|neither|without|cannot|avoids?|avoiding|instead of|rather than|nobody|none|sin|nunca|jamás|tampoco|"
    r"ni|evit\w+|en vez de|en lugar de)\b|n't\b|\bno\b(?! (?:later|sooner|further|farther|more|less|longer)\b))"
    r"(?:(?!\b(?:and|but|then|when|once|until|before|y|pero|sino|luego|cuando|hasta)\b)[^.;:,!?]){0,30}?"
    r"\b(?:land(?:s|ed|ing)?|touch(?:es|ing)? down|aterri\w+)\b(?![^.;]*\b(?:until|till|before|unless|hasta|antes)\b)"
    r"|\b(?:landings?|aterrizajes?|aterrizar) (?:is|are|es|está|están) (?:not|never|forbidden|prohibited|no|prohibid\w+)\b"
)


def rules_out_landing(words: Words) -> bool:
    """Return whether a request says of somebody that it does not land: `without landing`, `under no circumstances land`."""
    return _RULED_OUT.search(_said(words)) is not None


def lands_only(words: Words) -> bool:
    """Return whether a request wants a landing, rules none out, and speaks of no way home."""
    text = _said(words)
    return re.search(INTENTS["land"], text) is not None and not HOME.search(text) and not _RULED_OUT.search(text)


def _said(words: Words) -> str:
    """Return a request in small letters without messages, and without what only sounds like a landing."""
    return NO_LANDING.sub(" ", unquoted(words.text).casefold())
