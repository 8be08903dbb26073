"""The ground under ways: flat with a relief, or from a height file."""

import math
import random

from formiga_bt.base.geo import Place, Position
from formiga_bt.base.heights import HeightGrid, parse_heights
from formiga_bt.safety.terrain import Flat, Heights, terrain_of, too_high, too_low
from tests.unit.safety.grounds import HILL, site


def at(east: float, north: float, up: float) -> Position:
    return Position(float(east), float(north), float(up))


def hill(error_m: float = 0.0) -> Heights:
    return Heights(parse_heights(HILL, 0.0), error_m)


def test_flat_ground_rises_up_to_its_relief() -> None:
    ground = Flat(4.0)

    assert too_low(ground, at(0, 0, 9), at(500, 0, 9), 5.0) is None
    found = too_low(ground, at(0, 0, 8.9), at(500, 0, 8.9), 5.0)
    assert found is not None
    assert (found.at, found.ground_m) == (at(0, 0, 8.9), 4.0)


def test_height_over_flat_ground_is_over_the_bases_ground() -> None:
    assert too_high(Flat(4.0), at(0, 0, 120), at(500, 0, 120), 120.0) is None
    assert too_high(Flat(4.0), at(0, 0, 120), at(500, 0, 121), 120.0) is not None


def test_a_level_way_over_a_hill_is_too_low_at_the_hill_only() -> None:
    found = too_low(hill(), at(0, 0, 30), at(500, 0, 30), 5.0)

    assert found is not None
    assert found.ground_m is not None
    assert 255 <= found.at.east_m <= 265  # 26 m of ground: 62.5 m up a slope of 40 m over 100 m
    assert found.ground_m > 25.0
    assert too_low(hill(), at(0, 0, 45), at(500, 0, 45), 5.0) is None
    assert too_low(hill(), at(0, 100, 6), at(500, 100, 6), 5.0) is None


def test_a_file_that_may_be_wrong_counts_against_the_way_on_both_sides() -> None:
    assert too_low(hill(3.0), at(0, 0, 47.9), at(500, 0, 47.9), 5.0) is not None
    assert too_low(hill(3.0), at(0, 0, 48.1), at(500, 0, 48.1), 5.0) is None
    assert too_high(hill(3.0), at(0, 100, 118), at(0, 200, 118), 120.0) is not None
    assert too_high(hill(3.0), at(0, 100, 116), at(0, 200, 116), 120.0) is None


def test_a_file_without_holes_is_judged_with_its_error_too() -> None:
    ground = Heights(parse_heights(HILL.replace("-9999 0", "0 0"), 0.0), 3.0)

    assert ground.rough_m(Place(0, 0), Place(100, 100)) == (-3.0, 43.0)
    assert too_low(ground, at(0, 0, 47.9), at(500, 0, 47.9), 5.0) is not None
    assert too_low(ground, at(0, 0, 48.1), at(500, 0, 48.1), 5.0) is None


def test_unknown_ground_is_found_outside_the_file_and_in_its_holes() -> None:
    outside, hole = (
        too_low(hill(), at(0, 0, 90), at(700, 0, 90), 5.0),
        too_high(hill(), at(-300, 500, 90), at(-500, 500, 90), 120.0),
    )

    assert outside is not None
    assert outside.ground_m is None
    assert outside.at.east_m > 540.0
    assert hole is not None
    assert hole.ground_m is None


def test_a_site_has_flat_ground_or_that_of_its_file() -> None:
    grid = parse_heights(HILL, 0.0)

    assert terrain_of(site(relief_m=7.0)).rough_m(Place(0, 0), Place(1, 1)) == (0.0, 7.0)
    assert terrain_of(site(heights=grid)).ground_m(Place(300, 0)) == 40.0


def test_ways_over_rough_ground_agree_with_dense_samples() -> None:
    random_ = random.Random(11)
    cols, rows, cell = 70, 50, 7.0
    heights = [random_.uniform(0, 40) for _ in range(cols * rows)]
    grid = HeightGrid(cols, rows, -200.0, -100.0, cell, heights)
    ground = Heights(grid, 0.0)
    decided = set()
    for _ in range(150):
        a, b = (at(random_.uniform(-200, 280), random_.uniform(-100, 240), random_.uniform(35, 60)) for _ in range(2))
        margins = []
        for k in range(2001):
            share = k / 2000
            east, north = a.east_m + share * (b.east_m - a.east_m), a.north_m + share * (b.north_m - a.north_m)
            under = grid.ground_m(east, north)
            assert under is not None
            margins.append(a.up_m + share * (b.up_m - a.up_m) - under)
        found = too_low(ground, a, b, 10.0)
        decided.add(found is None)

        if min(margins) < 10.0:
            assert found is not None
        elif found is not None:  # a piece is judged by its lowest end over its highest ground
            assert (
                min(margins)
                < 10.0 + 40.0 / cell * max(1.0, math.dist((a.east_m, a.north_m), (b.east_m, b.north_m)) / 128) * 2
            )
    assert decided == {True, False}
