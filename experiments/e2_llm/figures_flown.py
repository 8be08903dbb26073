"""Figures in ways: a full circle, a zigzag, three that stand as a right triangle.

Tolerances: a ring is kept within 5 % of its radius and 0.1 m (a polygon of ten sides still passes, one of eight does not),
a point within 1.5 m, a swing within 15 % of its amplitude and 0.3 m.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import accumulate, pairwise, permutations
from typing import Final

from msgspec import Struct

from experiments.e2_llm.flown import Fix, Machine

Flat = tuple[float, float]

POINT_M: Final = 1.5
"""So near to a point it is there."""
FULL_DEG: Final = 350.0
"""A circle is full when it goes round so far."""
LEVEL_M: Final = 2.0
"""A height is kept within this."""


class Round(Struct, frozen=True):
    """A stretch of a way on a ring."""

    since_s: float
    until_s: float
    turned_deg: float
    lowest_m: float
    highest_m: float


def ring_band_m(radius_m: float) -> float:
    """Return how far from its radius a circle may be."""
    return 0.05 * radius_m + 0.1


def rounds(machine: Machine, center: Flat, radius_m: float, since_s: float = 0.0) -> list[Round]:
    """Return the stretches on which a machine in the air kept to a ring round a centre."""
    band = ring_band_m(radius_m)
    found: list[Round] = []
    stretch: list[Fix] = []
    for one in machine.steps(since_s):
        if abs(math.dist(one.flat, center) - radius_m) <= band and one.up_m > 2.0:
            stretch.append(one)
        elif stretch:
            found.append(_round(stretch, center))
            stretch = []
    if stretch:
        found.append(_round(stretch, center))
    return found


def _round(stretch: Sequence[Fix], center: Flat) -> Round:
    angles = [math.atan2(one.north_m - center[1], one.east_m - center[0]) for one in stretch]
    turned = [0.0, *accumulate(math.degrees(math.remainder(b - a, math.tau)) for a, b in pairwise(angles))]
    ends = max(range(len(turned)), key=turned.__getitem__), min(range(len(turned)), key=turned.__getitem__)
    begin, last = min(ends), max(ends)
    on_ring = [i for i in range(begin, last) if turned[i + 1] != turned[i] and _is_along(stretch[i : i + 2], center)]
    laps = [lap for end in on_ring if (lap := _lap(turned, begin, end + 1, on_ring))]
    heights = [[stretch[i].up_m for i in lap] for lap in laps] or [[stretch[i].up_m for i in on_ring]]
    level = min(
        (one for one in heights if one), key=lambda one: max(one) - min(one), default=[one.up_m for one in stretch]
    )
    return Round(stretch[0].at_s, stretch[last].at_s, abs(turned[last] - turned[begin]), min(level), max(level))


def _lap(turned: Sequence[float], begin: int, end: int, on_ring: Sequence[int]) -> list[int]:
    """Return the steps of the shortest full circle that ends there, [] = none: without the way to the ring and away from it."""
    since = next((i for i in range(end, begin - 1, -1) if abs(turned[end] - turned[i]) >= FULL_DEG), None)
    return [i for i in on_ring if since <= i < end] if since is not None else []


def _is_along(two: Sequence[Fix], center: Flat) -> bool:
    """Return whether a step goes along the ring rather than to it, or up and down on it."""
    a, b = two
    inwards = abs(math.dist(a.flat, center) - math.dist(b.flat, center))
    return math.dist(a.flat, b.flat) > max(inwards, 0.5 * abs(a.up_m - b.up_m))


def full_round(machine: Machine, center: Flat, radius_m: float) -> Round | None:
    """Return the longest stretch on a ring, if it goes once round."""
    best = max(rounds(machine, center, radius_m), key=lambda one: one.turned_deg, default=None)
    return best if best is not None and best.turned_deg >= FULL_DEG else None


def first_at(machine: Machine, where: Flat, *, near_m: float = POINT_M, since_s: float = 0.0) -> float | None:
    """Return when a machine in the air was first over a point."""
    for one in machine.steps(since_s):
        if math.dist(one.flat, where) <= near_m and one.up_m > 2.0:
            return one.at_s
    return None


class Swings(Struct, frozen=True):
    """How a way swings about the line from one point to another."""

    offsets_m: tuple[float, ...]
    """The extremes, alternating in sign, in order."""
    backwards_m: float
    """The most that it went back along the line."""
    widest_m: float


def swings(way: Iterable[Fix], start: Flat, end: Flat, least_m: float) -> Swings:
    """Return the swings of a way of at least a size."""
    length = math.dist(start, end)
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    extremes: list[float] = []
    furthest, back, widest = 0.0, 0.0, 0.0
    for one in way:
        dx, dy = one.east_m - start[0], one.north_m - start[1]
        along, aside = dx * ux + dy * uy, dx * uy - dy * ux
        back, furthest = max(back, furthest - along), max(furthest, along)
        widest = max(widest, abs(aside))
        if abs(aside) < least_m:
            continue
        if not extremes or (aside > 0) != (extremes[-1] > 0):
            extremes.append(aside)
        elif abs(aside) > abs(extremes[-1]):
            extremes[-1] = aside
    return Swings(tuple(extremes), back, widest)


def right_triangle(at: Sequence[Flat], corner: Flat, leg_m: float, near_m: float = POINT_M) -> bool:
    """Return whether three points are a right triangle with equal legs of a length and its right angle at a corner."""
    for a, b, c in permutations(at):
        legs = (math.dist(a, b), math.dist(a, c))
        square = math.dist(b, c) - leg_m * math.sqrt(2.0)
        if math.dist(a, corner) <= near_m and all(abs(leg - leg_m) <= near_m for leg in legs) and abs(square) <= near_m:
            return True
    return False


def formation(machines: Sequence[Machine], corner: Flat, leg_m: float) -> float | None:
    """Return the first instant at which three machines hover as such a triangle."""
    instants = sorted({one.at_s for machine in machines for one in machine.way})
    for at_s in instants:
        now = [machine.at(at_s) for machine in machines]
        still = all(
            math.dist(one.flat, machine.at(at_s - 0.25).flat) < 0.1
            or math.dist(one.flat, machine.at(at_s + 0.25).flat) < 0.1
            for one, machine in zip(now, machines, strict=True)
        )
        if still and all(one.up_m > 2.0 for one in now) and right_triangle([one.flat for one in now], corner, leg_m):
            return at_s
    return None
