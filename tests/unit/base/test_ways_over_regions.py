"""Ways over regions: does a straight way leave a polygon, does it enter one."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.geo import Place, Region, RegionOutline, is_within, way_enters, way_leaves

SQUARE = Region((Place(0, 0), Place(100, 0), Place(100, 100), Place(0, 100)))
U = Region(
    (
        Place(0, 0), Place(100, 0), Place(100, 100), Place(70, 100),
        Place(70, 30), Place(30, 30), Place(30, 100), Place(0, 100),
    )
)  # fmt: skip
"""Open to the north: between the arms, from east 30 to 70 and north of 30, is outside."""


@pytest.mark.parametrize(
    ("a", "b", "leaves"),
    [
        ((10, 10), (90, 90), False),
        ((10, 10), (100, 100), False),  # to a corner
        ((0, 0), (100, 0), False),  # along an edge
        ((10, 10), (100.0009, 50), False),
        ((10, 10), (100.002, 50), True),
        ((-5, 50), (105, 50), True),  # both ends outside
    ],
)
def test_a_way_leaves_a_square(a: tuple[float, float], b: tuple[float, float], leaves: bool) -> None:
    assert way_leaves(Place(*a), Place(*b), SQUARE) is leaves
    assert way_leaves(Place(*b), Place(*a), SQUARE) is leaves


@pytest.mark.parametrize(
    ("a", "b", "leaves"),
    [
        ((15, 90), (85, 90), True),  # both ends inside, across the gap
        ((15, 30), (85, 30), False),  # along the bottom of the gap
        ((15, 30.002), (85, 30.002), True),
        ((30, 90), (30, 5), False),  # along an arm
        ((15, 90), (15, 10), False),
        ((15, 20), (85, 20), False),
    ],
)
def test_a_way_leaves_a_concave_region_between_two_points_inside(
    a: tuple[float, float], b: tuple[float, float], leaves: bool
) -> None:
    assert way_leaves(Place(*a), Place(*b), U) is leaves
    assert way_leaves(Place(*b), Place(*a), U) is leaves


@pytest.mark.parametrize(
    ("a", "b", "enters"),
    [
        ((-10, 50), (110, 50), True),  # through
        ((40, 60), (60, 60), True),  # all inside
        ((-10, -10), (-10, 110), False),
        ((-10, 110), (110, 110), False),
        ((-10, 10), (10, -10), True),  # touches a corner
        ((-10, 9.99), (9.99, -10), False),  # passes it at 7 mm
        ((-10, 0), (110, 0), True),  # along an edge
        ((0, -0.002), (100, -0.002), False),
        ((0, -0.0009), (100, -0.0009), True),
    ],
)
def test_a_way_enters_a_square(a: tuple[float, float], b: tuple[float, float], enters: bool) -> None:
    assert way_enters(Place(*a), Place(*b), SQUARE) is enters
    assert way_enters(Place(*b), Place(*a), SQUARE) is enters


def test_a_way_through_the_gap_of_a_concave_region_does_not_enter_it() -> None:
    assert not way_enters(Place(50, 200), Place(50, 40), U)
    assert way_enters(Place(50, 200), Place(50, 30), U)


def test_the_parts_of_a_way_are_told_in_order() -> None:
    parts = RegionOutline(U).spans(Place(-20, 60), Place(120, 60))

    assert [inside for _, _, inside in parts] == [False, True, False, True, False]
    assert [round(start * 140 - 20) for start, _, _ in parts] == [-20, 0, 30, 70, 100]
    assert RegionOutline(U).spans(Place(50, 50), Place(50, 50)) == [(0.0, 1.0, False)]


def test_depth_is_the_distance_to_the_border() -> None:
    square = RegionOutline(SQUARE)

    assert (square.inside_m(30, 50), square.outside_m(30, 50)) == (30, 0)
    assert (square.inside_m(-30, 50), square.outside_m(-30, 50)) == (0, 30)
    assert square.outside_m(103, 104) == 5


def test_a_region_without_area_holds_nothing_off_its_line() -> None:
    line = Region((Place(0, 0), Place(10, 0)))

    assert is_within(Place(5, 0), line)
    assert not is_within(Place(5, 1), line)
    assert not way_enters(Place(0, 1), Place(10, 1), line)


coordinates = st.integers(-50, 50).map(float)


@st.composite
def stars(draw: st.DrawFn) -> Region:
    """A simple polygon, mostly concave: corners at rising angles round a centre."""
    angles = sorted(draw(st.lists(st.integers(0, 359), min_size=3, max_size=9, unique=True)))
    radii = draw(st.lists(st.integers(5, 60), min_size=len(angles), max_size=len(angles)))
    return Region(
        tuple(
            Place(round(r * math.cos(math.radians(a)), 3), round(r * math.sin(math.radians(a)), 3))
            for a, r in zip(angles, radii, strict=True)
        )
    )


def samples(a: Place, b: Place) -> Sequence[Place]:
    return [
        Place(a.east_m + k / 300 * (b.east_m - a.east_m), a.north_m + k / 300 * (b.north_m - a.north_m))
        for k in range(301)
    ]


@settings(derandomize=True, max_examples=300, deadline=None)
@given(stars(), coordinates, coordinates, coordinates, coordinates)
def test_ways_agree_with_dense_samples(region: Region, ae: float, an: float, be: float, bn: float) -> None:
    a, b, outline = Place(ae, an), Place(be, bn), RegionOutline(region)
    points = samples(a, b)
    deepest_out = max(outline.outside_m(p.east_m, p.north_m) for p in points)
    step_m = math.dist((ae, an), (be, bn)) / 300

    if deepest_out > 0.002:
        assert way_leaves(a, b, region)
    if any(outline.contains(p.east_m, p.north_m) for p in points):
        assert way_enters(a, b, region)
    if way_leaves(a, b, region) and deepest_out == 0.0:
        # what the samples missed is a notch narrower than their step
        parts = [(end - start) * 300 * step_m for start, end, inside in outline.spans(a, b) if not inside]
        assert parts
        assert max(parts) <= step_m + 0.002
    if not way_enters(a, b, region):
        assert all(outline.outside_m(p.east_m, p.north_m) > 0.0 for p in points)


@settings(derandomize=True, max_examples=200, deadline=None)
@given(stars(), coordinates, coordinates, coordinates, coordinates)
def test_a_convex_shortcut_changes_no_answer(region: Region, ae: float, an: float, be: float, bn: float) -> None:
    a, b, outline = Place(ae, an), Place(be, bn), RegionOutline(region)

    assert outline.is_left_by(a, b) == any(not inside for _, _, inside in outline.spans(a, b))
