"""Does the charge do? The most that a goal takes, the way home included, against what is left over the reserve.

Called by `envelope`, and for how long a machine may wait in the air; the formulae are in `energy`.
"""

import math
from collections.abc import Callable
from typing import Final

from formiga_bt.base.energy import CALM, Power, Wind, home_pct, hover_pct, way_pct
from formiga_bt.base.geo import Place, Position
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.area import Area, cover_pct
from formiga_bt.safety.flights import Breach, FlightState, GateFlight, ways_of
from formiga_bt.safety.rules import Rules

GATE_MARGIN_PCT: Final = 0.5
"""So many points more than reckoned a goal must leave: else a hair's breadth in flight would be a breach."""


def charge_at_gate(flight: GateFlight, area: Area | None, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the breach of the reserve by a goal, or None; `area` is what it covers."""
    power = flight.power
    if power is None:
        return None
    need = _need_pct(flight, power, area, ground) + GATE_MARGIN_PCT
    going = "to go there, do it and come home" if flight.ways or area is not None else "to do it and come home"
    return _charge(need, going, flight.battery, flight.wind, power, rules)


def _need_pct(flight: GateFlight, power: Power, area: Area | None, ground: Airspace) -> float:
    """Return the most charge that is gone, at any point of the flight, once the machine has come home from there."""
    wind, payload, speed = flight.wind or CALM, flight.payload_kg, flight.speed_m_s
    home = way_home(flight.home, flight.layer_m, power, wind, payload, ground)
    spent, most, end = 0.0, 0.0, flight.here
    landing = flight.lands_at is not None
    if end is not None and not landing:
        most = home(end, flight.grounded)
    last = len(flight.ways) - 1
    for i, (a, b) in enumerate(flight.ways):
        spent, end = spent + way_pct(a, b, power, wind, payload, speed), b
        if not landing and i < last:  # from the last end, it is reckoned below
            most = max(most, spent + home(b, False))
    spent += hover_pct(power.landing_s if landing else flight.hover_s, power, payload)
    if area is not None and end is not None:
        spent += cover_pct(area, end, power, wind, payload, speed)
        return max(most, spent + max(home(corner, False) for corner in area.corners))
    if end is None:
        return max(most, spent)
    return max(most, spent + home(end, landing or (flight.grounded and not flight.ways)))


def charge_in_flight(state: FlightState, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the breach of the reserve by a machine in the air, or None."""
    power, here = state.power, state.here
    if power is None or here is None:
        return None
    wind, payload = state.wind or CALM, state.payload_kg
    home = way_home(state.home, state.layer_m, power, wind, payload, ground)
    if state.lands_at is None:
        need, going = home(here, False), "to come home from here"
    else:
        ways = ways_of(here, state.lands_at, ground)
        need = sum(way_pct(a, b, power, wind, payload) for a, b in ways) + hover_pct(power.landing_s, power, payload)
        need, going = need + home(ways[-1][1], True), "to land and come home from there"
    return _charge(need, going, state.battery, state.wind, power, rules)


def way_home(
    place: Place | None, layer_m: float | None, power: Power, wind: Wind, payload_kg: float, ground: Airspace
) -> Callable[[Position, bool], float]:
    """Return what tells the charge for the way home from a position, standing there or not: as `energy.home_pct`."""
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
