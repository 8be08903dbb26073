"""Ground heights from a file: an ESRI ASCII grid in metres east and north of the base.

Ground floor: the site reader parses the file, the safety rules ask how high the ground is under a place and under a leg.
A height belongs to the middle of its cell; between the middles of four cells the ground is bilinear, so that the height
under a leg has no steps. Where the grid ends or has no data the ground is unknown (None), never zero.
"""

import math
from array import array
from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Final

from msgspec import Struct

from formiga_bt.base.geo import Place, Position

MOST_CELLS: Final = 4_000_000
"""A grid may have no more cells than this (2 km by 2 km at 1 m)."""

HIGHEST_M: Final = 10_000.0
"""No ground lies further than this above or below the sea."""

_COUNTS: Final = ("ncols", "nrows")
_CORNERS: Final = (("xllcorner", "xllcenter"), ("yllcorner", "yllcenter"))
_KEYS: Final = (*_COUNTS, *_CORNERS[0], *_CORNERS[1], "cellsize", "nodata_value")


_made_of = attrgetter("cols", "rows", "west_m", "south_m", "cell_m", "digest")


class HeightGrid(Struct, frozen=True, eq=False):
    """Heights of the ground over the base's ground, metres; rows from south to north, in each from west to east."""

    cols: int
    rows: int
    west_m: float
    """East of the base: the middle of the westernmost cells."""
    south_m: float
    """North of the base: the middle of the southernmost cells."""
    cell_m: float
    heights_m: Sequence[float]
    """`cols * rows` heights; NaN = no data."""
    digest: str = ""
    """What the heights were read from, as the reader names it; it stands for them when grids are compared."""

    def __eq__(self, other: object) -> bool:
        """Return whether two grids were read from the same, for the same place."""
        return isinstance(other, HeightGrid) and _made_of(self) == _made_of(other)

    def __ne__(self, other: object) -> bool:
        """Return whether they differ: a Struct without its own equality would compare identities."""
        return not self == other

    def __hash__(self) -> int:
        """Return a hash of what it was read from."""
        return hash(_made_of(self))

    def __repr__(self) -> str:
        """Return it without its heights: there are millions."""
        return f"HeightGrid({', '.join(map(repr, _made_of(self)))})"

    def ground_m(self, east_m: float, north_m: float) -> float | None:
        """Return the height of the ground over the base's ground; None outside the grid and where it has no data."""
        x = (east_m - self.west_m) / self.cell_m
        y = (north_m - self.south_m) / self.cell_m
        if not (-0.5 <= x <= self.cols - 0.5 and -0.5 <= y <= self.rows - 0.5):
            return None
        x, y = min(max(x, 0.0), self.cols - 1.0), min(max(y, 0.0), self.rows - 1.0)
        return self._between(x, y)

    def _between(self, x: float, y: float) -> float | None:
        """Return the height at `x` cells east and `y` cells north of the first cell's middle."""
        col, row = min(int(x), max(self.cols - 2, 0)), min(int(y), max(self.rows - 2, 0))
        u, v = x - col, y - row
        total = 0.0
        for dx, dy, weight in ((0, 0, (1 - u) * (1 - v)), (1, 0, u * (1 - v)), (0, 1, (1 - u) * v), (1, 1, u * v)):
            if weight > 0.0:
                total += weight * self.heights_m[(row + dy) * self.cols + col + dx]
        return None if math.isnan(total) else total

    def highest_m(self, a: Place | Position, b: Place | Position) -> float | None:
        """Return the highest ground under the straight leg from `a` to `b`; None if any of it is unknown.

        Args:
            a: where the leg begins; only its place counts.
            b: where it ends; it may be the same.
        """
        highest = -math.inf
        stops = self._stops(a, b)
        at = next(stops)
        low = self._along(a, b, at)
        for stop in stops:
            middle, high = self._along(a, b, (at + stop) / 2), self._along(a, b, stop)
            if low is None or middle is None or high is None:
                return None
            highest = max(highest, _top(low, middle, high))
            at, low = stop, high
        return highest

    def _along(self, a: Place | Position, b: Place | Position, share: float) -> float | None:
        return self.ground_m(a.east_m + share * (b.east_m - a.east_m), a.north_m + share * (b.north_m - a.north_m))

    def _stops(self, a: Place | Position, b: Place | Position) -> Iterator[float]:
        """Iterate over 0, the shares of the leg at which it crosses a line between middles of cells, and 1."""
        shares = {0.0, 1.0}
        for start, end, first, count in (
            (a.east_m, b.east_m, self.west_m, self.cols),
            (a.north_m, b.north_m, self.south_m, self.rows),
        ):
            low, high = sorted(((start - first) / self.cell_m, (end - first) / self.cell_m))
            for line in range(max(0, math.ceil(low)), min(count - 1, math.floor(high)) + 1):
                share = (first + line * self.cell_m - start) / (end - start) if end != start else 0.0
                shares.add(min(1.0, max(0.0, share)))
        return iter(sorted(shares))


def _top(low: float, middle: float, high: float) -> float:
    """Return the top of the parabola through three heights at equal distances: the ground under a piece of a leg."""
    bend = low - 2 * middle + high
    if bend >= -1e-12:
        return max(low, high)
    slope = (high - low) / 2
    at = -slope / bend
    return middle - slope * slope / (2 * bend) if -1.0 < at < 1.0 else max(low, high)


def parse_heights(text: str, base_msl_m: float, digest: str = "") -> HeightGrid:
    """Read an ESRI ASCII grid.

    Args:
        text: `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter` (metres east and north of the
            base), `cellsize` (metres) and, if wanted, `NODATA_value` (else -9999); then a line for each row, the
            northernmost first, of heights over the sea in metres.
        base_msl_m: height of the base's ground over the sea; the grid's heights are over it.
        digest: what the grid shall be told apart by.

    Raises:
        ValueError: the text is no such grid, with the number of the line; or it has more than `MOST_CELLS` cells.
    """
    lines = text.splitlines()
    head, first = _head(lines)
    cols, rows, cell = _count(head, "ncols"), _count(head, "nrows"), head["cellsize"][0]
    if cell <= 0:
        raise ValueError(f"line {head['cellsize'][1]}: cellsize must be above 0, this is {cell:g}")
    if cols * rows > MOST_CELLS:
        raise ValueError(f"{cols} times {rows} cells are more than {MOST_CELLS}; take larger cells or a smaller area")
    west, south = (head[corner][0] + cell / 2 if corner in head else head[center][0] for corner, center in _CORNERS)
    nodata = head["nodata_value"][0] if "nodata_value" in head else -9999.0
    found = [_row(line, number, cols, nodata, base_msl_m) for number, line in _rows(lines, first)]
    if len(found) != rows:
        raise ValueError(f"the file has {len(found)} rows of heights, nrows is {rows}")
    heights = array("d")
    for row in reversed(found):
        heights.extend(row)
    return HeightGrid(cols, rows, west, south, cell, heights, digest)


def _head(lines: Sequence[str]) -> tuple[dict[str, tuple[float, int]], int]:
    """Return the header's values with their line numbers, and the index of the first row of heights."""
    head: dict[str, tuple[float, int]] = {}
    first = 0
    for index, line in enumerate(lines):
        words = line.split()
        if words and _float(words[0]) is not None:
            break
        first = index + 1
        if not words:
            continue
        key = words[0].lower()
        if key not in _KEYS:
            raise ValueError(f"line {index + 1}: '{words[0][:40]}' is no key of an ESRI ASCII grid")
        value = _float(words[1]) if len(words) == 2 else None
        if value is None:
            raise ValueError(f"line {index + 1}: {words[0]} needs one number")
        if key in head:
            raise ValueError(f"line {index + 1}: {words[0]} stands here twice; first at line {head[key][1]}")
        head[key] = value, index + 1
    for names in (*((name,) for name in (*_COUNTS, "cellsize")), *_CORNERS):
        given = [name for name in names if name in head]
        if not given:
            raise ValueError(f"line {first + 1}: before the heights {' or '.join(names)} is missing")
        if len(given) > 1:
            raise ValueError(f"line {head[given[1]][1]}: give {names[0]} or {names[1]}, not both")
    return head, first


def _count(head: dict[str, tuple[float, int]], key: str) -> int:
    value, line = head[key]
    if value < 1 or value != int(value):
        raise ValueError(f"line {line}: {key} must be a whole number above 0, this is {value:g}")
    return int(value)


def _rows(lines: Sequence[str], first: int) -> Iterator[tuple[int, str]]:
    return ((number, line) for number, line in enumerate(lines[first:], start=first + 1) if line.strip())


def _row(line: str, number: int, cols: int, nodata: float, base_msl_m: float) -> "array[float]":
    words = line.split()
    if len(words) != cols:
        raise ValueError(f"line {number}: this row has {len(words)} heights, ncols is {cols}")
    row = array("d")
    for word in words:
        height = _float(word)
        if height is None:
            raise ValueError(f"line {number}: '{word[:40]}' is no height")
        if height != nodata and abs(height) > HIGHEST_M:
            raise ValueError(f"line {number}: no ground lies {height:g} m over the sea; is NODATA_value missing?")
        row.append(math.nan if height == nodata else height - base_msl_m)
    return row


def _float(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
