"""How long something takes, counted in classes: what a histogram is drawn of. One thread adds, any reads."""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate
from typing import Final

from msgspec import Struct

BOUNDS_S: Final = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""From a tenth of a millisecond to far too long."""


class DurationCounts(Struct, frozen=True):
    """What was counted so far."""

    bounds_s: tuple[float, ...]
    within: tuple[int, ...]
    """How many took no longer than each bound; the last number is of all."""
    sum_s: float


class Durations:
    """Counts durations.

    Args:
        bounds_s: upper bounds of the classes, seconds, ascending.
    """

    def __init__(self, bounds_s: Sequence[float] = BOUNDS_S) -> None:
        self._bounds = tuple(bounds_s)
        self._counts = [0] * (len(self._bounds) + 1)
        self._sum_s = 0.0

    def add(self, seconds: float) -> None:
        """Count one; what is below zero counts as zero."""
        self._counts[bisect_left(self._bounds, seconds)] += 1
        self._sum_s += max(0.0, seconds)

    def statistics(self) -> DurationCounts:
        """Return what was counted."""
        return DurationCounts(self._bounds, tuple(accumulate(self._counts)), self._sum_s)
