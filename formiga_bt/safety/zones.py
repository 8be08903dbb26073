"""Fence and no-fly regions: does a way over ground break one, and may a rescue that begins in a breach go on?

A zone is a region in which a machine must stay (the fence) or must not be (no-fly). Its breach has a depth: metres outside
the fence, metres inside a no-fly region. The border belongs to the region, to 1 mm; for a no-fly region that is a breach
of depth 0.
"""

from typing import Final

from msgspec import Struct

from formiga_bt.base.geo import Place, Position, Region, RegionOutline

FORGIVEN_M: Final = 0.5
"""So much deeper than where it began the way out of a breach may lead: positions are not exact."""
SAMPLES: Final = 32
"""Points at which the depth of a way out is looked at."""

Point = Place | Position


class Offence(Struct, frozen=True):
    """Where a way breaks a zone, and how deep."""

    zone: str
    at: Place
    depth_m: float


class Zone:
    """One region with its rule."""

    __slots__ = ("keep_in", "name", "outline")

    def __init__(self, name: str, region: Region, *, keep_in: bool) -> None:
        self.name = name
        self.outline = RegionOutline(region)
        self.keep_in = keep_in

    def is_broken_at(self, at: Point) -> bool:
        """Return whether a machine must not be there."""
        return self.outline.contains(at.east_m, at.north_m) != self.keep_in

    def depth_m(self, at: Point) -> float:
        """Return how deep in the breach a place is; 0 where there is none."""
        of = self.outline.outside_m if self.keep_in else self.outline.inside_m
        return of(at.east_m, at.north_m)

    def is_offended(self, a: Point, b: Point) -> bool:
        """Return whether the straight way from `a` to `b` is anywhere where a machine must not be."""
        return self.outline.is_left_by(a, b) if self.keep_in else self.outline.is_entered_by(a, b)

    def offence(self, a: Point, b: Point, *, rescue: bool = False) -> Offence | None:
        """Return how the straight way from `a` to `b` breaks the zone, or None if it may be flown."""
        if not self.is_offended(a, b):
            return None
        return None if rescue and self._leads_out(a, b) else self._deepest(a, b)

    def _leads_out(self, a: Point, b: Point) -> bool:
        """Return whether a way that begins in the breach only lessens it."""
        if not self.is_broken_at(a):
            return False
        least = self.depth_m(a)
        if self.depth_m(b) > least + 0.001:
            return False
        bad = [(start, end) for start, end, inside in self.outline.spans(a, b) if inside != self.keep_in]
        if len(bad) > 1 or (bad and bad[0][0] > 0.0):
            return False
        return all(
            self.depth_m(_at(a, b, share)) <= least + FORGIVEN_M for share in _shares(0.0, bad[0][1] if bad else 0.0)
        )

    def _deepest(self, a: Point, b: Point) -> Offence:
        bad = [(start, end) for start, end, inside in self.outline.spans(a, b) if inside != self.keep_in]
        # No part in the breach: the way only touches the border, somewhere.
        points = [_at(a, b, share) for start, end in bad or [(0.0, 1.0)] for share in _shares(start, end)]
        if not bad:
            points.sort(key=lambda p: self.outline.border_m(p.east_m, p.north_m), reverse=True)
            return Offence(self.name, points[-1], 0.0)
        deepest = max(points, key=self.depth_m)
        return Offence(self.name, deepest, self.depth_m(deepest))


def _at(a: Point, b: Point, share: float) -> Place:
    return Place(a.east_m + share * (b.east_m - a.east_m), a.north_m + share * (b.north_m - a.north_m))


def _shares(start: float, end: float) -> list[float]:
    return [start + k / SAMPLES * (end - start) for k in range(SAMPLES + 1)]
