"""What a machine's motion costs in charge; the engine's estimate (`formiga_bt.base.energy`) uses the same limits."""

from collections.abc import Iterable

from agents_sim.limits import DroneLimits, MachineLimits
from agents_sim.motion import MotionKind, Segment
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, horizontal_m

AT_HOME_M = 2.0
"""A machine at rest charges when it is this near its home, or another charger, horizontally."""


def drain_percent_s(
    limits: MachineLimits, kind: MotionKind, way: Segment, chargers: Iterable[Place], payload_kg: float
) -> float:
    """Return the points of charge lost a second during a segment; negative while it charges.

    A leg that gains height drains more, for as long as the climb alone would take. A fall costs nothing.
    """
    if kind == "rest":
        charges = any(horizontal_m(place, way.p1) <= AT_HOME_M for place in chargers)
        return -limits.charge_percent_s if charges else 0.0
    if kind == "drive":
        return limits.drive_drain_pct_s
    if kind == "fall" or not isinstance(limits, DroneLimits):
        return 0.0
    load = payload_kg * limits.payload_drain_pct_kg_s
    if kind == "hover":
        return limits.hover_drain_pct_s + load
    lasts_s, rises_m = (way.t1 - way.t0) / SECOND, way.p1.up_m - way.p0.up_m
    share = min(1.0, rises_m / limits.climb_m_s / lasts_s) if rises_m > 0.0 and lasts_s > 0.0 else 0.0
    return limits.cruise_drain_pct_s + share * (limits.climbing_percent_s - limits.cruise_drain_pct_s) + load
