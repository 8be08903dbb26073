"""What a search gives, for people and for maps.

A search is an action of any name with a region among its fields and `coverage` (percent) in its result; `finds` are places.
"""

from typing import Final

from msgspec import Struct

from formiga_bt.base.geo import Place, Region
from formiga_bt.engine.kernel.records import GoalRecord
from formiga_bt.show.facts import MapMark, MapShape, Point

MOST: Final = 200
"""So many finds of one search are marked on a map."""


class SearchProduct(Struct, frozen=True):
    """What a search gave."""

    text: str
    shape: MapShape | None
    marks: tuple[MapMark, ...]


def product_of(goal: GoalRecord) -> SearchProduct:
    """Return what a search gave that succeeded."""
    coverage, finds = goal.result.get("coverage"), goal.result.get("finds")
    share = f"{coverage:.0f} % seen" if isinstance(coverage, int | float) else "searched"
    places = [one for one in finds if isinstance(one, Place)] if isinstance(finds, tuple | list) else []
    text = share + (f", {len(places)} find{'s' * (len(places) != 1)}" if places else "")
    region = next((value for value in goal.fields.values() if isinstance(value, Region)), None)
    corners = tuple(Point(corner.east_m, corner.north_m) for corner in region.corners) if region is not None else ()
    shape = MapShape(name=f"{share} by {goal.agent}", kind="searched", corners=corners) if corners else None
    marks = (
        MapMark(name=f"find {i + 1}", kind="find", at=Point(p.east_m, p.north_m)) for i, p in enumerate(places[:MOST])
    )
    return SearchProduct(text, shape, tuple(marks))
