"""What a request says for certain: amounts with their units, counts, places, agents, types of agents, a few intentions.

Tables by language; names of the site need none. Whoever compares a task with its request reads this: what is not recognised
is not compared, for a wrong alarm is worse than none.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.llm.words.few import is_besides, is_other_told, numbers, one_and_one
from formiga_bt.llm.words.mentions import bare, is_certain, is_doing, unquoted
from formiga_bt.llm.words.points import Point, named
from formiga_bt.llm.words.spoken import is_english, pattern_of, said
from formiga_bt.units import UNITS

NUMBERS: Final[Mapping[str, int]] = {
    # English
    "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12, "fifteen": 15, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60,
    "seventy": 70, "eighty": 80, "ninety": 90, "hundred": 100,
    # Finnish
    "yksi": 1, "kaksi": 2, "kolme": 3, "neljä": 4, "viisi": 5, "kuusi": 6, "seitsemän": 7, "kahdeksan": 8, "yhdeksän": 9,
    "kymmenen": 10, "kaksikymmentä": 20, "kolmekymmentä": 30, "viisikymmentä": 50, "sata": 100,
    # Spanish; not `un`, which is an article
    "dos": 2, "tres": 3, "cuatro": 4, "cinco": 5, "seis": 6, "siete": 7, "ocho": 8, "nueve": 9, "diez": 10, "doce": 12,
    "quince": 15, "veinte": 20, "treinta": 30, "cuarenta": 40, "cincuenta": 50, "sesenta": 60, "setenta": 70, "ochenta": 80,
    "noventa": 90, "cien": 100,
    "yhden": 1, "kahden": 2, "kolmen": 3, "neljän": 4, "viiden": 5, "kuuden": 6, "kymmenen metrin": 10,
}  # fmt: skip
UNIT_WORDS: Final[Mapping[str, str]] = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "kilometer": "km", "kilometers": "km", "kilometre": "km",
    "kilometres": "km", "second": "s", "seconds": "s", "sec": "s", "secs": "s", "minute": "min", "minutes": "min",
    "mins": "min", "hour": "h", "hours": "h", "percent": "%", "degree": "deg", "degrees": "deg", "°": "deg",
    "metri": "m", "metriä": "m", "metrin": "m", "kilometri": "km", "kilometriä": "km", "kilometrin": "km",
    "sekunti": "s", "sekuntia": "s", "sekunnin": "s", "minuutti": "min", "minuuttia": "min", "minuutin": "min",
    "metro": "m", "metros": "m", "kilómetro": "km", "kilómetros": "km", "segundos": "s", "minuto": "min", "minutos": "min",
    "hora": "h", "horas": "h", "por ciento": "%", "grados": "deg",
    "tunti": "h", "tuntia": "h", "tunnin": "h", "prosenttia": "%", "astetta": "deg",
}  # fmt: skip
_MORE: Final = re.compile(
    r"\b(?:another|the other|a second|the second|other)\s+(?:\w+\s+)?(?:one|ones|drones?|lwds?|hwds?|uavs?)\b"
    r"|\b(?:otro|el otro|un segundo|el segundo)\s+(?:dron|va|vuela|aterriza|rodea|regresa|vuelve)\b"
    r"|\b(?:the |a )?second\s+(?:flies|goes|on\b|one\b)|\b(?:one|first)\b[^.]*\band (?:the other|another|one)\b",
    re.IGNORECASE,
)
"""Machines that are spoken of besides `one light drone`."""
_AND_MORE: Final = re.compile(
    r"\b(?:a|an|one|un|uno)\s+((?:[\w-]+\s+){0,2}?(?:drone?|lwd|hwd|uav))\b[^.;]*?\b(?:and|y)\s+"
    rf"(\d|{'|'.join(word for word, number in NUMBERS.items() if number in (2, 3, 4, 5))})\s+(?:more|others|más)\b"
    r"(?!\s+(?:times?|rounds?|laps?|minutes?|seconds?|met\w+|m|s|min|h|veces|vueltas)\b)",
    re.IGNORECASE,
)
"""`A drone ... and two more`: three."""
_ALL_ARE: Final = (
    r"(?:[,;(–—-]\s*|\b(?:are|being|son)\s+)(?:all|both|todos|todas|ambos)\s+"
    r"(?:(?:of\s+them|of\s+these|ellos|son|are|being|three|four|five|\d)\s+)*"
)
"""`, all of them LWDs`."""
PEOPLE: Final[Mapping[str, tuple[str, ...]]] = {
    "watcher": ("vigilante", "vigilantes", "valvoja"),
    "picker": ("recolector", "recolectora", "recolectores", "poimija"),
}
"""Other names of the shipped types of people."""
DRONES: Final = ("drone", "drones", "uav", "uavs", "dron", "drones", "drooni", "droonia", "droonin", "droonit")
LIGHT_HEAVY: Final[Mapping[str, tuple[str, ...]]] = {
    "lwd": ("lwd", "lwds", "light drone", "light drones", "light-weight drone", "light-weight drones", "lightweight drone",
            "lightweight drones", "light one", "small drone", "small drones", "kevyt drooni", "kevyttä droonia",
            "kevyen droonin", "dron ligero", "drones ligeros", "uno ligero"),
    "hwd": ("hwd", "hwds", "heavy drone", "heavy drones", "heavy-weight drone", "heavyweight drone", "heavyweight drones",
            "heavy one", "big drone", "big drones", "raskas drooni", "raskasta droonia", "raskaan droonin",
            "dron pesado", "drones pesados", "uno pesado"),
}  # fmt: skip
_CORNER: Final = re.compile(
    r"\b(?:corners?|angles?|vertex|vertices|tri[aá]ng\w+|esquinas?|[aá]ngulos?|vértices?)\b"
    r"|(?:degrees?|deg|°|grados)\s+(?:between|apart|(?:to|from) (?:each|one an)other|entre)\b",
    re.IGNORECASE,
)
INTENTS: Final[Mapping[str, str]] = {
    "home": r"\b(?:(?:comes?|flies|fly|goes|go|returns?|gets?|brings?) (?:it |them |both )?(?:back )?home|"
    r"(?:coming|returning|going|flying|heading|heads?) (?:back )?home|return(?:s|ing)? to"
    r" (?:the |its |their )?(?:base|port|ports|home)|back (?:to (?:the |its |their )?(?:base|port|ports)|home)|comes? back|"
    r"(?<!from )(?<!leave )(?<!leaves )(?<!leaving )(?:its|their) (?:own |home )?ports?|en sus? (?:propios? )?puertos?|"
    r"(?<=[,;:] )(?:and |then |and then )?home(?=\s*(?:[.;!]|$))|(?<=[,;] )back(?=\s*(?:[.;,!]|$))|"
    r"(?:and|then) returns?(?=\s*(?:[.;!]|$))|"
    r"(?:(?<=both )|(?<=all )|(?<=them )|(?<=two )|(?<=three ))return(?=\s*(?:[.;!]|$))|"
    r"(?:(?<=dos )|(?<=tres )|(?<=ambos )|(?<=todos ))vuelv[ae]n(?=\s*(?:[.;!]|$))|"
    r"a casa(?=\s*(?:[.;!]|$))|y (?:que |luego |después )*vuelv[ae]n?(?=\s*(?:[.;!]|$))|"
    r"(?:vuelv\w+|volver|volviendo) a (?:casa|la base|su puerto|sus puertos)|regres\w+|retorn\w+ a|palaa|palaavat|kotiin)\b",
    "ask": r"\b(?:ask|asks|asked|confirm\w*|approv\w+|permission|says? so|agrees?|okays?|kysy\w*|"
    r"pregunt\w+|consult\w+|permiso|aprueb\w+|autoriz\w+|est[aá] de acuerdo|dice(?:n)? (?:que|si)|diga(?:n)? que|vahvist\w+|"
    r"question|\w+'s (?:word|ok|okay|answer|go-ahead))\b",
    "stay": r"\b(?:stays? there|remains?|leave (?:it|them) there|jää)\b",
    "land": r"\b(?:land|lands|landing|touch(?:es)? down|aterri\w+|laskeudu\w*|"
    r"(?:gather|put|set|place|park|collect)\w*\b[^.;,]{0,40}\bon the ground)\b",
}
"""What is meant -> a pattern over the request in small letters."""
_NO_QUESTION: Final = re.compile(
    r"\b(?:nobody|no one|no-one|nadie)\b[^.;]*\b(?:ask\w*|confirm\w*|pregunt\w+)"
    r"|\bno (?:hay que|hace falta|es necesario) pregunt\w+"
    r"|\b(?:no need to|without|do not|don't|sin) (?:ask\w*|pregunt\w+)(?: \w+)?"
    r"|\"[^\"]*\"|“[^”]*”|«[^»]*»"  # a message, or the question itself: that somebody is asked is said before it
)
"""What says that nobody is to be asked."""
_SHARED_NOUN: Final = re.compile(
    r"\b(light|heavy|small|big)(?=\s+(?:one\s+)?and\s+(?:a|an|one|the)\s+(?:light|heavy|small|big)\s+drone)",
    re.IGNORECASE,
)
"""`a light and a heavy drone`: the first one is a drone, too."""
_UNITS: Final = sorted([*UNIT_WORDS, *UNITS], key=len, reverse=True)
_IN_FULL: Final[Mapping[str, int]] = {
    **NUMBERS,
    **{f"{few} hundred": 100 * NUMBERS[few] for few in ("one", "two", "three", "four", "five")},
    **{
        f"{ten}{link}{few}": NUMBERS[ten] + NUMBERS[few]
        for tens, fews, links in (
            (("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"),
             ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine"), ("-", " ")),
            (("treinta", "cuarenta", "cincuenta", "sesenta", "setenta", "ochenta", "noventa"),
             ("dos", "tres", "cuatro", "cinco", "seis", "siete", "ocho", "nueve"), (" y ",)),
        )
        for ten in tens for few in fews for link in links
    },
}  # fmt: skip
"""Numbers of one word, and those of two: `twenty-five`."""
_OF_LARGER: Final = re.compile(
    rf"\b(?:{'|'.join(NUMBERS)}|ciento|thousand|mil)(?:\s+(?:and|y)\s+|\s+|-)$", re.IGNORECASE
)
"""What stands before the end of a number that is not known in full: `one hundred and`."""
_NUMBER_WORDS: Final = "|".join(sorted(_IN_FULL, key=len, reverse=True))
_AMOUNT: Final = re.compile(
    rf"(?<![\w.,])(\d{{1,3}}(?:,\d{{3}})+(?!\d)|\d{{1,3}}(?:\.\d{{3}})+(?!\d)|\d+(?:[.,]\d+)?|{_NUMBER_WORDS})(?:\s*-\s*|\s*)"
    rf"({'|'.join(map(re.escape, _UNITS))})(?![\w%])",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Amount:
    """A number with its unit, as a request has it."""

    type: str
    si: float
    words: str


@dataclass(frozen=True, slots=True)
class Words:
    """A request, read as far as that can be done for certain."""

    text: str
    amounts: tuple[Amount, ...]
    places: Mapping[str, str]
    """Name of a place, port or region of the site -> the words."""
    agents: Mapping[str, str]
    """Id -> the words."""
    counts: Mapping[str, int]
    """Agent type -> how many machines; `*` = machines of any type. Only what is said once and plainly."""
    points: Mapping[str, Point] = field(default_factory=dict)
    """Coordinates of the request by the names that they got."""
    original: str = ""
    """The request as it was said; "" = `text`."""

    @property
    def said(self) -> str:
        """Return the request in the words of who made it."""
        return self.original or self.text

    def speaks_of_more(self) -> bool:
        """Return whether a second machine is spoken of: `while another one ...`."""
        return _MORE.search(self.text) is not None

    def amount(self, type_: str, si: float) -> str:
        """Return the words of an amount, or ""."""
        same = (a.words for a in self.amounts if a.type == type_ and abs(a.si - si) <= 1e-6 * max(1.0, abs(si)))
        return next(same, "")

    def number(self, value: float) -> str:
        """Return the words of a plain number, or ""."""
        for match in re.finditer(r"(?<![\w.])(\d+(?:\.\d+)?|[^\W\d_]+)(?![\w.]*\w)", self.text):
            word = match[1].casefold()
            if (word[0].isdigit() and float(word) == value) or NUMBERS.get(word) == value:
                return match[1]
        return ""

    def means(self, intent: str) -> bool:
        """Return whether an intention of `INTENTS` is said."""
        text = _NO_QUESTION.sub(" ", self.text.casefold()) if intent == "ask" else self.text.casefold()
        return re.search(INTENTS[intent], text) is not None

    def holds(self, words: str) -> str:
        """Return the words as they stand in the request, or ""."""
        parts = words.split()
        if not parts:
            return ""
        found = re.search(r"\s+".join(map(re.escape, parts)), self.text, re.IGNORECASE)
        return found[0] if found is not None else ""


def read(request: str, site: Site, catalogue: Catalogue) -> Words:
    """Return what a request says for certain.

    Args:
        request: in words.
        site: its names are recognised.
        catalogue: its agent types are.
    """
    found = named(request, site)
    original, request = request, found.text
    left = request
    places: dict[str, str] = {}
    for name in sorted([*site.places, *site.regions, *site.ports], key=len, reverse=True):  # `lake_shore` is no `lake`
        if words := said(name, left):
            places[name] = words
            left = left.replace(words, " " * len(words))
    places |= {name: name for name in found.points}
    if re.search(r"\b(?:the )?base(?: station)?\b", request, re.IGNORECASE):
        places.setdefault("base", "base")
    agents = {name: words for name in site.agents if (words := said(name, request))}
    counts = _counts(unquoted(bare(request, places.values())), catalogue)
    return Words(request, tuple(_amounts(request)), places, agents, counts, found.points, original)


def _amounts(request: str) -> Iterator[Amount]:
    for match in _AMOUNT.finditer(request):
        word, unit = match[1].casefold(), match[2].casefold()
        if not word[0].isdigit() and _OF_LARGER.search(request[: match.start()]):
            continue
        number = _number(word, request) if word[0].isdigit() else float(_IN_FULL[word])
        type_, factor = UNITS[UNIT_WORDS.get(unit, unit)]
        if type_ == "angle" and number == 90 and _CORNER.search(request):
            continue  # `a corner of 90 degrees`: a right angle, in other words
        yield Amount(type_, number * factor, match[0])


def _number(digits: str, request: str) -> float:
    """Return a number in digits: `1,000` is a thousand in English, `1.000` in Spanish and Finnish; else both are points."""
    mark = "," if is_english(request) else "."
    if re.fullmatch(rf"\d{{1,3}}(?:{re.escape(mark)}\d{{3}})+", digits) or digits.count(",") + digits.count(".") > 1:
        return float(re.sub(r"[.,]", "", digits))
    return float(digits.replace(",", "."))


def _counts(request: str, catalogue: Catalogue) -> dict[str, int]:
    """Return how many machines of each type are spoken of, where that is plain."""
    found: dict[str, set[int]] = {}
    request = _SHARED_NOUN.sub(r"\1 drone", request)
    of_type = {name: words for name, words in LIGHT_HEAVY.items() if name in catalogue.types}
    for type_ in catalogue.types.values():
        if not type_.human and type_.label:
            names = of_type.get(type_.name, (type_.name, type_.name + "s"))
            of_type[type_.name] = (*names, type_.label, type_.label + "s")
    told: set[int] = set()
    for name, words in sorted([*of_type.items(), ("*", DRONES)], key=lambda one: one[0] in ("*", "drone")):
        ones, key = 0, "*" if name == "drone" else name
        for at, number in _before(request, words):
            if name not in ("*", "drone") or at not in told:  # `dos drones ligeros` are not `dos drones`, too
                so_far = found.setdefault(key, set())
                so_far.add(number)
                ones += number == 1
                if ones > 1:  # `one drone goes there, one drone goes home`: the same one, or two
                    so_far.add(0)
            if name not in ("*", "drone"):
                told.add(at)
        if found.get(key, set()) <= {1} and one_and_one(request, _nouns(words)):
            found[key] = {2}
    more = _MORE.search(request) is not None or is_other_told(request)
    plain = {name: next(iter(all_)) for name, all_ in found.items() if len(all_) == 1 and 0 not in all_}
    besides = _AND_MORE.search(request)
    if besides is not None:
        word = besides[2].casefold()
        plain["*"], more = 1 + (int(word) if word.isdigit() else NUMBERS[word]), True
    every = _type_of_all(request, of_type, besides.span(1) if besides is not None else (0, 0))
    if every and plain.get("*", 0) > 1:
        plain[every] = plain["*"]
    return {name: number for name, number in plain.items() if number > 1 or not more}


def _type_of_all(request: str, of_type: Mapping[str, tuple[str, ...]], noun: tuple[int, int]) -> str:
    """Return the one type that all machines of a request have: `a light drone ... and two more`, `all of them LWDs`; or "".

    Args:
        request: in words.
        of_type: what each type is called.
        noun: where the one stands besides which there are more; (0, 0) = nowhere.
    """
    named: dict[str, bool] = {}
    for name, words in of_type.items():
        nouns = "|".join(re.escape(w) for w in sorted(words, key=len, reverse=True))
        at = [match.start() for match in re.finditer(rf"(?<!\w)(?:{nouns})(?!\w)", request, re.IGNORECASE)]
        every = rf"{_ALL_ARE}(?:{nouns})(?=\s*(?:[.,;:)]|$))"
        if at and name != "drone":
            named[name] = (
                any(noun[0] <= one < noun[1] for one in at) or re.search(every, request, re.IGNORECASE) is not None
            )
    return next(iter(named)) if len(named) == 1 and all(named.values()) else ""


def _before(request: str, words: Iterable[str]) -> Iterator[tuple[int, int]]:
    """Yield where each number of machines called so stands, and the number; 0 = it counts others besides."""
    for start, end, word in numbers(request, _nouns(words), _NUMBER_WORDS):
        if not is_certain(request, start, end) or _OF_LARGER.search(request[:start]):
            continue
        yield start, 0 if is_besides(request, start) else int(word) if word.isdigit() else _IN_FULL.get(word, 2)


def _nouns(words: Iterable[str]) -> str:
    return "|".join(re.escape(w) for w in sorted(set(words), key=len, reverse=True))


def types_said(words: Words, catalogue: Catalogue) -> set[str]:
    """Return the agent types that a request names, by their name or label."""
    found = set()
    request = _SHARED_NOUN.sub(r"\1 drone", bare(words.text, words.places.values()))
    for type_ in catalogue.types.values():
        known = [
            type_.name,
            *LIGHT_HEAVY.get(type_.name, ()),
            *PEOPLE.get(type_.name, ()),
            *([type_.label] if type_.label else []),
        ]
        nouns = [noun for one in known for noun in (one, one + "s")]
        sure = type_.human or type_.name in LIGHT_HEAVY  # nothing that a machine does is called so
        if type_.name not in ("drone", "person") and any(_is_said(noun, request, sure) for noun in nouns):
            found.add(type_.name)
    return found


def _is_said(noun: str, request: str, sure: bool) -> bool:
    """Return whether a noun is said of an agent; if not `sure`, it may be what one does."""
    every = re.finditer(pattern_of(noun), request, re.IGNORECASE)
    return any(sure or not is_doing(request, *match.span()) for match in every)


def roles_of(words: Words, catalogue: Catalogue) -> tuple[tuple[str, int], ...]:
    """Return the agent types and how many of each a task must have, where that is certain; () = it is not."""
    types = catalogue.types
    named = types_said(words, catalogue)
    machines = {one for one in named if not types[one].human}
    people = sorted(one for one in named if types[one].human)
    if words.agents or not machines or machines != words.counts.keys() - {"*"} or bool(people) != words.means("ask"):
        return ()
    return (*((one, words.counts[one]) for one in sorted(machines)), *((one, 1) for one in people))
