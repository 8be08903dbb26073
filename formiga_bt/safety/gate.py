"""The gate: may this goal leave now? Every goal passes here, whatever tree, retry or cleanup it comes from.

Pure functions over a small view of the site and fleet. The engine acts on the verdict: `Go` = send, with the leg and the
clearance that go along; `Hold` = wait, with a code and for whom; `Refuse` = never.

Rules of this version: who is in command, link, one goal at a time, task held, clearance of people away from ports, one
machine on a spot, and legs kept apart. Codes are listed in docs/reasons.md.
"""

import math
from collections.abc import Sequence

from msgspec import Struct

from formiga_bt.clock import SECOND, Micros
from formiga_bt.geo import Place, Position, horizontal_m, segment_distance_m
from formiga_bt.transport.messages import Clearance, Control, Landed

CLEARANCE_LIFE_US: Micros = 60 * SECOND
"""Rotors must start, or the descent begin, within this time of the word."""

SPOT_M = 3.0
"""No two machines use ground spots closer than this."""

AT_PORT_M = 3.0
"""A machine this near to a port (horizontally) stands at it."""

GROUND_M = 0.5
"""A leg that ends at most so high ends on the ground."""

VERTICAL_M = 10.0
"""A leg that stays within this (horizontally) is a vertical move at its place."""


Way = tuple[Position, Position]
"""A straight way; both ends equal = a hover."""


class Traffic(Struct, frozen=True):
    """Another machine: where it is, and the ways that it takes up. Made by `traffic_of`."""

    agent: str
    task: str
    landed: Landed
    position: Position | None
    leg: Way | None
    ways: tuple[Way, ...]
    """Where it is or will be: its leg, its hover, the column of its next climb."""
    box: tuple[float, float, float, float]
    """Horizontal bounds of the ways: west, east, south, north, metres."""


class Ask(Struct, frozen=True, kw_only=True):
    """A goal that wants to leave, and what the gate must know of its agent."""

    agent: str
    task: str
    human: bool
    reachable: bool
    control: Control
    safety: bool = False
    """A safety goal replaces whatever runs: it waits for no other goal of its agent."""
    deposed: bool = False
    """A newer engine commands this site: this one sends nothing more."""
    taken: bool = False
    """A pilot or its own failsafe took it over, and no person has handed it back yet."""
    busy: str = ""
    """Why the agent cannot take a goal now (another goal in flight), or empty."""
    stopped: str = ""
    """The stop that stands on the agent, if this goal does not carry it out."""
    locked: str = ""
    """What lockdown makes the fleet do, if it holds this goal back."""
    held: bool = False
    """Its task is held and the goal comes from `steps`."""
    position: Position | None = None
    landed: Landed = "unknown"
    target: Place | Position | None = None
    rises_to_m: float | None = None
    starts_rotors: bool = False
    lands: bool = False
    clearance: Clearance | None = None
    ports: tuple[Place, ...] = ()
    home: Place | None = None
    exempt_clearance: bool = False


class Go(Struct, frozen=True):
    """Send it."""

    leg: tuple[Position, Position] | None = None


class Hold(Struct, frozen=True):
    """Wait. `whom`: the agent, task or person waited for."""

    code: str
    whom: str = ""


class Refuse(Struct, frozen=True):
    """Never."""

    code: str
    text: str


Verdict = Go | Hold | Refuse


def judge(ask: Ask, traffic: Sequence[Traffic], now: Micros, separation_m: float) -> Verdict:
    """Return what becomes of a goal that wants to leave now."""
    if ask.deposed:
        return Hold("epoch", "a newer engine")
    if ask.human:
        return Go() if ask.reachable else Hold("unreachable", ask.agent)
    for verdict in (_command(ask), _spot(ask, traffic), _clear(ask, now)):
        if verdict is not None:
            return verdict
    leg = leg_of(ask)
    if leg is None:
        return Go()
    blocker = first_in_the_way(ask, leg, traffic, separation_m)
    return Hold("leg_busy", blocker) if blocker else Go(leg)


def _command(ask: Ask) -> Verdict | None:
    if ask.control != "engine":
        return Hold("control", ask.control)
    if ask.taken:
        return Hold("control", "handback")
    if not ask.reachable:
        return Hold("suspect", ask.agent)
    if ask.stopped:
        return Hold("stopped", ask.stopped)
    if ask.locked:
        return Hold("lockdown", ask.locked)
    if ask.busy and not ask.safety:
        return Hold("draining", ask.busy)
    if ask.held:
        return Hold("held", ask.task)
    return None


def _spot(ask: Ask, traffic: Sequence[Traffic]) -> Verdict | None:
    if not ask.lands or ask.target is None:
        return None
    for port in ask.ports:
        if horizontal_m(port, ask.target) < AT_PORT_M and (
            ask.home is None or horizontal_m(port, ask.home) >= AT_PORT_M
        ):
            return Refuse("foreign_port", "that port belongs to another agent")
    for other in traffic:
        for spot in _ground_spots(other):
            if horizontal_m(spot, ask.target) < SPOT_M:
                return Hold("spot_busy", other.agent)
    return None


def _ground_spots(other: Traffic) -> list[Place]:
    spots = []
    if other.position is not None and other.landed != "airborne":
        spots.append(other.position.ground)
    if other.leg is not None and other.leg[1].up_m <= GROUND_M:
        spots.append(other.leg[1].ground)
    return spots


def needs_clearance(ask: Ask) -> bool:
    """Return whether a person must say first that people stand clear: a rotor start or landing away from ports."""
    if not (ask.starts_rotors or ask.lands) or ask.exempt_clearance:
        return False
    spot = ask.target if ask.lands else ask.position
    return spot is None or all(horizontal_m(port, spot) >= AT_PORT_M for port in ask.ports)


def _clear(ask: Ask, now: Micros) -> Verdict | None:
    if not needs_clearance(ask):
        return None
    if ask.clearance is not None and now - ask.clearance.at <= CLEARANCE_LIFE_US:
        return None
    return Hold("clearance")


def leg_of(ask: Ask) -> Way | None:
    """Return the straight way that a goal flies, or None if it does not move the agent."""
    here = ask.position
    if here is None:
        return None
    if ask.rises_to_m is not None:
        return here, Position(here.east_m, here.north_m, ask.rises_to_m)
    if isinstance(ask.target, Position):
        return here, ask.target
    if isinstance(ask.target, Place):
        return here, Position(ask.target.east_m, ask.target.north_m, 0.0)
    return None


def first_in_the_way(ask: Ask, leg: Way, traffic: Sequence[Traffic], separation_m: float) -> str:
    """Return the agent whose granted leg or hover is within the separation of `leg`, or "".

    Machines of the same task are the author's business, those on the ground are no traffic. Vertical moves at a place keep
    half the separation: ports and spots lie closer together than cruise legs may pass.
    """
    keep_m = separation_m / 2 if horizontal_m(leg[0], leg[1]) <= VERTICAL_M else separation_m
    west, east, south, north = box_of((leg,))
    west, east, south, north = west - keep_m, east + keep_m, south - keep_m, north + keep_m
    for other in traffic:
        box = other.box
        if box[1] < west or box[0] > east or box[3] < south or box[2] > north:
            continue
        if other.agent == ask.agent or (other.task and other.task == ask.task):
            continue
        if any(segment_distance_m(*leg, *way) < keep_m for way in other.ways):
            return other.agent
    return ""


def traffic_of(
    agent: str,
    task: str,
    landed: Landed,
    position: Position | None,
    leg: Way | None = None,
    rises_to_m: float | None = None,
) -> Traffic:
    """Return a machine as traffic.

    Args:
        agent: who.
        task: for which task.
        landed: as last known.
        position: as last known.
        leg: the way that was granted to it.
        rises_to_m: where it will climb to from the ground for its task, metres over the base's ground: nobody stops in that
            column, else both may wait for ever.
    """
    ways: list[Way] = []
    if position is not None:
        end = leg[1] if leg is not None else position
        if leg is not None or landed != "grounded":
            ways.append((position, end))
        if rises_to_m is not None:
            ways.append((end, Position(end.east_m, end.north_m, rises_to_m)))
    return Traffic(agent, task, landed, position, leg, tuple(ways), box_of(ways))


def box_of(ways: Sequence[Way]) -> tuple[float, float, float, float]:
    """Return the horizontal bounds (west, east, south, north, metres) of ways; of none, bounds that meet nothing."""
    if not ways:
        return math.inf, -math.inf, math.inf, -math.inf
    easts = [point.east_m for way in ways for point in way]
    norths = [point.north_m for way in ways for point in way]
    return min(easts), max(easts), min(norths), max(norths)
