"""The fence of a site: which points of a value lie outside it.

Called where a request is bound (E063) and where constant places of a task are read (W063). A region counts by its
corners. Plain arithmetic: no shapely, so that a request costs nothing.
"""

from collections.abc import Iterator
from typing import Any

from formiga_bt.base.geo import Place, Position, Region, is_within, way_enters, way_leaves
from formiga_bt.lang.model import Site


def crossing(region: Region) -> tuple[int, int] | None:
    """Return the numbers (from 1) of two edges of a region that meet where they should not; None = a simple region.

    Edge `n` goes from corner `n` to the next one. Repeated corners, such as a last one that is the first, are no edges.
    """
    corners = region.corners
    edges = [
        (number, a, b)
        for number, (a, b) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True), start=1)
        if a != b
    ]
    for at, (first, a, b) in enumerate(edges):
        for later, (second, c, d) in enumerate(edges[at + 1 :], start=at + 1):
            if later == at + 1 and b == c:
                bad = _folds(a, b, d)
            elif at == 0 and later == len(edges) - 1 and d == a:
                bad = _folds(c, a, b)
            else:
                bad = _meet(a, b, c, d)
            if bad:
                return first, second
    return None


def _turn(a: Place, b: Place, c: Place) -> float:
    return (b.east_m - a.east_m) * (c.north_m - a.north_m) - (b.north_m - a.north_m) * (c.east_m - a.east_m)


def _folds(a: Place, b: Place, c: Place) -> bool:
    """Return whether the way a-b-c turns back on itself."""
    back = (b.east_m - a.east_m) * (c.east_m - b.east_m) + (b.north_m - a.north_m) * (c.north_m - b.north_m)
    return _turn(a, b, c) == 0 and back < 0


def _meet(a: Place, b: Place, c: Place, d: Place) -> bool:
    """Return whether the edges a-b and c-d have a point in common."""
    if max(a.east_m, b.east_m) < min(c.east_m, d.east_m) or max(c.east_m, d.east_m) < min(a.east_m, b.east_m):
        return False
    if max(a.north_m, b.north_m) < min(c.north_m, d.north_m) or max(c.north_m, d.north_m) < min(a.north_m, b.north_m):
        return False
    one, other = _turn(a, b, c), _turn(a, b, d)
    third, fourth = _turn(c, d, a), _turn(c, d, b)
    return one * other <= 0 and third * fourth <= 0


def leaves(value: Any, site: Site | None) -> bool:
    """Return whether any point of a value lies outside the site's fence; False without a fence."""
    if site is None or site.fence is None:
        return False
    return any(not is_within(point, site.fence) for point in _points(value))


def enters(value: Any, site: Site | None) -> bool:
    """Return whether any point of a value lies in a no-fly region of the site."""
    return site is not None and any(is_within(point, region) for point in _points(value) for region in site.no_fly)


def breaks(a: Place | Position, b: Place | Position, site: Site | None) -> str:
    """Return what a straight way between two points does that are fine by themselves: leave the fence, cross a region."""
    if site is None:
        return ""
    if site.fence is not None and way_leaves(a, b, site.fence):
        return f"the way there leaves the fence of site {site.name}"
    if any(way_enters(a, b, region) for region in site.no_fly):
        return f"the way there crosses a no-fly region of site {site.name}"
    return ""


def _points(value: Any) -> Iterator[Place | Position]:
    match value:
        case Place() | Position():
            yield value
        case Region():
            yield from value.corners
        case tuple():
            for part in value:
                yield from _points(part)
        case dict():
            for part in value.values():
                yield from _points(part)
