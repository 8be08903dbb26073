"""What a drone saw of a region that it searched: the share of its cells that came under the camera.

The camera looks straight down and sees as far to each side as half the drone's height. A cell is a square of 5 m (larger in a
large region, so that there are at most some 2,500) whose middle lies in the region; it is seen when its middle came under the
camera.
"""

import json
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.geo import Frame, Place

CELL_M: Final = 5.0
MOST: Final = 2500
SIDE: Final = 0.5
"""How far the camera sees to each side, by its height."""


class Coverage(Struct, frozen=True):
    """The cells of a region, and which of them were seen."""

    cells: tuple[Place, ...]
    """Their middles."""
    seen: tuple[bool, ...]
    cell_m: float

    def result(self) -> dict[str, Any]:
        """Return what the drone says of it, as it passes the wire."""
        count = sum(self.seen)
        return {"coverage": round(100.0 * count / len(self.cells), 1), "cells": len(self.cells), "seen": count}

    def geojson(self, frame: Frame) -> bytes:
        """Return the cells as a file for maps: two features, `seen: true` and `seen: false`, in degrees.

        Args:
            frame: of the base.
        """
        features = [
            {
                "type": "Feature",
                "properties": {"seen": seen},
                "geometry": {
                    "type": "MultiPolygon",
                    "coordinates": [[self._ring(a, b, frame)] for a, b in self._runs(seen)],
                },
            }
            for seen in (True, False)
        ]
        return json.dumps({"type": "FeatureCollection", "features": features}).encode()

    def _runs(self, seen: bool) -> Iterator[tuple[Place, Place]]:
        """Yield the first and the last cell of each row of neighbours that were seen, or were not."""
        run: list[Place] = []
        for cell, was_seen in zip(self.cells, self.seen, strict=True):
            goes_on = bool(run) and cell.north_m == run[-1].north_m and cell.east_m - run[-1].east_m < 1.5 * self.cell_m
            if run and not (goes_on and was_seen == seen):
                yield run[0], run[-1]
                run = []
            if was_seen == seen:
                run.append(cell)
        if run:
            yield run[0], run[-1]

    def _ring(self, first: Place, last: Place, frame: Frame) -> list[list[float]]:
        half = self.cell_m / 2.0
        west, east, south, north = first.east_m - half, last.east_m + half, first.north_m - half, first.north_m + half
        corners = (Place(west, south), Place(east, south), Place(east, north), Place(west, north), Place(west, south))
        degrees = (frame.lat_lng(corner) for corner in corners)
        return [[round(lng, 7), round(lat, 7)] for lat, lng in degrees]


def covered(corners: Sequence[Place], way: Sequence[Place], height_m: float) -> Coverage:
    """Return what was seen of a region.

    Args:
        corners: of the region.
        way: the lanes that were flown, from point to point.
        height_m: over the ground.
    """
    cells, cell_m = _cells(corners)
    reach_m = height_m * SIDE + 0.001
    legs = list(pairwise(way)) or [(way[0], way[0])]
    return Coverage(cells, tuple(any(_is_near(cell, a, b, reach_m) for a, b in legs) for cell in cells), cell_m)


def _cells(corners: Sequence[Place]) -> tuple[tuple[Place, ...], float]:
    west, east = min(c.east_m for c in corners), max(c.east_m for c in corners)
    south, north = min(c.north_m for c in corners), max(c.north_m for c in corners)
    size = max(CELL_M, math.sqrt((east - west) * (north - south) / MOST))
    found = [
        Place(west + (i + 0.5) * size, south + (j + 0.5) * size)
        for j in range(max(1, math.ceil((north - south) / size)))
        for i in range(max(1, math.ceil((east - west) / size)))
    ]
    inside = tuple(cell for cell in found if _is_inside(cell, corners))
    return inside or (Place((west + east) / 2, (south + north) / 2),), size


def _is_inside(cell: Place, corners: Sequence[Place]) -> bool:
    inside = False
    for a, b in pairwise((*corners, corners[0])):
        if (a.north_m > cell.north_m) != (b.north_m > cell.north_m):
            share = (cell.north_m - a.north_m) / (b.north_m - a.north_m)
            inside ^= cell.east_m < a.east_m + share * (b.east_m - a.east_m)
    return inside


def _is_near(cell: Place, a: Place, b: Place, reach_m: float) -> bool:
    east, north = b.east_m - a.east_m, b.north_m - a.north_m
    whole = east * east + north * north
    along = ((cell.east_m - a.east_m) * east + (cell.north_m - a.north_m) * north) / whole if whole else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(a.east_m + along * east - cell.east_m, a.north_m + along * north - cell.north_m) <= reach_m
