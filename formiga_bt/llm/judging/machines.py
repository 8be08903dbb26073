"""Machines: those that a request names or counts take part, and no others; at one time, or never, where that is wanted."""

import re
from collections.abc import Iterator, Mapping, Set
from itertools import pairwise
from typing import Final

from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.plain import is_refused
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.at_once import certainly_at_once, may_rest
from formiga_bt.llm.words.one_by_one import certainly_one_by_one
from formiga_bt.llm.words.spoken import is_english
from formiga_bt.llm.words.wording import LIGHT_HEAVY, Words, types_said
from formiga_bt.llm.world import RequestWorld

_ANY_DRONE: Final = re.compile(
    r"\b(?:an?|one|another|un|otro)\s+(?:other\s+|second\s+|segundo\s+)?drone?\b(?!\s+(?:ligero|pesado))", re.IGNORECASE
)
"""A machine of which no type is said."""


def agents(words: Words, task: Task, flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find machines that are named, counted or of a type that is asked for and take no part; and others that do."""
    used = {agent for granted in flight.agents.values() for agent in granted}
    types = world.catalogue.types
    if flight.status == "SUCCEEDED":
        for name, said in words.agents.items():
            if name not in used and name not in flight.asked and not is_refused(words.text, said):
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
    if flight.status == "SUCCEEDED":
        yield from _in_turn(words, flight, world)
        if certainly_one_by_one(words):
            yield from _together(flight, world)


def _together(flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find two machines that are in the air at one time; of more than two, the first ones."""
    spans = sorted((up, down, agent) for agent, own in _flights(flight, world).items() for up, down in own)
    for (_, down, one), (up, _, other) in pairwise(spans):
        if one != other and up < down:
            text = (
                f"the request wants no two machines in the air at one time, and {other} takes off before {one} is down"
            )
            yield Shortfall(
                "air_shared",
                text,
                help="one after the other, not in parallel: the first lands, then the next one starts",
            )
            return


def _in_turn(words: Words, flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find machines of which one flies after the other where the request certainly wants them in the air at one time.

    Args:
        words: the request, as read.
        flight: the dry run; it succeeded.
        world: the site.
    """
    types = world.catalogue.types
    said = {t for t in types_said(words, world.catalogue) if not types[t].human}
    named = [one for one in words.agents if not types[world.site.agents[one].type].human]
    several = words.speaks_of_more() or len(said) > 1 or len(named) > 1 or any(n > 1 for n in words.counts.values())
    spans = sorted(_in_the_air(flight, world).values())
    if not several or len(spans) < 2 or not certainly_at_once(words):
        return
    if may_rest(words) and any(place != "home" for places in flight.landed.values() for place in places):
        return
    if all(end <= start for (_, end), (start, _) in pairwise(spans)):
        yield Shortfall(
            "not_at_once",
            "the request wants them at the same time, and one flies after the other",
            help='{"parallel": [...]}',
        )


def _in_the_air(flight: RehearsedFlight, world: RequestWorld) -> Mapping[str, tuple[int, int]]:
    """Return when each machine took off first and landed last (microseconds); who waits for a free way is under way, too."""
    found: dict[str, tuple[int, int]] = {}
    if flight.timeline is None:
        return found
    rows = [one for one in flight.timeline.actions if one.agent in flight.visited]
    waits = [one for one in flight.timeline.waits if one.kind in ("gate", "held")]
    if any(not one.agent for one in waits):
        return found
    ups, downs = _ups_and_downs(world)
    for agent in {one.agent for one in rows if one.action in ups}:
        own = [one for one in rows if one.agent == agent]
        first = min(one.start for one in own if one.action in ups)
        landings = [one.end for one in own if one.action in downs and one.end is not None]
        last = max(landings or [one.end if one.end is not None else flight.timeline.at for one in own])
        waited = [one.start for one in waits if one.agent == agent]
        found[agent] = min([first, *waited]), last
    return found


def _flights(flight: RehearsedFlight, world: RequestWorld) -> Mapping[str, list[tuple[int, int]]]:
    """Return when each machine took off and landed next (microseconds)."""
    found: dict[str, list[tuple[int, int]]] = {}
    if flight.timeline is None:
        return found
    ups, lands = _ups_and_downs(world)
    for agent in flight.visited:
        rows = [one for one in flight.timeline.actions if one.agent == agent]
        downs = sorted(one.end for one in rows if one.action in lands and one.end is not None)
        for up in sorted(one.start for one in rows if one.action in ups):
            found.setdefault(agent, []).append((up, next((one for one in downs if one > up), flight.timeline.at)))
    return found


def _ups_and_downs(world: RequestWorld) -> tuple[Set[str], Set[str]]:
    """Return the actions of the catalogue that begin a flight, and those that end one."""
    actions = world.catalogue.actions.values()
    return {one.name for one in actions if one.starts_rotors}, {one.name for one in actions if one.lands}


def _may_be_more(words: Words, said_types: Set[str], have: int) -> bool:
    """Return whether so many may be meant by a number of machines of any type, for others are spoken of besides.

    `Two drones land; one heavy drone circles`: two machines, or three.
    """
    counted = [number for type_, number in words.counts.items() if type_ != "*"]
    if len(counted) > 1 or have < words.counts["*"]:
        return len(counted) > 1
    uncounted = said_types - words.counts.keys() or _ANY_DRONE.search(words.text) is not None
    return bool(uncounted) or have <= words.counts["*"] + sum(counted)


def _machines(task: Task, flight: RehearsedFlight, world: RequestWorld) -> Mapping[str, int]:
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
