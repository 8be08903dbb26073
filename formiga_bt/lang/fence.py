"""The fence of a site: which points of a value lie outside it.

Called where a request is bound (E063) and where constant places of a task are read (W063). A region counts by its
corners. Plain arithmetic: no shapely, so that a request costs nothing.
"""

from collections.abc import Iterator
from typing import Any

from formiga_bt.geo import Place, Position, Region, is_within
from formiga_bt.lang.model import Site


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
