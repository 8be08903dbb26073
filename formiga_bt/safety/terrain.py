"""The ground under ways: flat ground with a relief, or heights from a file, and where a way comes too near to it.

Heights are metres over the base's ground. Between `low` and `high` of `bounds_m` the ground surely lies: flat ground rises
up to the relief, a height file may be wrong by it either way. Where a file ends or has no data the ground is unknown, and
so is whether a way is clear of it. Used by `airspace`; whole sites and coarse blocks are asked first, cells only in doubt.
"""

import math
from collections.abc import Callable
from typing import Final, Protocol

from msgspec import Struct

from formiga_bt.base.geo import Place, Position
from formiga_bt.base.heights import HeightGrid
from formiga_bt.lang.model import Site

BLOCK: Final = 16
"""Cells on each side of a block whose lowest and highest height are kept."""
FEW_CELLS: Final = 64
"""So many cells are looked at one by one."""
PIECE_M: Final = 1.0
"""Ways are not cut into shorter pieces than this, and into 128 at most."""

Bounds = tuple[float, float]
Point = Place | Position


class Terrain(Protocol):
    """The ground of a site."""

    def ground_m(self, at: Point) -> float | None:
        """Return the height of the ground at a place; None = unknown."""
        ...

    def rough_m(self, a: Point, b: Point) -> Bounds | None:
        """Return bounds of all ground, if all under the box from `a` to `b` is known; costs nothing."""
        ...

    def bounds_m(self, a: Point, b: Point) -> Bounds | None:
        """Return bounds of the ground in the box from `a` to `b`, not too narrow; None if some of it may be unknown."""
        ...

    def under_m(self, a: Point, b: Point) -> Bounds | None:
        """Return bounds of the ground under a short straight way; None = unknown."""
        ...


class Flat:
    """Ground that rises nowhere more than `relief_m` over the base's ground, and sinks nowhere below it."""

    def __init__(self, relief_m: float) -> None:
        self._bounds = (0.0, max(0.0, relief_m))

    def ground_m(self, at: Point) -> float | None:  # noqa: ARG002 - it is flat
        """Return 0."""
        return 0.0

    def rough_m(self, a: Point, b: Point) -> Bounds | None:  # noqa: ARG002
        """Return 0 and the relief."""
        return self._bounds

    bounds_m = under_m = rough_m


class Heights:
    """Ground from a height file that may be wrong by `error_m`."""

    def __init__(self, grid: HeightGrid, error_m: float) -> None:
        self.grid = grid
        self._error_m = error_m = max(0.0, error_m)
        self._across = -(-grid.cols // BLOCK)
        self._lows: list[float] = []
        self._highs: list[float] = []
        for row in range(0, grid.rows, BLOCK):
            for col in range(0, grid.cols, BLOCK):
                low, high = self._cells(col, min(col + BLOCK, grid.cols) - 1, row, min(row + BLOCK, grid.rows) - 1)
                self._lows.append(low)
                self._highs.append(high)
        low, high = min(self._lows), max(self._highs)
        self._whole = (low - error_m, high + error_m) if math.isfinite(low) and math.isfinite(high) else None

    def ground_m(self, at: Point) -> float | None:
        """Return the height in the file."""
        return self.grid.ground_m(at.east_m, at.north_m)

    def rough_m(self, a: Point, b: Point) -> Bounds | None:
        """Return the lowest and the highest height of the file, if it has no holes and both ends lie within."""
        return self._whole if self._whole is not None and self._covers(a) and self._covers(b) else None

    def bounds_m(self, a: Point, b: Point) -> Bounds | None:
        """Return bounds from the cells, or blocks of cells, that the box meets."""
        if not (self._covers(a) and self._covers(b)):
            return None
        grid = self.grid
        west, east = self._range(a.east_m, b.east_m, grid.west_m, grid.cols)
        south, north = self._range(a.north_m, b.north_m, grid.south_m, grid.rows)
        if (east - west + 1) * (north - south + 1) <= FEW_CELLS:
            low, high = self._cells(west, east, south, north)
        else:
            first, last = west // BLOCK, east // BLOCK + 1
            rows = [row * self._across for row in range(south // BLOCK, north // BLOCK + 1)]
            low = min(min(self._lows[row + first : row + last]) for row in rows)
            high = max(max(self._highs[row + first : row + last]) for row in rows)
        known = math.isfinite(low) and math.isfinite(high)
        return (low - self._error_m, high + self._error_m) if known else None

    def under_m(self, a: Point, b: Point) -> Bounds | None:
        """Return the lower of the ground at the ends, and the highest ground between them."""
        high, ends = self.grid.highest_m(a, b), (self.ground_m(a), self.ground_m(b))
        if high is None or ends[0] is None or ends[1] is None:
            return None
        return min(ends[0], ends[1]) - self._error_m, high + self._error_m

    def _covers(self, at: Point) -> bool:
        grid = self.grid
        x, y = (at.east_m - grid.west_m) / grid.cell_m, (at.north_m - grid.south_m) / grid.cell_m
        return -0.5 <= x <= grid.cols - 0.5 and -0.5 <= y <= grid.rows - 0.5

    def _range(self, a_m: float, b_m: float, first_m: float, count: int) -> tuple[int, int]:
        low, high = min(a_m, b_m) - first_m, max(a_m, b_m) - first_m
        cell = self.grid.cell_m
        return max(0, math.floor(low / cell)), min(count - 1, math.ceil(high / cell))

    def _cells(self, west: int, east: int, south: int, north: int) -> Bounds:
        """Return the lowest and highest height of cells; infinite if one has no data."""
        low, high = math.inf, -math.inf
        for row in range(south, north + 1):
            at = row * self.grid.cols
            part = self.grid.heights_m[at + west : at + east + 1]
            if math.isnan(sum(part)):
                return -math.inf, math.inf
            low, high = min(low, *part), max(high, *part)
        return low, high


def terrain_of(site: Site) -> Terrain:
    """Return a site's ground: from its height file, else flat with its relief."""
    return Heights(site.heights, site.relief_m) if site.heights is not None else Flat(site.relief_m)


class TerrainConflict(Struct, frozen=True):
    """Where a way is too low or too high."""

    at: Position
    ground_m: float | None
    """The ground there as it counts against the way; None = unknown."""


def is_surely_fine(terrain: Terrain, a: Position, b: Position, need_m: float, most_m: float) -> bool:
    """Return whether a way is so clear of the ground, and so low over it, that it need not be looked at closely."""
    rough = terrain.rough_m(a, b)
    low_m, high_m = (a.up_m, b.up_m) if a.up_m <= b.up_m else (b.up_m, a.up_m)
    return rough is not None and low_m - rough[1] >= need_m and high_m - rough[0] <= most_m


def too_low(terrain: Terrain, a: Position, b: Position, need_m: float) -> TerrainConflict | None:
    """Return where the way from `a` to `b` first may be less than `need_m` over the ground."""

    def judge(p: Position, q: Position, bounds: Bounds) -> TerrainConflict | None:
        at = p if p.up_m <= q.up_m else q
        return TerrainConflict(at, bounds[1]) if at.up_m - bounds[1] < need_m - 1e-6 else None

    return _first(terrain, a, b, judge)


def too_high(terrain: Terrain, a: Position, b: Position, most_m: float) -> TerrainConflict | None:
    """Return where the way from `a` to `b` first may be more than `most_m` over the ground."""

    def judge(p: Position, q: Position, bounds: Bounds) -> TerrainConflict | None:
        at = p if p.up_m >= q.up_m else q
        return TerrainConflict(at, bounds[0]) if at.up_m - bounds[0] > most_m + 1e-6 else None

    return _first(terrain, a, b, judge)


def _first(
    terrain: Terrain, a: Position, b: Position, judge: Callable[[Position, Position, Bounds], TerrainConflict | None]
) -> TerrainConflict | None:
    rough = terrain.rough_m(a, b)
    if rough is not None and judge(a, b, rough) is None:
        return None
    length = math.hypot(b.east_m - a.east_m, b.north_m - a.north_m)
    piece = max(PIECE_M, length / 128)

    def look(p: Position, q: Position, long_m: float) -> TerrainConflict | None:
        bounds = terrain.bounds_m(p, q)
        if bounds is not None and judge(p, q, bounds) is None:
            return None
        if long_m <= piece:
            bounds = terrain.under_m(p, q)
            return TerrainConflict(p, None) if bounds is None else judge(p, q, bounds)
        middle = Position((p.east_m + q.east_m) / 2, (p.north_m + q.north_m) / 2, (p.up_m + q.up_m) / 2)
        return look(p, middle, long_m / 2) or look(middle, q, long_m / 2)

    return look(a, b, length)
