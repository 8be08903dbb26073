"""Compares a request with the task that was written for it and with what it did in a dry run.

It is cautious: it says only what is certain, from names of the site, counts, amounts and a few plain words. What it does not
say may still be wrong; the person who approves a task reads it.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from itertools import pairwise
from typing import Final

from formiga_bt.geo import Place
from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.asked import asked, only_asked
from formiga_bt.llm.judging.outcome import OVER_M
from formiga_bt.llm.records import Flight, Shortfall
from formiga_bt.llm.shaping.teams import from_to, gap_of
from formiga_bt.llm.shaping.tidying import wants_centre
from formiga_bt.llm.words import plain_words
from formiga_bt.llm.words.endings import ends_home
from formiga_bt.llm.words.only_question import only_question
from formiga_bt.llm.words.spoken import is_english
from formiga_bt.llm.words.wording import INTENTS, LIGHT_HEAVY, NUMBERS, Words, types_said
from formiga_bt.llm.world import World
from formiga_bt.units import NUMBER, UNIT, parse_quantity

_TRIANGLE: Final = r"\btri[aá]ng\w+|\bright angle\b"
_TIMES: Final = re.compile(
    rf"(?<![\w.])(\d{{1,3}}|{'|'.join(NUMBERS)})\s+(?:full |complete |whole )?(?:laps|rounds|times|vueltas|veces)\b"
    r"(?!\s+(?:yes|no|s[ií]|the|as|that|higher|faster|más|que)\b)",
    re.IGNORECASE,
)
_ONCE_MORE: Final = re.compile(r"\b(?:repeat\w*|again|more|repit\w+|otra|más|and then)\b", re.IGNORECASE)
"""What may stand beside a number of times that does not count the first one."""
_LEGS: Final = re.compile(r"\b(?:legs|catetos)\W*(?:(?:of|are|is|both|each|de|:)\s*)*$")
FIGURES: Final[Mapping[str, str]] = {
    rf"\b(?:circle[sd]?|circular|orbits?|c[ií]rculo)\b|{plain_words.pattern_of('circle')}": "circle",
    rf"\bzig-?zag\w*|{plain_words.pattern_of('zigzag')}": "zigzag",
    _TRIANGLE: "triangle",
}
"""What a request calls a figure -> the helper that is it."""
OF_CHANGES: Final = frozenset({"place_not_used", "amount_not_used", "agent_not_used"})
"""What is certain of a request that only says what is to be changed."""
_ELSE: Final = r"\b(?:otherwise|if not|else|says? no|on (?:a )?no|unless|si no|en caso contrario|dice que no)\b"
"""What is said of the other case need not happen in the dry run, in which all answers are yes."""
_LAND_AT: Final = (
    r"\b(?:land(?:s|ing)?|touch(?:es)? down|(?<!be )(?<!is )(?<!are )(?:set|put)s? down|settles?(?: down)?|alights?)\s+"
    r"(?:together\s+)?(?:at|in|on|by|near|beside)\s+(?:the\s+)?"
)
_TO, _AND_LAND = r"\b(?:to|towards?)\s+(?:the\s+)?", r",?\s+(?:and|to)\s+(?:then\s+)?lands?\b"
_NO_WAY_HOME: Final = re.compile(
    r"\b(?:not|never|without|no need to|n't|no|sin)\b(?:(?!\b(?:and|then|y|luego)\b)[^.;:,]){0,25}$"
    r"|\b(?:stays?|remains?|waits?|keeps?|kept|left|leaves?|se queda|permanece|espera)(?: it| them)? (?:at|in|on|en)? ?$"
)
"""What stands before a way home that is not wanted: `does not come home`, `stays at its port`."""
_ANY_DRONE: Final = re.compile(
    r"\b(?:an?|one|another|un|otro)\s+(?:other\s+|second\s+|segundo\s+)?drone?\b(?!\s+(?:ligero|pesado))", re.IGNORECASE
)
"""A machine of which no type is said."""
_QUANTITY: Final = re.compile(rf"(?<![\w.])({NUMBER})\s*({UNIT})(?![\w%])", re.ASCII)
_NOT: Final = re.compile(
    r"\b(?:not|never|avoid|avoids|without|except|don't|instead of|rather than|ei|älä)\b", re.IGNORECASE
)


def compare(words: Words, task: Task, text: str, flight: Flight, world: World) -> list[Shortfall]:
    """Return what was asked for and is not so.

    Args:
        words: the request, as read.
        task: the checked task.
        text: its YAML.
        flight: its dry run; empty status = it was not flown.
        world: the site.
    """
    if only_question(words, world) is not None:
        return list(only_asked(words, text, flight, world))
    found = [
        *_places(words, text),
        *_amounts(words, text),
        *_misused(words, task),
        *_figures(words, text),
        *_rings(text, task, world),
        *_often(words, text),
        *_agents(words, task, flight, world),
    ]
    if flight.status == "SUCCEEDED":
        found += [*asked(words, text, flight, world), *_ends(words, flight), *_order(words, flight, world)]
    return found


def _places(words: Words, text: str) -> Iterator[Shortfall]:
    used = set(re.findall(r"[A-Za-z_][\w-]*", _code(text)))
    for name, said in words.places.items():
        if name not in used and name != "base" and not _is_refused(words.text, said):
            text_ = f'the request names "{said}", and the task never goes to {name}'
            yield Shortfall("place_not_used", text_, about=name)


def _code(text: str) -> str:
    """Return a file without its comments and its texts for people."""
    lines = (line.split("  #")[0] for line in text.splitlines() if not line.lstrip().startswith("#"))
    return "\n".join(line for line in lines if not re.match(r"\s*-?\s*(?:ask|notify|description|note|name):", line))


def _is_refused(request: str, said: str) -> bool:
    """Return whether something may be named because it is not wanted."""
    at = request.find(said)
    return _NOT.search(request[max(0, at - 40) : at]) is not None


def _amounts(words: Words, text: str) -> Iterator[Shortfall]:
    values = [a for match in _QUANTITY.finditer(_code(text)) if (a := parse_quantity(match[0])) is not None]
    for amount in words.amounts:
        if not any(t == amount.type and abs(v - amount.si) <= 1e-6 * max(1.0, abs(v)) for t, v in values):
            apart = gap_of(words) == f"{amount.si:g} m"
            yield Shortfall(
                "amount_not_used",
                f'the request says "{amount.words}", and no value of the task is {amount.words}',
                help=f"one at PLACE, the other at offset(PLACE, east={amount.si:g} m)" if apart else "",
                about=amount.words,
            )


def _misused(words: Words, task: Task) -> Iterator[Shortfall]:
    """Find amounts that the request says are a radius, a leg or a gap, and that the task uses as something else only."""
    for amount in words.amounts:
        if amount.type != "distance":
            continue
        at = words.text.find(amount.words)
        before, after = words.text[:at].casefold(), words.text[at + len(amount.words) :].casefold()
        uses = [name for name, si in _params(task) if abs(si - amount.si) < 1e-6]
        if not uses:
            continue
        if re.match(r"\W*(?:apart|from each other|from one another)\b", after) and all(map(_is_height, uses)):
            yield Shortfall(
                "amount_misused",
                f'the request says "{amount.words} apart", and the task uses {amount.words} as a height only',
            )
        is_radius = (
            re.search(r"\bradius(?:\s+of)?\s*$", before) is not None or re.match(r"\W*radius\b", after) is not None
        )
        if is_radius and not any(name.startswith("radius") for name in uses):
            yield Shortfall(
                "amount_misused",
                f"the request wants a radius of {amount.words}, and the task uses it as {', '.join(uses)}",
            )
        is_leg = _LEGS.search(before) is not None or re.match(r"\W*(?:long )?(?:legs|catetos)\b", after) is not None
        if is_leg and re.search(_TRIANGLE, words.text.casefold()) and not any(name.startswith("leg") for name in uses):
            yield Shortfall(
                "amount_misused",
                f"the request wants legs of {amount.words}, and the task uses it as {', '.join(uses)}",
                help=f"triangle(CORNER, {amount.words})",
            )


def _is_height(name: str) -> bool:
    return name.startswith(("height", "altitude"))


def _params(task: Task) -> Iterator[tuple[str, float]]:
    for param in task.params.values():
        if param.type.name == "distance" and param.default is not None and param.default.is_const:
            yield param.name, float(param.default.const)


def _agents(words: Words, task: Task, flight: Flight, world: World) -> Iterator[Shortfall]:
    used = {agent for granted in flight.agents.values() for agent in granted}
    types = world.catalogue.types
    if flight.status == "SUCCEEDED":
        for name, said in words.agents.items():
            if name not in used and name not in flight.asked and not _is_refused(words.text, said):
                yield Shortfall("agent_not_used", f'the request names "{said}", and {name} takes no part in the task')
    machines = _machines(task, flight, world)
    said_types = {t for t in types_said(words, world.catalogue) if not types[t].human}
    for type_, wanted in words.counts.items():
        have = sum(n for name, n in machines.items() if type_ == "*" or name == type_ or type_ in types[name].extends)
        if have != wanted and not (type_ == "*" and _may_be_more(words, said_types, have)):
            noun = "machines" if type_ == "*" else types[type_].label or type_
            yield Shortfall("wrong_count", f"the request speaks of {wanted} {noun}, the task uses {have}")
    if words.speaks_of_more() and sum(machines.values()) == 1:
        yield Shortfall("wrong_count", "the request speaks of more than one drone, the task uses 1")
    for type_ in sorted(said_types - set(words.counts)):
        if not any(name == type_ or type_ in types[name].extends for name in machines) and machines:
            yield Shortfall(
                "type_not_used", f"the request asks for a {types[type_].label or type_} ({type_}), the task uses none"
            )
    is_free = words.agents or "*" in words.counts or _ANY_DRONE.search(words.text)
    if len(said_types) == 1 and machines and not is_free:
        known = machines if is_english(words.text) else machines.keys() & LIGHT_HEAVY.keys()  # by a name, if asked for
        wrong = sorted(name for name in known if name not in said_types and not said_types & set(types[name].extends))
        for type_ in wrong:
            only = next(iter(said_types))
            yield Shortfall("type_unasked", f"the request speaks of {only} only, the task uses a {type_} too")


def _may_be_more(words: Words, said_types: Set[str], have: int) -> bool:
    """Return whether so many may be meant by a number of machines of any type, for others are spoken of besides.

    `Two drones land; one heavy drone circles`: two machines, or three.
    """
    counted = [number for type_, number in words.counts.items() if type_ != "*"]
    if len(counted) > 1 or have < words.counts["*"]:
        return len(counted) > 1
    uncounted = said_types - words.counts.keys() or _ANY_DRONE.search(words.text) is not None
    return bool(uncounted) or have <= words.counts["*"] + sum(counted)


def _machines(task: Task, flight: Flight, world: World) -> Mapping[str, int]:
    """Return how many machines of each type a task uses: as granted in the dry run, else as its roles say."""
    types, agents = world.catalogue.types, world.site.agents
    found: dict[str, int] = {}
    if flight.agents:
        for one in {agent for granted in flight.agents.values() for agent in granted}:
            if one in agents and not types[agents[one].type].human:
                found[agents[one].type] = found.get(agents[one].type, 0) + 1
        return found
    for role in task.roles.values():
        if not types[role.types[0]].human:
            found[role.types[0]] = found.get(role.types[0], 0) + (role.count or 1)
    return found


def _figures(words: Words, text: str) -> Iterator[Shortfall]:
    """Find figures that a request names and a task does not fly: each has a helper."""
    code, said = _code(text), words.text.casefold()
    ways = re.sub(r"^ *near: .*$", "", code, flags=re.MULTILINE)
    for pattern, helper in FIGURES.items():  # who goes to the end of a way does not fly it
        is_flown = re.search(rf"(?<!\bfirst\()(?<!\blast\()\b{helper}\(", ways) is not None
        if re.search(pattern, said) and not is_flown and "Explore" not in code:
            yield Shortfall("figure_not_used", f"the request wants a {helper}, and the task flies none")
    ring = re.search(r"circle\((?:above\()?(\w+)", code)
    if ring is not None and wants_centre(words.text):
        after = code[ring.end() :]
        if re.search(rf"(?:to|at): \$\{{(?:above\()?{ring[1]}\b", after) is None:
            text_ = f"the request wants the drone back at the centre after the circle, and it does not go to {ring[1]}"
            yield Shortfall("not_at_centre", text_, help=f"FlyTo {ring[1]} after the FlyAlong")


def _rings(text: str, task: Task, world: World) -> Iterator[Shortfall]:
    """Find rings round a machine that still stands at its port when they are begun."""
    steps = _code(text).partition("\nsteps:")[2]
    machines = {name for name, role in task.roles.items() if not world.catalogue.types[role.types[0]].human}
    for ring in re.finditer(r"\bcircle\((?:(?:ground|above)\()?(\w+)\.position\b", steps):
        name = ring[1]
        if name in machines and re.search(rf"\b{name}\b(?!\.position)", steps[: ring.start()]) is None:
            yield Shortfall(
                "ring_elsewhere",
                f"the ring is round where {name} stands before it is sent anywhere",
                help="circle(PLACE, RADIUS) with the place that it is sent to",
            )


def _often(words: Words, text: str) -> Iterator[Shortfall]:
    """Find laps and times that a task does not fly: it repeats nothing, and has no verb so often."""
    code = _code(text)
    if re.search(r"\b(?:repeat|for):", code):
        yield from _too_often(words, code)
        return
    verbs = re.findall(r"\b(?:call|do): *(?:\w+\.)?(\w+)", code)
    most = max((verbs.count(one) for one in verbs), default=0)
    for match in _TIMES.finditer(words.text):
        word = match[1].casefold()
        wanted = int(word) if word.isdigit() else NUMBERS.get(word, 0)
        if 2 <= wanted <= 1000 and most < wanted:
            yield Shortfall(
                "not_so_often",
                f'the request says "{match[0]}", and the task does nothing {wanted} times',
                help=f'{{"repeat": "{wanted}", "steps": [...]}}',
                about=match[0],
                wanted=wanted,
            )


def _too_often(words: Words, code: str) -> Iterator[Shortfall]:
    """Find the one repetition of a task that has more rounds than the one number of times that the request says."""
    said, rounds = list(_TIMES.finditer(words.text)), re.findall(r"\brepeat: *(\S+)", code)
    if len(said) != 1 or len(rounds) != 1 or not rounds[0].isdigit():
        return
    word = said[0][1].casefold()
    wanted = int(word) if word.isdigit() else NUMBERS.get(word, 0)
    if int(rounds[0]) > max(1, wanted) + (_ONCE_MORE.search(words.text) is not None):
        yield Shortfall(
            "too_often",
            f'the request says "{said[0][0]}", and the task repeats its steps {rounds[0]} times',
            help=f'{{"repeat": "{wanted}", "steps": [...]}}',
            about=said[0][0],
            wanted=wanted,
        )


def _order(words: Words, flight: Flight, world: World) -> Iterator[Shortfall]:
    """Find ways that are flown the other way round than from the one place to the other."""
    for a, b in sorted(from_to(words)):
        ways = [way for way in flight.visited.values() if a in way and b in way]
        often = any(words.text.casefold().count(words.places[one].casefold()) > 1 for one in (a, b))
        if ways and not often and not any(way.index(a) < way.index(b) for way in ways):
            yield Shortfall(
                "wrong_way",
                f'the request says from "{words.places[a]}" to "{words.places[b]}", the task flies back to front',
            )
    for first, then in in_turn(words):
        ways = [way for way in flight.visited.values() if first in way and then in way]
        if ways and not any(_comes_before(first, then, way, world) for way in ways):
            yield Shortfall("wrong_order", f'the request wants "{words.places[first]}" before "{words.places[then]}"')


def _comes_before(first: str, then: str, way: Sequence[str], world: World) -> bool:
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
    said = sorted((text.find(w.casefold()), name, w.casefold()) for name, w in words.places.items())
    if re.search(r"\bbefore\b|\bafter\b|\breverse\b", text) or any(text.count(w) > 1 for _, _, w in said):
        return
    for (at, a, first), (until, b, _) in pairwise(said):
        between = text[at + len(first) : until]
        if re.search(r"\bthen\b", between) or re.search(r"\bin (?:this|that) order\b", text):
            yield a, b


def _wants_home(text: str) -> bool:
    """Return whether a request, in small letters, wants a way home: not `it does not come home`, nor in a message."""
    text = re.sub(r'"[^"]*"', " ", text)
    return ends_home(text) or any(
        _NO_WAY_HOME.search(text[: found.start()]) is None for found in re.finditer(INTENTS["home"], text)
    )


def _ends(words: Words, flight: Flight) -> Iterator[Shortfall]:
    homes = [agent for agent, where in flight.stands.items() if where == "home"]
    landed = {place for places in flight.landed.values() for place in places}
    text = words.text.casefold()
    for name, said in words.places.items():
        if name == "base" or _is_refused(words.text, said):
            continue
        there = re.escape(said.casefold())
        wanted = re.search(_LAND_AT + there, text) or re.search(_TO + there + _AND_LAND, text)
        if wanted and name not in landed:
            text_ = f'the request wants a landing at "{said}", and nobody lands at {name}'
            yield Shortfall("not_landed_there", text_, about=name)
    if _wants_home(text) and flight.stands and not homes and not re.search(_ELSE, text):
        yield Shortfall("not_home", "the request wants a machine to come home, and none stands at its port at the end")
