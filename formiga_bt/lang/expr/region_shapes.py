"""Geometry of regions for task authors: area, centroid, splitting, lawnmower paths. shapely is imported on first use.

Pure and deterministic; results rounded to 1 mm. Registered as helpers in `helpers`.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Final

from formiga_bt.base.geo import Place, Position, Region, mm
from formiga_bt.lang.model import Env, EvalError

MAX_PARTS: Final = 100
MAX_LANES: Final = 500


def area(region: Region) -> float:
    """Return the area in square metres."""
    return mm(_shape(region).area)


def centroid(region: Region) -> Place:
    """Return the centre of mass, a place (outside the region where that is bent like a horseshoe)."""
    center = _shape(region).centroid
    return Place(mm(center.x), mm(center.y))


def inside(point: Place | Position, region: Region) -> bool:
    """Return whether the point is over the region or on its border."""
    return bool(_shape(region).covers(_shapely().Point(point.east_m, point.north_m)))


def split(region: Region, parts: int) -> tuple[Region, ...]:
    """Cut a region into `parts` connected regions of equal area: strips where that works, else halves of halves."""
    if not 1 <= parts <= MAX_PARTS:
        raise EvalError(f"split makes 1 to {MAX_PARTS} parts, not {parts}")
    shape = _shape(region)
    for angle in range(0, 180, 15):
        pieces = _strips(shape, parts, float(angle))
        if pieces is not None:
            return tuple(_region(piece) for piece in pieces)
    pieces = _halves(shape, parts)
    if pieces is None:
        raise EvalError("this region cannot be split into connected parts by straight lines")
    return tuple(_region(piece) for piece in pieces)


def split_by_area(region: Region, max_area_m2: float) -> tuple[Region, ...]:
    """Cut a region into the fewest parts of equal area, none larger than `max_area_m2` square metres."""
    if not max_area_m2 > 0:
        raise EvalError("max_area must be above 0")
    parts = math.ceil(_shape(region).area / max_area_m2 - 1e-9)
    return split(region, max(1, min(parts, MAX_PARTS + 1)))


def lawnmower(
    env: Env, region: Region, spacing_m: float, altitude_m: float, angle_deg: float = 0.0
) -> tuple[Position, ...]:
    """Return a path over the region in parallel lanes, `altitude_m` over the ground of each point.

    Args:
        env: knows the height of the ground.
        region: to cover.
        spacing_m: the greatest distance of two lanes.
        altitude_m: over the ground.
        angle_deg: direction of the lanes, from north.
    """
    if not spacing_m > 0:
        raise EvalError("spacing must be above 0 m")
    turned = _turn(_shape(region), angle_deg)
    path: list[Position] = []
    for number, lane in enumerate(_lanes(turned, spacing_m)):
        for end in reversed(lane) if number % 2 else lane:
            place = _turned_back(end, angle_deg)
            path.append(Position(place.east_m, place.north_m, mm(env.ground_up_m(place) + altitude_m)))
    return tuple(path)


def _lanes(shape: Any, spacing_m: float) -> Iterator[list[tuple[float, float]]]:
    """Yield the ends of each lane (south to north; four or more where the region is bent), from west to east."""
    west, south, east, north = shape.bounds
    count = max(1, math.ceil((east - west) / spacing_m - 1e-9))
    if count > MAX_LANES:
        raise EvalError(f"lawnmower would need {count} lanes, at most {MAX_LANES}: widen the spacing")
    for i in range(count):
        x = west + (i + 0.5) * (east - west) / count
        cut = shape.intersection(_shapely().LineString([(x, south - 1.0), (x, north + 1.0)]))
        pieces = [part for part in getattr(cut, "geoms", [cut]) if part.geom_type == "LineString" and not part.is_empty]
        ends = sorted((x, y) for piece in pieces for y in (piece.bounds[1], piece.bounds[3]))
        if ends:
            yield ends


def _strips(shape: Any, parts: int, angle_deg: float) -> list[Any] | None:
    """Cut the turned shape by east-west positions; None if a strip falls into several pieces."""
    turned = _turn(shape, angle_deg)
    west, south, east, north = turned.bounds
    cuts = [west]
    for i in range(1, parts):
        cuts.append(_cut_at(turned, turned.area * i / parts, cuts[-1]))
    cuts.append(east)
    strips = []
    for left, right in pairwise(cuts):
        piece = turned.intersection(_shapely().box(left, south - 1.0, right, north + 1.0))
        strips.append(_whole(_turn(piece, -angle_deg)))
    return None if None in strips else strips


def _halves(shape: Any, parts: int) -> list[Any] | None:
    """Cut a shape in two connected pieces, and those again; the first way that works."""
    if parts == 1:
        return [shape]
    few = parts // 2
    for angle in range(0, 360, 15):
        pair = _in_two(shape, few / parts, float(angle))
        if pair is None:
            continue
        one, other = _halves(pair[0], few), _halves(pair[1], parts - few)
        if one is not None and other is not None:
            return one + other
    return None


def _in_two(shape: Any, share: float, angle_deg: float) -> tuple[Any, Any] | None:
    """Cut off `share` of the area along one line; None if a side falls into several pieces."""
    turned = _turn(shape, angle_deg)
    west, south, east, north = turned.bounds
    at = _cut_at(turned, turned.area * share, west)
    boxes = (
        _shapely().box(west - 1.0, south - 1.0, at, north + 1.0),
        _shapely().box(at, south - 1.0, east + 1.0, north + 1.0),
    )
    one, other = (turned.intersection(box) for box in boxes)
    pair = _whole(_turn(one, -angle_deg)), _whole(_turn(other, -angle_deg))
    return None if None in pair else pair


def _whole(piece: Any) -> Any | None:
    """Return the piece on the grid of 1 mm, or None if it is several, or hangs together by less than 10 cm."""
    clean = _shapely().set_precision(piece, 0.001)
    solid = clean.buffer(-0.05)
    return clean if clean.geom_type == solid.geom_type == "Polygon" and not solid.is_empty else None


def _cut_at(shape: Any, wanted_m2: float, low: float) -> float:
    """Return the east-west position that leaves `wanted_m2` square metres to the west."""
    west, south, high, north = shape.bounds
    for _ in range(50):
        middle = (low + high) / 2
        if shape.intersection(_shapely().box(west - 1.0, south - 1.0, middle, north + 1.0)).area < wanted_m2:
            low = middle
        else:
            high = middle
    return float(high)


def _shapely() -> Any:
    """Import shapely on first use: most trees never need it."""
    import shapely
    import shapely.affinity

    return shapely


def _shape(region: Region) -> Any:
    if len(region.corners) < 3:
        raise EvalError("a region needs three corners")
    shape = _shapely().Polygon([(corner.east_m, corner.north_m) for corner in region.corners])
    if not shape.is_valid or shape.area <= 0:
        raise EvalError("the border of this region crosses itself or encloses nothing")
    return shape


def _turn(shape: Any, degrees: float) -> Any:
    return _shapely().affinity.rotate(shape, degrees, origin=(0.0, 0.0)) if degrees else shape


def _turned_back(end: tuple[float, float], degrees: float) -> Place:
    turn = math.radians(-degrees)
    x, y = end
    return Place(mm(x * math.cos(turn) - y * math.sin(turn)), mm(x * math.sin(turn) + y * math.cos(turn)))


def _region(shape: Any) -> Region:
    ring = list(shape.normalize().exterior.coords)[:-1]
    return Region(tuple(Place(mm(x), mm(y)) for x, y in ring))
