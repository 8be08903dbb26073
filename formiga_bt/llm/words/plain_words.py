"""One plain word for what is said in several: a model that knows `zigzag` is shown `in a zigzag` where a request has `weaves`.

The request itself stays as it was, in the file, the records and the comparison. Names of the site and messages in quotes are
left alone. A word stands here only if it means the plain one for certain, as drones are spoken of.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from formiga_bt.llm.words.amounts import in_metres
from formiga_bt.llm.words.endings import written_out

_PLACE_AT: Final = r"(?=\s+(?:at|in|on|by|near|beside|there|here|where|for|and|safely|gently)\b|\s*(?:[.,;:!]|$))"
_OVER: Final = r"(?=\s+(?:\S+\s+(?:m|s|min|h|met\w+|sec\w*|minutes?|hours?)\s+)?(?:over|above)\b)"
_SOBRE: Final = r"(?=\s+(?:\S+\s+(?:m|s|min|h|metros?|segundos?|minutos?)\s+)?(?:sobre|encima)\b)"
_AT_END: Final = r"(?=\s*(?:[.;!]|$))"
_MACHINES_DOWN: Final = (
    r"(?=\s+(?:[^\W_]+\s+){0,3}?(?:drones?|lwds?|hwds?|uavs?|machines?|them)\b[^.;]{0,40}\bon the ground\b)"
)
_FLY_TO: Final = "|".join(4 * ["fly to|flies to"])
_ROUND: Final = r"\s+(?:about|around|round)\b"
_OF: Final = r"(?:\s+of\s+\S+\s+(?:m|met\w+))?"
_TOOTH: Final = r"saw(?:[- ]?(?:blade|tooth|teeth))?"


@dataclass(frozen=True, slots=True)
class Phrasing:
    """Words that mean a plain word. Forms stand in the order of the plain ones: `weave|weaves`, `fly ..|flies ..`."""

    forms: str
    plain: str
    after: str = ""
    """A pattern of what follows; what it takes in is replaced too."""
    sure: bool = True
    """Whether a task that does not do the plain thing is wrong."""


DEEDS: Final[Mapping[str, tuple[Phrasing, ...]]] = {
    "zigzag": (
        Phrasing("weave|weaves|weaving", "fly in a zigzag|flies in a zigzag|flying in a zigzag", r"(?:\s+(?:its|their) way)?"),
        Phrasing(
            "serpentea|serpentee|serpentear|serpenteando",
            "vuela en zigzag|vuele en zigzag|volar en zigzag|volando en zigzag",
        ),
        Phrasing(rf"(?:like|as|in the shape of) (?:(?:a|an|the) )?(?:(?:teeth|edge) of (?:a|the) )?{_TOOTH}", "in a zigzag"),
        Phrasing(rf"(?:in )?(?:a )?{_TOOTH}(?:ed)? (?:line|pattern|course|path|shape)", "in a zigzag"),
        Phrasing(r"in (?:a )?(?:slalom|serpentines?|saw[- ]?tooth)", "in a zigzag", r"(?: (?:line|pattern|course|path))?"),
        Phrasing(r"(?:a|the) (?:slalom|serpentine)", "a zigzag", r"(?: (?:line|pattern|course|path))?"),
        Phrasing("slalom|slaloms|slaloming", "fly in a zigzag|flies in a zigzag|flying in a zigzag"),
        Phrasing(r"serpentines?|saw[- ]?tooth", "zigzag"),
        Phrasing(r"zig zag", "zigzag"),
        Phrasing(r"(?:(?:en|como|con) )?(?:forma de )?(?:(?:los )?dientes de (?:una )?sierra|una sierra)", "en zigzag"),
        Phrasing(r"en (?:un )?(?:eslalon|eslálom|slalom|serpentina)", "en zigzag"),
        Phrasing(r"un (?:eslalon|eslálom|slalom)", "un zigzag"),
    ),
    "land": (
        Phrasing("touch down|touches down|touching down", "land|lands|landing", _PLACE_AT),
        Phrasing("(?<!be )(?<!is )(?<!are )set down|sets down|setting down", "land|lands|landing", _PLACE_AT),
        Phrasing("(?<!be )(?<!is )(?<!are )put down|puts down|putting down", "land|lands|landing", _PLACE_AT),
        Phrasing("settle down|settles down|settling down", "land|lands|landing", _PLACE_AT),
        Phrasing("settle|settles|settling", "land|lands|landing", r"(?=\s+(?:at|in|on|by|near|beside|there)\b)"),
        Phrasing("alight|alights|alighting", "land|lands|landing", _PLACE_AT),
        Phrasing("come to rest|comes to rest|coming to rest", "land|lands|landing", _PLACE_AT),
        Phrasing("touchdown", "landing", r"(?=\s+(?:at|in|on|by|near)\b)"),
        Phrasing("se posa|se pose|posarse|se posan|se posen", "aterriza|aterrice|aterrizar|aterrizan|aterricen"),
        Phrasing(
            "toma tierra|tome tierra|tomar tierra|toman tierra|tomen tierra",
            "aterriza|aterrice|aterrizar|aterrizan|aterricen",
        ),
        Phrasing(
            "toca tierra|toque tierra|tocar tierra|toca el suelo|toque el suelo|tocar el suelo",
            "aterriza|aterrice|aterrizar|aterriza|aterrice|aterrizar",
        ),
    ),
    "circle": (
        Phrasing("encircle|encircles|encircling", "circle|circles|circling"),
        Phrasing("circumnavigate|circumnavigates|circumnavigating", "circle|circles|circling"),
        Phrasing(
            r"(?:round|circular) flight|flight in a circle|(?:closed|full) (?:ring|loop)", "circle", rf"(?={_OF}{_ROUND})"
        ),
        Phrasing("three[- ]sixty|360(?! ?(?:m|s|degrees?|°))|360[- ]degree (?:turn|orbit)", "circle", rf"(?={_ROUND})"),
        Phrasing("loop|loops|looping", "circle|circles|circling", rf"(?={_ROUND})", sure=False),
        Phrasing("round trip|circular trip|circuit|full turn", "circle", rf"(?={_ROUND})(?![^.]*:)", sure=False),
        Phrasing(
            "gira|gire|girar|dar vueltas|da vueltas|dé vueltas", "orbita|orbite|orbitar|orbitar|orbita|orbite",
            r"(?=\s+(?:alrededor|en torno)\b)", sure=False,
        ),
        Phrasing("circunvala|circunvale|circunvalar", "rodea|rodee|rodear"),
        Phrasing(r"vuelo circular|vuelo en círculo", "círculo", r"(?=\s+(?:alrededor|en torno)\b)"),
    ),
    "hover": (
        Phrasing("loiter|loiters|loitering", "hover|hovers|hovering"),
        Phrasing("take station|takes station|taking station", "hover|hovers|hovering", _OVER),
        Phrasing("hold station|holds station|holding station", "hover|hovers|hovering", _OVER),
        Phrasing("station itself|stations itself", "hover|hovers", _OVER),
        Phrasing("hang|hangs|hanging", "hover|hovers|hovering", r"(?:\s+in the air)?" + _OVER),
        Phrasing("remain stationary|remains stationary|stay stationary|stays stationary", "hover|hovers|hover|hovers"),
        Phrasing("flota|flote|flotar", "se queda|se quede|quedarse", _SOBRE),
        Phrasing(
            "se mantiene|se mantenga|mantenerse", "se queda|se quede|quedarse",
            r"(?:\s+(?:suspendido|suspendida|en el aire|flotando|quieto|parado))?" + _SOBRE,
        ),
    ),
    "park": (
        Phrasing("gather|gathers|assemble|assembles|collect|collects", "park|parks|park|parks|park|parks", _MACHINES_DOWN),
    ),
    "go": (
        Phrasing("swing by|swings by|drop by|drops by|stop by|stops by|call at|calls at", _FLY_TO),
        Phrasing("drop in at|drops in at|drop in on|drops in on|pop over to|pops over to|nip over to|nips over to", _FLY_TO),
        Phrasing("hop over to|hops over to|dash to|dashes to|make for|makes for|push on to|pushes on to", _FLY_TO),
    ),
    "home": (
        Phrasing("head back|heads back|fly back|flies back", "come home|comes home|come home|comes home", _AT_END),
        Phrasing("pull back|pulls back", "come home|comes home", _AT_END),
        Phrasing("come back|comes back", "come home|comes home", _AT_END),
        Phrasing(
            "(?<!in )(?<!on )(?<!the )(?<!a )(?<!its )return|returns", "return home|returns home", _AT_END
        ),
        Phrasing(
            "vuelve|vuelva|vuelven|vuelvan|volver|regresa|regrese|regresan|regresen|regresar",
            "vuelve a casa|vuelva a casa|vuelven a casa|vuelvan a casa|volver a casa|"
            "regresa a casa|regrese a casa|regresan a casa|regresen a casa|regresar a casa",
            _AT_END,
        ),
    ),
}  # fmt: skip
"""A deed or a figure -> how else it is said, English and Spanish."""

_METRES: Final = r"(\S+?\s*-?(?:m|met(?:er|re)s?|metros?))\b"
_OF_LINE: Final = r"(?:(?:straight|direct|middle|cent(?:re|er)) )?(?:line|course|track|axis|route|línea|recta|ruta)"
_LINE: Final = rf"(?:\s+(?:of|from|de)\s+(?:the|that|its|a|la|su)\s+{_OF_LINE}(?: (?:recta|central))?)?"
_BESIDE: Final = rf"\s+(?:beside|off|from|away from|out from|to the side of|aside of)\s+(?:the|that|its|a)\s+{_OF_LINE}"
_SWINGS: Final = (
    (
        rf"(?:with )?(?:the |its |all )?(?:corners?|turning points?|turns|peaks?|tips?|teeth)\s+"
        rf"(?:lie |lying |are |being )?{_METRES}{_BESIDE}",
        r"\1 to each side",
    ),
    (rf"{_METRES}\s+(?:off )?(?:to|on|at) (?:either|both|every) (?:sides?|hand){_LINE}", r"\1 to each side"),
    (
        rf"(?:(?:swing\w*|sway\w*|deviat\w+|veer\w*|turning|with swings? of|with (?:a )?swing) )?{_METRES}\s+"
        rf"(?:to (?:the|its) )?(?:left and (?:to the )?right|right and (?:to the )?left){_LINE}",
        r"\1 to each side",
    ),
    (
        rf"{_METRES}\s+(?:a|hacia) (?:uno y otro lado|ambos lados|los dos lados|(?:la )?izquierda y (?:a )?(?:la )?derecha|"
        rf"(?:la )?derecha y (?:a )?(?:la )?izquierda){_LINE}",
        r"\1 a cada lado",
    ),
    (
        rf"(?:con )?(?:las |sus )?(?:esquinas|puntas|vértices) a {_METRES} de (?:la|su) {_OF_LINE}(?: recta| central)?",
        r"\1 a cada lado",
    ),
    (r"(?<=\d )(?:straight )?(?:stretches|segments|sections|strokes)\b", "legs"),
    (r"(?<=\d )(?:segmentos|trechos|trozos)\b", "tramos"),
)
"""How far a zigzag swings and of how many legs it is; only where a zigzag is spoken of."""
_GAP: Final = (
    rf"\bwith {_METRES} (?:of space )?(?:between|from) (?:neighbou?rs|neighbou?r to neighbou?r|each pair|one and the next"
    r"|(?:the )?(?:machines|drones))\b"
)
_LOOKED: Final = (
    ("search|scan|survey|scour|comb|sweep|examine|reconnoitre|map", "explore"),
    ("searches|scans|surveys|scours|combs|sweeps|examines|reconnoitres|maps", "explores"),
    ("searching|scanning|surveying|scouring|combing|sweeping|examining|mapping", "exploring"),
    ("busca|registra|rastrea|peina|barre|reconoce|examina", "explora"),
    ("busque|registre|rastree|peine|barra|reconozca|examine", "explore"),
    ("buscar|registrar|rastrear|peinar|barrer|reconocer|examinar", "explorar"),
)
_ALL_OF: Final = (
    r"(?:\s+(?:through|over|out|por|en))?(?:\s+(?:all(?: of)?|the whole of|every (?:corner|bit|part) of|toda))?"
    r"(\s+(?:the |el |la |los |las )?)(?:(?:whole|entire) )?(?:(?:area|zone|zona) (?:of|de)(?: the| la| el)? )?"
)
_QUOTED: Final = r'"[^"]*"|“[^”]*”|«[^»]*»'
_FIRST_MARK: Final = 0xE000
_MOST_MARKS: Final = 1000
_MARKS: Final = f"[{chr(_FIRST_MARK)}-{chr(_FIRST_MARK + _MOST_MARKS)}]"
"""What stands for a name or a message while a request is put in plain words."""


def pattern_of(deed: str) -> str:
    """Return a pattern of the words of a deed or a figure besides the plain one, for a search that ignores case."""
    return "|".join(rf"\b(?:{way.forms})\b{way.after}" for way in DEEDS[deed] if way.sure)


def plainly(request: str, regions: Iterable[str] = (), names: Iterable[str] = ()) -> str:
    """Return a request in plain words, for a model.

    Args:
        request: in words.
        regions: the words of it that name regions, which can be explored.
        names: the words of it that name anything else of the site.
    """
    kept: list[str] = []

    def hidden(text: str, pattern: str) -> str:
        """Return a text with marks in place of what is left alone."""

        def keep(match: re.Match[str]) -> str:
            kept.append(match[0])
            return chr(_FIRST_MARK + len(kept) - 1)

        return re.sub(pattern, keep, text, flags=re.IGNORECASE)

    text = hidden(request, _QUOTED)
    quoted = len(kept)
    text = hidden(text, _any_of(regions))
    areas = "".join(chr(_FIRST_MARK + i) for i in range(quoted, len(kept)))
    text = hidden(text, _any_of(names))
    if len(kept) > _MOST_MARKS:
        return request
    for deed, ways in DEEDS.items():
        if deed != "zigzag" or not _speaks_of_zigzag(text):
            for way in ways:
                text = _replaced(text, way)
    if _speaks_of_zigzag(text):
        for pattern, plain in _SWINGS:
            text = re.sub(rf"(?<!\w){pattern}", plain, text, flags=re.IGNORECASE)
    text = re.sub(_GAP, r"\1 apart", text, flags=re.IGNORECASE)
    for forms, plain in _LOOKED if areas else ():
        text = re.sub(rf"\b(?:{forms}){_ALL_OF}(?=[{areas}])", _with_article(plain), text, flags=re.IGNORECASE)
    text = in_metres(written_out(text))
    return re.sub(_MARKS, lambda mark: kept[ord(mark[0]) - _FIRST_MARK], text)


def _any_of(words: Iterable[str]) -> str:
    """Return a pattern of any of some names, the longest first; of none, one that never fits."""
    listed = "|".join(re.escape(one) for one in sorted(set(words), key=len, reverse=True))
    return rf"(?<!\w)(?:{listed})(?!\w)" if listed else "(?!)"


def _speaks_of_zigzag(text: str) -> bool:
    return re.search(r"\bzig-?zag", text, re.IGNORECASE) is not None


def _replaced(text: str, way: Phrasing) -> str:
    """Return a text with the plain forms of one way of speaking."""
    plain = way.plain.split("|")
    for form, said in zip(way.forms.split("|"), plain, strict=True) if len(plain) > 1 else [(way.forms, way.plain)]:
        text = re.sub(rf"\b(?:{form})\b{way.after}", _as_large(said), text, flags=re.IGNORECASE)
    return text


def _as_large(said: str) -> Callable[[re.Match[str]], str]:
    """Return what puts words in place of others, with a large letter where these had one."""
    return lambda match: said[:1].upper() + said[1:] if match[0][:1].isupper() else said


def _with_article(said: str) -> Callable[[re.Match[str]], str]:
    large = _as_large(said)
    return lambda match: large(match) + match[1]
