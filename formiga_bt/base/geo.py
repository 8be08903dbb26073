"""Points, regions, ways over them, and the site's frame.

Inside formiga_bt every point is metres east, north and up in the local tangent plane of the site's base station;
`up_m` counts from the ground at the base. Only `Frame` converts to and from WGS84 (lazily, with pyproj).
All results that are compared or sent are rounded to 1 mm (`mm`), so that two runs agree byte for byte.
"""

import math
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, Final

from msgspec import Struct

EDGE_M: Final = 0.001
"""So near to a border is on it: what is rounded to 1 mm."""


def mm(metres: float) -> float:
    """Round to 1 mm, never returning -0.0."""
    return round(metres, 3) + 0.0


class Place(Struct, frozen=True, gc=False, tag_field="is", tag="place"):
    """A point on the ground, metres east and north of the base station."""

    east_m: float
    north_m: float


class Position(Struct, frozen=True, gc=False, tag_field="is", tag="position"):
    """A point in space, metres east and north of the base station and up from the ground at the base."""

    east_m: float
    north_m: float
    up_m: float

    @property
    def ground(self) -> Place:
        """Return the place straight below."""
        return Place(self.east_m, self.north_m)


class Region(Struct, frozen=True, tag_field="is", tag="region"):
    """A simple polygon on the ground; the last corner joins the first."""

    corners: tuple[Place, ...]


def horizontal_m(a: Place | Position, b: Place | Position) -> float:
    """Return the distance over ground in metres."""
    return math.hypot(a.east_m - b.east_m, a.north_m - b.north_m)


def distance_m(a: Position, b: Position) -> float:
    """Return the straight distance in metres."""
    return math.hypot(a.east_m - b.east_m, a.north_m - b.north_m, a.up_m - b.up_m)


def segment_distance_m(p1: Position, p2: Position, q1: Position, q2: Position) -> float:
    """Return the least distance in metres between the straight legs p1-p2 and q1-q2 (either may be a point).

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    px, py, pz, qx, qy, qz = p1.east_m, p1.north_m, p1.up_m, q1.east_m, q1.north_m, q1.up_m
    ux, uy, uz = p2.east_m - px, p2.north_m - py, p2.up_m - pz
    vx, vy, vz = q2.east_m - qx, q2.north_m - qy, q2.up_m - qz
    rx, ry, rz = px - qx, py - qy, pz - qz
    a, e, f = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, vx * rx + vy * ry + vz * rz
    tiny = 1e-9
    if a <= tiny and e <= tiny:
        s = t = 0.0
    elif a <= tiny:
        s, t = 0.0, _unit(f / e)
    else:
        c = ux * rx + uy * ry + uz * rz
        if e <= tiny:
            s, t = _unit(-c / a), 0.0
        else:
            b = ux * vx + uy * vy + uz * vz
            denominator = a * e - b * b
            s = _unit((b * f - c * e) / denominator) if denominator > tiny else 0.0
            t = (b * s + f) / e
            if t < 0.0:
                s, t = _unit(-c / a), 0.0
            elif t > 1.0:
                s, t = _unit((b - c) / a), 1.0
    gx, gy, gz = rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz
    return math.sqrt(gx * gx + gy * gy + gz * gz)


def _unit(x: float) -> float:
    return min(1.0, max(0.0, x))


# -- polygons ------------------------------------------------------------------------------------------------------------


class RegionOutline:
    """A region made ready for many questions: its edges, its bounds. Corners and edges belong to it, to 1 mm.

    Made once per region (`outline_of` keeps the newest); plain arithmetic, no shapely, so that asking costs microseconds.
    """

    __slots__ = ("bounds", "edges", "is_convex", "region")

    def __init__(self, region: Region) -> None:
        points = [(corner.east_m, corner.north_m) for corner in region.corners]
        self.region = region
        self.edges = tuple((*a, *b) for a, b in zip(points, points[1:] + points[:1], strict=True))
        easts, norths = [p[0] for p in points] or [math.inf], [p[1] for p in points] or [math.inf]
        self.bounds = (min(easts), max(easts), min(norths), max(norths))
        self.is_convex = _is_convex(points)

    def contains(self, east_m: float, north_m: float) -> bool:
        """Return whether a point is over the region or on its border."""
        west, east, south, north = self.bounds
        if east_m < west - EDGE_M or east_m > east + EDGE_M or north_m < south - EDGE_M or north_m > north + EDGE_M:
            return False
        return self._parity(east_m, north_m) or self.border_m(east_m, north_m) <= EDGE_M

    def border_m(self, east_m: float, north_m: float) -> float:
        """Return the distance from a point to the nearest edge in metres, from inside or outside."""
        least = math.inf
        for ax, ay, bx, by in self.edges:
            dx, dy = bx - ax, by - ay
            square = dx * dx + dy * dy
            along = ((east_m - ax) * dx + (north_m - ay) * dy) / square if square else 0.0
            along = 0.0 if along < 0.0 else min(along, 1.0)
            x, y = ax + along * dx - east_m, ay + along * dy - north_m
            gap = x * x + y * y
            if gap < least:
                least = gap
        return math.sqrt(least)

    def outside_m(self, east_m: float, north_m: float) -> float:
        """Return how far outside the region a point is in metres; 0 inside and on the border."""
        return 0.0 if self.contains(east_m, north_m) else self.border_m(east_m, north_m)

    def inside_m(self, east_m: float, north_m: float) -> float:
        """Return how deep inside the region a point is in metres; 0 outside and on the border."""
        return self.border_m(east_m, north_m) if self.contains(east_m, north_m) else 0.0

    def spans(self, a: Place | Position, b: Place | Position) -> list[tuple[float, float, bool]]:
        """Return the parts of the straight way from `a` to `b`: from share, to share (0..1), whether it is inside.

        Neighbours differ, the first begins at 0 and the last ends at 1. Parts on the border (nowhere more than 1 mm from it)
        are inside.
        """
        ax, ay = a.east_m, a.north_m
        dx, dy = b.east_m - ax, b.north_m - ay
        cuts = [0.0, *self._cuts(ax, ay, dx, dy), 1.0]
        found: list[tuple[float, float, bool]] = []
        for start, end in pairwise(cuts):
            if end <= start and len(cuts) > 2:
                continue
            middle = (start + end) / 2
            inside = self._parity(ax + middle * dx, ay + middle * dy) or self._runs_along(ax, ay, dx, dy, start, end)
            if found and found[-1][2] == inside:
                found[-1] = (found[-1][0], end, inside)
            else:
                found.append((start, end, inside))
        return found

    def _runs_along(self, ax: float, ay: float, dx: float, dy: float, start: float, end: float) -> bool:
        """Return whether a part of a way that meets no edge on its way lies on the border from end to end."""
        shares = (start + share * (end - start) for share in (0.0, 0.29, 0.5, 0.71, 1.0))
        return all(self.border_m(ax + t * dx, ay + t * dy) <= EDGE_M for t in shares)

    def _cuts(self, ax: float, ay: float, dx: float, dy: float) -> list[float]:
        """Return the shares, in order, at which a way meets edges."""
        found = []
        square = dx * dx + dy * dy
        for px, py, qx, qy in self.edges:
            ex, ey = qx - px, qy - py
            cross = dx * ey - dy * ex
            if cross:
                along = ((px - ax) * ey - (py - ay) * ex) / cross
                share = ((px - ax) * dy - (py - ay) * dx) / cross
                if 0.0 < along < 1.0 and -1e-9 <= share <= 1.0 + 1e-9:
                    found.append(along)
            elif square and abs((px - ax) * dy - (py - ay) * dx) <= EDGE_M * math.sqrt(square):
                shares = (((x - ax) * dx + (y - ay) * dy) / square for x, y in ((px, py), (qx, qy)))
                found += [share for share in shares if 0.0 < share < 1.0]
        found.sort()
        return found

    def _parity(self, x: float, y: float) -> bool:
        within = False
        for ax, ay, bx, by in self.edges:
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                within = not within
        return within

    def is_left_by(self, a: Place | Position, b: Place | Position) -> bool:
        """Return whether the straight way over ground is anywhere more than 1 mm outside."""
        if not (self.contains(a.east_m, a.north_m) and self.contains(b.east_m, b.north_m)):
            return True
        return not self.is_convex and any(not inside for _, _, inside in self.spans(a, b))

    def is_entered_by(self, a: Place | Position, b: Place | Position) -> bool:
        """Return whether the straight way over ground touches the region: comes within 1 mm of it."""
        west, east, south, north = self.bounds
        ax, ay, bx, by = a.east_m, a.north_m, b.east_m, b.north_m
        if (
            (ax < west - EDGE_M and bx < west - EDGE_M)
            or (ax > east + EDGE_M and bx > east + EDGE_M)
            or (ay < south - EDGE_M and by < south - EDGE_M)
            or (ay > north + EDGE_M and by > north + EDGE_M)
        ):
            return False
        if self._is_beside(ax, ay, bx - ax, by - ay):
            return False
        if self.contains(ax, ay) or self.contains(bx, by):
            return True
        return any(_edge_gap_m(ax, ay, bx, by, *edge) <= EDGE_M for edge in self.edges)

    def _is_beside(self, ax: float, ay: float, dx: float, dy: float) -> bool:
        """Return whether all corners lie more than 1 mm off on one side of a line: then no way along it touches."""
        off = EDGE_M * (abs(dx) + abs(dy))
        sides = [(x - ax) * dy - (y - ay) * dx for x, y, _, _ in self.edges]
        return bool(sides) and (min(sides) > off or max(sides) < -off)


def _is_convex(points: list[tuple[float, float]]) -> bool:
    """Return whether a polygon is convex and goes round once; False when in doubt."""
    turns, winding = set(), 0.0
    count = len(points)
    for i in range(count):
        (ax, ay), (bx, by), (cx, cy) = points[i], points[(i + 1) % count], points[(i + 2) % count]
        ux, uy, vx, vy = bx - ax, by - ay, cx - bx, cy - by
        cross = ux * vy - uy * vx
        if cross == 0.0 and ux * vx + uy * vy <= 0.0:
            return False  # turns back on itself, or a corner twice
        turns.add(cross > 0.0 if cross else None)
        winding += math.atan2(cross, ux * vx + uy * vy)
    return len(turns - {None}) == 1 and abs(abs(winding) - 2 * math.pi) < 1e-6


def _edge_gap_m(ax: float, ay: float, bx: float, by: float, px: float, py: float, qx: float, qy: float) -> float:
    """Return the distance of two straight lines over ground, 0 if they cross."""
    dx, dy, ex, ey = bx - ax, by - ay, qx - px, qy - py
    cross = dx * ey - dy * ex
    if cross:
        along = ((px - ax) * ey - (py - ay) * ex) / cross
        share = ((px - ax) * dy - (py - ay) * dx) / cross
        if 0.0 <= along <= 1.0 and 0.0 <= share <= 1.0:
            return 0.0
    return min(
        _point_gap_m(ax, ay, px, py, ex, ey),
        _point_gap_m(bx, by, px, py, ex, ey),
        _point_gap_m(px, py, ax, ay, dx, dy),
        _point_gap_m(qx, qy, ax, ay, dx, dy),
    )


def _point_gap_m(x: float, y: float, ax: float, ay: float, dx: float, dy: float) -> float:
    square = dx * dx + dy * dy
    along = _unit(((x - ax) * dx + (y - ay) * dy) / square) if square else 0.0
    return math.hypot(x - ax - along * dx, y - ay - along * dy)


@lru_cache(maxsize=256)
def outline_of(region: Region) -> RegionOutline:
    """Return a region made ready for questions; the newest few hundred are kept."""
    return RegionOutline(region)


def is_within(point: Place | Position, region: Region) -> bool:
    """Return whether a point is over a region or on its border, to 1 mm."""
    return outline_of(region).contains(point.east_m, point.north_m)


def way_leaves(a: Place | Position, b: Place | Position, region: Region) -> bool:
    """Return whether the straight way over ground from `a` to `b` is anywhere outside a region, also a concave one."""
    return outline_of(region).is_left_by(a, b)


def way_enters(a: Place | Position, b: Place | Position, region: Region) -> bool:
    """Return whether the straight way over ground from `a` to `b` crosses or touches a region."""
    return outline_of(region).is_entered_by(a, b)


def way_gap_m(a: Place | Position, b: Place | Position, region: Region) -> float:
    """Return the distance over ground from the straight way `a` to `b` to a region in metres; 0 if it touches it."""
    if way_enters(a, b, region):
        return 0.0
    return min(_edge_gap_m(a.east_m, a.north_m, b.east_m, b.north_m, *edge) for edge in outline_of(region).edges)


def regions_meet(one: Region, other: Region) -> bool:
    """Return whether two regions have a point in common."""
    if any(is_within(corner, other) for corner in one.corners) or any(is_within(c, one) for c in other.corners):
        return True
    corners = (*one.corners, *one.corners[:1])
    return any(way_enters(a, b, other) for a, b in pairwise(corners))


class Frame:
    """The local east-north-up frame of a base station at WGS84 latitude and longitude (degrees).

    The only place that converts heights and degrees. pyproj is imported on first use.
    """

    def __init__(self, lat: float, lng: float, ground_msl_m: float = 0.0) -> None:
        self.lat = lat
        self.lng = lng
        self.ground_msl_m = ground_msl_m

    @cached_property
    def _transformer(self) -> Any:
        return _transformer(self.lat, self.lng)

    def place(self, lat: float, lng: float) -> Place:
        """Return the place at WGS84 `lat`, `lng` (degrees), rounded to 1 mm."""
        east, north, _ = self._transformer.transform(lat, lng, 0.0)
        return Place(mm(east), mm(north))

    def lat_lng(self, point: Place | Position) -> tuple[float, float]:
        """Return WGS84 latitude and longitude (degrees, rounded to 1e-8) of a point."""
        up = self._tangent_drop_m(point)
        lat, lng, _ = self._transformer.transform(point.east_m, point.north_m, up, direction="INVERSE")
        return round(lat, 8), round(lng, 8)

    @staticmethod
    def _tangent_drop_m(point: Place | Position) -> float:
        # A point on the ellipsoid lies below the tangent plane by about d^2 / 2R.
        d2 = point.east_m**2 + point.north_m**2
        return float(-d2 / (2 * 6_378_137.0))


@lru_cache(maxsize=16)
def _transformer(lat: float, lng: float) -> Any:
    """Return the transformer of a frame; making one takes as long as two hundred places."""
    from pyproj import Transformer

    return Transformer.from_pipeline(
        "+proj=pipeline +step +proj=axisswap +order=2,1 +step +proj=unitconvert +xy_in=deg +xy_out=rad "
        f"+step +proj=cart +ellps=WGS84 +step +proj=topocentric +ellps=WGS84 +lon_0={lng!r} +lat_0={lat!r}"
    )
