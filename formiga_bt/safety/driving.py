"""Ground machines at the gate: may this machine drive this way, and does its charge do?

Zones are the fence and the no-go regions; the speed is the one that the goal asks for; the charge is reckoned for the straight
way and from its end to the nearest charging station, in time over the ground times `drive_drain_pct_s` of the type.
The corridor is the straight way with `min_spacing` around it: while another machine of another task stands or drives in it, a
goal waits. Two that both keep away from obstacles by themselves (`avoids` of their cards) share the ground, and two that are
both on the site's routes have their nodes and edges.
Pure; called by the gate (`in_the_way`), by what it asks of the limits (`at_gate`), and at each status (the others).
"""

import math
from collections.abc import Sequence

from msgspec import Struct

from formiga_bt.base.geo import Place, Position, horizontal_m, segment_distance_m
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.flights import Breach
from formiga_bt.safety.rules import Rules
from formiga_bt.safety.traffic import TakenArea, Traffic, Way, way_area_m, ways_into

LOW_M = 3.0
"""What is lower than this over the ground is in the way of who drives."""


class Drive(Struct, frozen=True, kw_only=True, gc=False):
    """What a goal would do, and with which machine."""

    agent: str
    here: Position | None
    to: Place | None
    """Where it drives; None = it stays where it is, or goes about in an area."""
    around: tuple[Way, ...] = ()
    """Of an action in an area: the ways into it and around it."""
    speed_m_s: float | None = None
    """That the goal asks for; None = the machine's own."""
    own_speed_m_s: float = 0.0
    battery: float | None = None
    drain_pct_s: float = 0.0
    """Points of charge a second while it drives; 0 = not known, and the charge is not reckoned."""
    chargers: tuple[Place, ...] = ()
    onward_m: float | None = None
    """On routes: how far it is from `to` to where it drives in the end, and on to a charging station; None: straight."""
    rescue: bool = False
    """A goal of recover: it is not judged by its charge, and may lead out of a breach."""


def at_gate(drive: Drive, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the gravest limit that a goal would break, or None."""
    speed = drive.own_speed_m_s if drive.speed_m_s is None else drive.speed_m_s
    if speed > rules.max_speed_m_s and (drive.speed_m_s is not None or drive.to is not None or drive.around):
        text = f"{drive.agent} would go with {speed:g} m/s, at most {rules.max_speed_m_s:g} m/s are allowed"
        return Breach("max_speed", text, speed, rules.max_speed_m_s)
    if drive.to is None and not drive.around:
        return None
    if drive.here is None:
        return Breach("position", f"it is not known where {drive.agent} is")
    ways = drive.around if drive.to is None else ((_low(drive.here), _low(drive.to)),)
    if not all(math.isfinite(a.east_m + a.north_m + b.east_m + b.north_m) for a, b in ways):
        return Breach("position", f"{drive.agent} is to go nowhere: a coordinate of the way is no number")
    for zone in ground.ground_zones:
        found = (zone.offence(a, b, rescue=drive.rescue) for a, b in ways)
        offence = next((one for one in found if one is not None), None)
        if offence is not None:
            deep, at = (
                round(offence.depth_m, 1),
                f"east {round(offence.at.east_m)} m, north {round(offence.at.north_m)} m",
            )
            if zone.keep_in:
                return Breach("keep_in", f"the way leaves the fence: {deep:g} m outside at {at}", deep, 0.0)
            return Breach(
                "keep_out", f"the way enters the no-go region {zone.name}: {deep:g} m deep at {at}", deep, 0.0
            )
    return None if drive.rescue else _charge(drive, drive.to or drive.here.ground, speed, rules)


def while_driving(
    agent: str, here: Position | None, battery: float | None, ground: Airspace, rules: Rules
) -> tuple[Breach, ...]:
    """Return all limits that a machine on the ground breaks now, the gravest first.

    Args:
        agent: which one.
        here: where it is; None = not known.
        battery: percent; None = it is not judged by it, because it stands or does not tell.
        ground: the fence and the no-go regions.
        rules: its limits.
    """
    found: list[Breach] = []
    if here is None:
        found.append(Breach("position", f"it is not known where {agent} is"))
    else:
        for zone in ground.ground_zones:
            if zone.is_broken_at(here):
                name, where = (
                    ("keep_in", "outside the fence") if zone.keep_in else ("keep_out", f"in no-go {zone.name}")
                )
                found.append(Breach(name, f"{agent} is {where}"))
    if battery is not None and battery < rules.reserve_pct:
        text = f"{agent} has {battery:.1f} %, {rules.reserve_pct:g} % are reserve"
        found.append(Breach("reserve", text, battery, rules.reserve_pct))
    return tuple(found)


def off_the_way(here: Position, ways: Sequence[Way], most_m: float) -> Breach | None:
    """Return the breach of a machine that is off the ways that it may be on: others were let go because it keeps to them."""
    off = round(min(segment_distance_m(_low(here), _low(here), _low(a), _low(b)) for a, b in ways), 1)
    if off <= most_m:
        return None
    return Breach(
        "way", f"it is {off:g} m off the way that it was given, at most {most_m:g} m are allowed", off, most_m
    )


def _charge(drive: Drive, to: Place, speed: float, rules: Rules) -> Breach | None:
    if drive.drain_pct_s <= 0.0 or drive.here is None:
        return None
    if drive.battery is None:
        return Breach("reserve", f"the charge of {drive.agent} is not known")
    pace = speed if speed > 0.0 else 1.0
    home_m = drive.onward_m
    if home_m is None:
        home_m = min((horizontal_m(to, one) for one in drive.chargers), default=0.0)
    need = (horizontal_m(drive.here, to) + home_m) / pace * drive.drain_pct_s
    left = drive.battery - rules.reserve_pct
    if need <= left:
        return None
    then = "to go there and on to the nearest charging station" if drive.chargers else "to go there"
    text = f"needs {need:.1f} % {then}, has {drive.battery:.1f} % of which {rules.reserve_pct:g} % are reserve"
    return Breach("reserve", text, need, left)


def ways_over(start: Position, leg: Way | None, area: TakenArea | None) -> tuple[Way, ...]:
    """Return the straight ways over ground of a goal: its leg, or the ways into and around what it goes about in."""
    if area is None:
        return (leg,) if leg is not None else ()
    corners = [_low(corner) for corner in area.corners]
    return (*zip(corners, [*corners[1:], corners[0]], strict=True), *ways_into(start, area))


def in_the_way(
    agent: str,
    task: str,
    ways: Sequence[Way],
    area: TakenArea | None,
    traffic: Sequence[Traffic],
    keep_m: float,
    *,
    on_routes: bool = False,
    avoids: bool = False,
) -> str:
    """Return the machine of another task that stands, drives, starts or lands in the way of who drives, or "".

    One that is too near already may be left, never be come nearer to.

    Args:
        agent: who drives.
        task: for which task.
        ways: where.
        area: what it goes about in.
        traffic: the others.
        keep_m: how far apart they stay.
        on_routes: it drives on the site's routes, which keep it apart from others on them.
        avoids: it keeps away from obstacles by itself: it shares the ground with others that do.
    """
    for other in traffic:
        if other.agent == agent or (other.task and other.task == task):
            continue
        if (on_routes and other.on_routes) or (avoids and other.avoids):
            continue
        theirs = [(_low(spot), _low(spot)) for spot in other.spots]
        theirs += [(_low(a), _low(b)) for a, b in other.ways if min(a.up_m, b.up_m) < LOW_M]
        for taken in theirs:
            if area is not None and way_area_m(taken, area) < keep_m:
                return other.agent
            for start, end in ways:
                if segment_distance_m(start, end, *taken) < keep_m and not _leaves(start, end, taken, keep_m):
                    return other.agent
        if other.area is not None and other.area.up_m < LOW_M:
            low = TakenArea(other.area.corners, 0.0)
            if any(way_area_m(way, low) < keep_m for way in ways):
                return other.agent
    return ""


def _leaves(start: Position, end: Position, theirs: Way, keep_m: float) -> bool:
    now_m = segment_distance_m(start, start, *theirs)
    least_m = segment_distance_m(start, end, *theirs)
    return now_m < keep_m <= segment_distance_m(end, end, *theirs) and least_m >= now_m - 0.1


def _low(at: Place | Position) -> Position:
    return Position(at.east_m, at.north_m, 0.0)
