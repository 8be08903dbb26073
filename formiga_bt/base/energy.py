"""How much charge a flight takes: points of charge (percent of a full battery, 0..100) for straight ways.

Formulae and where they come from:

* A straight way lasts as long as the slower of its parts: over ground at the ground speed, up or down at `climb_m_s`. That
  is how the usual autopilots fly a leg (both speeds are limited, the slower one decides) and what the simulated drone does.
* Wind triangle: a machine with air speed v in a wind with part `along` its track and part `across` it keeps its track by
  heading into the wind, and moves over ground at along + sqrt(v^2 - across^2). A tail wind is not counted on: the ground
  speed is never more than v. No ground speed left = the way takes for ever (`math.inf`).
* Charge = time x drain. The drain is constant in each kind of flight: hover, cruise (also descending), climb. A way that
  rises and goes forward drains as a climb for the time that the climb alone takes, as a cruise for the rest. Assumed
  linear in the payload: so many points a second more for each kilogram. (Induced power of a rotor grows with the power
  3/2 of the weight; near the weights that a machine is made for a line is within a few percent of that.) Not modelled:
  voltage sag, cold, age. The reserve is for those.
* The way home is the one that recover flies: up or down to its layer, across, down at the port, and `landing_s` of hover.

Time over ground in a steady wind is a convex function of the way, so on a straight way "spent so far + way home from
there" is largest at one of its ends: the gate looks at the ends only.

Numbers come from `AgentType.limits`: `speed_m_s`, `climb_m_s`, `cruise_drain_pct_s`, `hover_drain_pct_s`, and, where given,
`climb_drain_pct_s` (else as cruise), `payload_drain_pct_kg_s` (else 0), `landing_s` (else 5 s), `sweep_spacing_m` (else 20 m).
What one machine announces about itself under the same names replaces the type's number.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from msgspec import Struct

from formiga_bt.base.geo import Place, Position

AT_HOME_M: Final = 3.0
"""Grounded so near to its port a machine is home."""

Wind = tuple[float, float]
"""East and north, m/s, where it blows to."""

CALM: Final[Wind] = (0.0, 0.0)

_NONE: Final[Mapping[str, float]] = MappingProxyType({})


class Power(Struct, frozen=True, kw_only=True):
    """What a machine uses, and how fast it is; points of charge a second."""

    speed_m_s: float
    climb_m_s: float
    cruise_pct_s: float
    hover_pct_s: float
    climb_pct_s: float
    payload_pct_kg_s: float = 0.0
    landing_s: float = 5.0
    """Hover at the end of a landing, seconds."""
    sweep_spacing_m: float = 20.0
    """Distance of the lanes when it covers an area."""


def power_of(limits: Mapping[str, float], announced: Mapping[str, float] = _NONE) -> Power | None:
    """Return what a machine uses, or None if its drain or speeds are not known (it walks, it hangs on a wire).

    Args:
        limits: of its type.
        announced: of its card; its numbers replace the type's.
    """
    known = {**limits, **announced}

    def of(name: str, otherwise: float = 0.0) -> float:
        value = known.get(name, otherwise)
        return value if math.isfinite(value) and value >= 0.0 else otherwise

    cruise, hover = of("cruise_drain_pct_s"), of("hover_drain_pct_s")
    speed, climb = of("speed_m_s"), of("climb_m_s")
    if not (cruise or hover) or not speed or not climb:
        return None
    cruise = cruise or hover
    return Power(
        speed_m_s=speed,
        climb_m_s=climb,
        cruise_pct_s=cruise,
        hover_pct_s=hover or cruise,
        climb_pct_s=of("climb_drain_pct_s") or cruise,
        payload_pct_kg_s=of("payload_drain_pct_kg_s"),
        landing_s=of("landing_s", 5.0),
        sweep_spacing_m=of("sweep_spacing_m") or 20.0,
    )


def ground_speed_m_s(east_m: float, north_m: float, speed_m_s: float, wind: Wind) -> float:
    """Return the speed over ground in a direction; 0 if the wind is too strong, never more than the air speed."""
    way = math.hypot(east_m, north_m)
    if way == 0.0 or wind == CALM:
        return speed_m_s
    along = (wind[0] * east_m + wind[1] * north_m) / way
    across = (wind[0] * north_m - wind[1] * east_m) / way
    left = speed_m_s * speed_m_s - across * across
    return min(speed_m_s, max(0.0, along + math.sqrt(left))) if left > 0.0 else 0.0


def way_pct(
    a: Position,
    b: Position,
    power: Power,
    wind: Wind = CALM,
    payload_kg: float = 0.0,
    speed_m_s: float | None = None,
) -> float:
    """Return the points of charge for a straight way; `math.inf` against a wind that is too strong.

    Args:
        a: where it begins.
        b: where it ends.
        power: of the machine.
        wind: where it blows to.
        payload_kg: carried, 0 or more.
        speed_m_s: the speed asked for; the machine's own if None or more than that.
    """
    east, north, rise = b.east_m - a.east_m, b.north_m - a.north_m, b.up_m - a.up_m
    upright_s = abs(rise) / power.climb_m_s
    way = math.hypot(east, north)
    level_s = 0.0
    if way > 0.0:
        over_ground = ground_speed_m_s(east, north, power.speed_m_s, wind)
        if speed_m_s is not None and 0.0 < speed_m_s < over_ground:
            over_ground = speed_m_s
        if over_ground <= 0.0:
            return math.inf
        level_s = way / over_ground
    lasts = max(level_s, upright_s)
    climbs = upright_s if rise > 0.0 else 0.0
    load = power.payload_pct_kg_s * max(0.0, payload_kg)
    return climbs * (power.climb_pct_s + load) + (lasts - climbs) * (power.cruise_pct_s + load)


def hover_pct(lasts_s: float, power: Power, payload_kg: float = 0.0) -> float:
    """Return the points of charge for hovering so many seconds."""
    return lasts_s * (power.hover_pct_s + power.payload_pct_kg_s * max(0.0, payload_kg))


def home_pct(
    here: Position,
    home: Place | None,
    layer_m: float,
    power: Power,
    wind: Wind = CALM,
    payload_kg: float = 0.0,
    home_up_m: float = 0.0,
    grounded: bool = False,
) -> float:
    """Return the points of charge to come home: to the layer, across, down and land; 0 for a machine that stands at home.

    Args:
        here: where it is.
        home: its port; None = it can only land where it is.
        layer_m: its layer over the base's ground.
        power: of the machine.
        wind: where it blows to.
        payload_kg: carried.
        home_up_m: the ground at its port over the base's ground.
        grounded: it stands, and must take off first unless it is home.
    """
    load = power.payload_pct_kg_s * payload_kg if payload_kg > 0.0 else 0.0
    landing = power.landing_s * (power.hover_pct_s + load)
    if home is None:
        down = _upright_pct(min(here.up_m, home_up_m) - here.up_m, power, load)
        return 0.0 if grounded else down + landing
    east, north = home.east_m - here.east_m, home.north_m - here.north_m
    way = math.hypot(east, north)
    if grounded and way <= AT_HOME_M:
        return 0.0
    across = 0.0
    if way > 0.0:
        over_ground = power.speed_m_s if wind is CALM else ground_speed_m_s(east, north, power.speed_m_s, wind)
        if over_ground <= 0.0:
            return math.inf
        across = way / over_ground * (power.cruise_pct_s + load)
    to_layer = _upright_pct(layer_m - here.up_m, power, load)
    return to_layer + across + _upright_pct(home_up_m - layer_m, power, load) + landing


def _upright_pct(rise_m: float, power: Power, load: float) -> float:
    """Return the points of charge for going straight up, or down where `rise_m` is below 0; `load` = more points a second."""
    if rise_m > 0.0:
        return rise_m / power.climb_m_s * (power.climb_pct_s + load)
    return -rise_m / power.climb_m_s * (power.cruise_pct_s + load)


def reach_m(
    charge_pct: float,
    here: Position,
    power: Power,
    wind: Wind = CALM,
    payload_kg: float = 0.0,
    ground_up_m: float = 0.0,
) -> float:
    """Return how far over ground a machine can go, in any direction, and land there with `charge_pct` points; 0 or more.

    The wind is taken as a head wind all the way.
    """
    down = Position(here.east_m, here.north_m, min(here.up_m, ground_up_m))
    left = charge_pct - way_pct(here, down, power, CALM, payload_kg) - hover_pct(power.landing_s, power, payload_kg)
    speed = power.speed_m_s - math.hypot(*wind)
    drain = power.cruise_pct_s + power.payload_pct_kg_s * max(0.0, payload_kg)
    return max(0.0, left / drain * speed) if speed > 0.0 else 0.0
