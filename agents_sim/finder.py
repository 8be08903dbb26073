"""The tracker that a picker carries: it knows the way back to the base (action MiniFinder).

The model: the tracker knows where it is, with an error that shrinks with each fix of one search (30 m, then 15 m, ..., at last
3 m), and how large that error may be. A search is all that one task asks. Nothing is random: the direction of an error follows
from the person's id and the number of the fix. The answer is `in_range` when its person is within 20 m of the base, the error
counted, and `go_to`: the next point of the straight way to the base, at most 40 m ahead of the fix. Who has not come on since
the last fix does not see the drone there: the next point is half as far ahead.
"""

import math
import zlib
from collections.abc import Callable, Mapping
from typing import Any, Final

from msgspec import Struct

from agents_sim.limits import PersonLimits
from formiga_bt.base.geo import Place, Position, horizontal_m, mm

Sight = Callable[[], Mapping[str, Position]]
"""Returns where the drones are that fly now."""

SHRINK: Final = 0.5
AHEAD_M: Final = 40.0
"""A point of the way is at most this far ahead."""
LEAST_AHEAD_M: Final = 10.0
CAME_ON_M: Final = 5.0
"""Who came less than this nearer to the base from one fix to the next has not come on."""


def sees_nothing() -> Mapping[str, Position]:
    """Return no drone: the sight of someone alone."""
    return {}


class _Search(Struct):
    fixes: int = 0
    left_m: float = math.inf
    """From the last fix to the base."""
    ahead_m: float = AHEAD_M


class Finder:
    """Answers for one person."""

    def __init__(self, person: str, limits: PersonLimits) -> None:
        self._person = person
        self._limits = limits
        self._searches: dict[str, _Search] = {}

    def answer(self, here: Place, base: Place, search: str) -> dict[str, Any]:
        """Return the result of a MiniFinder goal.

        Args:
            here: where the person stands.
            base: where they are to be guided.
            search: the task that asks; each task's errors begin anew.
        """
        of = self._searches.setdefault(search, _Search())
        fix, error_m = self.fix(here, of.fixes), self.error_m(of.fixes)
        left_m = horizontal_m(fix, base)
        came_on = left_m < of.left_m - CAME_ON_M
        of.ahead_m = AHEAD_M if came_on else max(LEAST_AHEAD_M, of.ahead_m * SHRINK)
        of.fixes, of.left_m = of.fixes + 1, left_m
        to = _toward(fix, base, of.ahead_m)
        return {
            "in_range": left_m + error_m <= self._limits.finder_range_m,
            "go_to": {"east_m": to.east_m, "north_m": to.north_m},
        }

    def error_m(self, number: int) -> float:
        """Return how far off the tracker is at its `number`th fix (from 0) of a search."""
        best_m = min(self._limits.fix_floor_m, self._limits.fix_error_m)
        return max(best_m, self._limits.fix_error_m * SHRINK**number)

    def fix(self, here: Place, number: int) -> Place:
        """Return where the tracker believes to be at its `number`th fix (from 0) of a search."""
        error_m = self.error_m(number)
        angle = math.tau * (zlib.crc32(f"{self._person}/{number}".encode()) / 2**32)
        return Place(mm(here.east_m + error_m * math.cos(angle)), mm(here.north_m + error_m * math.sin(angle)))


def _toward(start: Place, end: Place, ahead_m: float) -> Place:
    whole_m = horizontal_m(start, end)
    if whole_m <= ahead_m:
        return end
    share = ahead_m / whole_m
    return Place(
        mm(start.east_m + share * (end.east_m - start.east_m)),
        mm(start.north_m + share * (end.north_m - start.north_m)),
    )
