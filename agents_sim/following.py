"""How a person follows the drone that guides them: they see it, walk after a moment, and stop when it is out of sight.

The tracker says where the drone goes (`finder`). Of the drones in sight they follow the one nearest to that point. Nothing is
random.
"""

from typing import Final

from agents_sim.finder import Sight
from agents_sim.limits import PersonLimits
from formiga_bt.base.clock import SECOND, Micros, micros
from formiga_bt.base.geo import Place, Position, horizontal_m

BELOW_M: Final = 3.0
"""So near, over ground, they stand below the drone and wait."""
MOVES_ON_M: Final = 6.0
"""So far from who waits below it the drone has moved on: less than a tracker points ahead, its error counted."""
FORGOTTEN_AFTER_US: Final[Micros] = 120 * SECOND
"""Without a new point for this long nobody guides them any more."""


class Follower:
    """Where one person walks who is guided.

    Args:
        limits: how far they see and how soon they walk.
        sight: where the drones are that fly now.
    """

    def __init__(self, limits: PersonLimits, sight: Sight) -> None:
        self._limits = limits
        self._sight = sight
        self._to: Place | None = None
        """Where the drone goes; None = nobody guides them."""
        self._told_at: Micros = 0
        self._sees_since: Micros | None = None
        self._waits = False

    def guide(self, to: Place, now: Micros) -> None:
        """Take in where the drone goes next."""
        self._to, self._told_at = to, now

    def arrive(self) -> None:
        """Follow no more."""
        self._to = self._sees_since = None
        self._waits = False

    def is_guided(self, now: Micros) -> bool:
        """Return whether somebody guides them."""
        if self._to is not None and now > self._told_at + FORGOTTEN_AFTER_US:
            self.arrive()
        return self._to is not None

    @property
    def sees(self) -> bool:
        """Return whether they saw the drone when they last looked."""
        return self._sees_since is not None

    def look(self, here: Place, now: Micros) -> Place | None:
        """Return where they walk to now; None = they stay."""
        drone = self._drone(here) if self.is_guided(now) else None
        if drone is None:
            self._sees_since, self._waits = None, False
            return None
        away_m = horizontal_m(here, drone)
        if self._sees_since is None or (self._waits and away_m > MOVES_ON_M):
            self._sees_since, self._waits = now, False
        if away_m <= BELOW_M:
            self._waits = True
        if self._waits or now - self._sees_since < micros(self._limits.reaction_s):
            return None
        return drone.ground

    def shift(self, by: Micros) -> None:
        """Follow a jump of engine time."""
        self._told_at += by
        if self._sees_since is not None:
            self._sees_since += by

    def _drone(self, here: Place) -> Position | None:
        """Return where the drone is that they take for theirs."""
        to = self._to
        in_sight = [one for one in self._sight().values() if horizontal_m(here, one) <= self._limits.sight_m]
        return min(in_sight, key=lambda one: horizontal_m(one, to), default=None) if to is not None else None
