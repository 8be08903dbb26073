"""A ring counts as level by itself: not with the way down onto it, nor the climb at its end and the way off along it."""

import math

from experiments.e2_llm.figures_flown import LEVEL_M, full_round
from experiments.e2_llm.flown import Fix, Machine


def at(turned_deg: float, up_m: float, at_s: float, radius_m: float = 15.0) -> Fix:
    angle = math.radians(turned_deg)
    return Fix(at_s, radius_m * math.cos(angle), radius_m * math.sin(angle), up_m)


def machine(*way: Fix) -> Machine:
    return Machine(id="lwd_1", type="lwd", home=(0.0, 0.0), way=way)


RING = [at(5.0 * i, 30.0, 10.0 + i) for i in range(73)]


def test_the_way_to_a_ring_and_off_it_is_no_part_of_it() -> None:
    down = [at(-8.0, 75.0, 0.0), at(-4.0, 75.0, 2.0), at(0.0, 75.0, 4.0)]
    off = [at(360.0, 75.0, 100.0), at(364.0, 75.0, 102.0), at(369.0, 75.0, 104.0)]
    found = full_round(machine(*down, *RING, *off), (0.0, 0.0), 15.0)

    assert found is not None
    assert found.highest_m - found.lowest_m < LEVEL_M


def test_a_ring_that_climbs_is_not_level() -> None:
    screw = [at(5.0 * i, 30.0 + 0.2 * i, float(i)) for i in range(73)]
    found = full_round(machine(*screw), (0.0, 0.0), 15.0)

    assert found is not None
    assert found.highest_m - found.lowest_m > LEVEL_M
    assert full_round(machine(*RING[:60]), (0.0, 0.0), 15.0) is None
