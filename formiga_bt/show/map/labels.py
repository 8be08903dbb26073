"""Free places for labels: each takes the first of its candidates that meets no label, mark or way already there."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Final

from msgspec import Struct

DISTANCES: Final = (4.0, 9.0, 15.0, 24.0, 36.0)
_WAYS: Final = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))


class Rect(Struct, frozen=True):
    """A rectangle of the picture, in pixels or columns."""

    left: float
    low: float
    right: float
    high: float

    def meets(self, other: "Rect") -> bool:
        """Return whether they overlap."""
        return self.left < other.right and other.left < self.right and self.low < other.high and other.low < self.high

    def is_inside(self, other: "Rect") -> bool:
        """Return whether it lies in another."""
        return (
            other.left <= self.left and self.right <= other.right and other.low <= self.low and self.high <= other.high
        )


class TakenSpace:
    """What is taken in a picture. Lines weigh less than labels: a label may cross one if there is no better place.

    Args:
        frame: labels stay inside.
    """

    def __init__(self, frame: Rect) -> None:
        self.frame = frame
        self._hard: list[Rect] = []
        self._soft: list[tuple[float, float]] = []

    def take(self, rect: Rect) -> None:
        """Let no label come over a rectangle."""
        self._hard.append(rect)

    def avoid(self, points: Iterable[tuple[float, float]]) -> None:
        """Let labels rather not cover points: those of lines."""
        self._soft += points

    def place(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        *,
        must: bool = False,
        around: float = 0.0,
        on: bool = False,
    ) -> tuple[Rect, float] | None:
        """Take a place for a label near a point.

        Args:
            x: of the point.
            y: of the point.
            width: of the label.
            height: of the label.
            must: take a place that crosses lines rather than none.
            around: the size of the mark at the point.
            on: rather take the point itself.

        Returns:
            The place and how far from the point it is, or None: there is no free one.
        """
        best: tuple[int, Rect, float] | None = None
        centred = [(0.0, Rect(x - width / 2, y - height / 2, x + width / 2, y + height / 2))] if on else []
        for distance, rect in (*centred, *_candidates(x, y, width, height, around)):
            if not rect.is_inside(self.frame) or any(rect.meets(taken) for taken in self._hard):
                continue
            crossed = sum(rect.left <= px <= rect.right and rect.low <= py <= rect.high for px, py in self._soft)
            if best is None or crossed < best[0]:
                best = crossed, rect, distance
            if not crossed:
                break
        if best is None or (best[0] and not must):
            return None
        self._hard.append(best[1])
        return best[1], best[2]


def _candidates(x: float, y: float, width: float, height: float, around: float) -> Iterator[tuple[float, Rect]]:
    for distance in DISTANCES:
        off = distance + around
        for east, north in _WAYS:
            slant = 0.75 if east and north else 1.0
            left = x + east * off * slant - (width / 2 if not east else 0.0 if east > 0 else width)
            low = y + north * off * slant - (height / 2 if not north else 0.0 if north > 0 else height)
            yield distance, Rect(left, low, left + width, low + height)


def along(points: Sequence[tuple[float, float]], step: float) -> Iterator[tuple[float, float]]:
    """Yield points of a broken line, at most `step` apart; at most 20000 of them."""
    count = 0
    for (ax, ay), (bx, by) in pairwise(points):
        parts = max(1, int(max(abs(bx - ax), abs(by - ay)) / step))
        for i in range(parts):
            if count >= 20_000:
                return
            yield ax + (bx - ax) * i / parts, ay + (by - ay) * i / parts
            count += 1
    yield from points[-1:]
