"""Coordinates of a request get names, so that a model has no digits to copy: `61.234567 N, 24.123456 E` becomes `point_1`.

A point that is a place of the site has that place's name. The file has the coordinates again, as the value of a param.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from msgspec import structs

from formiga_bt.base.geo import Frame, Place
from formiga_bt.lang.model import Site
from formiga_bt.llm.world import RequestWorld

SAME_M: Final = 2.0
"""So near to a place of the site a point is that place."""
_NUMBER: Final = r"(\d{1,3}\.\d{3,})\s*°?\s*"
_COORDINATES: Final = re.compile(
    rf"(?<![\w.])(?:{_NUMBER}([NS])[\s,;]+{_NUMBER}([EW])(?!\w)"
    r"|(?:lat(?:itude)?[\s:=]+)?(-?\d{1,2}\.\d{3,})\s*°?(?:\s*,\s*|[\s,;]+(?=l(?:on|ng)))"
    r"(?:l(?:on|ng|ong|ongitude)[\s:=]+)?(-?\d{1,3}\.\d{3,})(?:\s*°)?(?!\w|\.\d))",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class RequestPoint:
    """A point of a request."""

    lat: float
    lng: float
    words: str
    """As the request has it."""

    @property
    def text(self) -> str:
        """Return it as on the command line."""
        return f"{self.lat:g},{self.lng:g}" if self.lat == round(self.lat, 4) else f"{self.lat:.6f},{self.lng:.6f}"


@dataclass(frozen=True, slots=True)
class NamedRequest:
    """A request with names in place of coordinates."""

    text: str
    points: Mapping[str, RequestPoint] = field(default_factory=dict)
    """Name -> point; those that are no place of the site."""
    said: Mapping[str, str] = field(default_factory=dict)
    """Name of a place -> the coordinates that stood for it."""


def named(request: str, site: Site) -> NamedRequest:
    """Return a request with names for its coordinates."""
    frame = Frame(site.lat, site.lng, site.ground_msl_m)
    points: dict[str, RequestPoint] = {}
    said: dict[str, str] = {}

    def name(match: re.Match[str]) -> str:
        if match[1]:
            lat = float(match[1]) * (-1 if match[2] in "Ss" else 1)
            lng = float(match[3]) * (-1 if match[4] in "Ww" else 1)
        else:
            lat, lng = float(match[5]), float(match[6])
        if abs(lat) > 90 or abs(lng) > 180:
            return match[0]
        here = frame.place(lat, lng)
        for known, place in site.places.items():
            if isinstance(place, Place) and _far_m(place, here) <= SAME_M:
                said[known] = match[0]
                return known
        for known, point in points.items():
            if (point.lat, point.lng) == (lat, lng):
                return known
        number = 1 + len(points)
        while f"point_{number}" in site.places:
            number += 1
        points[f"point_{number}"] = RequestPoint(lat, lng, match[0])
        said[f"point_{number}"] = match[0]
        return f"point_{number}"

    return NamedRequest(_COORDINATES.sub(name, request), points, said)


def _far_m(a: Place, b: Place) -> float:
    return max(abs(a.east_m - b.east_m), abs(a.north_m - b.north_m))


def with_points(world: RequestWorld, points: Mapping[str, RequestPoint]) -> RequestWorld:
    """Return a world whose site has the points of a request as places."""
    if not points:
        return world
    site = world.site
    frame = Frame(site.lat, site.lng, site.ground_msl_m)
    places = {**site.places, **{name: frame.place(one.lat, one.lng) for name, one in points.items()}}
    return replace(world, site=structs.replace(site, places=places))
