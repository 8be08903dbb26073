"""The tracker that a picker carries: a drone asks it where to look (action MiniFinder).

The model: the tracker knows where it is, with an error that shrinks with each fix of one search (30 m, then 15 m, ...),
and which drones fly near it. A search is all that one task asks. The answer is `in_range` when a flying drone is within
20 m over ground, and `go_to`: the place where the tracker believes to be. Nothing is random: the direction of an error
follows from the person's id and the number of the fix.
"""

import math
import zlib
from collections.abc import Callable, Mapping
from typing import Any, Final

from agents_sim.limits import PersonLimits
from formiga_bt.base.geo import Place, Position, horizontal_m, mm

Sight = Callable[[], Mapping[str, Position]]
"""Returns where the drones are that fly now."""

SHRINK: Final = 0.5


def sees_nothing() -> Mapping[str, Position]:
    """Return no drone: the sight of someone alone."""
    return {}


class Finder:
    """Answers for one person."""

    def __init__(self, person: str, limits: PersonLimits, sight: Sight = sees_nothing) -> None:
        self.sight = sight
        self._person = person
        self._limits = limits
        self._fixes: dict[str, int] = {}

    def answer(self, here: Place, search: str) -> dict[str, Any]:
        """Return the result of a MiniFinder goal.

        Args:
            here: where the person stands.
            search: the task that asks; each task's errors begin anew.
        """
        number = self._fixes.get(search, 0)
        self._fixes[search] = number + 1
        near = min((horizontal_m(here, drone) for drone in self.sight().values()), default=math.inf)
        fix = self.fix(here, number)
        return {
            "in_range": near <= self._limits.finder_range_m,
            "go_to": {"east_m": fix.east_m, "north_m": fix.north_m},
        }

    def fix(self, here: Place, number: int) -> Place:
        """Return where the tracker believes to be at its `number`th fix (from 0) of a search."""
        error_m = self._limits.fix_error_m * SHRINK**number
        angle = math.tau * (zlib.crc32(f"{self._person}/{number}".encode()) / 2**32)
        return Place(mm(here.east_m + error_m * math.cos(angle)), mm(here.north_m + error_m * math.sin(angle)))
