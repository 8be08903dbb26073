"""The helpers as pure functions: geometry of points and regions, lists and numbers."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from formiga_bt.base.geo import Place, Position, Region, horizontal_m
from formiga_bt.lang.expr import region_shapes, shapes
from formiga_bt.lang.expr.helpers import REQUIRED, STANDARD
from formiga_bt.lang.model import EvalError
from tests.golden import Wording

metres = st.floats(-5000, 5000).map(lambda x: round(x, 3))
places = st.builds(Place, metres, metres)
positions = st.builds(Position, metres, metres, st.floats(0, 120).map(lambda x: round(x, 3)))
SQUARE = Region((Place(0.0, 0.0), Place(100.0, 0.0), Place(100.0, 100.0), Place(0.0, 100.0)))
HORSESHOE = Region(
    tuple(Place(x, y) for x, y in [(0.0, 0.0), (90.0, 0.0), (90.0, 60.0), (60.0, 60.0), (60.0, 20.0), (30.0, 20.0),
                                   (30.0, 60.0), (0.0, 60.0)])
)  # fmt: skip


class Hill:
    """The ground rises 1 m for each 10 m east."""

    def ground_up_m(self, place):
        return place.east_m / 10


def call(name, *args, form=0):
    helper = STANDARD.forms(name)[form]
    return helper.run(*args)


def test_above_follows_the_ground_and_at_height_does_not():
    assert shapes.above(Hill(), Place(50.0, 1.0), 60.0) == Position(50.0, 1.0, 65.0)
    assert shapes.at_height(Place(50.0, 1.0), 60.0) == Position(50.0, 1.0, 60.0)
    assert shapes.ground(Position(1.0, 2.0, 3.0)) == Place(1.0, 2.0)


def test_offset_keeps_the_kind_of_point():
    assert shapes.moved(Place(0.0, 0.0), 1.0, 2.0) == Place(1.0, 2.0)
    assert shapes.moved(Position(0.0, 0.0, 5.0), 1.0, 2.0, -3.0) == Position(1.0, 2.0, 2.0)


@pytest.mark.parametrize(
    ("to", "degrees"),
    [((0.0, 9.0), 0.0), ((9.0, 0.0), 90.0), ((0.0, -9.0), 180.0), ((-9.0, 0.0), 270.0), ((0.0, 0.0), 0.0)],
)
def test_bearing_is_clockwise_from_north(to, degrees):
    assert shapes.bearing(Place(0.0, 0.0), Place(*to)) == degrees


def test_toward_and_midpoint():
    assert shapes.toward(Place(0.0, 0.0), Place(0.0, 10.0), 4.0) == Place(0.0, 4.0)
    assert shapes.toward(Place(1.0, 1.0), Place(1.0, 1.0), 4.0) == Place(1.0, 1.0)
    assert shapes.toward(Position(0.0, 0.0, 0.0), Position(0.0, 3.0, 4.0), 5.0) == Position(0.0, 3.0, 4.0)
    assert shapes.midpoint(Position(0.0, 0.0, 10.0), Position(4.0, 0.0, 20.0)) == Position(2.0, 0.0, 15.0)


def test_distance_is_over_ground_for_places_and_straight_for_positions():
    assert shapes.between(Place(0.0, 0.0), Place(3.0, 4.0)) == 5.0
    assert shapes.between(Position(0.0, 0.0, 0.0), Position(2.0, 3.0, 6.0)) == 7.0


def test_line_has_both_ends():
    assert shapes.line(Place(0.0, 0.0), Place(9.0, 0.0), 4) == tuple(Place(x, 0.0) for x in (0.0, 3.0, 6.0, 9.0))


@given(places, st.floats(0.5, 500), st.integers(3, 72), st.floats(-360, 360))
def test_circle_is_closed_and_every_point_lies_at_the_radius(center, radius, points, start):
    ring = shapes.circle(center, radius, points, start)
    assert len(ring) == points + 1
    assert ring[0] == ring[-1]
    for point in ring:
        assert horizontal_m(center, point) == pytest.approx(radius, abs=0.002)


def test_circle_goes_clockwise_from_its_start():
    assert shapes.circle(Place(0.0, 0.0), 10.0, 4, 90.0)[:3] == (Place(10.0, 0.0), Place(0.0, -10.0), Place(-10.0, 0.0))
    assert shapes.circle(Position(0.0, 0.0, 7.0), 10.0, 4)[0] == Position(0.0, 10.0, 7.0)


def test_polygon_has_its_corners_once():
    assert shapes.polygon(Place(0.0, 0.0), 2.0, 4) == (
        Place(0.0, 2.0), Place(2.0, 0.0), Place(0.0, -2.0), Place(-2.0, 0.0),
    )  # fmt: skip


@given(places, st.floats(1, 500), st.floats(-360, 360))
def test_triangle_has_its_right_angle_first(corner, leg, heading):
    a, b, c = shapes.triangle(corner, leg, heading)
    assert a == corner
    assert horizontal_m(a, b) == pytest.approx(leg, abs=0.002)
    assert horizontal_m(a, c) == pytest.approx(leg, abs=0.002)
    assert horizontal_m(b, c) == pytest.approx(leg * math.sqrt(2), abs=0.004)


@given(positions, positions, st.floats(0, 50), st.integers(1, 40))
def test_zigzag_ends_exactly_at_its_end(start, end, amplitude, legs):
    assume(horizontal_m(start, end) > 0.01)
    path = shapes.zigzag(start, end, amplitude, legs)
    assert (path[0], path[-1], len(path)) == (start, end, legs + 1)


def test_zigzag_swings_left_and_right():
    path = shapes.zigzag(Place(0.0, 0.0), Place(0.0, 40.0), 5.0, 4)
    assert path == (Place(0.0, 0.0), Place(5.0, 10.0), Place(-5.0, 20.0), Place(5.0, 30.0), Place(0.0, 40.0))


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: shapes.circle(Place(0.0, 0.0), 0.0), "the radius must be above 0 m"),
        (lambda: shapes.circle(Place(0.0, 0.0), 5.0, 2), "circle takes 3 to 1000 points, not 2"),
        (lambda: shapes.line(Place(0.0, 0.0), Place(1.0, 0.0), 1), "line takes 2 to 1000 points, not 1"),
        (
            lambda: shapes.zigzag(Place(0.0, 0.0), Place(0.0, 0.0), 1.0, 2),
            "zigzag needs a start and an end that differ",
        ),
        (lambda: shapes.triangle(Place(0.0, 0.0), 0.0), "triangle needs a leg above 0 m"),
        (lambda: shapes.nearest(Place(0.0, 0.0), ()), "nearest of an empty list"),
        (lambda: region_shapes.split(SQUARE, 0), "split makes 1 to 100 parts, not 0"),
        (lambda: region_shapes.lawnmower(Hill(), SQUARE, 0.0, 9.0), "spacing must be above 0 m"),
        (lambda: region_shapes.area(Region(SQUARE.corners[:2])), "a region needs three corners"),
    ],
)
def test_what_has_no_shape_is_refused(make, reason):
    with pytest.raises(EvalError) as raised:
        make()
    assert raised.value.reason == reason


def test_nearest_takes_the_first_of_equals():
    assert shapes.nearest(Place(0.0, 0.0), (Place(5.0, 0.0), Place(0.0, 3.0), Place(3.0, 0.0))) == Place(0.0, 3.0)


def test_area_centroid_inside():
    assert region_shapes.area(SQUARE) == 10_000.0
    assert region_shapes.centroid(SQUARE) == Place(50.0, 50.0)
    assert region_shapes.inside(Place(100.0, 50.0), SQUARE)
    assert region_shapes.inside(Position(50.0, 50.0, 9.0), SQUARE)
    assert not region_shapes.inside(Place(100.1, 50.0), SQUARE)


@pytest.mark.parametrize("region", [SQUARE, HORSESHOE])
@pytest.mark.parametrize("parts", [1, 2, 3, 7])
def test_split_makes_equal_connected_parts(region, parts):
    pieces = region_shapes.split(region, parts)
    assert len(pieces) == parts
    share = region_shapes.area(region) / parts
    for piece in pieces:
        assert region_shapes.area(piece) == pytest.approx(share, rel=1e-3)


def test_split_by_area_makes_the_fewest_parts():
    assert len(region_shapes.split_by_area(SQUARE, 2500.0)) == 4
    assert len(region_shapes.split_by_area(SQUARE, 2499.0)) == 5
    assert len(region_shapes.split_by_area(SQUARE, 99_999.0)) == 1


def test_lawnmower_covers_the_region_in_lanes_over_the_ground():
    path = region_shapes.lawnmower(Hill(), SQUARE, 50.0, 30.0)
    assert path == (
        Position(25.0, 0.0, 32.5), Position(25.0, 100.0, 32.5), Position(75.0, 100.0, 37.5), Position(75.0, 0.0, 37.5),
    )  # fmt: skip


def test_lawnmower_lanes_follow_the_angle():
    path = region_shapes.lawnmower(Hill(), SQUARE, 50.0, 30.0, 90.0)
    assert {round(point.north_m, 3) for point in path} == {25.0, 75.0}
    for point in path:
        assert region_shapes.inside(point, Region(tuple(Place(p.east_m * 1.001, p.north_m) for p in SQUARE.corners)))


def test_lists_and_numbers():
    assert call("len", (1, 2)) == 2
    assert call("min", (3, 1, 2)) == 1
    assert call("max", 1.0, 4.0, form=1) == 4.0
    assert call("round", 2.6) == 3
    assert call("round", 2.345, 2, form=1) == pytest.approx(2.35, abs=0.01)
    assert call("sum", (0.1,) * 10) == 1.0
    assert call("mod", 370.0, 360.0) == 10.0
    assert call("range", 3) == (0, 1, 2)
    assert (call("first", (1, 2)), call("last", (1, 2)), call("reverse", (1, 2))) == (1, 2, (2, 1))


def test_the_registry_knows_every_helper_of_the_language(wording: Wording):
    wanted = (
        "above at_height offset toward distance bearing midpoint line circle polygon triangle zigzag lawnmower split "
        "split_by_area centroid area inside nearest ground len min max abs round sum mod range first last reverse is_set "
        "where count each sort append concat random shuffle today sunrise sunset fleet"
    )
    assert set(STANDARD.names()) == set(wanted.split())
    assert STANDARD.forms("nothing") == ()
    wording(STANDARD.forms("circle")[0].signature)


def test_defaults_come_after_what_is_required():
    for name in STANDARD.names():
        for helper in STANDARD.forms(name):
            required = [arg.default is REQUIRED for arg in helper.args]
            assert required == sorted(required, reverse=True)
            assert helper.help


class Of:
    """What chance draws from: a task and its run."""

    def __init__(self, task, run=1):
        self.names = {"task": {"id": task, "run": run}}

    def name(self, name):
        return self.names[name]


def test_chance_is_of_the_seed_the_task_and_its_run_alone():
    drawn = [call("random", Of(task, run), seed) for task in ("A-1", "A-2") for run in (1, 2) for seed in (0, 1, -7)]
    assert len(set(drawn)) == len(drawn)
    assert all(0 <= one < 1 for one in drawn)
    assert drawn == [
        call("random", Of(task, run), seed) for task in ("A-1", "A-2") for run in (1, 2) for seed in (0, 1, -7)
    ]
    assert call("random", Of("A-1"), 0) == 0.19612158265481683, "no version of Python draws otherwise"


def test_each_order_is_as_likely_as_any_other():
    orders = [call("shuffle", Of("A-1"), ("a", "b", "c"), seed) for seed in range(6000)]
    counts = {order: orders.count(order) for order in set(orders)}
    assert len(counts) == 6
    assert all(900 < count < 1100 for count in counts.values()), counts
    numbers = [call("random", Of("A-1"), seed) for seed in range(10_000)]
    assert abs(sum(numbers) / 10_000 - 0.5) < 0.01
