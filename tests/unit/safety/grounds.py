"""Sites and flights for the envelope's tests."""

from typing import Any

from formiga_bt.base.energy import Power
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.heights import parse_heights
from formiga_bt.lang.model import Site
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.envelope import FlightState, GateFlight, ways_of
from formiga_bt.safety.rules import Rules

FENCE = Region((Place(-500, -500), Place(500, -500), Place(500, 500), Place(-500, 500)))
LAKE = Region((Place(100, -50), Place(200, -50), Place(200, 50), Place(100, 50)))
HOME = Place(0, 0)

POWER = Power(speed_m_s=10.0, climb_m_s=2.0, cruise_pct_s=0.1, hover_pct_s=0.08, climb_pct_s=0.2, landing_s=0.0)
"""Ten points a kilometre, ten points for 100 m of climb, five for 100 m of descent."""

RULES = Rules(keep_in=True, keep_out=True)

HILL = """\
ncols 11
nrows 11
xllcenter -500
yllcenter -500
cellsize 100
NODATA_value -9999
""" + "\n".join(
    " ".join("40" if (row, col) == (5, 8) else "-9999" if (row, col) == (0, 0) else "0" for col in range(11))
    for row in range(11)
)
"""Flat, but for a hill of 40 m at east 300, north 0, and a hole in the north-west corner."""


def site(**changes: Any) -> Site:
    keys: dict[str, Any] = {"fence": FENCE, "no_fly": (LAKE,), "regions": {"lake": LAKE}, "layers_m": (60.0,)}
    return Site("yard", 66.5, 25.7, **{**keys, **changes})


def airspace(**changes: Any) -> Airspace:
    return Airspace(site(**changes))


def hilly(error_m: float = 0.0) -> Airspace:
    return airspace(heights=parse_heights(HILL, 0.0), relief_m=error_m, no_fly=())


def flight(
    here: Position | None, to: Place | Position | None, ground: Airspace | None = None, **changes: Any
) -> GateFlight:
    keys: dict[str, Any] = {
        "agent": "hwd_1",
        "ways": ways_of(here, to, ground or airspace()),
        "battery": 90.0,
        "power": POWER,
        "home": HOME,
        "layer_m": 60.0,
    }
    return GateFlight(here=here, **{**keys, **changes})


def state(here: Position | None, **changes: Any) -> FlightState:
    keys: dict[str, Any] = {"agent": "hwd_1", "battery": 90.0, "power": POWER, "home": HOME, "layer_m": 60.0}
    return FlightState(here=here, **{**keys, **changes})
