"""A uniform grid of boxes: who may be near, without looking at everybody.

Used by the gatekeeper for machines in the air and for ports. Entries that span many cells stand apart and are always looked
at; with few entries, or for a wide question, the boxes are compared one by one, which is quicker than walking cells.
"""

import math
from typing import Generic, TypeVar

T = TypeVar("T")

Box = tuple[float, float, float, float]
"""Horizontal bounds: west, east, south, north, metres."""

Entry = tuple[float, float, float, float, T]
"""Bounds, and what lies in them."""

NOWHERE: Box = (math.inf, -math.inf, math.inf, -math.inf)
"""Bounds that meet nothing."""

CELL_M = 150.0
FEW = 64
"""So many entries, or cells of a question, are not worth a walk over cells; one entry stands in at most so many cells."""


class Grid(Generic[T]):
    """Things by key, each with a box. Keys are unique; the order of `near` is that of no set or hash (see there)."""

    def __init__(self, cell_m: float = CELL_M) -> None:
        self._cell_m = cell_m
        self._entries: dict[str, Entry[T]] = {}
        self._cells: dict[tuple[int, int], dict[str, Entry[T]]] = {}
        self._wide: dict[str, Entry[T]] = {}

    def __len__(self) -> int:
        """Return how many things it holds."""
        return len(self._entries)

    def put(self, key: str, box: Box, thing: T) -> None:
        """Put a thing in, or replace what stands under its key."""
        self.drop(key)
        if box[0] > box[1]:
            return
        entry = self._entries[key] = (*box, thing)
        cells = self._cells_of(box)
        if cells is None:
            self._wide[key] = entry
            return
        held_in = self._cells
        for cell in cells:
            if cell in held_in:
                held_in[cell][key] = entry
            else:
                held_in[cell] = {key: entry}

    def drop(self, key: str) -> None:
        """Take a thing out, if it is in."""
        entry = self._entries.pop(key, None)
        if entry is None or self._wide.pop(key, None) is not None:
            return
        for cell in self._cells_of(entry[:4]) or ():
            held = self._cells[cell]
            del held[key]
            if not held:
                del self._cells[cell]

    def get(self, key: str) -> T | None:
        """Return the thing that stands under a key, or None."""
        entry = self._entries.get(key)
        return entry[4] if entry is not None else None

    def near(self, box: Box) -> list[T]:
        """Return all things whose box meets this one. Sort them before their order may matter."""
        west, east, south, north = box
        if west > east:
            return []
        entries = self._entries
        cells = self._cells_of(box) if len(entries) > FEW else None
        if cells is not None:
            held_in = self._cells
            if len(cells) == 1 and not self._wide:
                entries = held_in.get(cells[0], {})
            else:
                entries = self._wide.copy()
                for cell in cells:
                    if cell in held_in:
                        entries.update(held_in[cell])
        return [
            thing for w, e, s, n, thing in entries.values() if w <= east and e >= west and s <= north and n >= south
        ]

    def _cells_of(self, box: Box) -> list[tuple[int, int]] | None:
        size = self._cell_m
        west, east = math.floor(box[0] / size), math.floor(box[1] / size)
        south, north = math.floor(box[2] / size), math.floor(box[3] / size)
        if west == east and south == north:
            return [(west, south)]
        if (east - west + 1) * (north - south + 1) > FEW:
            return None
        rows = range(south, north + 1)
        return [(x, y) for x in range(west, east + 1) for y in rows]


def box_of(points: "list[tuple[float, float]]") -> Box:
    """Return the bounds of points (east, north); of none, `NOWHERE`."""
    if not points:
        return NOWHERE
    easts, norths = [p[0] for p in points], [p[1] for p in points]
    return min(easts), max(easts), min(norths), max(norths)


def grown(box: Box, by_m: float) -> Box:
    """Return a box with so much more on each side."""
    return box[0] - by_m, box[1] + by_m, box[2] - by_m, box[3] + by_m
