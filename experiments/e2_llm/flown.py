"""What a flight in the simulator showed, as plain values: the ground truth that oracles judge.

Ways come from the motion of the simulated bodies themselves, not from what the engine believes or what a model wrote. Metres
east, north and up of the base station, seconds since the task was submitted.
"""

import math
from collections.abc import Iterator
from itertools import pairwise

from msgspec import Struct

ON_GROUND_M = 0.3
"""Lower than this a machine stands."""
STEP_M = 0.5
"""Ways are looked at in steps of at most this length."""


class Fix(Struct, frozen=True):
    """Where a machine was at an instant; between two fixes it moves straight."""

    at_s: float
    east_m: float
    north_m: float
    up_m: float

    @property
    def flat(self) -> tuple[float, float]:
        """Return metres east and north."""
        return (self.east_m, self.north_m)


class Touch(Struct, frozen=True):
    """A landing or a take-off."""

    at_s: float
    east_m: float
    north_m: float

    @property
    def flat(self) -> tuple[float, float]:
        """Return metres east and north."""
        return (self.east_m, self.north_m)


class Machine(Struct, frozen=True, kw_only=True):
    """A machine and the way it went."""

    id: str
    type: str
    home: tuple[float, float]
    way: tuple[Fix, ...]

    @property
    def moved(self) -> bool:
        """Return whether it ever was elsewhere than where it stood at first."""
        return any(
            math.dist(one.flat, self.way[0].flat) > 1.0 or abs(one.up_m - self.way[0].up_m) > 1.0 for one in self.way
        )

    @property
    def end(self) -> Fix:
        """Return where it is at the end."""
        return self.way[-1]

    @property
    def is_down(self) -> bool:
        """Return whether it stands on the ground at the end."""
        return self.end.up_m <= ON_GROUND_M

    @property
    def landings(self) -> tuple[Touch, ...]:
        """Return where and when it came to stand."""
        return tuple(Touch(b.at_s, *b.flat) for a, b in pairwise(self.way) if a.up_m > ON_GROUND_M >= b.up_m)

    @property
    def take_offs(self) -> tuple[Touch, ...]:
        """Return where and when it left the ground."""
        return tuple(Touch(a.at_s, *a.flat) for a, b in pairwise(self.way) if a.up_m <= ON_GROUND_M < b.up_m)

    def steps(self, since_s: float = 0.0, until_s: float = math.inf) -> Iterator[Fix]:
        """Iterate over its way in short steps."""
        for a, b in pairwise(self.way):
            if b.at_s < since_s or a.at_s > until_s:
                continue
            far = math.dist((a.east_m, a.north_m, a.up_m), (b.east_m, b.north_m, b.up_m))
            parts = max(1, math.ceil(far / STEP_M))
            for i in range(parts):
                one = between(a, b, i / parts)
                if since_s <= one.at_s <= until_s:
                    yield one
        if since_s <= self.end.at_s <= until_s:
            yield self.end

    def at(self, at_s: float) -> Fix:
        """Return where it is at an instant."""
        for a, b in pairwise(self.way):
            if a.at_s <= at_s <= b.at_s:
                return between(a, b, (at_s - a.at_s) / (b.at_s - a.at_s) if b.at_s > a.at_s else 1.0)
        return self.way[0] if at_s < self.way[0].at_s else self.end


class Asked(Struct, frozen=True, kw_only=True):
    """A question of the task to people."""

    at_s: float
    people: tuple[str, ...]
    text: str
    options: tuple[str, ...]
    answer: str = ""
    answered_s: float | None = None


class Done(Struct, frozen=True, kw_only=True):
    """An action of a machine or a person that the task asked for."""

    agent: str
    action: str
    start_s: float
    end_s: float | None
    state: str


class Flown(Struct, frozen=True, kw_only=True):
    """A whole flight."""

    status: str
    """SUCCEEDED, FAILED, CANCELED, UNFINISHED, or REFUSED: it did not start."""
    code: str = ""
    reason: str = ""
    end_s: float = 0.0
    """When the task was over."""
    machines: dict[str, Machine] = {}
    people: dict[str, str] = {}
    """Person -> type."""
    asked: tuple[Asked, ...] = ()
    done: tuple[Done, ...] = ()
    notices: tuple[str, ...] = ()
    """What it told people without a question."""
    crashes: int = 0
    places: dict[str, tuple[float, float]] = {}

    def movers(self) -> tuple[Machine, ...]:
        """Return the machines that moved, by id."""
        return tuple(one for one in self.machines.values() if one.moved)


def between(a: Fix, b: Fix, share: float) -> Fix:
    """Return the fix at a share of the straight way from `a` to `b`."""
    return Fix(
        a.at_s + share * (b.at_s - a.at_s),
        a.east_m + share * (b.east_m - a.east_m),
        a.north_m + share * (b.north_m - a.north_m),
        a.up_m + share * (b.up_m - a.up_m),
    )
