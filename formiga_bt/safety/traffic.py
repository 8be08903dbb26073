"""Traffic: the ways and areas that machines take up in the air, and how near others come to them.

A machine takes up the rest of its granted way, its hover, the column of its next climb, or, while it explores, a whole area
at one height. The gate lets a way go only when it stays the separation away from what machines of other tasks take up.
Pure geometry; `formiga_bt.safety.gate` decides, the engine keeps a `Traffic` for each machine.
"""

import math
from collections.abc import Iterable, Sequence

from msgspec import Struct

from formiga_bt.base.geo import Place, Position, horizontal_m, segment_distance_m
from formiga_bt.safety.grid import Box, box_of, grown
from formiga_bt.transport.messages import Landed

GROUND_M = 0.5
"""A leg that ends at most so high ends on the ground."""

VERTICAL_M = 10.0
"""A leg that stays within this (horizontally) is a vertical move at its place."""

LEVEL_M = 0.1
"""Ends closer than this are one point for the sweep of an area."""

Way = tuple[Position, Position]
"""A straight way; both ends equal = a hover."""


class TakenArea(Struct, frozen=True):
    """A convex area at one height, taken up as a whole: counter-clockwise corners, metres over the base's ground."""

    corners: tuple[Place, ...]
    up_m: float


class Traffic(Struct, frozen=True, gc=False):
    """Another machine: where it is, and what it takes up. Made by `traffic_of`."""

    agent: str
    task: str
    landed: Landed
    position: Position | None
    ways: tuple[Way, ...]
    """Where it is or will be: its leg, its hover, the ways into its area."""
    area: TakenArea | None
    spots: tuple[Place, ...]
    """Where it stands, or will stand on the ground."""
    box: Box
    """Bounds of the ways and the area."""
    low_m: float
    high_m: float
    """Heights between which they lie."""
    column: Way | None = None
    """Its next climb from the ground: one may fly through it, but not stop in it, else both may wait for ever."""
    order: int = 0
    """Of its admission: who is named first of several in the way."""
    on_routes: bool = False
    """It is on the site's routes, whose nodes and edges keep it apart from all others on them."""
    avoids: bool = False
    """It keeps away from obstacles by itself."""

    @property
    def reach(self) -> Box:
        """Return the bounds of all of it, spots included."""
        if not self.spots:
            return self.box
        points = [(spot.east_m, spot.north_m) for spot in self.spots]
        if self.box[0] <= self.box[1]:
            points += [(self.box[0], self.box[2]), (self.box[1], self.box[3])]
        return box_of(points)


def traffic_of(
    agent: str,
    task: str,
    landed: Landed,
    position: Position | None,
    leg: Way | None = None,
    rises_to_m: float | None = None,
    area: TakenArea | None = None,
    order: int = 0,
    spot: Place | None = None,
    also: Way | None = None,
    *,
    on_routes: bool = False,
    avoids: bool = False,
) -> Traffic:
    """Return a machine as traffic.

    Args:
        agent: who.
        task: for which task.
        landed: as last known.
        position: as last known.
        leg: the way that was granted to it.
        rises_to_m: where it will climb to from the ground for its task, metres over the base's ground.
        area: what it explores.
        order: of its admission.
        spot: where it waits to land.
        also: another way that it may be on.
        on_routes: it is on the site's routes.
        avoids: it keeps away from obstacles by itself.
    """
    ways: list[Way] = []
    spots: list[Place] = [] if spot is None else [spot]
    column: Way | None = None
    if position is not None:
        end = leg[1] if leg is not None else position
        if leg is not None or landed != "grounded":
            ways += path((position, end))
        if also is not None:
            ways += path((position, also[1]))
        if area is not None:
            ways += ways_into(position, area)
        if rises_to_m is not None:
            column = end, Position(end.east_m, end.north_m, rises_to_m)
        if landed != "airborne":
            spots.append(position.ground)
    if leg is not None and leg[1].up_m <= GROUND_M:
        spots.append(leg[1].ground)
    if also is not None and also[1].up_m <= GROUND_M:
        spots.append(also[1].ground)
    around = bounds(ways if column is None else [*ways, column], area)
    return Traffic(
        agent, task, landed, position, tuple(ways), area, tuple(spots), *around, column, order, on_routes, avoids
    )


def bounds(ways: Iterable[Way], area: TakenArea | None = None) -> tuple[Box, float, float]:
    """Return the horizontal bounds, lowest and highest height of ways and an area; of none, bounds that meet nothing."""
    if area is None and isinstance(ways, Sequence) and len(ways) == 1:  # nearly all of them
        a, b = ways[0]
        west, east = (a.east_m, b.east_m) if a.east_m <= b.east_m else (b.east_m, a.east_m)
        south, north = (a.north_m, b.north_m) if a.north_m <= b.north_m else (b.north_m, a.north_m)
        low, high = (a.up_m, b.up_m) if a.up_m <= b.up_m else (b.up_m, a.up_m)
        return (west, east, south, north), low, high
    points = [(point.east_m, point.north_m, point.up_m) for way in ways for point in way]
    if area is not None:
        points += [(corner.east_m, corner.north_m, area.up_m) for corner in area.corners]
    if not points:
        return box_of([]), math.inf, -math.inf
    easts, norths, ups = [p[0] for p in points], [p[1] for p in points], [p[2] for p in points]
    return (min(easts), max(easts), min(norths), max(norths)), min(ups), max(ups)


def path(leg: Way) -> tuple[Way, ...]:
    """Return the straight ways that a leg is flown in: one that ends on the ground goes across first, then straight down."""
    start, end = leg
    if end.up_m > GROUND_M or horizontal_m(start, end) <= LEVEL_M:
        return (leg,)
    above = Position(end.east_m, end.north_m, start.up_m)
    return (start, above), (above, end)


def is_vertical(leg: Way) -> bool:
    """Return whether a leg is a vertical move at its place."""
    return horizontal_m(leg[0], leg[1]) <= VERTICAL_M


def first_in_the_way(
    agent: str,
    task: str,
    ways: Sequence[Way],
    area: TakenArea | None,
    traffic: Sequence[Traffic],
    separation_m: float,
    *,
    climbs_on: bool = False,
    leaves: bool = False,
) -> str:
    """Return the machine that takes up something within the separation of `ways` and `area`, or "".

    Machines of the same task are the author's business, those on the ground are no traffic. A take-off or landing straight up
    or down keeps half the separation: ports and spots may lie closer together than legs may pass. Where it ends in the air it
    stays, and there it keeps all of it. `climbs_on`: what is left of a take-off that was broken off in the air counts as one.
    `leaves`: who is nearer to another than that already may go a way that leads only away from it, and ends clear of it.
    """
    keep_m = separation_m
    stays: tuple[Way, ...] = ()
    if area is None and ways and is_vertical((ways[0][0], ways[-1][1])):
        end = ways[-1][1]
        if climbs_on or end.up_m <= GROUND_M or ways[0][0].up_m <= GROUND_M:
            keep_m = separation_m / 2
            stays = ((end, end),) if end.up_m > GROUND_M else ()
    box, low, high = bounds(ways, area)
    west, east, south, north = grown(box, separation_m)
    low, high = low - separation_m, high + separation_m
    for other in traffic:
        if other.low_m >= high or other.high_m <= low:
            continue
        its = other.box
        if its[1] < west or its[0] > east or its[3] < south or its[2] > north:
            continue
        if other.agent == agent or (other.task and other.task == task):
            continue
        if _too_near(ways, area, other, keep_m) or (stays and _too_near(stays, None, other, separation_m)):
            if leaves and area is None and not stays and _leads_away(ways, other, keep_m):
                continue
            return other.agent
    return ""


def _leads_away(ways: Sequence[Way], other: Traffic, keep_m: float) -> bool:
    """Return whether ways that begin too near to a machine come no nearer to what it takes up, and end clear of it.

    Machines of one task may fly as near to each other as they like; once they are no longer of one task (one was lost, or each
    is ordered home) neither could go, if the separation that they have not were asked of them. Who stops in a column of a next
    climb already may stop elsewhere in it, no nearer: it is waited for here as there, and from there its way may be free.
    """
    if other.area is not None:
        return False
    start, end = ways[0][0], ways[-1][1]
    if other.column is not None:
        now_m, then_m = (segment_distance_m(at, at, *other.column) for at in (start, end))
        if then_m < keep_m and (now_m >= keep_m or then_m < now_m - LEVEL_M):
            return False
    for theirs in other.ways:
        now_m = segment_distance_m(start, start, *theirs)
        least_m = min(segment_distance_m(a, b, *theirs) for a, b in ways)
        if least_m >= keep_m:
            continue
        if now_m >= keep_m or least_m < now_m - LEVEL_M or segment_distance_m(end, end, *theirs) < keep_m:
            return False
    return True


def _too_near(ways: Sequence[Way], area: TakenArea | None, other: Traffic, keep_m: float) -> bool:
    for theirs in other.ways:
        for a, b in ways:
            if segment_distance_m(a, b, theirs[0], theirs[1]) < keep_m:
                return True
        if area is not None and way_area_m(theirs, area) < keep_m:
            return True
    if other.column is not None:
        end = ways[-1][1] if ways else None
        if end is not None and end.up_m > GROUND_M and segment_distance_m(end, end, *other.column) < keep_m:
            return True
        if area is not None and way_area_m(other.column, area) < keep_m:
            return True
    if other.area is None:
        return False
    if any(way_area_m(way, other.area) < keep_m for way in ways):
        return True
    return area is not None and areas_m(area, other.area) < keep_m


# -- areas -----------------------------------------------------------------------------------------------------------


def area_of(corners: Sequence[Place], up_m: float, here: Position | None) -> TakenArea:
    """Return what a machine takes up that explores a region from `here`.

    It is the hull of the region, as tracks over a concave one may leave it, and of the way into it at that height.
    """
    points = [*corners]
    if here is not None and abs(here.up_m - up_m) <= VERTICAL_M:
        points.append(here.ground)
    return TakenArea(hull(points), up_m)


def ways_into(here: Position, area: TakenArea) -> tuple[Way, ...]:
    """Return the straight ways from a point to each corner of an area; none from inside it."""
    if abs(here.up_m - area.up_m) <= LEVEL_M and is_inside(here.east_m, here.north_m, area.corners):
        return ()
    entries = [Position(corner.east_m, corner.north_m, area.up_m) for corner in area.corners]
    return tuple((here, entry) for entry in entries if _apart(here, entry))


def _apart(a: Position, b: Position) -> bool:
    return horizontal_m(a, b) > LEVEL_M or abs(a.up_m - b.up_m) > LEVEL_M


def way_area_m(way: Way, area: TakenArea) -> float:
    """Return the least distance in metres between a straight way and a horizontal area.

    Over the inside of the area the distance is linear in height, so that it is least at an end of the way, where the way
    passes the height of the area, or at an edge.
    """
    start, end = way
    for point in way:
        if point.up_m == area.up_m and is_inside(point.east_m, point.north_m, area.corners):
            return 0.0
    above, below = start.up_m - area.up_m, end.up_m - area.up_m
    if above * below < 0.0:
        share = above / (above - below)
        east = start.east_m + share * (end.east_m - start.east_m)
        north = start.north_m + share * (end.north_m - start.north_m)
        if is_inside(east, north, area.corners):
            return 0.0
    least = math.inf
    for point in way:
        if is_inside(point.east_m, point.north_m, area.corners):
            least = min(least, abs(point.up_m - area.up_m))
    corners = [Position(corner.east_m, corner.north_m, area.up_m) for corner in area.corners]
    for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
        least = min(least, segment_distance_m(start, end, a, b))
    return least


def areas_m(a: TakenArea, b: TakenArea) -> float:
    """Return the least distance in metres between two horizontal areas."""
    inner = b.corners[0]
    if is_inside(inner.east_m, inner.north_m, a.corners):
        return abs(a.up_m - b.up_m)
    corners = [Position(corner.east_m, corner.north_m, a.up_m) for corner in a.corners]
    edges = zip(corners, (*corners[1:], corners[0]), strict=True)
    return min(way_area_m(edge, b) for edge in edges)


def is_inside(east_m: float, north_m: float, corners: Sequence[Place]) -> bool:
    """Return whether a point lies in, or on the edge of, a convex polygon with counter-clockwise corners."""
    for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
        if (b.east_m - a.east_m) * (north_m - a.north_m) < (b.north_m - a.north_m) * (east_m - a.east_m):
            return False
    return len(corners) > 2


def hull(points: Iterable[Place]) -> tuple[Place, ...]:
    """Return the convex hull, counter-clockwise from the westmost point (A. M. Andrew, 1979)."""
    ordered = sorted({(p.east_m, p.north_m) for p in points})
    if len(ordered) < 3:
        return tuple(Place(*p) for p in ordered)
    chains = []
    for run in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for p in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0.0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return tuple(Place(*p) for p in chains)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
