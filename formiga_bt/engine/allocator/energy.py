"""May this machine go to a role's place and come home with its reserve left? The allocator's rough look before a grant.

It counts the way up to a layer, across, and home again, in the wind as it is felt; not the work there, of which only the gate
knows more. So whom it refuses surely cannot; whom it lets through the gate may still refuse.
"""

import math

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.energy import CALM, Power, home_pct, way_pct
from formiga_bt.base.geo import Place, Position


class Charge(Struct, frozen=True, kw_only=True):
    """What is known of a machine's charge; SI, percent 0..100."""

    battery: float
    reserve: float
    power: Power
    position: Position
    home: Place | None
    layer_m: float
    lowest_m: float
    """The site's lowest layer."""
    wind: tuple[float, float] = CALM
    payload_kg: float = 0.0


def short_of(charge: Charge, near: tuple[Place, ...]) -> str:
    """Return what a machine lacks for the nearest of these places, and what is enough; "" = nothing, or none is named."""
    needs = min((round_trip_pct(charge, place) for place in near), default=0.0)
    if not near or charge.battery - needs >= charge.reserve:
        return ""
    if math.isinf(needs):
        return "there is too much wind to come home"
    enough = math.ceil(needs + charge.reserve)
    when = f"; {enough} % is enough" if enough <= 100 else ""
    has, reserve = f"{charge.battery:.0f} %", f"{charge.reserve:.0f} %"
    return f"{has} less {needs:.1f} % there and back leaves less than its reserve of {reserve}{when}"


def never_enough(charge: Charge, near: tuple[Place, ...]) -> str:
    """Return what a machine lacks for the nearest of these places on its best day; "" = waiting may help.

    Its best day: full, empty-handed, over its own port at the lowest layer, in calm air.
    """
    if charge.home is None:
        return ""
    over_home = Position(charge.home.east_m, charge.home.north_m, charge.lowest_m)
    best = replace(charge, battery=100.0, position=over_home, layer_m=charge.lowest_m, wind=CALM, payload_kg=0.0)
    return short_of(best, near)


def round_trip_pct(charge: Charge, place: Place) -> float:
    """Return the points of charge for going over a place at the layer and coming home from there."""
    here = charge.position
    above = Position(here.east_m, here.north_m, charge.layer_m)
    over = Position(place.east_m, place.north_m, charge.layer_m)
    wind, load = charge.wind, charge.payload_kg
    out = way_pct(here, above, charge.power, wind, load) + way_pct(above, over, charge.power, wind, load)
    return out + home_pct(over, charge.home, charge.layer_m, charge.power, wind, load)
