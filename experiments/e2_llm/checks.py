"""The oracle of the second set as data: a small vocabulary of checks over a flight.

A check is a mapping with one key, its name:

    flies: {lwd: 1, hwd: 1}                     so many machines of each type moved, and no other
    moves: [lwd_2]                              exactly these moved
    home: true                                  all that moved stand at their own ports at the end
    ends: {north_field: 2}                      so many stand there at the end
    row: {place: camp, count: 3, apart_m: 10}   so many stand there at the end, each so far from its nearest (within 3 m)
    over: {place: camp, times: 3, height_m: 40, stay_s: 60, type: hwd}     so often one of them was over it in the air;
                                                with and_back: true one time more is right, too
    order: [camp, north_field]                  first reached in this order
    lands: {place: camp, times: 1, type: hwd}   so many landings there
    not_over: [camp]                            nothing came near
    rings: {place: camp, radius_m: 20, turns: 2}
    explores: {regions: [lake], height_m: 40}
    asks: {type: watcher, times: 1, when: before_flight | landed | airborne | home}
    asks_nobody: true
    no_flight_before_answer: true               after a landing, or before the first take-off, nothing starts until the answer
    at_once: true                               those that moved were in the air at one time
    one_by_one: true                            never two in the air at one time
    every: {place: camp, period_s: 300}         arrivals are so far apart (within 25 %)
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations, pairwise
from typing import Any, Final

from experiments.e2_llm.figures_flown import POINT_M, ring_band_m, rounds
from experiments.e2_llm.flown import Fix, Flown, Machine
from experiments.e2_llm.oracles import LANE_M, grid
from experiments.e2_llm.verdicts import Faults, Verdict

NEAR_M: Final = 8.0
"""So near to a place a machine is over it."""
AWAY_M: Final = 20.0
"""A visit is over when a machine is further away than this."""

Where = Mapping[str, tuple[float, float]]
Check = Callable[[Faults, Flown, Any, Mapping[str, Any]], None]


def check(flown: Flown, wanted: Sequence[Mapping[str, Any]], site: Mapping[str, Any]) -> Verdict:
    """Return what a flight lacks of the checks.

    Args:
        flown: the flight.
        wanted: the checks.
        site: `places` (also ports and base) and `regions` in metres.
    """
    faults = Faults()
    if flown.status == "REFUSED":
        faults.add("refused", f"{flown.code}: {flown.reason}")
        return faults.verdict()
    faults.unless(flown.crashes == 0, "crash", f"{flown.crashes} crashes")
    for one in wanted:
        ((name, value),) = one.items()
        CHECKS[name](faults, flown, value, site)
    return faults.verdict()


def _flies(faults: Faults, flown: Flown, value: Mapping[str, int], _site: Mapping[str, Any]) -> None:
    found: dict[str, int] = {}
    for one in flown.movers():
        found[one.type] = found.get(one.type, 0) + 1
    faults.unless(found == dict(value), "flies", f"{found or 'nobody'} flew, not {dict(value) or 'nobody'}")


def _moves(faults: Faults, flown: Flown, value: list[str], _site: Mapping[str, Any]) -> None:
    found = sorted(one.id for one in flown.movers())
    faults.unless(found == sorted(value), "moves", f"{', '.join(found) or 'nobody'} moved, not {', '.join(value)}")


def _home(faults: Faults, flown: Flown, _value: bool, _site: Mapping[str, Any]) -> None:
    away = [one.id for one in flown.movers() if not one.is_down or math.dist(one.end.flat, one.home) > POINT_M]
    faults.unless(not away, "home", f"{', '.join(away)} did not end at home")


def _ends(faults: Faults, flown: Flown, value: Mapping[str, int], site: Mapping[str, Any]) -> None:
    for place, count in value.items():
        there = [
            one
            for one in flown.movers()
            if one.is_down and math.dist(one.end.flat, site["places"][place]) <= NEAR_M + 4.0
        ]
        faults.unless(len(there) == count, "ends", f"{len(there)} stand at {place} at the end, not {count}")


def _row(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    """A row may begin at its place, so that its end stands further away than one machine alone would."""
    place, count, apart = value["place"], value["count"], value["apart_m"]
    far = {one.id: math.dist(one.end.flat, site["places"][place]) for one in flown.movers() if one.is_down}
    there = [one for one in flown.movers() if far.get(one.id, math.inf) <= (count - 1) * apart + NEAR_M]
    is_there = len(there) == count and min(far[one.id] for one in there) <= NEAR_M + 4.0
    if not faults.unless(is_there, "row", f"{len(there)} stand at {place} at the end, not {count}"):
        return
    gaps = [min(math.dist(a.end.flat, b.end.flat) for b in there if b is not a) for a in there]
    text = f"their nearest are {', '.join(f'{gap:.0f}' for gap in gaps)} m away, not {apart:g} m"
    faults.unless(all(abs(gap - apart) <= 3.0 for gap in gaps), "row", text)


def visits(machine: Machine, where: tuple[float, float]) -> list[list[Fix]]:
    """Return the visits of a machine in the air to a place."""
    found: list[list[Fix]] = []
    inside = False
    for one in machine.steps():
        far = math.dist(one.flat, where)
        if far <= NEAR_M and one.up_m > 2.0:
            if not inside:
                found.append([])
            inside = True
            found[-1].append(one)
        elif far > AWAY_M or one.up_m <= 2.0:
            inside = False
    return found


def _over(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    place = value["place"]
    types = value.get("type")
    seen = [
        visit
        for one in flown.movers()
        if types is None or one.type == types
        for visit in visits(one, site["places"][place])
        if _is_long(visit, value.get("stay_s"))
    ]
    height = value.get("height_m")
    if height is not None:
        seen = [visit for visit in seen if any(abs(one.up_m - height) <= 3.0 for one in visit)]
    times = value.get("times", 1)
    text = f"{len(seen)} fitting visits to {place}, not {times}"
    right = (times, times + 1) if value.get("and_back") else (times,)
    faults.unless(len(seen) in right, "over", text)


def _is_long(visit: list[Fix], stay_s: float | None) -> bool:
    if stay_s is None:
        return True
    stood = max((b.at_s - a.at_s for a, b in pairwise(visit)), default=0.0)
    return 0.9 * stay_s <= stood <= 1.6 * stay_s + 30.0


def _order(faults: Faults, flown: Flown, value: list[str], site: Mapping[str, Any]) -> None:
    at: list[float] = []
    for place in value:
        first = [visit[0].at_s for one in flown.movers() for visit in visits(one, site["places"][place])]
        later = [one for one in first if not at or one > at[-1]]
        if not faults.unless(bool(later), "order", f"{place} was not reached in its turn ({', '.join(value)})"):
            return
        at.append(min(later))


def _lands(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    where = site["places"][value["place"]]
    types, times = value.get("type"), value.get("times", 1)
    found = [
        touch
        for one in flown.movers()
        if types is None or one.type == types
        for touch in one.landings
        if math.dist(touch.flat, where) <= NEAR_M + 4.0
    ]
    faults.unless(len(found) == times, "lands", f"{len(found)} landings at {value['place']}, not {times}")


def _not_over(faults: Faults, flown: Flown, value: list[str], site: Mapping[str, Any]) -> None:
    for place in value:
        went = [one.id for one in flown.movers() if visits(one, site["places"][place])]
        faults.unless(not went, "not_over", f"{', '.join(went)} went to {place}")


def _rings(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    turns, radius, where = value.get("turns", 1), value["radius_m"], site["places"][value["place"]]
    best = max((one.turned_deg for machine in flown.movers() for one in rounds(machine, where, radius)), default=0.0)
    right = abs(best - 360.0 * turns) <= 40.0
    text = f"{best:.0f} degrees round {value['place']} at {radius:g} m (within {ring_band_m(radius):.1f} m), not {360 * turns}"
    faults.unless(right, "rings", text)


def _explores(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    height = value["height_m"]
    steps = [one for machine in flown.movers() for one in machine.steps() if abs(one.up_m - height) <= 3.0]
    for region in value["regions"]:
        spots = grid(site["regions"][region])
        missed = [spot for spot in spots if min((math.dist(spot, one.flat) for one in steps), default=1e9) > LANE_M]
        faults.unless(not missed, "explores", f"{len(missed)} spots of {region} were not looked at from {height} m")


def _asks(faults: Faults, flown: Flown, value: Mapping[str, Any], _site: Mapping[str, Any]) -> None:
    kind, times, when = value.get("type"), value.get("times", 1), value.get("when")
    rows = [one for one in flown.asked if kind is None or any(flown.people.get(who) == kind for who in one.people)]
    if "who" in value:
        rows = [one for one in rows if value["who"] in one.people]
    rows = [one for one in rows if when is None or _WHEN[when](flown, one.at_s)]
    faults.unless(len(rows) == times, "asks", f"{len(rows)} fitting questions, not {times} ({dict(value)})")


def _in_air(flown: Flown, at_s: float) -> bool:
    return any(one.at(at_s).up_m > 2.0 for one in flown.movers())


def _flew(flown: Flown, at_s: float) -> bool:
    return any(touch.at_s < at_s for one in flown.movers() for touch in one.take_offs)


_WHEN: Final[Mapping[str, Callable[[Flown, float], bool]]] = {
    "before_flight": lambda flown, at_s: not _flew(flown, at_s),
    "airborne": _in_air,
    "landed": lambda flown, at_s: _flew(flown, at_s) and not _in_air(flown, at_s),
    "home": lambda flown, at_s: all(
        math.dist(one.at(at_s).flat, one.home) <= POINT_M and one.at(at_s).up_m < 1.0 and _flew(flown, at_s)
        for one in flown.movers()
    ),
}


def _asks_nobody(faults: Faults, flown: Flown, _value: bool, _site: Mapping[str, Any]) -> None:
    faults.unless(not flown.asked, "asks_nobody", f"{len(flown.asked)} questions were asked")


def _held(faults: Faults, flown: Flown, _value: bool, _site: Mapping[str, Any]) -> None:
    for question in flown.asked:
        until = question.answered_s if question.answered_s is not None else flown.end_s
        went = [
            one.id for one in flown.movers() if any(question.at_s < touch.at_s < until - 0.5 for touch in one.take_offs)
        ]
        faults.unless(not went, "no_flight_before_answer", f"{', '.join(went)} took off before the answer")


def _spans(one: Machine) -> list[tuple[float, float]]:
    return [(up.at_s, next((t.at_s for t in one.landings if t.at_s > up.at_s), math.inf)) for up in one.take_offs]


def _overlap(a: Machine, b: Machine) -> bool:
    return any(max(x[0], y[0]) < min(x[1], y[1]) for x in _spans(a) for y in _spans(b))


def _at_once(faults: Faults, flown: Flown, _value: bool, _site: Mapping[str, Any]) -> None:
    apart = [f"{a.id} and {b.id}" for a, b in combinations(flown.movers(), 2) if not _overlap(a, b)]
    faults.unless(not apart, "at_once", f"{', '.join(apart)} were never in the air at one time")


def _one_by_one(faults: Faults, flown: Flown, _value: bool, _site: Mapping[str, Any]) -> None:
    both = [f"{a.id} and {b.id}" for a, b in combinations(flown.movers(), 2) if _overlap(a, b)]
    faults.unless(not both, "one_by_one", f"{', '.join(both)} were in the air at one time")


def _every(faults: Faults, flown: Flown, value: Mapping[str, Any], site: Mapping[str, Any]) -> None:
    arrivals = sorted(visit[0].at_s for one in flown.movers() for visit in visits(one, site["places"][value["place"]]))
    gaps = [b - a for a, b in pairwise(arrivals)]
    period = value["period_s"]
    wrong = [gap for gap in gaps if abs(gap - period) > 0.25 * period]
    faults.unless(
        bool(gaps) and not wrong, "every", f"arrivals {', '.join(f'{gap:.0f} s' for gap in gaps) or 'too few'} apart"
    )


CHECKS: Final[Mapping[str, Check]] = {
    "flies": _flies,
    "moves": _moves,
    "home": _home,
    "ends": _ends,
    "row": _row,
    "over": _over,
    "order": _order,
    "lands": _lands,
    "not_over": _not_over,
    "rings": _rings,
    "explores": _explores,
    "asks": _asks,
    "asks_nobody": _asks_nobody,
    "no_flight_before_answer": _held,
    "at_once": _at_once,
    "one_by_one": _one_by_one,
    "every": _every,
}
