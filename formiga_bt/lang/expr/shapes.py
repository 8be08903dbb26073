"""Geometry of points for task authors: circles, zigzags, triangles. Metres east, north and up; bearings from north.

Pure functions, results rounded to 1 mm. Registered as helpers in `helpers`; a shape of places is made of places, a
shape of positions of positions.
"""

import math
from typing import Final, TypeVar, cast

from formiga_bt.base.geo import Place, Position, distance_m, horizontal_m, mm
from formiga_bt.lang.model import Env, EvalError

Point = TypeVar("Point", bound=Place | Position)

MAX_POINTS: Final = 1000


def above(env: Env, place: Place, height_m: float) -> Position:
    """Return the position `height_m` over the ground at `place`."""
    return Position(place.east_m, place.north_m, mm(env.ground_up_m(place) + height_m))


def at_height(place: Place, height_m: float) -> Position:
    """Return the position over `place` at `height_m` over the ground at the base."""
    return Position(place.east_m, place.north_m, mm(height_m))


def ground(position: Position) -> Place:
    """Return the place straight below."""
    return position.ground


def moved(point: Point, east_m: float, north_m: float, up_m: float = 0.0) -> Point:
    """Return the point moved by metres; `up_m` is of no matter to a place."""
    if isinstance(point, Position):
        made = Position(mm(point.east_m + east_m), mm(point.north_m + north_m), mm(point.up_m + up_m))
        return cast(Point, made)
    return cast(Point, Place(mm(point.east_m + east_m), mm(point.north_m + north_m)))


def between(a: Point, b: Point) -> float:
    """Return the distance in metres: over ground for places, straight for positions."""
    if isinstance(a, Position) and isinstance(b, Position):
        return mm(distance_m(a, b))
    return mm(horizontal_m(a, b))


def toward(a: Point, b: Point, dist_m: float) -> Point:
    """Return the point `dist_m` from `a` on the line to `b` (and beyond it); `a` itself if both are one."""
    length = distance_m(a, b) if isinstance(a, Position) and isinstance(b, Position) else horizontal_m(a, b)
    if length < 0.001:
        return a
    return _part(a, b, dist_m / length)


def bearing(a: Place | Position, b: Place | Position) -> float:
    """Return the direction from `a` to `b`, degrees clockwise from north, 0 up to 360; 0 if one is over the other."""
    degrees = math.degrees(math.atan2(b.east_m - a.east_m, b.north_m - a.north_m))
    return round(degrees % 360.0, 6) % 360.0


def midpoint(a: Point, b: Point) -> Point:
    """Return the point half way."""
    return _part(a, b, 0.5)


def line(a: Point, b: Point, n: int) -> tuple[Point, ...]:
    """Return `n` points from `a` to `b` at equal steps, both ends included."""
    _count("line", "points", n, 2)
    points = [_part(a, b, i / (n - 1)) for i in range(n)]
    return (a, *points[1:-1], b)


def circle(center: Point, radius_m: float, points: int = 24, start_deg: float = 0.0) -> tuple[Point, ...]:
    """Return a closed circle, clockwise from bearing `start_deg`: `points` + 1 points, the last is the first."""
    _count("circle", "points", points, 3)
    ring = list(_ring(center, radius_m, points, start_deg))
    return (*ring, ring[0])


def polygon(center: Point, radius_m: float, sides: int) -> tuple[Point, ...]:
    """Return the corners of a regular polygon, clockwise from north (not closed)."""
    _count("polygon", "sides", sides, 3)
    return _ring(center, radius_m, sides, 0.0)


def triangle(corner: Point, leg_m: float, heading_deg: float = 0.0) -> tuple[Point, ...]:
    """Return three points, the right angle at `corner` first; one leg along `heading_deg`, one 90 deg to its right."""
    if not leg_m > 0:
        raise EvalError("triangle needs a leg above 0 m")
    return (corner, _polar(corner, leg_m, heading_deg), _polar(corner, leg_m, heading_deg + 90.0))


def zigzag(start: Point, end: Point, amplitude_m: float, legs: int) -> tuple[Point, ...]:
    """Return `legs` + 1 points from `start` exactly to `end`; the corners between lie `amplitude_m` left and right."""
    _count("zigzag", "legs", legs, 1)
    length = horizontal_m(start, end)
    if length < 0.001:
        raise EvalError("zigzag needs a start and an end that differ")
    across = ((end.north_m - start.north_m) / length, -(end.east_m - start.east_m) / length)
    points: list[Point] = [start]
    for i in range(1, legs):
        side = amplitude_m if i % 2 else -amplitude_m
        points.append(moved(_part(start, end, i / legs), across[0] * side, across[1] * side))
    points.append(end)
    return tuple(points)


def nearest(point: Point, others: tuple[Point, ...]) -> Point:
    """Return the one of `others` that is nearest to `point`; the first of equals."""
    if not others:
        raise EvalError("nearest of an empty list")
    return min(others, key=lambda other: between(point, other))


def _part(a: Point, b: Point, t: float) -> Point:
    up_m = (b.up_m - a.up_m) * t if isinstance(a, Position) and isinstance(b, Position) else 0.0
    return moved(a, (b.east_m - a.east_m) * t, (b.north_m - a.north_m) * t, up_m)


def _polar(center: Point, radius_m: float, bearing_deg: float) -> Point:
    turn = math.radians(bearing_deg)
    return moved(center, radius_m * math.sin(turn), radius_m * math.cos(turn))


def _ring(center: Point, radius_m: float, count: int, start_deg: float) -> tuple[Point, ...]:
    if not radius_m > 0:
        raise EvalError("the radius must be above 0 m")
    return tuple(_polar(center, radius_m, start_deg + 360.0 * i / count) for i in range(count))


def _count(helper: str, what: str, n: int, least: int) -> None:
    if not least <= n <= MAX_POINTS:
        raise EvalError(f"{helper} takes {least} to {MAX_POINTS} {what}, not {n}")
