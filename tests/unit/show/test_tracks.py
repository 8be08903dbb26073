"""Ways are thinned as they come in: straight ones to their ends, corners kept, standing still costs nothing, never too long."""

import math
from itertools import pairwise

import pytest

from formiga_bt.clock import SECOND
from formiga_bt.geo import Position
from formiga_bt.show.facts import Point, Track
from formiga_bt.show.tracks import Way


def flown(points: list[tuple[float, float, float]], task: str = "T-1", limit: int = 5000) -> Way:
    way = Way("hwd_1", "hwd", human=False, points=limit)
    for n, (east, north, up) in enumerate(points):
        way.note(n * SECOND, Position(east, north, up), task)
    return way


def only(way: Way) -> Track:
    (track,) = way.tracks()
    return track


def test_a_straight_way_is_its_ends_and_a_corner_is_kept() -> None:
    east = [(float(n), 0.0, 60.0) for n in range(0, 200, 5)]
    north = [(195.0, float(n), 60.0) for n in range(5, 200, 5)]

    track = only(flown(east + north))

    assert track.points[0] == Point(0.0, 0.0, 60.0)
    assert track.points[-1] == Point(195.0, 195.0, 60.0)
    assert min(math.dist((p.east_m, p.north_m), (195.0, 0.0)) for p in track.points) == 0.0
    assert len(track.points) < 12
    assert list(track.times) == sorted(track.times)


@pytest.mark.parametrize("radius_m", [5.0, 40.0, 300.0])
def test_nothing_dropped_is_further_than_a_metre_from_what_is_kept(radius_m: float) -> None:
    circle = [(radius_m * math.cos(n / 40), radius_m * math.sin(n / 40), 60.0 + n / 50) for n in range(500)]
    track = only(flown(circle))

    assert len(track.points) < 250
    kept = [(p.east_m, p.north_m, p.up_m) for p in track.points]
    worst = max(min(_to_line(p, a, b) for a, b in pairwise(kept)) for p in circle)
    assert worst < 1.6  # 1 m, and 0.5 m of standing still


def _to_line(p: tuple[float, ...], a: tuple[float, ...], b: tuple[float, ...]) -> float:
    d = [y - x for x, y in zip(a, b, strict=True)]
    square = sum(x * x for x in d)
    along = sum((x - y) * z for x, y, z in zip(p, a, d, strict=True)) / square if square else 0.0
    along = min(1.0, max(0.0, along))
    return math.dist(p, [x + along * z for x, z in zip(a, d, strict=True)])


def test_standing_still_is_one_point() -> None:
    assert only(flown([(3.0, 4.0, 0.1 * (n % 3)) for n in range(1000)])).points == (Point(3.0, 4.0, 0.0),)


def test_each_task_has_its_piece_and_they_join() -> None:
    way = Way("hwd_1", "hwd", human=False)
    for n in range(30):
        way.note(n * SECOND, Position(n * 10.0, 0.0, 60.0), "" if n < 10 else "A-1" if n < 20 else "B-2")

    tracks = way.tracks()
    assert [track.task for track in tracks] == ["", "A-1", "B-2"]
    assert [a.points[-1] == b.points[0] for a, b in pairwise(tracks)] == [True, True]
    assert [track.task for track in way.tracks(frozenset({"A-1"}))] == ["A-1"]


def test_a_task_for_which_it_did_not_move_leaves_no_piece() -> None:
    way = Way("hwd_1", "hwd", human=False)
    for n, task in enumerate(["", "A-1", "", "B-2", "B-2", ""]):
        way.note(n * SECOND, Position(1.0 + 20.0 * (n > 3), 0.0, 0.0), task)

    assert [(track.task, len(track.points)) for track in way.tracks()] == [("B-2", 2), ("", 1)]


def test_a_long_way_loses_the_details_of_its_older_half() -> None:
    zigzag = [(float(n), 30.0 * (n % 2), 60.0) for n in range(20_000)]
    way = flown(zigzag, limit=1000)

    track = only(way)
    assert len(track.points) <= 1001
    assert track.points[0] == Point(0.0, 0.0, 60.0)
    newest = [(p.east_m, p.north_m, p.up_m) for p in track.points[-100:]]
    assert newest == zigzag[-100:]


def test_a_way_of_many_tasks_forgets_the_oldest() -> None:
    way = Way("hwd_1", "hwd", human=False, points=200)
    for n in range(5000):
        way.note(n * SECOND, Position(float(n % 7) * 20, 0.0, 60.0), f"T-{n // 3}")

    tracks = way.tracks()
    assert sum(len(track.points) for track in tracks) <= 202
    assert tracks[-1].task == "T-1666"
