"""Points, regions and the site's frame.

Inside formiga_bt every point is metres east, north and up in the local tangent plane of the site's base station;
`up_m` counts from the ground at the base. Only `Frame` converts to and from WGS84 (lazily, with pyproj).
All results that are compared or sent are rounded to 1 mm (`mm`), so that two runs agree byte for byte.
"""

import math
from functools import cached_property
from typing import Any

from msgspec import Struct


def mm(metres: float) -> float:
    """Round to 1 mm, never returning -0.0."""
    return round(metres, 3) + 0.0


class Place(Struct, frozen=True, tag_field="is", tag="place"):
    """A point on the ground, metres east and north of the base station."""

    east_m: float
    north_m: float


class Position(Struct, frozen=True, tag_field="is", tag="position"):
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
    return math.sqrt((a.east_m - b.east_m) ** 2 + (a.north_m - b.north_m) ** 2 + (a.up_m - b.up_m) ** 2)


def segment_distance_m(p1: Position, p2: Position, q1: Position, q2: Position) -> float:
    """Return the least distance in metres between the straight legs p1-p2 and q1-q2 (either may be a point).

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    d1 = (p2.east_m - p1.east_m, p2.north_m - p1.north_m, p2.up_m - p1.up_m)
    d2 = (q2.east_m - q1.east_m, q2.north_m - q1.north_m, q2.up_m - q1.up_m)
    r = (p1.east_m - q1.east_m, p1.north_m - q1.north_m, p1.up_m - q1.up_m)
    a, e, f = _dot(d1, d1), _dot(d2, d2), _dot(d2, r)
    tiny = 1e-9
    if a <= tiny and e <= tiny:
        s = t = 0.0
    elif a <= tiny:
        s, t = 0.0, _unit(f / e)
    else:
        c = _dot(d1, r)
        if e <= tiny:
            s, t = _unit(-c / a), 0.0
        else:
            b = _dot(d1, d2)
            denominator = a * e - b * b
            s = _unit((b * f - c * e) / denominator) if denominator > tiny else 0.0
            t = (b * s + f) / e
            if t < 0.0:
                s, t = _unit(-c / a), 0.0
            elif t > 1.0:
                s, t = _unit((b - c) / a), 1.0
    gap = tuple(r[i] + s * d1[i] - t * d2[i] for i in range(3))
    return math.sqrt(sum(g * g for g in gap))


def _dot(u: tuple[float, float, float], v: tuple[float, float, float]) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _unit(x: float) -> float:
    return min(1.0, max(0.0, x))


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
        from pyproj import Transformer

        return Transformer.from_pipeline(
            "+proj=pipeline +step +proj=axisswap +order=2,1 +step +proj=unitconvert +xy_in=deg +xy_out=rad "
            f"+step +proj=cart +ellps=WGS84 +step +proj=topocentric +ellps=WGS84 +lon_0={self.lng!r} +lat_0={self.lat!r}"
        )

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
