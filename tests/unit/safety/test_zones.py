"""Fence and no-fly regions: which ways break them, and which lead out of a breach."""

import pytest

from formiga_bt.base.geo import Place, Region
from formiga_bt.safety.zones import Zone
from tests.unit.safety.grounds import FENCE, LAKE

fence = Zone("fence", FENCE, keep_in=True)
lake = Zone("lake", LAKE, keep_in=False)

BAY = Region(
    (
        Place(0, 0), Place(90, 0), Place(90, 90), Place(60, 90),
        Place(60, 30), Place(30, 30), Place(30, 90), Place(0, 90),
    )
)  # fmt: skip
"""A fence with a bay from the north, from east 30 to 60."""


def test_a_way_is_judged_between_its_ends_too() -> None:
    found = lake.offence(Place(0, 0), Place(300, 0))

    assert found is not None
    assert (found.zone, found.at.east_m, found.depth_m) == ("lake", 150.0, 50.0)
    assert lake.offence(Place(0, 60), Place(300, 60)) is None


def test_what_is_told_is_the_deepest_point() -> None:
    found = fence.offence(Place(0, 0), Place(560, 0))

    assert found is not None
    assert (round(found.at.east_m), round(found.depth_m)) == (560, 60)


def test_touching_a_no_fly_region_breaks_it_and_touching_the_fence_does_not() -> None:
    found = lake.offence(Place(0, -50), Place(100, -50))

    assert found is not None
    assert (found.at, found.depth_m) == (Place(100, -50), 0.0)
    assert fence.offence(Place(0, 0), Place(500, 0)) is None


@pytest.mark.parametrize(
    ("a", "b", "allowed"),
    [
        ((520, 0), (0, 0), True),  # straight in
        ((520, 0), (520, 0), True),  # up or down at its place
        ((520, 0), (515, 40), True),  # ends less deep
        ((520, 0), (521, 0), False),  # deeper
        ((520, 0), (520.1, 0), False),  # a little
        ((520, 0), (-520, 0), False),  # in, and out again on the other side
        ((499, 0), (501, 0), False),  # begins inside
    ],
)
def test_a_rescue_may_come_back_into_the_fence(a: tuple[float, float], b: tuple[float, float], allowed: bool) -> None:
    assert (fence.offence(Place(*a), Place(*b), rescue=True) is None) is allowed
    if a != b:
        assert fence.offence(Place(*a), Place(*b)) is not None


@pytest.mark.parametrize(
    ("a", "b", "allowed"),
    [
        ((110, 0), (0, 0), True),  # out by the near side
        ((110, 0), (300, 0), False),  # out across the middle
        ((150, 0), (300, 0), True),  # from the middle any side will do
        ((110, 0), (110, 0), True),
        ((110, 0), (120, 0), False),
        ((90, 0), (110, 0), False),
        ((90, 0), (300, 0), False),
    ],
)
def test_a_rescue_may_leave_a_no_fly_region_by_a_short_way(
    a: tuple[float, float], b: tuple[float, float], allowed: bool
) -> None:
    assert (lake.offence(Place(*a), Place(*b), rescue=True) is None) is allowed


def test_a_rescue_may_not_go_far_outside_to_come_back_elsewhere() -> None:
    bay = Zone("fence", BAY, keep_in=True)

    # One metre outside the east arm, across the bay to one metre outside the west arm: 15 m outside on the way.
    assert bay.offence(Place(59, 60), Place(31, 60), rescue=True) is not None
    assert bay.offence(Place(59, 60), Place(70, 60), rescue=True) is None
