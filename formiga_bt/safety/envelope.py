"""The envelope: may this machine fly this goal, and is it still within its limits now?

Called by the gate before a goal leaves (`at_gate`) and by the fleet at each status (`in_flight`). Pure: the same inputs
give the same answer, nothing is sent, nothing raised; what is not known counts as bad for tasks and as no reason against a
rescue. Limits come from `rules.rules_of`, the site's ground and zones from `airspace.Airspace`, charge from `energy`.

A rescue (safety goals and every way home) is not judged by reserve, wind and daylight. A leg of it that starts in a breach
(outside the fence, inside a no-fly region, too high, too low) is allowed when it ends no deeper in that breach, is never
deeper on the way than where it began (half a metre is forgiven), does not come back once it is out, and breaks nothing else.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from msgspec import Struct, structs

from formiga_bt.geo import Place, Position, Region
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.area import Area, area_of, cover_pct, height_offence, zone_offence
from formiga_bt.safety.clearing import first_too_high, first_too_low
from formiga_bt.safety.energy import CALM, Power, Wind, home_pct, hover_pct, way_pct
from formiga_bt.safety.rules import Rules
from formiga_bt.safety.spots import safe_landing_spot
from formiga_bt.safety.terrain import Found
from formiga_bt.safety.traffic import Way
from formiga_bt.safety.zones import Offence, Zone

__all__ = ["Breach", "FlightState", "GateFlight", "at_gate", "in_flight", "safe_landing_spot", "ways_of"]

GATE_MARGIN_PCT: Final = 0.5
"""So many points more than reckoned a goal must leave: else a hair's breadth in flight would be a breach."""


class Breach(Struct, frozen=True):
    """A limit that a goal would break, or that a machine breaks now."""

    name: str
    """reserve, max_height, terrain_clearance, keep_in, keep_out, wind_max, daylight_only, or position (it is unknown)."""
    text: str
    """For people: what, by how much, where."""
    value: float | None = None
    limit: float | None = None
    only_alarm: bool = False
    """A landing is finished in spite of it, and the task ends then."""

    @property
    def code(self) -> str:
        """Return the reason code."""
        return f"envelope.{self.name}"


class GateFlight(Struct, frozen=True, kw_only=True):
    """What a goal would do, and with which machine."""

    agent: str
    here: Position | None
    """Where the machine is; None = unknown, which a task's goal that moves it does not get past."""
    grounded: bool = False
    """It stands on the ground now."""
    ways: tuple[Way, ...] = ()
    """The straight ways of the action in order, the first from `here`; see `ways_of`."""
    region: Region | None = None
    """Of an action that covers an area: all within the convex hull of it and the place it comes from must be legal."""
    region_up_m: float | None = None
    """Its height over the base's ground; None = the machine's own."""
    lands_at: Place | None = None
    """Where the action ends on the ground."""
    hover_s: float = 0.0
    """How long the action lasts besides its ways, seconds: its typical time, 0 when it only moves."""
    speed_m_s: float | None = None
    """The speed that the goal asks for; None = the machine's own."""
    spots: tuple[Place, ...] = ()
    """Further places near which it may be low: where it took off. Its home, start and landing spot count by themselves."""
    battery: float | None = None
    """Percent; None = unknown, which refuses every goal of a task for a machine with a known drain."""
    payload_kg: float = 0.0
    wind: tuple[float, float] | None = None
    """East and north, m/s, where it blows to; None = the machine cannot tell, reckoned as calm."""
    power: Power | None = None
    """What the machine uses; None = it has no drain that is known, and the reserve is not checked."""
    home: Place | None = None
    """Its own port; without one it is reckoned to land where the action ends."""
    layer_m: float | None = None
    """Its layer over the base's ground; None = the site's highest."""
    sun_up: bool | None = None
    """Whether the sun is up (`Airspace.sun_is_up`); None = unknown, which a machine with daylight_only does not get past."""
    rescue: bool = False
    """A safety goal or a goal of recover."""


class FlightState(Struct, frozen=True, kw_only=True):
    """A machine in the air at one status. Fields as in `GateFlight`."""

    agent: str
    here: Position | None
    spots: tuple[Place, ...] = ()
    """Where it took off, while it rises or is still low; home and landing spot count by themselves."""
    lands_at: Place | None = None
    """The place of the landing under way: the reserve is reckoned for landing there first."""
    descending: bool = False
    """The landing is in its last phase: reserve, wind and daylight are only alarms."""
    battery: float | None = None
    payload_kg: float = 0.0
    wind: tuple[float, float] | None = None
    power: Power | None = None
    home: Place | None = None
    layer_m: float | None = None
    sun_up: bool | None = None


def ways_of(
    here: Position | None, target: Place | Position | None, ground: Airspace, rises_to_m: float | None = None
) -> tuple[Way, ...]:
    """Return the straight ways of an action that moves a machine.

    Args:
        here: where it is; None gives the end alone.
        target: a position is flown to straight; over a place it is flown to at the present height, then straight down.
        ground: for the height of the ground at a place.
        rises_to_m: of a take-off: straight up to this height over the base's ground.
    """
    if here is not None and rises_to_m is not None:
        return ((here, Position(here.east_m, here.north_m, rises_to_m)),)
    if isinstance(target, Position):
        return ((target if here is None else here, target),)
    if not isinstance(target, Place):
        return ()
    down = Position(target.east_m, target.north_m, ground.ground_m(target))
    if here is None:
        return ((down, down),)
    over = Position(target.east_m, target.north_m, max(here.up_m, down.up_m))
    return ((over, down),) if over == here else ((here, over), (over, down))


def at_gate(flight: GateFlight, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the gravest limit that a goal would break, or None."""
    if flight.here is not None and not _is_somewhere(flight.here):
        flight = structs.replace(flight, here=None)
    here = flight.here
    moves = bool(flight.ways) or flight.region is not None
    if here is None and moves and not flight.rescue:
        return Breach("position", f"it is not known where {flight.agent} is")
    if not all(_is_somewhere(end) for way in flight.ways for end in way):
        return Breach("position", f"{flight.agent} is to go nowhere: a coordinate of the way is no number")
    area = None
    if flight.region is not None and flight.region.corners:
        own = here.up_m if here is not None else 0.0
        area = area_of(flight.region, flight.region_up_m if flight.region_up_m is not None else own, here)
        if not all(map(_is_somewhere, area.corners)):
            return Breach("position", f"{flight.agent} is to cover nothing: a coordinate of the area is no number")
    for breach in _space(flight, area, ground, rules):
        return breach
    if flight.rescue or not (moves or flight.power is not None):
        return None
    return _wind(flight.wind, rules) or _daylight(flight.sun_up, rules) or _charge_at_gate(flight, area, ground, rules)


def in_flight(state: FlightState, ground: Airspace, rules: Rules) -> tuple[Breach, ...]:
    """Return all limits that a machine in the air breaks now, the gravest first (keep_out, keep_in, heights, reserve, ...)."""
    found: list[Breach] = []
    here = state.here
    if here is None or not _is_somewhere(here):
        found.append(Breach("position", f"it is not known where {state.agent} is"))
    else:
        at = f"{state.agent} is"
        found += [_in_breach(zone, state.agent, here) for zone in ground.zones if zone.is_broken_at(here)]
        spots = _spots(state.spots, state.home, state.lands_at)
        low = first_too_low(ground.terrain, (here, here), spots, rules.terrain_clearance_m)
        if low is not None:
            found.append(_too_low(low, at, rules))
        high = first_too_high(ground.terrain, (here, here), rules.max_height_m)
        if high is not None and high.ground_m is not None:  # unknown ground is told above, unless it is a spot's
            found.append(_too_high(high, at, rules))
    soft = (_charge_in_flight(state, ground, rules), _wind(state.wind, rules), _daylight(state.sun_up, rules))
    for breach in soft:
        if breach is not None:
            found.append(structs.replace(breach, only_alarm=True) if state.descending else breach)
    return tuple(found)


# -- where -------------------------------------------------------------------------------------------------------------


def _is_somewhere(at: Position) -> bool:
    return math.isfinite(at.east_m + at.north_m + at.up_m)


def _space(flight: GateFlight, area: Area | None, ground: Airspace, rules: Rules) -> Iterator[Breach]:
    """Iterate over what a goal breaks of zones and heights, the gravest first."""
    rescue = flight.rescue and flight.here is not None
    for zone in ground.zones:
        for a, b in flight.ways:
            offence = zone.offence(a, b, rescue=rescue)
            if offence is not None:
                yield _zone_breach(zone, offence, "the leg")
        if area is not None:
            offence = zone_offence(area, zone)
            if offence is not None:
                yield _zone_breach(zone, offence, "the area, or the way into it,")
    start = flight.here.ground if flight.grounded and flight.here is not None else None
    spots = _spots((*flight.spots, *((start,) if start is not None else ())), flight.home, flight.lands_at)
    for way in flight.ways:
        low = first_too_low(ground.terrain, way, spots, rules.terrain_clearance_m, rescue=flight.rescue)
        if low is not None:
            yield _too_low(low, "the leg would be", rules)
        high = first_too_high(ground.terrain, way, rules.max_height_m, rescue=flight.rescue)
        if high is not None:
            yield _too_high(high, "the leg would be", rules)
    if area is not None:
        found = height_offence(area, ground.terrain, rules.terrain_clearance_m, rules.max_height_m)
        if found is not None:
            tell = _too_low if found[0] == "terrain_clearance" else _too_high
            yield tell(found[1], "over the area it would be", rules)


def _spots(spots: Sequence[Place], *more: Place | None) -> tuple[Place, ...]:
    return (*spots, *(spot for spot in more if spot is not None))


def _zone_breach(zone: Zone, offence: Offence, who: str) -> Breach:
    deep, at = round(offence.depth_m, 1), _is_at(offence.at)
    if zone.keep_in:
        return Breach("keep_in", f"{who} leaves the fence: {deep:g} m outside at {at}", offence.depth_m, 0.0)
    how = f"enters {_no_fly(zone)}: {deep:g} m deep" if deep else f"touches the border of {_no_fly(zone)}"
    return Breach("keep_out", f"{who} {how} at {at}", offence.depth_m, 0.0)


def _in_breach(zone: Zone, agent: str, here: Position) -> Breach:
    depth = zone.depth_m(here)
    deep, at = round(depth, 1), _is_at(here)
    if zone.keep_in:
        return Breach("keep_in", f"{agent} is {deep:g} m outside the fence at {at}", depth, 0.0)
    return Breach("keep_out", f"{agent} is {deep:g} m deep in {_no_fly(zone)} at {at}", depth, 0.0)


def _no_fly(zone: Zone) -> str:
    return zone.name if zone.name.startswith("no-fly") else f"the no-fly region {zone.name}"


def _too_low(found: Found, who: str, rules: Rules) -> Breach:
    need = rules.terrain_clearance_m
    if found.ground_m is None:
        return Breach("terrain_clearance", f"{_unknown(found)}, and {need:g} m over it must be kept", None, need)
    over = found.at.up_m - found.ground_m
    text = f"{who} {_over(over)} at {_where(found)}, at least {need:g} m must be kept"
    return Breach("terrain_clearance", text, over, need)


def _too_high(found: Found, who: str, rules: Rules) -> Breach:
    most = rules.max_height_m
    if found.ground_m is None:
        return Breach("max_height", f"{_unknown(found)}, and no more than {most:g} m over it are allowed", None, most)
    over = found.at.up_m - found.ground_m
    text = f"{who} {_over(over)} at {_where(found)}, at most {most:g} m are allowed"
    return Breach("max_height", text, over, most)


def _unknown(found: Found) -> str:
    return f"the height of the ground at {_is_at(found.at)} is not known"


def _over(metres: float) -> str:
    return f"{metres:.1f} m over the ground" if metres >= 0.0 else f"{-metres:.1f} m below the ground"


def _where(found: Found) -> str:
    ground = round(found.ground_m or 0.0, 1)
    if ground == 0.0:
        return _is_at(found.at)
    side = "over" if ground > 0.0 else "below"
    return f"{_is_at(found.at)} (where it may be {abs(ground):g} m {side} the base's)"


def _is_at(at: Place | Position) -> str:
    return f"east {round(at.east_m)} m, north {round(at.north_m)} m"


# -- weather, light ------------------------------------------------------------------------------------------------------


def _wind(wind: Wind | None, rules: Rules) -> Breach | None:
    blows = math.hypot(*wind) if wind is not None else 0.0
    if blows <= rules.wind_max_m_s:
        return None
    text = f"the wind blows with {blows:.1f} m/s, at most {rules.wind_max_m_s:g} m/s are allowed"
    return Breach("wind_max", text, blows, rules.wind_max_m_s)


def _daylight(sun_up: bool | None, rules: Rules) -> Breach | None:
    if not rules.daylight_only or sun_up:
        return None
    why = "it is not known whether the sun is up" if sun_up is None else "the sun is down"
    return Breach("daylight_only", f"{why}, and flights are allowed by daylight only")


# -- charge --------------------------------------------------------------------------------------------------------------


def _charge_at_gate(flight: GateFlight, area: Area | None, ground: Airspace, rules: Rules) -> Breach | None:
    power = flight.power
    if power is None:
        return None
    need = _need_pct(flight, power, area, ground) + GATE_MARGIN_PCT
    going = "to go there, do it and come home" if flight.ways or area is not None else "to do it and come home"
    return _charge(need, going, flight.battery, flight.wind, power, rules)


def _need_pct(flight: GateFlight, power: Power, area: Area | None, ground: Airspace) -> float:
    """Return the most charge that is gone, at any point of the flight, once the machine has come home from there."""
    wind, payload, speed = flight.wind or CALM, flight.payload_kg, flight.speed_m_s
    home = _way_home(flight.home, flight.layer_m, power, wind, payload, ground)
    spent, most, end = 0.0, 0.0, flight.here
    landing = flight.lands_at is not None
    if end is not None and not landing:
        most = home(end, flight.grounded)
    for a, b in flight.ways:
        spent, end = spent + way_pct(a, b, power, wind, payload, speed), b
        if not landing:
            most = max(most, spent + home(b, False))
    spent += hover_pct(power.landing_s if landing else flight.hover_s, power, payload)
    if area is not None and end is not None:
        spent += cover_pct(area, end, power, wind, payload, speed)
        return max(most, spent + max(home(corner, False) for corner in area.corners))
    if end is None:
        return max(most, spent)
    return max(most, spent + home(end, landing or (flight.grounded and not flight.ways)))


def _charge_in_flight(state: FlightState, ground: Airspace, rules: Rules) -> Breach | None:
    power, here = state.power, state.here
    if power is None or here is None or not _is_somewhere(here):
        return None
    wind, payload = state.wind or CALM, state.payload_kg
    home = _way_home(state.home, state.layer_m, power, wind, payload, ground)
    if state.lands_at is None:
        need, going = home(here, False), "to come home from here"
    else:
        ways = ways_of(here, state.lands_at, ground)
        need = sum(way_pct(a, b, power, wind, payload) for a, b in ways) + hover_pct(power.landing_s, power, payload)
        need, going = need + home(ways[-1][1], True), "to land and come home from there"
    return _charge(need, going, state.battery, state.wind, power, rules)


def _way_home(
    place: Place | None, layer_m: float | None, power: Power, wind: Wind, payload_kg: float, ground: Airspace
) -> Callable[[Position, bool], float]:
    layer = layer_m if layer_m is not None else ground.highest_layer_m

    def pct(here: Position, grounded: bool) -> float:
        home_up = ground.ground_m(place if place is not None else here)
        return home_pct(here, place, layer, power, wind, payload_kg, home_up, grounded)

    return pct


def _charge(
    need: float, going: str, battery: float | None, wind: Wind | None, power: Power, rules: Rules
) -> Breach | None:
    reserve = rules.reserve_pct
    if not math.isfinite(need):
        blows = math.hypot(*(wind or CALM))
        text = f"a wind of {blows:.1f} m/s is too strong {going} with {power.speed_m_s:g} m/s"
        return Breach("reserve", text, None, reserve)
    if battery is None:
        return Breach("reserve", f"needs {need:.1f} % {going}, and its charge is not known", need, None)
    if battery - need >= reserve:
        return None
    text = f"needs {need:.1f} % {going}, has {battery:.1f} % of which {reserve:g} % are reserve"
    return Breach("reserve", text, need, battery - reserve)
