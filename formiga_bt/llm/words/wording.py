"""What a request says for certain: amounts with their units, counts, places, agents, types of agents, a few intentions.

Tables by language; names of the site need none. Whoever compares a task with its request reads this: what is not recognised
is not compared, for a wrong alarm is worse than none.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.llm.words.amounts import IN_FULL, NUMBER_WORDS, NUMBERS, OF_LARGER, Amount, amounts_of
from formiga_bt.llm.words.few import is_besides, is_every, is_fleet, is_other_told, numbers, one_and_one
from formiga_bt.llm.words.mentions import bare, is_certain, is_doing, unquoted
from formiga_bt.llm.words.points import RequestPoint, named
from formiga_bt.llm.words.spoken import pattern_of, said

_MORE: Final = re.compile(
    r"\b(?:another|the other|a second|the second|other)\s+(?:\w+\s+)?(?:one|ones|drones?|lwds?|hwds?|uavs?)\b"
    r"|\b(?:otro|el otro|un segundo|el segundo)\s+(?:dron|va|vuela|aterriza|rodea|regresa|vuelve)\b"
    r"|\b(?:an?|one)\s+(?:[\w-]+\s+){0,2}?(?:drone|lwd|hwd|uav)\s+(?:lands|hovers|flies|goes|looks|waits|stays)\b"
    r"(?:(?!\b(?:an?|one|first)\b)[^.;])*?\band\s+another\s+(?:at|over|above|near|by|to|in)\b"
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
    points: Mapping[str, RequestPoint] = field(default_factory=dict)
    """Coordinates of the request by the names that they got."""
    original: str = ""
    """The request as it was said; "" = `text`."""

    @property
    def said(self) -> str:
        """Return the request in the words of who made it."""
        return self.original or self.text

    def alone(self, name: str, text: str = "") -> str:
        """Return the request, or a text of it, without longer names that hold those of a place: no `lake shore` for `lake`."""
        text, said = text or self.text, self.places.get(name, name).casefold()
        longer = {one for one in self.places.values() if said in one.casefold() and len(one) > len(said)}
        for one in sorted(longer, key=len, reverse=True):
            text = re.sub(rf"(?<!\w){re.escape(one)}(?!\w)", "·" * len(one), text, flags=re.IGNORECASE)
        return text

    def spans(self, name: str) -> list[tuple[int, int]]:
        """Return where a place is named."""
        said = rf"(?<!\w){re.escape(self.places.get(name, name))}(?!\w)"
        return [match.span() for match in re.finditer(said, self.alone(name), re.IGNORECASE)]

    def speaks_of_more(self) -> bool:
        """Return whether a second machine is spoken of: `while another one ...`."""
        return _MORE.search(self.text) is not None

    def amount(self, type_: str, si: float) -> str:
        """Return the words of an amount, or ""."""
        return next((a.words for a in self.amounts if a.means(type_, si)), "")

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
    told = unquoted(bare(request, places.values()))
    counts = _counts(told, catalogue)
    counts |= _all_there(told, counts, {site.agents[name].type for name in agents}, site, catalogue)
    return Words(request, tuple(amounts_of(request)), places, agents, counts, found.points, original)


def _all_there(
    request: str, counts: Mapping[str, int], named: Set[str], site: Site, catalogue: Catalogue
) -> dict[str, int]:
    """Return how many machines the site has, of types of which a request wants all: `all light drones`, `the whole fleet`.

    Args:
        request: in words.
        counts: what it counts.
        named: the types of agents that it names.
        site: its agents.
        catalogue: their types.
    """
    here = Counter(one.type for one in site.agents.values() if not catalogue.types[one.type].human)
    if "*" in counts or named & here.keys():
        return {}
    every = {
        name: here[name] for name, words in _nouns_of(catalogue).items()
        if name not in counts and here[name] > 1 and is_every(request, _nouns(words))
    }  # fmt: skip
    return every or ({"*": here.total()} if not counts and here.total() > 1 and is_fleet(request) else {})


def _nouns_of(catalogue: Catalogue) -> dict[str, tuple[str, ...]]:
    """Return what machines of each type are called."""
    found = {name: words for name, words in LIGHT_HEAVY.items() if name in catalogue.types}
    for type_ in catalogue.types.values():
        if not type_.human and type_.label:
            names = found.get(type_.name, (type_.name, type_.name + "s"))
            found[type_.name] = (*names, type_.label, type_.label + "s")
    return found


def _counts(request: str, catalogue: Catalogue) -> dict[str, int]:
    """Return how many machines of each type are spoken of, where that is plain."""
    found: dict[str, set[int]] = {}
    request = _SHARED_NOUN.sub(r"\1 drone", request)
    of_type = _nouns_of(catalogue)
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
    for start, end, word in numbers(request, _nouns(words), NUMBER_WORDS):
        if not is_certain(request, start, end) or OF_LARGER.search(request[:start]):
            continue
        yield start, 0 if is_besides(request, start) else int(word) if word.isdigit() else IN_FULL.get(word, 2)


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
