"""The ways agents went, thinned as they go: a point is dropped when it is within about 1 m of the line through its neighbours.

Bounded: at most `POINTS` points an agent; beyond that the older half loses every second one, then its oldest pieces.
"""

import math
from typing import Final

from msgspec import Struct, field

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Position
from formiga_bt.base.machines import Mobility
from formiga_bt.show.facts import Point, Track

NEAR_M: Final = 1.0
STILL_M: Final = 0.5
"""So near to the newest point it stands still."""
REST_US: Final[Micros] = 5 * SECOND
"""What stood for longer has a point when it came and one when it left."""
WAITING: Final = 16
"""So many points may wait for the line that is drawn through them."""
POINTS: Final = 5000

Fix = tuple[Micros, float, float, float]
"""When, and metres east, north, up."""


class TrackPiece(Struct):
    """The way of an agent while it worked for one task, or for none ("")."""

    task: str
    fixes: list[Fix] = field(default_factory=list)


class AgentTrack:
    """The way of one agent."""

    def __init__(self, agent: str, agent_type: str, *, mobility: Mobility, points: int = POINTS) -> None:
        self.agent, self.type, self.mobility = agent, agent_type, mobility
        self.pieces: list[TrackPiece] = []
        self._points = points
        self._kept = 0
        self._waiting: list[Fix] = []
        """After the newest kept point; the last of them is where it is."""
        self._still: Micros = 0
        """When it was last told to be there."""

    def note(self, at: Micros, where: Position, task: str) -> None:
        """Take the agent's position at an instant."""
        fix = (at, where.east_m, where.north_m, where.up_m)
        if not self.pieces or self.pieces[-1].task != task:
            self._turn(at, task)
        kept, waiting = self.pieces[-1].fixes, self._waiting
        if not kept:
            self._keep(fix)
            return
        newest = waiting[-1] if waiting else kept[-1]
        if _gap(newest, fix) <= STILL_M:
            self._still = at
            return
        if self._still - newest[0] > REST_US:  # it stood: it left then, not when it came
            if waiting:
                self._keep(newest)
                waiting.clear()
            self._keep((self._still, *newest[1:]))
        if len(waiting) >= WAITING or any(_aside(kept[-1], fix, one) > NEAR_M for one in waiting):
            self._keep(waiting[-1])
            waiting.clear()
        waiting.append(fix)

    def stood(self, at: Micros) -> None:
        """Take that the agent is where it was."""
        self._still = at

    def adopt(self, other: "AgentTrack", task: str, until: Micros) -> None:
        """Take what another one has of the way for a task before an instant; this one began then."""
        found = []
        for piece in other.pieces:
            newest = other._waiting[-1:] if piece is other.pieces[-1] else ()
            fixes = [fix for fix in (*piece.fixes, *newest) if fix[0] < until]
            if piece.task == task and fixes:
                found.append(TrackPiece(task, fixes))
                self._kept += len(fixes)
        now = self.pieces[-1:]  # what waits belongs to it
        former = [*found, *self.pieces[:-1]]
        self.pieces = sorted(former, key=lambda one: one.fixes[0][0] if one.fixes else until) + now
        if self._kept > self._points:
            self._thin()

    def tracks(self, tasks: frozenset[str] | None = None) -> list[Track]:
        """Return the pieces for these tasks, or all."""
        found = []
        for piece in self.pieces:
            fixes = [*piece.fixes, *(self._waiting[-1:] if piece is self.pieces[-1] else ())]
            if fixes and (tasks is None or piece.task in tasks):
                times = tuple(fix[0] for fix in fixes)
                points = tuple(Point(round(e, 2), round(n, 2), round(u, 2)) for _, e, n, u in fixes)
                found.append(
                    Track(
                        agent=self.agent,
                        type=self.type,
                        task=piece.task,
                        mobility=self.mobility,
                        times=times,
                        points=points,
                    )
                )
        return found

    def _turn(self, at: Micros, task: str) -> None:
        """Begin the piece of another task where the one before it ended."""
        last = self._waiting[-1] if self._waiting else self.pieces[-1].fixes[-1] if self.pieces else None
        if self._waiting:
            self._keep(self._waiting[-1])
            self._waiting = []
        if self.pieces and len(self.pieces[-1].fixes) < 2:  # it did not move for that task
            self._kept -= len(self.pieces.pop().fixes)
        if self.pieces and self.pieces[-1].task == task:
            return
        self.pieces.append(TrackPiece(task))
        if last is not None:
            self._keep((at, *last[1:]))

    def _keep(self, fix: Fix) -> None:
        self.pieces[-1].fixes.append(fix)
        self._kept += 1
        if self._kept > self._points:
            self._thin()

    def _thin(self) -> None:
        half, seen = self._kept // 2, 0
        for piece in self.pieces:
            if seen >= half:
                break
            seen += len(piece.fixes)
            piece.fixes = [*piece.fixes[:-1:2], piece.fixes[-1]]
        self._kept = sum(len(piece.fixes) for piece in self.pieces)
        while self._kept > self._points * 3 // 4 and len(self.pieces) > 1:
            self._kept -= len(self.pieces.pop(0).fixes)


def _gap(a: Fix, b: Fix) -> float:
    return math.sqrt((a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2 + (a[3] - b[3]) ** 2)


def _aside(a: Fix, b: Fix, p: Fix) -> float:
    """Return how far `p` is from the straight way from `a` to `b`."""
    dx, dy, dz = b[1] - a[1], b[2] - a[2], b[3] - a[3]
    px, py, pz = p[1] - a[1], p[2] - a[2], p[3] - a[3]
    square = dx * dx + dy * dy + dz * dz
    along = (px * dx + py * dy + pz * dz) / square if square else 0.0
    along = 0.0 if along < 0.0 else min(along, 1.0)
    return math.sqrt((px - along * dx) ** 2 + (py - along * dy) ** 2 + (pz - along * dz) ** 2)
