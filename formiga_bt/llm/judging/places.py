"""Places: those that a request names are gone to, in its order, and no others, and the way ends as it says."""

import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from formiga_bt.base.geo import Place
from formiga_bt.llm.judging.outcome import OVER_M
from formiga_bt.llm.judging.plain import code_of, is_refused
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.shaping.teams import from_to
from formiga_bt.llm.words.endings import ends_home
from formiga_bt.llm.words.spoken import is_english, is_known
from formiga_bt.llm.words.wording import INTENTS, Words
from formiga_bt.llm.world import RequestWorld

_ELSE: Final = r"\b(?:otherwise|if not|else|says? no|on (?:a )?no|unless|si no|en caso contrario|dice que no)\b"
"""What is said of the other case need not happen in the dry run, in which all answers are yes."""
_NOUNS: Final = ("field", "place", "point", "site", "station")
_ANY_PLACE: Final = re.compile(
    r"\b(?:all|every|each|any|next|nearest|closest|remaining|rest|wherever|anywhere|somewhere|elsewhere|everything|"
    r"places?|fields?|points?|sites?|stations?|tod[oa]s?|cada|cualquier\w*|pr[oó]xim\w+|siguientes?|cercan\w+|resto|lugar\w*|"
    r"campos?|puntos?|sitios?)\b"
)
"""Words by which a place may be meant that has no name."""
_NO_WAY_HOME: Final = re.compile(
    r"\b(?:not|never|without|no need to|n't|no|sin)\b(?:(?!\b(?:and|then|y|luego)\b)[^.;:,]){0,25}$"
    r"|\b(?:instead of|rather than|en vez de|en lugar de) $"
    r"|\b(?:stays?|remains?|waits?|keeps?|kept|left|leaves?|se queda|permanece|espera)(?: it| them)? (?:at|in|on|en)? ?$"
)
"""What stands before a way home that is not wanted: `does not come home`, `stays at its port`."""


def places(words: Words, text: str) -> Iterator[Shortfall]:
    """Find places that a request names and a task never goes to."""
    used = set(re.findall(r"[A-Za-z_][\w-]*", code_of(text)))
    for name, said in words.places.items():
        if name not in used and name != "base" and not is_refused(words.text, said):
            text_ = f'the request names "{said}", and the task never goes to {name}'
            yield Shortfall("place_not_used", text_, about=name)


def unnamed(words: Words, text: str, world: RequestWorld) -> Iterator[Shortfall]:
    """Find places of the site that a task goes to and that the request, which names others, does not speak of."""
    said = words.text.casefold()
    for one in words.places.values():
        said = said.replace(one.casefold(), " ")
    if not words.places.keys() - {"base"} or _ANY_PLACE.search(said) is not None:
        return
    code = re.sub(r"^ *near: .*$", "", code_of(text), flags=re.MULTILINE)
    in_english = is_english(words.text)
    for name in sorted(
        set(re.findall(r"[A-Za-z_]\w*", code)) & world.site.places.keys() - words.places.keys() - {"base"}
    ):
        if not in_english and not is_known(name):
            continue  # it may be named in words that nobody here knows
        if not any(part in said for part in name.casefold().split("_") if len(part) > 2 and part not in _NOUNS):
            yield Shortfall(
                "place_unasked",
                f"the task goes to {name}, which the request does not name",
                help=f"only {', '.join(words.places)}",
                about=name,
            )


def order(words: Words, flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find ways that are flown the other way round than from the one place to the other."""
    for a, b in sorted(from_to(words)):
        ways = [way for way in flight.visited.values() if a in way and b in way]
        often = any(len(words.spans(one)) > 1 for one in (a, b))
        if ways and not often and not any(way.index(a) < way.index(b) for way in ways):
            yield Shortfall(
                "wrong_way",
                f'the request says from "{words.places[a]}" to "{words.places[b]}", the task flies back to front',
            )
    for first, then in in_turn(words):
        ways = [way for way in flight.visited.values() if first in way and then in way]
        if ways and not any(_comes_before(first, then, way, world) for way in ways):
            yield Shortfall("wrong_order", f'the request wants "{words.places[first]}" before "{words.places[then]}"')


def _comes_before(first: str, then: str, way: Sequence[str], world: RequestWorld) -> bool:
    """Return whether a machine was at one place before another, or passed that one on the straight way to the first."""
    at, spots = way.index(then), world.site.places
    if way.index(first) < at:
        return True
    a, b, over = (spots.get(one) for one in (way[at - 1] if at else "", first, then))
    if not (isinstance(a, Place) and isinstance(b, Place) and isinstance(over, Place)):
        return False
    east, north = b.east_m - a.east_m, b.north_m - a.north_m
    length = math.hypot(east, north)
    if not length:
        return False
    along = ((over.east_m - a.east_m) * east + (over.north_m - a.north_m) * north) / length
    aside = abs((over.east_m - a.east_m) * north - (over.north_m - a.north_m) * east) / length
    return 0 < along < length and aside <= OVER_M


def in_turn(words: Words) -> Iterator[tuple[str, str]]:
    """Yield the pairs of places that a request wants one after the other: `first A, then B`; `A, B and C, in this order`."""
    text = words.text.casefold()
    spans = {name: words.spans(name) for name in words.places}
    if re.search(r"\bbefore\b|\bafter\b|\breverse\b", text) or any(len(one) > 1 for one in spans.values()):
        return
    for ((_, end), a), ((until, _), b) in pairwise(sorted((one[0], name) for name, one in spans.items() if one)):
        between = text[end:until]
        if re.search(r"\bthen\b", between) or re.search(r"\bin (?:this|that) order\b", text):
            yield a, b


def ends(words: Words, flight: RehearsedFlight) -> Iterator[Shortfall]:
    """Find ways home that a request wants and that did not happen in the dry run."""
    homes = [agent for agent, where in flight.stands.items() if where == "home"]
    text = words.text.casefold()
    if _wants_home(text) and flight.stands and not homes and not re.search(_ELSE, text):
        yield Shortfall("not_home", "the request wants a machine to come home, and none stands at its port at the end")


def _wants_home(text: str) -> bool:
    """Return whether a request, in small letters, wants a way home: not `it does not come home`, nor in a message."""
    text = re.sub(r'"[^"]*"', " ", text)
    return ends_home(text) or any(
        _NO_WAY_HOME.search(text[: found.start()]) is None for found in re.finditer(INTENTS["home"], text)
    )
