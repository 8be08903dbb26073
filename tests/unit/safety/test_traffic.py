"""Ways and areas (safety: keeping apart): exact distances, and who is named as in the way."""

import math
import random

import pytest

from formiga_bt.base.geo import Place, Position, segment_distance_m
from formiga_bt.safety.traffic import (
    TakenArea,
    Traffic,
    area_of,
    areas_m,
    first_in_the_way,
    hull,
    path,
    traffic_of,
    way_area_m,
    ways_into,
)

SQUARE = TakenArea((Place(0.0, 0.0), Place(100.0, 0.0), Place(100.0, 100.0), Place(0.0, 100.0)), 60.0)


def at(east: float, north: float, up: float = 60.0) -> Position:
    return Position(east, north, up)


@pytest.mark.parametrize(
    ("way", "metres"),
    [
        ((at(50, 50), at(50, 50)), 0.0),  # hovers within
        ((at(50, 50, 75), at(50, 50, 75)), 15.0),  # hovers above
        ((at(50, 50, 40), at(50, 50, 90)), 0.0),  # climbs through
        ((at(-50, 50, 40), at(150, 50, 70)), 0.0),  # passes its height inside
        ((at(-10, 50), at(-40, 50)), 10.0),  # beside
        ((at(-30, 50, 100), at(-30, 50, 20)), 30.0),  # passes its height outside
        ((at(-50, 50, 80), at(150, 50, 80)), 20.0),  # straight over it, both ends outside
        ((at(-3, -4), at(-3, -40)), 5.0),  # at a corner
        ((at(-50, -20, 60), at(150, -20, 60)), 20.0),  # along it
    ],
)
def test_the_distance_of_a_way_from_an_area(way: tuple[Position, Position], metres: float) -> None:
    assert way_area_m(way, SQUARE) == pytest.approx(metres, abs=1e-9)
    assert way_area_m((way[1], way[0]), SQUARE) == pytest.approx(metres, abs=1e-9)


def test_the_distance_is_what_sampling_finds() -> None:
    dice = random.Random(7)

    def nearest(point: Position) -> float:
        east, north = min(100.0, max(0.0, point.east_m)), min(100.0, max(0.0, point.north_m))
        return math.dist((point.east_m, point.north_m, point.up_m), (east, north, 60.0))

    for _ in range(200):
        a, b = (at(dice.uniform(-150, 250), dice.uniform(-150, 250), dice.uniform(0, 120)) for _ in range(2))
        samples = (
            at(*(x + (y - x) * i / 2000 for x, y in zip(_numbers(a), _numbers(b), strict=True))) for i in range(2001)
        )
        assert way_area_m((a, b), SQUARE) == pytest.approx(min(nearest(p) for p in samples), abs=0.3)


def _numbers(point: Position) -> tuple[float, float, float]:
    return point.east_m, point.north_m, point.up_m


@pytest.mark.parametrize(
    ("other", "metres"),
    [
        (TakenArea(hull([Place(120, 0), Place(200, 0), Place(200, 50)]), 60.0), 20.0),
        (TakenArea(hull([Place(40, 40), Place(60, 40), Place(50, 60)]), 85.0), 25.0),  # all of it within, above
        (TakenArea(hull([Place(-900, -900), Place(900, -900), Place(0, 900)]), 70.0), 10.0),  # all around it
    ],
)
def test_the_distance_of_two_areas(other: TakenArea, metres: float) -> None:
    assert areas_m(SQUARE, other) == pytest.approx(metres)
    assert areas_m(other, SQUARE) == pytest.approx(metres)


def test_the_hull_takes_in_what_tracks_over_a_concave_region_cross() -> None:
    notch = [Place(0, 0), Place(100, 0), Place(100, 100), Place(50, 10), Place(0, 100)]

    assert hull(notch) == (Place(0, 0), Place(100, 0), Place(100, 100), Place(0, 100))
    assert hull([Place(1, 1), Place(2, 2), Place(3, 3)]) == (Place(1, 1), Place(3, 3))
    assert hull([Place(1, 1)]) == (Place(1, 1),)


def test_who_explores_from_outside_takes_up_the_way_in_too() -> None:
    area = area_of(SQUARE.corners, 60.0, at(-100, 50))

    assert Place(-100, 50) in area.corners
    assert way_area_m((at(-50, 50), at(-50, 50)), area) == 0.0
    assert area_of(SQUARE.corners, 60.0, at(-100, 50, 90)) == SQUARE


def test_the_ways_into_an_area_from_another_height_end_at_its_corners() -> None:
    assert [way[1] for way in ways_into(at(50, 50, 90), SQUARE)] == [at(p.east_m, p.north_m) for p in SQUARE.corners]
    assert ways_into(at(50, 50), SQUARE) == ()


def test_a_landing_goes_across_first_and_then_straight_down() -> None:
    assert path((at(0, 0), at(8, 0, 0.0))) == ((at(0, 0), at(8, 0)), (at(8, 0), at(8, 0, 0.0)))
    assert path((at(0, 0), at(0, 0, 0.0))) == ((at(0, 0), at(0, 0, 0.0)),)
    assert path((at(0, 0), at(8, 0, 30.0))) == ((at(0, 0), at(8, 0, 30.0)),)


# -- who is in the way ---------------------------------------------------------------------------------------------------


def explorer(**fields: object) -> Traffic:
    given: dict[str, object] = {"position": at(50, 50), "area": SQUARE, "order": 1}
    return traffic_of("d2", "T-2", "airborne", **{**given, **fields})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("way", "waits"),
    [
        ((at(-200, 50, 60), at(300, 50, 60)), True),
        ((at(-200, 50, 74), at(300, 50, 74)), True),
        ((at(-200, 50, 75), at(300, 50, 75)), False),
        ((at(-200, -14, 60), at(300, -14, 60)), True),
        ((at(-200, -15, 60), at(300, -15, 60)), False),
    ],
)
def test_nobody_crosses_an_area_that_is_explored(way: tuple[Position, Position], waits: bool) -> None:
    assert first_in_the_way("d1", "T-1", (way,), None, [explorer()], 15.0) == ("d2" if waits else "")


def test_an_explorer_waits_for_who_is_in_its_area_or_on_a_way_into_it() -> None:
    here = at(-200, 50, 90)
    ways = ways_into(here, SQUARE)
    within = traffic_of("d2", "T-2", "airborne", at(70, 70))
    on_the_way = traffic_of("d3", "T-3", "airborne", at(-100, 25, 75))

    assert first_in_the_way("d1", "T-1", ways, SQUARE, [within], 15.0) == "d2"
    assert first_in_the_way("d1", "T-1", ways, SQUARE, [on_the_way], 15.0) == "d3"
    assert first_in_the_way("d1", "T-1", ways, SQUARE, [explorer(area=None, position=at(50, 50, 75))], 15.0) == ""
    assert first_in_the_way("d1", "T-1", ways, SQUARE, [explorer(position=at(50, 50))], 15.0) == "d2"


def test_two_explorers_of_one_task_are_the_authors_business() -> None:
    assert first_in_the_way("d1", "T-2", (), SQUARE, [explorer()], 15.0) == ""


def test_a_machine_that_waits_to_land_keeps_its_spot() -> None:
    waiting = traffic_of("d2", "T-2", "airborne", at(0, 0), spot=Place(0.0, 0.0))

    assert waiting.spots == (Place(0.0, 0.0),)
    assert waiting.reach == (0.0, 0.0, 0.0, 0.0)


def test_distances_are_those_of_segments() -> None:
    a, b = (at(0, 0), at(100, 0)), (at(50, 20), at(50, 90, 80))
    assert first_in_the_way("d1", "T-1", (a,), None, [traffic_of("d2", "T-2", "airborne", b[0], b)], 20.0) == ""
    assert segment_distance_m(*a, *b) == 20.0


@pytest.mark.parametrize(
    ("way", "in_the_way"),
    [
        ((at(0, 0, 20), at(0, 0, 60)), ""),  # straight up, from beside it
        ((at(0, 0, 20), at(-40, 0, 20)), ""),  # away at its height
        ((at(0, 0, 20), at(0, 0, 25)), "b"),  # does not end clear of it
        ((at(0, 0, 20), at(40, 0, 20)), "b"),  # past it
        ((at(0, 0, 20), at(8, 0, 40)), "b"),  # comes nearer first
        ((at(-20, 0, 20), at(0, 0, 30)), "b"),  # was clear of it, and would not stay so
    ],
)
def test_who_is_too_near_already_may_leave(way: tuple[Position, Position], in_the_way: str) -> None:
    beside = traffic_of("b", "", "airborne", at(10, 0, 20))

    assert first_in_the_way("a", "Return-1", [way], None, [beside], 15.0, leaves=True) == in_the_way
    assert first_in_the_way("a", "Return-1", [way], None, [beside], 15.0) == "b"


@pytest.mark.parametrize(
    ("way", "in_the_way"),
    [
        ((at(0, 0, 40), at(0, 0, 75)), ""),  # it would stop in the column as it does now
        ((at(0, 0, 40), at(6, 0, 75)), "b"),  # nearer to it
        ((at(-20, 0, 40), at(0, 0, 75)), "b"),  # it does not stop in it yet
    ],
)
def test_who_hovers_in_the_column_of_a_next_climb_may_climb_in_it(
    way: tuple[Position, Position], in_the_way: str
) -> None:
    below = traffic_of("b", "Start-1", "grounded", at(10, 0, 0), rises_to_m=90.0)

    assert first_in_the_way("a", "Home-1", [way], None, [below], 15.0, leaves=True) == in_the_way


def test_who_leaves_keeps_clear_of_all_others() -> None:
    beside, above = traffic_of("b", "", "airborne", at(10, 0, 20)), traffic_of("c", "", "airborne", at(0, 0, 55))

    assert first_in_the_way("a", "", [(at(0, 0, 20), at(0, 0, 60))], None, [beside, above], 15.0, leaves=True) == "c"
