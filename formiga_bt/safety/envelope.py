"""The envelope: may this machine fly this goal, and is it still within its limits now?

Called by the gate before a goal leaves (`at_gate`) and by the fleet at each status (`in_flight`). Pure: the same inputs
give the same answer, nothing is sent, nothing raised; what is not known counts as bad for tasks and as no reason against a
rescue. Limits come from `rules.rules_of`, the site's ground and zones from `airspace.Airspace`, charge from `charge`.

A rescue (safety goals and every way home) is not judged by reserve, wind and daylight. A leg of it that starts in a breach
(outside the fence, inside a no-fly region, too high, too low) is allowed when it ends no deeper in that breach, is never
deeper on the way than where it began (half a metre is forgiven), does not come back once it is out, and breaks nothing else.
"""

import math
from collections.abc import Iterator, Sequence

from msgspec import structs

from formiga_bt.base.energy import Wind
from formiga_bt.base.geo import Place, Position
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.area import Area, area_of, height_offence, zone_offence
from formiga_bt.safety.charge import charge_at_gate, charge_in_flight
from formiga_bt.safety.clearing import first_too_high, first_too_low
from formiga_bt.safety.flights import Breach, FlightState, GateFlight, ways_of
from formiga_bt.safety.rules import Rules
from formiga_bt.safety.spots import safe_landing_spot
from formiga_bt.safety.terrain import TerrainConflict, is_surely_fine
from formiga_bt.safety.zones import Offence, Zone

__all__ = ["Breach", "FlightState", "GateFlight", "at_gate", "in_flight", "safe_landing_spot", "ways_of"]


def at_gate(flight: GateFlight, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the gravest limit that a goal would break, or None."""
    if flight.here is not None and not _is_somewhere(flight.here):
        flight = structs.replace(flight, here=None)
    here = flight.here
    moves = bool(flight.ways) or flight.region is not None
    if here is None and moves and not flight.rescue:
        return Breach("position", f"it is not known where {flight.agent} is")
    if flight.ways and not all(map(_is_somewhere, [way[1] for way in flight.ways])):
        return Breach("position", f"{flight.agent} is to go nowhere: a coordinate of the way is no number")
    area = None
    if flight.region is not None and flight.region.corners:
        own = here.up_m if here is not None else 0.0
        area = area_of(flight.region, flight.region_up_m if flight.region_up_m is not None else own, here)
        if not all(map(_is_somewhere, area.corners)):
            return Breach("position", f"{flight.agent} is to cover nothing: a coordinate of the area is no number")
    breach = _legs(flight, ground, rules) if area is None else next(_space(flight, area, ground, rules), None)
    if breach is not None:
        return breach
    if flight.rescue or not (moves or flight.power is not None):
        return None
    return _wind(flight.wind, rules) or _daylight(flight.sun_up, rules) or charge_at_gate(flight, area, ground, rules)


def in_flight(state: FlightState, ground: Airspace, rules: Rules) -> tuple[Breach, ...]:
    """Return all limits that a machine in the air breaks now, the gravest first (keep_out, keep_in, heights, reserve, ...)."""
    found: list[Breach] = []
    if state.here is not None and not _is_somewhere(state.here):
        state = structs.replace(state, here=None)
    here = state.here
    if here is None:
        found.append(Breach("position", f"it is not known where {state.agent} is"))
    else:
        found += [_in_breach(zone, state.agent, here) for zone in ground.zones if zone.is_broken_at(here)]
        spots = _spots(state.spots, state.home, state.lands_at)
        low = first_too_low(ground.terrain, (here, here), spots, rules.terrain_clearance_m)
        if low is not None:
            found.append(_too_low(low, f"{state.agent} is", rules))
        high = first_too_high(ground.terrain, (here, here), rules.max_height_m)
        if high is not None and high.ground_m is not None:  # unknown ground is told above, unless it is a spot's
            found.append(_too_high(high, f"{state.agent} is", rules))
    soft = (charge_in_flight(state, ground, rules), _wind(state.wind, rules), _daylight(state.sun_up, rules))
    for breach in soft:
        if breach is not None:
            found.append(structs.replace(breach, only_alarm=True) if state.descending else breach)
    return tuple(found)


# -- where -------------------------------------------------------------------------------------------------------------


def _is_somewhere(at: Position) -> bool:
    return math.isfinite(at.east_m + at.north_m + at.up_m)


def _legs(flight: GateFlight, ground: Airspace, rules: Rules) -> Breach | None:
    """Return what a goal that covers no area breaks of zones and heights, if anything: the common case, quickly answered."""
    for a, b in flight.ways:
        for zone in ground.zones:
            if zone.is_offended(a, b):
                return next(_space(flight, None, ground, rules), None)
        if not is_surely_fine(ground.terrain, a, b, rules.terrain_clearance_m, rules.max_height_m):
            return next(_space(flight, None, ground, rules), None)
    return None


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


def _too_low(found: TerrainConflict, who: str, rules: Rules) -> Breach:
    need = rules.terrain_clearance_m
    if found.ground_m is None:
        return Breach("terrain_clearance", f"{_unknown(found)}, and {need:g} m over it must be kept", None, need)
    over = found.at.up_m - found.ground_m
    text = f"{who} {_over(over)} at {_where(found)}, at least {need:g} m must be kept"
    return Breach("terrain_clearance", text, over, need)


def _too_high(found: TerrainConflict, who: str, rules: Rules) -> Breach:
    most = rules.max_height_m
    if found.ground_m is None:
        return Breach("max_height", f"{_unknown(found)}, and no more than {most:g} m over it are allowed", None, most)
    over = found.at.up_m - found.ground_m
    text = f"{who} {_over(over)} at {_where(found)}, at most {most:g} m are allowed"
    return Breach("max_height", text, over, most)


def _unknown(found: TerrainConflict) -> str:
    return f"the height of the ground at {_is_at(found.at)} is not known"


def _over(metres: float) -> str:
    return f"{metres:.1f} m over the ground" if metres >= 0.0 else f"{-metres:.1f} m below the ground"


def _where(found: TerrainConflict) -> str:
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
