"""The gate: may this goal leave now? Every goal passes here, whatever tree, retry or cleanup it comes from.

Pure functions over a small view of the site and fleet. The engine acts on the verdict: `Go` = send, with what the machine then
takes up in the air; `Hold` = wait, with a code and for whom; `Refuse` = never.

In this order: who is in command, link, stops and lockdown, one goal at a time, task held; the envelope; one machine on a spot
and its own port free; ways kept apart; clearance of people away from ports, who are asked once the way is free. Codes are
listed in docs/reasons.md.
"""

from collections.abc import Callable, Sequence
from typing import assert_never

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, Region, horizontal_m
from formiga_bt.base.machines import Mobility
from formiga_bt.safety import driving
from formiga_bt.safety.envelope import Breach
from formiga_bt.safety.traffic import VERTICAL_M, TakenArea, Traffic, Way, area_of, first_in_the_way, path, ways_into
from formiga_bt.transport.messages import Clearance, Control, Landed

CLEARANCE_LIFE_US: Micros = 60 * SECOND
"""Rotors must start, or the descent begin, within this time of the word."""

CLEARED_M = 5.0
"""The word counts for starts and landings so near to the spot that it was given for."""

AT_PORT_M = 3.0
"""A machine this near to a port (horizontally) stands at it."""


class GateInput(Struct, frozen=True, kw_only=True, gc=False):
    """A goal that wants to leave, and what the gate must know of its agent."""

    agent: str
    task: str
    mobility: Mobility
    reachable: bool
    control: Control
    quarantined: bool = False
    """It cannot be trusted now, and this goal is not for safety."""
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
    unsettled: bool = False
    """It is not known yet what the agent did while the engine was away."""
    goes_home: bool = False
    """It is part of a way home."""
    rebooted: bool = False
    """Its process was started anew, it has not said since that it flies, and nobody has cleared it."""
    lacks: str = ""
    """What the site demands and the agent's wire does not guarantee, in words."""
    held: bool = False
    """Its task is held and the goal comes from `steps`."""
    requires: str = ""
    """`airborne` or `grounded`, if the action needs it; empty = neither."""
    position: Position | None = None
    landed: Landed = "unknown"
    target: Place | Position | None = None
    rises_to_m: float | None = None
    starts_rotors: bool = False
    climbs_on: bool = False
    """It does what is left of a take-off, straight up from where it hovers: kept apart like a take-off."""
    lands: bool = False
    region: Region | None = None
    """What it explores, at `rises_to_m`."""
    clearance: Clearance | None = None
    cleared: Place | None = None
    """The spot that the clearance is for."""
    asked: bool = False
    """People are being asked for it."""
    ports: tuple[Place, ...] = ()
    """Ports near the target and the position, for a goal that lands or starts rotors."""
    home: Place | None = None
    on_routes: bool = False
    """It drives from where it is on the site's routes along an edge of them."""
    avoids: bool = False
    """The machine keeps away from obstacles by itself."""
    exempt_clearance: bool = False
    """It carries out the stop `land`, which waits for nobody."""


class Go(Struct, frozen=True, gc=False):
    """Send it: it takes up `leg`, or `area` and the ways into it."""

    leg: Way | None = None
    area: TakenArea | None = None


class Hold(Struct, frozen=True):
    """Wait. `whom`: the agent, task or person waited for."""

    code: str
    whom: str = ""


class Refuse(Struct, frozen=True):
    """Never."""

    code: str
    text: str
    value: float | None = None
    """Of a limit that it would break: how far it would go, SI, percent 0..100."""


Verdict = Go | Hold | Refuse


def no_limits() -> Breach | None:
    """Nothing is known that the goal would break."""
    return None


def judge(
    ask: GateInput,
    traffic: Sequence[Traffic],
    now: Micros,
    separation_m: float,
    min_spacing_m: float = 3.0,
    limits: Callable[[], Breach | None] = no_limits,
) -> Verdict:
    """Return what becomes of a goal that wants to leave now.

    Args:
        ask: the goal.
        traffic: at least every machine that takes up something near the goal's way and spots, in the order of admission.
        now: engine time.
        separation_m: how far ways of different tasks stay apart.
        min_spacing_m: how far ground spots of different machines stay apart.
        limits: tells which limit of its envelope the goal would break; asked once the goal could be sent as to who commands.
    """
    if ask.deposed:
        return Hold("epoch", "a newer engine")
    if ask.mobility == "people":
        return _person(ask)
    verdict = _command(ask)
    if verdict is not None:
        return verdict
    match ask.mobility:
        case "air":
            return _fly(ask, traffic, now, separation_m, min_spacing_m, limits)
        case "ground":
            return _drive(ask, traffic, min_spacing_m, limits)
        case "fixed" | "none":
            return Go()
        case never:
            assert_never(never)


def _drive(
    ask: GateInput, traffic: Sequence[Traffic], min_spacing_m: float, limits: Callable[[], Breach | None]
) -> Verdict:
    breach = limits()
    if breach is not None:
        return Refuse(breach.code, breach.text, breach.value)
    here, target = ask.position, ask.target
    if here is None or (target is None and ask.region is None):
        return Go()
    start = Position(here.east_m, here.north_m, 0.0)
    leg = None if target is None else (start, Position(target.east_m, target.north_m, 0.0))
    area = area_of(ask.region.corners, 0.0, start) if target is None and ask.region is not None else None
    ways = driving.ways_over(start, leg, area)
    blocker = driving.in_the_way(
        ask.agent, ask.task, ways, area, traffic, min_spacing_m, on_routes=ask.on_routes, avoids=ask.avoids
    )
    return Hold("leg_busy", blocker) if blocker else Go(leg, area)


def _fly(
    ask: GateInput,
    traffic: Sequence[Traffic],
    now: Micros,
    separation_m: float,
    min_spacing_m: float,
    limits: Callable[[], Breach | None],
) -> Verdict:
    if {ask.requires, ask.landed} == {"airborne", "grounded"}:
        return Refuse("requires", f"{ask.agent} must be {ask.requires}, it is {ask.landed}")
    breach = limits()
    if breach is not None:
        return Refuse(breach.code, breach.text, breach.value)
    return _spot(ask, traffic, min_spacing_m) or _clear_way(ask, traffic, now, separation_m)


def _clear_way(ask: GateInput, traffic: Sequence[Traffic], now: Micros, separation_m: float) -> Verdict:
    # A word counts for 60 s: asked for while the way is taken, it would be asked for again and again.
    clear = _clear(ask, now)
    if clear is not None and ask.asked:
        return clear
    way = _way(ask, traffic, separation_m)
    return clear if clear is not None and isinstance(way, Go) else way


def _person(ask: GateInput) -> Verdict:
    # Questions do not come here: they pass in lockdown, and while their task is held.
    if ask.locked:
        return Hold("lockdown", ask.locked)
    if ask.unsettled:
        return Hold("reconcile", ask.agent)
    if ask.held:
        return Hold("held", ask.task)
    return Go() if ask.reachable else Hold("unreachable", ask.agent)


def _command(ask: GateInput) -> Verdict | None:
    if ask.control != "engine":
        return Hold("control", ask.control)
    if ask.taken:
        return Hold("control", "handback")
    if not ask.reachable:
        return Hold("suspect", ask.agent)
    if ask.quarantined:
        return Hold("quarantined", ask.agent)
    if ask.stopped:
        return Hold("stopped", ask.stopped)
    if ask.locked:
        return Hold("lockdown", ask.locked)
    if ask.unsettled and (not ask.safety or ask.starts_rotors):  # it may stand elsewhere than where it was left
        return Hold("reconcile", ask.agent)
    if ask.goes_home and ask.starts_rotors and _is_home(ask):
        return Refuse("at_port", f"{ask.agent} stands at its port: it is home")
    if ask.lacks and not ask.goes_home and not ask.safety:
        return Refuse("wire_lacks", f"the wire of {ask.agent} does not guarantee {ask.lacks}")
    if ask.rebooted and not ask.exempt_clearance:
        return Hold("rebooted", ask.agent)
    if ask.busy and not ask.safety:
        return Hold("draining", ask.busy)
    if ask.held:
        return Hold("held", ask.task)
    return None


def _is_home(ask: GateInput) -> bool:
    home, here = ask.home, ask.position
    return ask.landed == "grounded" and home is not None and here is not None and horizontal_m(home, here) < AT_PORT_M


def may_go_again(ask: GateInput, word: Clearance | None, given_for: Place | None, now: Micros) -> bool:
    """Return whether a goal that was sent and never arrived may be sent again as it is, with the word it carries."""
    if ask.deposed or (ask.mobility != "people" and _command(ask) is not None):
        return False
    return ask.mobility != "air" or not needs_clearance(ask) or is_cleared(word, given_for, spot_of(ask), now)


def _spot(ask: GateInput, traffic: Sequence[Traffic], min_spacing_m: float) -> Verdict | None:
    target = ask.target
    if target is None:
        return None
    home = ask.home is not None and horizontal_m(ask.home, target) < AT_PORT_M
    if not ask.lands:
        if not home or ask.position is None or horizontal_m(ask.position, target) <= VERTICAL_M:
            return None
    elif not home and any(horizontal_m(port, target) < AT_PORT_M for port in ask.ports):
        return Refuse("foreign_port", "that port belongs to another agent")
    for other in traffic:
        if not other.spots or other.agent == ask.agent:
            continue
        for spot in other.spots:
            if horizontal_m(spot, target) < min_spacing_m:
                return Hold("port_busy" if home else "spot_busy", other.agent)
    return None


def spot_of(ask: GateInput) -> Place | None:
    """Return where a goal starts rotors or lands; None if it does neither, or nobody knows where."""
    if ask.lands:
        return ask.target.ground if isinstance(ask.target, Position) else ask.target
    return ask.position.ground if ask.starts_rotors and ask.position is not None else None


def needs_clearance(ask: GateInput) -> bool:
    """Return whether a person must say first that people stand clear: a rotor start or landing away from ports."""
    if not (ask.starts_rotors or ask.lands) or ask.exempt_clearance:
        return False
    spot = spot_of(ask)
    return spot is None or all(horizontal_m(port, spot) >= AT_PORT_M for port in ask.ports)


def _clear(ask: GateInput, now: Micros) -> Verdict | None:
    if not needs_clearance(ask) or is_cleared(ask.clearance, ask.cleared, spot_of(ask), now):
        return None
    return Hold("clearance")


def is_cleared(word: Clearance | None, given_for: Place | None, spot: Place | None, now: Micros) -> bool:
    """Return whether a person's word counts now for a spot: at most 60 s old, and given for a spot within 5 m of it."""
    if word is None or given_for is None or spot is None or now - word.at > CLEARANCE_LIFE_US:
        return False
    return horizontal_m(given_for, spot) <= CLEARED_M


def leg_of(ask: GateInput) -> Way | None:
    """Return the straight way that a goal flies, or None if it does not move the agent, or explores."""
    here, target = ask.position, ask.target
    if here is None or ask.region is not None:
        return None
    if ask.rises_to_m is not None:
        return here, Position(here.east_m, here.north_m, ask.rises_to_m)
    if target is None:
        return None
    return here, target if isinstance(target, Position) else Position(target.east_m, target.north_m, 0.0)


def _way(ask: GateInput, traffic: Sequence[Traffic], separation_m: float) -> Verdict:
    leg, area = leg_of(ask), None
    ways = () if leg is None else path(leg)
    if ask.region is not None and ask.position is not None:
        area = area_of(
            ask.region.corners, ask.position.up_m if ask.rises_to_m is None else ask.rises_to_m, ask.position
        )
        ways = ways_into(ask.position, area)
    if not ways and area is None:
        return Go()
    blocker = first_in_the_way(
        ask.agent, ask.task, ways, area, traffic, separation_m, climbs_on=ask.climbs_on, leaves=ask.landed == "airborne"
    )
    return Hold("leg_busy", blocker) if blocker else Go(leg, area)
