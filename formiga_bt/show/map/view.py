"""Which part of a site a map shows, and of a track: where it turns, how high it is there.

A fence of a kilometre makes dots of flights over fifty metres. So a map shows what happened, with the base and the places near
by, unless the whole site is asked for; what lies outside is told in words.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.machines import Mobility
from formiga_bt.show.facts import Chart, MapLane, MapMark, MapShape, Point, Track

LEAST_M: Final = 20.0
"""A map is at least so wide."""
MARGIN: Final = 1.2
EDGE: Final = 0.015
TURN_DEG: Final = 12.0
NEAR_M: Final = 2.0
STILL_M: Final = 0.5
CLIMB_M: Final = 5.0
AGENTS: Final = 40
"""So many agents can be told apart on one map."""


class MapArea(Struct, frozen=True):
    """A rectangle of ground, metres."""

    west: float
    east: float
    south: float
    north: float

    @property
    def width(self) -> float:
        """Return its extent from west to east."""
        return self.east - self.west

    @property
    def height(self) -> float:
        """Return its extent from south to north."""
        return self.north - self.south

    def holds(self, point: Point) -> bool:
        """Return whether a point is in it, with room for its mark."""
        edge_x, edge_y = self.width * EDGE, self.height * EDGE
        in_width = self.west + edge_x <= point.east_m <= self.east - edge_x
        return in_width and self.south + edge_y <= point.north_m <= self.north - edge_y

    def cuts(self, shape: MapShape) -> bool:
        """Return whether some of an area's border or inside may be seen."""
        return self.crossed(shape.corners)

    def crossed(self, points: Sequence[Point]) -> bool:
        """Return whether the bounds of some points reach into the view."""
        easts, norths = [c.east_m for c in points], [c.north_m for c in points]
        if not easts or max(easts) < self.west or min(easts) > self.east:
            return False
        return not (max(norths) < self.south or min(norths) > self.north)


class AgentWalk(Struct, frozen=True):
    """All pieces of the way of one agent."""

    agent: str
    type: str
    mobility: Mobility
    tasks: tuple[str, ...]
    pieces: tuple[Track, ...]

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        return self.mobility == "people"

    @property
    def points(self) -> list[Point]:
        """Return the points of all pieces."""
        return [point for piece in self.pieces for point in piece.points]

    @property
    def end(self) -> Point:
        """Return where it is at last."""
        return self.pieces[-1].points[-1]

    @property
    def length_m(self) -> float:
        """Return how long the way was over ground."""
        return sum(
            math.hypot(b.east_m - a.east_m, b.north_m - a.north_m)
            for piece in self.pieces
            for a, b in pairwise(piece.points)
        )

    @property
    def stands(self) -> bool:
        """Return whether it stayed over one place."""
        return self.length_m < STILL_M

    @property
    def span(self) -> tuple[Micros, Micros] | None:
        """Return from when until when, if it is known."""
        times = [at for piece in self.pieces for at in piece.times]
        return (min(times), max(times)) if len(times) > 1 else None


class MapScene(Struct, frozen=True, kw_only=True):
    """What is drawn."""

    view: MapArea
    marks: tuple[MapMark, ...]
    shapes: tuple[MapShape, ...]
    walks: tuple[AgentWalk, ...]
    lanes: tuple[MapLane, ...] = ()
    outside: tuple[str, ...] = ()
    """Names of what is not in view."""
    notes: tuple[str, ...] = ()


def scene_of(chart: Chart, *, whole: bool = False, ratio: tuple[float, float] = (1.0, 1.0)) -> MapScene:
    """Return what a map shows.

    Args:
        chart: the site and the ways.
        whole: show everything that the site has.
        ratio: height by width of the picture, at least and at most; the view is widened to it.
    """
    walks = _walks(chart.tracks)
    shown = walks[:AGENTS]
    inner = [point for walk in shown for point in walk.points]
    marks = tuple(mark for mark in chart.marks if _is_finite(mark.at))
    shapes = tuple(s for s in chart.shapes if len(s.corners) > 1 and all(_is_finite(c) for c in s.corners))
    lanes = tuple(lane for lane in chart.lanes if _is_finite(lane.start) and _is_finite(lane.end))
    if whole or not inner:
        points = [*inner, *(m.at for m in marks), *(c for s in shapes for c in s.corners)]
        points += [point for lane in lanes for point in (lane.start, lane.end)]
    else:
        points = [*inner, *(m.at for m in marks if m.kind == "base")]
    view = _around(points, ratio)
    seen = tuple(mark for mark in marks if view.holds(mark.at))
    seen = (*(mark for mark in seen if mark.kind != "event"), *_together(mark for mark in seen if mark.kind == "event"))
    areas = tuple(shape for shape in shapes if view.cuts(shape) and not _is_around(shape, view))
    outside = [m.name for m in marks if not view.holds(m.at) and m.kind in ("base", "port", "station", "park", "place")]
    outside += [shape.name for shape in shapes if shape not in areas]
    notes = []
    if len(walks) > len(shown):
        notes.append(f"{len(walks) - AGENTS} more agents are not drawn: name tasks to see theirs")
    if not all(_is_finite(point) for track in chart.tracks for point in track.points):
        notes.append("points that are no numbers are left out")
    if not walks:
        notes.append("nobody has moved yet")
    return MapScene(
        view=view,
        marks=seen,
        shapes=areas,
        walks=shown,
        outside=tuple(dict.fromkeys(outside)),
        notes=tuple(notes),
        lanes=tuple(lane for lane in lanes if view.crossed((lane.start, lane.end))),
    )


def outside_in_words(names: Iterable[str], option: str) -> str:
    """Return what is not in view, in words, or an empty text."""
    listed = list(names)
    if not listed:
        return ""
    more = f" and {len(listed) - 6} more" if len(listed) > 6 else ""
    return f"outside: {', '.join(listed[:6])}{more} ({option} shows all)"


def turns_of(piece: Track) -> list[int]:
    """Return the numbers of the points at which a way begins, ends, turns or changes between level, climb and descent."""
    points = piece.points
    found = [0]
    for i in range(1, len(points) - 1):
        a, b, c = points[found[-1]], points[i], points[i + 1]
        if _turn_deg(a, b, c) > TURN_DEG or _climbs(a, b) != _climbs(b, c):
            found.append(i)
    if len(points) > 1:
        found.append(len(points) - 1)
    return found


def _walks(tracks: Iterable[Track]) -> tuple[AgentWalk, ...]:
    """Put together what is of one agent; a piece that goes on where the one before it ended is no piece of its own."""
    by_agent: dict[str, list[Track]] = {}
    for track in map(_finite, tracks):
        if not track.points:
            continue
        pieces = by_agent.setdefault(track.agent, [])
        if pieces and pieces[-1].points[-1] == track.points[0]:
            last = pieces.pop()
            points, times = last.points + track.points[1:], last.times + track.times[1:]
            track = replace(track, points=points, times=times, task=f"{last.task}, {track.task}".strip(", "))
        pieces.append(track)
    return tuple(
        AgentWalk(agent, p[0].type, p[0].mobility, tuple(dict.fromkeys(t.task for t in p if t.task)), tuple(p))
        for agent, p in by_agent.items()
    )


def _together(events: Iterable[MapMark]) -> Iterable[MapMark]:
    """Make one mark of what happened at one place."""
    at_place: dict[tuple[int, int], list[MapMark]] = {}
    for mark in events:
        at_place.setdefault((round(mark.at.east_m / NEAR_M), round(mark.at.north_m / NEAR_M)), []).append(mark)
    for marks in at_place.values():
        names = list(dict.fromkeys(mark.name for mark in marks))
        yield MapMark(name=", ".join(names), kind="event", at=marks[0].at)


def _climbs(a: Point, b: Point) -> int:
    """Return 1 for a leg that mostly climbs, -1 for one that mostly sinks, else 0."""
    level = math.hypot(b.east_m - a.east_m, b.north_m - a.north_m)
    if abs(b.up_m - a.up_m) <= max(CLIMB_M, level):
        return 0
    return 1 if b.up_m > a.up_m else -1


def _turn_deg(a: Point, b: Point, c: Point) -> float:
    first = (b.east_m - a.east_m, b.north_m - a.north_m)
    then = (c.east_m - b.east_m, c.north_m - b.north_m)
    if math.hypot(*first) < 0.5 or math.hypot(*then) < 0.5:
        return 0.0
    turn = math.degrees(math.atan2(*then) - math.atan2(*first)) % 360.0
    return min(turn, 360.0 - turn)


def _around(points: list[Point], ratio: tuple[float, float]) -> MapArea:
    easts, norths = [p.east_m for p in points] or [0.0], [p.north_m for p in points] or [0.0]
    west, east, south, north = min(easts), max(easts), min(norths), max(norths)
    width, height = max((east - west) * MARGIN, LEAST_M), max((north - south) * MARGIN, LEAST_M * ratio[0])
    width = max(width, height / ratio[1])
    height = max(height, width * ratio[0])
    x, y = (west + east) / 2, (south + north) / 2
    return MapArea(x - width / 2, x + width / 2, y - height / 2, y + height / 2)


def _is_around(shape: MapShape, view: MapArea) -> bool:
    """Return whether an area's border is nowhere in view, so far as its bounds tell."""
    easts, norths = [c.east_m for c in shape.corners], [c.north_m for c in shape.corners]
    around = min(easts) < view.west and max(easts) > view.east and min(norths) < view.south and max(norths) > view.north
    return around and shape.kind == "fence" and len(shape.corners) == 4


def _is_finite(point: Point) -> bool:
    return math.isfinite(point.east_m) and math.isfinite(point.north_m) and math.isfinite(point.up_m)


def _finite(track: Track) -> Track:
    if all(_is_finite(point) for point in track.points) and len(track.times) == len(track.points):
        return track
    times = track.times if len(track.times) == len(track.points) else (0,) * len(track.points)
    kept = [(at, p) for at, p in zip(times, track.points, strict=True) if _is_finite(p)]
    return replace(track, times=tuple(at for at, _ in kept), points=tuple(p for _, p in kept))
