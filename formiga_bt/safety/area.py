"""An action that covers an area: what it may fly over, and how far.

How a machine lays its lanes is its own business, and over a concave region they may leave it: so everything within the convex
hull of the region and of where it comes from counts as flown over. How far it flies is reckoned with lanes from edge to edge,
there and back along the wind, which is the worst of all directions.
"""

import math
from typing import Final

from msgspec import Struct

from formiga_bt.base.energy import CALM, Power, Wind, way_pct
from formiga_bt.base.geo import Place, Position, Region, RegionOutline
from formiga_bt.safety.terrain import Terrain, TerrainConflict, too_high, too_low
from formiga_bt.safety.traffic import hull
from formiga_bt.safety.zones import Offence, Zone

ROW_M = 5.0
"""Distance of the rows in which the ground below an area is looked at, if a look at all of it leaves doubt."""
MOST_ROWS: Final = 200


class Area(Struct, frozen=True):
    """All that an area action may fly over, at one height over the base's ground."""

    region: Region
    corners: tuple[Position, ...]
    """Of the convex hull."""

    @property
    def outline(self) -> RegionOutline:
        """Return the hull."""
        return RegionOutline(Region(tuple(corner.ground for corner in self.corners)))

    def edges(self) -> list[tuple[Position, Position]]:
        """Return the edges of the hull."""
        return list(zip(self.corners, (*self.corners[1:], *self.corners[:1]), strict=True))


def area_of(region: Region, up_m: float, here: Position | None) -> Area:
    """Return the area of a region at a height that is covered by a machine that comes from `here`."""
    points = [*region.corners, *([here.ground] if here is not None else [])]
    return Area(region, tuple(Position(p.east_m, p.north_m, up_m) for p in hull(points)))


def zone_offence(area: Area, zone: Zone) -> Offence | None:
    """Return how an area breaks a zone, or None."""
    for a, b in area.edges():
        found = zone.offence(a, b)
        if found is not None:
            return found
    if zone.keep_in and zone.outline.is_convex:
        return None
    outline = area.outline
    for east, north, _, _ in zone.outline.edges:
        deep = outline.inside_m(east, north)
        if deep > 0.001:  # a notch of the fence, or a whole no-fly region, within the area
            return Offence(zone.name, Place(east, north), deep)
    return None


def height_offence(area: Area, terrain: Terrain, need_m: float, most_m: float) -> tuple[str, TerrainConflict] | None:
    """Return the limit (terrain_clearance or max_height) that an area breaks and where, or None."""
    west, east, south, north = area.outline.bounds
    up = area.corners[0].up_m
    bounds = terrain.bounds_m(Place(west, south), Place(east, north))
    if bounds is not None and up - bounds[1] >= need_m and up - bounds[0] <= most_m:
        return None
    count = min(MOST_ROWS, max(1, math.ceil((north - south) / ROW_M)))
    for row in range(count + 1):
        at = south + row / count * (north - south)
        for a, b in _row(area, at):
            low = too_low(terrain, a, b, need_m)
            if low is not None:
                return "terrain_clearance", low
            high = too_high(terrain, a, b, most_m)
            if high is not None:
                return "max_height", high
    return None


def _row(area: Area, north_m: float) -> list[tuple[Position, Position]]:
    found = sorted(_crossings(area.outline, north_m))
    up = area.corners[0].up_m
    return [(Position(found[0], north_m, up), Position(found[-1], north_m, up))] if found else []


def _crossings(outline: RegionOutline, north_m: float) -> list[float]:
    found = []
    for ax, ay, bx, by in outline.edges:
        if min(ay, by) <= north_m <= max(ay, by):
            found += [ax, bx] if ay == by else [ax + (north_m - ay) / (by - ay) * (bx - ax)]
    return found


def lanes_m(region: Region, spacing_m: float) -> float:
    """Return how long lanes over a region are, from edge to edge and along its edge to the next one, metres."""
    outline = RegionOutline(region)
    _, _, south, north = outline.bounds
    count = max(1, round((north - south) / spacing_m))
    step = (north - south) / count
    total, end = 0.0, None
    for index in range(count):
        at = south + (index + 0.5) * step
        found = sorted(_crossings(outline, at))
        if not found:
            continue
        ends = (found[0], found[-1]) if index % 2 == 0 else (found[-1], found[0])
        total += found[-1] - found[0]
        if end is not None:
            total += math.hypot(ends[0] - end[0], at - end[1])
        end = ends[1], at
    return total


def cover_pct(
    area: Area, here: Position, power: Power, wind: Wind = CALM, payload_kg: float = 0.0, speed_m_s: float | None = None
) -> float:
    """Return the points of charge to go from `here` to the farthest corner of an area and cover all of it."""
    into = max(way_pct(here, corner, power, wind, payload_kg, speed_m_s) for corner in area.corners)
    blows = math.hypot(*wind)
    there, back = (way_pct(*_ONE_WAY, power, (w, 0.0), payload_kg, speed_m_s) / _LONG_M for w in (blows, -blows))
    return into + lanes_m(area.region, power.sweep_spacing_m) * (there + back) / 2


_LONG_M = 100.0
_ONE_WAY = Position(0.0, 0.0, 0.0), Position(_LONG_M, 0.0, 0.0)
