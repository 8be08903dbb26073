"""Oracles of T1 to T10: whether flights did what a request asked, from ways, questions and actions alone. No text is read.

Each takes what the request asked for (`Asked for`: numbers and points) and one flight. T10 is judged on two flights, with a
watcher who says yes and one who says no. What a request leaves open is left open here: which drone, which way round, where
the legs of a triangle point, how high.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from typing import Any, Final

from experiments.e2_llm.figures_flown import (
    FULL_DEG,
    LEVEL_M,
    POINT_M,
    Flat,
    first_at,
    formation,
    full_round,
    rounds,
    swings,
)
from experiments.e2_llm.flown import Asked, Flown, Machine
from experiments.e2_llm.verdicts import Faults, Verdict

Goal = Mapping[str, Any]
"""What a request asks for: `center`, `radius_m`, ... in metres, points as (east, north)."""
Oracle = Callable[[Goal, Flown], Verdict]

LANE_M: Final = 22.0
"""A region is looked at when no point of it was further than this from the way (lanes are 20 m apart)."""
LATE_S: Final = 60.0
"""Landing together: the last within this of the first."""


def circle(goal: Goal, flown: Flown) -> Verdict:
    """T6: one light drone goes once round a centre, back to it, and lands at its own port."""
    faults = Faults()
    drone = _only(faults, flown, "lwd", 1)
    if drone:
        lap = _lap(faults, drone[0], goal["center"], goal["radius_m"], goal.get("height_m"))
        if lap is not None and goal.get("to_center", True):
            back = first_at(drone[0], goal["center"], since_s=lap)
            faults.unless(
                back is not None, "not_at_center", f"{drone[0].id} did not go back to the centre after the circle"
            )
        _home(faults, drone[0])
    return _done(faults, flown)


def triangle(goal: Goal, flown: Flown) -> Verdict:
    """T7: three light drones hover as a right triangle at one time, then all land where they stood, together."""
    faults = Faults()
    drones = _only(faults, flown, "lwd", 3)
    if drones:
        corner, leg = goal["corner"], goal["leg_m"]
        at_s = formation(drones, corner, leg)
        if faults.unless(at_s is not None, "no_formation", "the three never hovered as the triangle at one time"):
            assert at_s is not None
            early = [one.id for one in drones if any(touch.at_s < at_s for touch in one.landings)]
            faults.unless(not early, "landed_early", f"{', '.join(early)} landed before the formation stood")
            for one in drones:
                _lands_at(faults, one, one.at(at_s).flat)
            down = [one.landings[-1].at_s for one in drones if one.landings]
            spread = max(down) - min(down) if down else 0.0
            faults.unless(spread <= LATE_S, "not_together", f"{spread:.0f} s between the first and the last landing")
    return _done(faults, flown)


def zigzag(goal: Goal, flown: Flown) -> Verdict:
    """T8: one light drone goes from a start to an end in a zigzag of an amplitude, and lands at the end."""
    faults = Faults()
    drone = _only(faults, flown, "lwd", 1)
    if drone:
        start, end, wide = goal["start"], goal["end"], goal["amplitude_m"]
        since = first_at(drone[0], start)
        if faults.unless(since is not None, "not_at_start", f"{drone[0].id} was never over the start"):
            assert since is not None
            seen = swings(drone[0].steps(since), start, end, least_m=0.5 * wide)
            _swings(faults, seen.offsets_m, wide, goal.get("legs"))
            faults.unless(seen.widest_m <= 1.15 * wide + POINT_M, "too_wide", f"it swung {seen.widest_m:.1f} m aside")
            faults.unless(seen.backwards_m <= 3.0, "went_back", f"it went back {seen.backwards_m:.0f} m along the line")
        _lands_at(faults, drone[0], end)
    return _done(faults, flown)


def _swings(faults: Faults, offsets: tuple[float, ...], wide: float, legs: int | None) -> None:
    least = 4 if legs is None else max(1, legs - 1)
    faults.unless(len(offsets) >= least, "no_zigzag", f"{len(offsets)} swings to alternating sides, not {least}")
    if legs is not None and len(offsets) > least:
        faults.add("wrong_legs", f"{len(offsets)} swings, not {least}")
    small = [one for one in offsets if abs(abs(one) - wide) > 0.15 * wide + 0.3]
    faults.unless(not small, "wrong_amplitude", f"swings of {', '.join(f'{abs(one):.1f} m' for one in small[:3])}")


def patrol_and_escort(goal: Goal, flown: Flown) -> Verdict:
    """T9: one light drone lands at the target; another goes round it meanwhile, and lands by itself."""
    faults = Faults()
    drones = _only(faults, flown, "lwd", 2)
    if drones:
        target, radius = goal["target"], goal["radius_m"]
        escorts = [one for one in drones if any(math.dist(touch.flat, target) <= POINT_M for touch in one.landings)]
        if not faults.unless(len(escorts) == 1, "no_escort", f"{len(escorts)} drones landed at the target, not one"):
            return _done(faults, flown)
        escort, patrol = escorts[0], next(one for one in drones if one is not escorts[0])
        _lands_at(faults, escort, target)
        _lap(faults, patrol, target, radius, None)
        faults.unless(bool(patrol.landings) and patrol.is_down, "not_landed", f"{patrol.id} did not land")
        far = math.dist(patrol.end.flat, target)
        near_home = math.dist(patrol.end.flat, patrol.home) <= POINT_M
        faults.unless(
            near_home or 3.0 <= far <= radius + 10.0, "landed_elsewhere", f"{patrol.id} landed {far:.0f} m off"
        )
        faults.unless(_overlap(escort, patrol), "one_after_the_other", "the two were never in the air at one time")
    return _done(faults, flown)


def delivery(goal: Goal, flown: Flown) -> Verdict:
    """T10, the watcher says yes: two land beside each other, wait for the answer, one goes home, the other on."""
    faults = Faults()
    drones = _only(faults, flown, "lwd", 2)
    if drones and _landed_beside(faults, drones, goal):
        both = max(one.landings[0].at_s for one in drones)
        question = _asked_after(faults, flown, "watcher", both)
        if question is not None:
            _waits(faults, drones, both, question.answered_s if question.answered_s is not None else math.inf)
        ends = {one.id: one for one in drones if math.dist(one.end.flat, goal["next_stop"]) <= POINT_M and one.is_down}
        home = [one for one in drones if one.id not in ends]
        if faults.unless(len(ends) == 1, "not_at_next_stop", f"{len(ends)} drones ended at the next stop, not one"):
            _home(faults, home[0])
    return _done(faults, flown)


def delivery_no(goal: Goal, flown: Flown) -> Verdict:
    """T10, the watcher says no: both land and ask as before, and none flies on to the next stop."""
    faults = Faults()
    drones = _only(faults, flown, "lwd", 2)
    if drones and _landed_beside(faults, drones, goal):
        _asked_after(faults, flown, "watcher", max(one.landings[0].at_s for one in drones))
        went = [one.id for one in drones if first_at(one, goal["next_stop"], near_m=10.0) is not None]
        faults.unless(not went, "flew_on", f"{', '.join(went)} flew to the next stop though the answer was no")
    faults.unless(flown.crashes == 0, "crash", f"{flown.crashes} crashes")
    return faults.verdict()


def move(goal: Goal, flown: Flown) -> Verdict:
    """T1: the named drone, or the only one that stands away, is brought to its own port."""
    faults = Faults()
    drone = _only(faults, flown, ("lwd", "hwd"), 1)
    if drone:
        named = goal.get("robot", drone[0].id)
        faults.unless(drone[0].id == named, "wrong_drone", f"{drone[0].id} moved, not {named}")
        _home(faults, drone[0])
    return _done(faults, flown)


def explore(goal: Goal, flown: Flown) -> Verdict:
    """T2: one light drone looks at all of a region and comes home."""
    faults = Faults()
    drone = _only(faults, flown, "lwd", 1)
    if drone:
        seen = [one.flat for one in drone[0].steps() if one.up_m > 2.0]
        missed = [spot for spot in grid(goal["corners"]) if min(math.dist(spot, one) for one in seen) > LANE_M]
        faults.unless(not missed, "not_explored", f"{len(missed)} spots of the region were not looked at")
        _home(faults, drone[0])
    return _done(faults, flown)


def pick_up(goal: Goal, flown: Flown) -> Verdict:
    """T3: a heavy drone lands at the picker, waits for their word (or a watcher's), and comes home."""
    faults = Faults()
    drone = _only(faults, flown, "hwd", 1)
    if drone:
        touched = [one for one in drone[0].landings if math.dist(one.flat, goal["target"]) <= POINT_M]
        if faults.unless(bool(touched), "not_landed_at_target", f"{drone[0].id} did not land at the picker"):
            question = _asked_after(faults, flown, ("picker", "watcher"), touched[0].at_s)
            if question is not None:
                _waits(faults, drone, touched[0].at_s, question.answered_s or math.inf)
        _home(faults, drone[0])
    return _done(faults, flown)


def sos(goal: Goal, flown: Flown) -> Verdict:
    """T4: a heavy drone flies over the alarm, a watcher is asked while it is there, and it comes home."""
    faults = Faults()
    drone = _only(faults, flown, "hwd", 1)
    if drone:
        _watched(faults, flown, drone[0], goal["target"])
        _home(faults, drone[0])
    return _done(faults, flown)


def lost(goal: Goal, flown: Flown) -> Verdict:
    """T5: as T4; after a yes it follows the picker's tracker until they are in range, after a no it does not."""
    faults = Faults()
    drone = _only(faults, flown, "hwd", 1)
    if drone:
        question = _watched(faults, flown, drone[0], goal["target"])
        fixes = [one for one in flown.done if one.action == "MiniFinder" and one.state == "succeeded"]
        if question is not None and question.answer == "no":
            faults.unless(not fixes, "followed_anyway", "it followed the picker though the answer was no")
        elif question is not None:
            told = question.answered_s or 0.0
            asked = [one for one in fixes if one.start_s >= told and one.agent == goal["picker"]]
            faults.unless(bool(asked), "not_followed", f"{goal['picker']}'s tracker was not asked after the answer")
            if goal.get("fixes"):
                text = f"{goal['picker']}'s tracker was asked {len(asked)} times, not until they were in range"
                faults.unless(len(asked) >= goal["fixes"], "followed_too_short", text)
        _home(faults, drone[0])
    return _done(faults, flown)


ORACLES: Final[Mapping[str, Mapping[str, Oracle]]] = {
    "T1": {"yes": move},
    "T2": {"yes": explore},
    "T3": {"yes": pick_up},
    "T4": {"yes": sos, "no": sos},
    "T5": {"yes": lost, "no": lost},
    "T6": {"yes": circle},
    "T7": {"yes": triangle},
    "T8": {"yes": zigzag},
    "T9": {"yes": patrol_and_escort},
    "T10": {"yes": delivery, "no": delivery_no},
}
"""Task -> name of the scene that is flown -> the oracle of that flight."""


# -- what several of them look at ----------------------------------------------------------------------------------------


def _only(faults: Faults, flown: Flown, types: str | tuple[str, ...], count: int) -> tuple[Machine, ...]:
    """Return the machines that moved if they are so many of the right types; else an empty tuple, with the fault."""
    if flown.status == "REFUSED":
        faults.add("refused", f"{flown.code}: {flown.reason}")
        return ()
    wanted = (types,) if isinstance(types, str) else types
    movers = flown.movers()
    right = tuple(one for one in movers if one.type in wanted)
    others = [one.id for one in movers if one not in right]
    faults.unless(not others, "wrong_machine", f"{', '.join(others)} flew, which is no {' or '.join(wanted)}")
    if not faults.unless(len(right) == count, "wrong_count", f"{len(right)} {' or '.join(wanted)} flew, not {count}"):
        return ()
    return right


def _done(faults: Faults, flown: Flown) -> Verdict:
    if flown.status not in ("REFUSED", "SUCCEEDED"):
        faults.add("not_succeeded", f"the task is {flown.status} {flown.code} {flown.reason}".rstrip())
    faults.unless(flown.crashes == 0, "crash", f"{flown.crashes} crashes")
    return faults.verdict()


def _home(faults: Faults, drone: Machine) -> None:
    far = math.dist(drone.end.flat, drone.home)
    text = f"{drone.id} is {'on the ground' if drone.is_down else 'in the air'} {far:.0f} m from its port at the end"
    faults.unless(drone.is_down and far <= POINT_M, "not_home", text)


def _lands_at(faults: Faults, drone: Machine, where: Flat) -> None:
    far = math.dist(drone.end.flat, where)
    text = f"{drone.id} is {'on the ground' if drone.is_down else 'in the air'} {far:.0f} m from where it must land"
    faults.unless(drone.is_down and far <= POINT_M and bool(drone.landings), "not_landed_there", text)


def _lap(faults: Faults, drone: Machine, center: Flat, radius_m: float, height_m: float | None) -> float | None:
    """Return when the drone ended its full circle."""
    lap = full_round(drone, center, radius_m)
    if lap is None:
        best = max((one.turned_deg for one in rounds(drone, center, radius_m)), default=0.0)
        faults.add("no_circle", f"{drone.id} went {best:.0f} of {FULL_DEG:.0f} degrees round at {radius_m:g} m")
        return None
    text = f"{drone.id} flew the circle between {lap.lowest_m:.0f} and {lap.highest_m:.0f} m"
    faults.unless(lap.highest_m - lap.lowest_m <= LEVEL_M, "not_level", text)
    if height_m is not None:
        off = max(abs(lap.lowest_m - height_m), abs(lap.highest_m - height_m))
        faults.unless(off <= LEVEL_M, "wrong_height", f"{text}, not at {height_m:g} m")
    return lap.until_s


def _overlap(a: Machine, b: Machine) -> bool:
    spans = [(one.take_offs[0].at_s, one.landings[-1].at_s) for one in (a, b) if one.take_offs and one.landings]
    return len(spans) == 2 and max(spans[0][0], spans[1][0]) < min(spans[0][1], spans[1][1])


def _landed_beside(faults: Faults, drones: Iterable[Machine], goal: Goal) -> bool:
    a, b = drones
    if not faults.unless(bool(a.landings and b.landings), "not_landed", "not both landed"):
        return False
    first, second = a.landings[0], b.landings[0]
    near = [math.dist(one.flat, goal["target"]) for one in (first, second)]
    apart = math.dist(first.flat, second.flat)
    here = max(near) <= goal["spacing_m"] + POINT_M
    faults.unless(here, "not_landed_there", f"they landed {near[0]:.0f} and {near[1]:.0f} m from the target")
    right = abs(apart - goal["spacing_m"]) <= 1.0
    faults.unless(right, "wrong_spacing", f"they landed {apart:.1f} m apart, not {goal['spacing_m']:g} m")
    return True


def _asked_after(faults: Faults, flown: Flown, kinds: str | tuple[str, ...], at_s: float) -> Asked | None:
    """Return the first question to such a person after an instant."""
    wanted = (kinds,) if isinstance(kinds, str) else kinds
    asked = [one for one in flown.asked if any(flown.people.get(who) in wanted for who in one.people)]
    late = [one for one in asked if one.at_s >= at_s - 0.5]
    if late:
        return late[0]
    faults.add("asked_early" if asked else "not_asked", f"no {' or '.join(wanted)} was asked after all had landed")
    return None


def _waits(faults: Faults, drones: Iterable[Machine], since_s: float, until_s: float) -> None:
    went = [one.id for one in drones if any(since_s < touch.at_s < until_s - 0.5 for touch in one.take_offs)]
    faults.unless(not went, "did_not_wait", f"{', '.join(went)} took off before the answer")


def _watched(faults: Faults, flown: Flown, drone: Machine, target: Flat) -> Asked | None:
    over = first_at(drone, target, near_m=5.0)
    if not faults.unless(over is not None, "not_at_target", f"{drone.id} was never over the alarm"):
        return None
    assert over is not None
    question = _asked_after(faults, flown, "watcher", over)
    if question is not None:
        until = question.answered_s if question.answered_s is not None else question.at_s
        off = max((math.dist(one.flat, target) for one in drone.steps(question.at_s, until)), default=0.0)
        faults.unless(
            off <= 5.0, "did_not_wait", f"{drone.id} was {off:.0f} m from the alarm while the watcher was asked"
        )
    return question


def grid(corners: list[Flat]) -> list[Flat]:
    """Return spots 10 m apart inside a polygon."""
    easts, norths = [one[0] for one in corners], [one[1] for one in corners]
    spots = [
        (min(easts) + 10.0 * i, min(norths) + 10.0 * j)
        for i in range(int((max(easts) - min(easts)) / 10.0) + 1)
        for j in range(int((max(norths) - min(norths)) / 10.0) + 1)
    ]
    return [spot for spot in spots if _is_inside(spot, corners)]


def _is_inside(spot: Flat, corners: list[Flat]) -> bool:
    inside = False
    for (ax, ay), (bx, by) in pairwise([*corners, corners[0]]):
        if (ay > spot[1]) != (by > spot[1]) and spot[0] < ax + (spot[1] - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside
