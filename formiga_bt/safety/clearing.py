"""Heights of a way: too near to the ground below, or too high over it.

Near take-off and landing spots (10 m over ground) a machine may be low. A rescue that begins too low or too high may go on
as long as it gets no worse; ground that is not known is no reason against a rescue, and one against everything else.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final

from formiga_bt.base.geo import Place, Position
from formiga_bt.safety.terrain import Terrain, TerrainConflict, too_high, too_low
from formiga_bt.safety.traffic import Way
from formiga_bt.safety.zones import FORGIVEN_M

NEAR_SPOT_M: Final = 10.0
"""So near to a take-off or landing spot, over ground, the clearance over the terrain does not bind."""
PIECES: Final = 64
"""Parts in which the way of a rescue is looked at."""


def first_too_low(
    terrain: Terrain, way: Way, spots: Sequence[Place], need_m: float, *, rescue: bool = False
) -> TerrainConflict | None:
    """Return where a way, away from the spots, is less than `need_m` over the ground: where first, or at an end if worse.

    Args:
        terrain: the ground.
        way: the straight way.
        spots: take-off and landing spots.
        need_m: least height over the ground.
        rescue: it may go on in a breach in which it begins.
    """
    if too_low(terrain, *way, need_m) is None:
        return None
    for part in parts_away(way, spots):
        found = too_low(terrain, *part, need_m)
        if found is None:
            continue
        if not rescue:
            return min(_candidates(terrain, found, part, 1), key=_over_m)

        def depth(a: Position, b: Position) -> float:
            bounds = terrain.under_m(a, b)
            return need_m + bounds[1] - min(a.up_m, b.up_m) if bounds is not None else 0.0

        worse = _gets_worse(part, depth, begins=part[0] == way[0])
        if worse is not None:
            return TerrainConflict(worse, terrain.ground_m(worse))
    return None


def first_too_high(terrain: Terrain, way: Way, most_m: float, *, rescue: bool = False) -> TerrainConflict | None:
    """Return where a way is more than `most_m` over the ground; as `first_too_low`, which see."""
    found = too_high(terrain, *way, most_m)
    if found is None:
        return None
    if not rescue:
        return max(_candidates(terrain, found, way, 0), key=_over_m)

    def depth(a: Position, b: Position) -> float:
        bounds = terrain.under_m(a, b)
        return max(a.up_m, b.up_m) - bounds[0] - most_m if bounds is not None else 0.0

    worse = _gets_worse(way, depth, begins=True)
    return TerrainConflict(worse, terrain.ground_m(worse)) if worse is not None else None


def _candidates(terrain: Terrain, found: TerrainConflict, way: Way, side: int) -> list[TerrainConflict]:
    """Return what was found first and how it is at the ends: people are told of the worst; unknown ground is told alone."""
    if found.ground_m is None:
        return [found]
    ends = [(end, terrain.under_m(end, end)) for end in way]
    return [found, *(TerrainConflict(end, bounds[side]) for end, bounds in ends if bounds is not None)]


def _over_m(found: TerrainConflict) -> float:
    return found.at.up_m - found.ground_m if found.ground_m is not None else 0.0


def _gets_worse(way: Way, depth: Callable[[Position, Position], float], *, begins: bool) -> Position | None:
    """Return where a rescue does what it may not: breaks the limit anew, or more than where it began."""
    a, b = way
    at_start = max(0.0, depth(a, a)) if begins else 0.0
    points = [_between(a, b, k / PIECES) for k in range(PIECES + 1)]
    in_breach = at_start > 0.0
    for one, other in pairwise(points):
        now = depth(one, other)
        if now > 1e-6 and (not in_breach or now > at_start + FORGIVEN_M):
            return other
        in_breach = in_breach and depth(other, other) > 1e-6
    return b if depth(b, b) > at_start + 0.001 else None


def _between(a: Position, b: Position, share: float) -> Position:
    return Position(
        a.east_m + share * (b.east_m - a.east_m),
        a.north_m + share * (b.north_m - a.north_m),
        a.up_m + share * (b.up_m - a.up_m),
    )


def parts_away(way: Way, spots: Sequence[Place]) -> list[Way]:
    """Return the parts of a way that are farther than 10 m over ground from every spot, in order."""
    a, b = way
    dx, dy = b.east_m - a.east_m, b.north_m - a.north_m
    square = dx * dx + dy * dy
    near: list[tuple[float, float]] = []
    for spot in spots:
        x, y = a.east_m - spot.east_m, a.north_m - spot.north_m
        gap = x * x + y * y - NEAR_SPOT_M**2
        if square == 0.0:
            if gap <= 0.0:
                return []
            continue
        half = x * dx + y * dy
        root = half * half - square * gap
        if root >= 0.0:
            near.append(((-half - math.sqrt(root)) / square, (-half + math.sqrt(root)) / square))
    parts: list[Way] = []
    start = 0.0
    for low, high in sorted(near):
        if high < 0.0 or low > 1.0:
            continue
        if low > start:
            parts.append((_between(a, b, start) if start else a, _between(a, b, low)))
        start = max(start, high)
    if start < 1.0:
        parts.append((_between(a, b, start) if start else a, b))
    return parts
