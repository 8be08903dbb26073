"""The fence of a site: which points of a value lie outside it.

Called where a request is bound (E063) and where constant places of a task are read (W063). A region counts by its
corners. Plain arithmetic: no shapely, so that a request costs nothing.
"""

from collections.abc import Iterator
from typing import Any, Final

from formiga_bt.geo import Place, Position, Region
from formiga_bt.lang.model import Site

_EDGE_M: Final = 0.001
"""So near to the border is on it: what is rounded to 1 mm."""


def is_within(point: Place | Position, region: Region) -> bool:
    """Return whether a point is over a region or on its border."""
    x, y = point.east_m, point.north_m
    within = False
    for one, other in zip(region.corners, (*region.corners[1:], region.corners[0]), strict=True):
        ax, ay, bx, by = one.east_m, one.north_m, other.east_m, other.north_m
        if _is_on(x, y, ax, ay, bx, by):
            return True
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            within = not within
    return within


def _is_on(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> bool:
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    along = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / square)) if square else 0.0
    return (x - ax - along * dx) ** 2 + (y - ay - along * dy) ** 2 <= _EDGE_M**2


def leaves(value: Any, site: Site | None) -> bool:
    """Return whether any point of a value lies outside the site's fence; False without a fence."""
    if site is None or site.fence is None:
        return False
    return any(not is_within(point, site.fence) for point in _points(value))


def _points(value: Any) -> Iterator[Place | Position]:
    match value:
        case Place() | Position():
            yield value
        case Region():
            yield from value.corners
        case tuple():
            for part in value:
                yield from _points(part)
