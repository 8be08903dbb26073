"""Where to land when a machine must come down."""

import math
import random

from formiga_bt.base.geo import Place, Region, horizontal_m, way_enters
from formiga_bt.safety.envelope import safe_landing_spot
from tests.unit.safety.grounds import RULES, airspace, hilly

HERE = Place(0, 0)


def test_with_nobody_near_it_lands_here() -> None:
    assert safe_landing_spot(HERE, [Place(15, 0)], [Place(0, 3)], airspace(), RULES, 100.0) is HERE


def test_it_goes_just_out_of_the_way_of_people() -> None:
    spot = safe_landing_spot(HERE, [Place(0, 5)], [], airspace(), RULES, 100.0)

    assert horizontal_m(spot, Place(0, 5)) >= 15.0
    assert horizontal_m(spot, HERE) <= 11.1
    assert spot.north_m < 0.0


def test_it_keeps_off_other_machines_by_the_sites_spacing() -> None:
    spot = safe_landing_spot(HERE, [], [HERE], airspace(min_spacing_m=5.0), RULES, 100.0)

    assert 5.0 <= horizontal_m(spot, HERE) <= 6.1


def test_out_of_reach_of_any_clear_spot_it_lands_here() -> None:
    assert safe_landing_spot(HERE, [Place(0, 5)], [], airspace(), RULES, 9.0) is HERE
    assert safe_landing_spot(HERE, [HERE], [], airspace(), RULES, math.nan) is HERE


def test_no_spot_lies_in_a_no_fly_region_outside_the_fence_or_beyond_one() -> None:
    by_the_lake = Place(99, 0)  # people west of it would drive it into the lake

    spot = safe_landing_spot(by_the_lake, [Place(90, 0)], [], airspace(), RULES, 300.0)
    assert spot.east_m < 100.0
    assert horizontal_m(spot, Place(90, 0)) >= 15.0

    corner = safe_landing_spot(Place(499, 499), [Place(495, 495)], [], airspace(), RULES, 300.0)
    assert max(corner.east_m, corner.north_m) <= 500.0


def test_the_way_to_the_spot_goes_round_a_no_fly_region() -> None:
    strip = Region((Place(1, -2), Place(2, -2), Place(2, 2), Place(1, 2)))

    spot = safe_landing_spot(HERE, [Place(-12, 0)], [], airspace(no_fly=(strip,)), RULES, 100.0)

    assert horizontal_m(spot, HERE) > 3.0  # straight east, behind the strip, would be nearest
    assert not way_enters(HERE, spot, strip)


def test_from_inside_a_no_fly_region_it_leaves_by_the_near_side() -> None:
    spot = safe_landing_spot(Place(110, 0), [], [], airspace(), RULES, 300.0)

    assert spot.east_m < 100.0
    assert horizontal_m(spot, Place(110, 0)) <= 11.1


def test_it_does_not_land_where_the_ground_is_not_known() -> None:
    spot = safe_landing_spot(Place(549, 0), [Place(540, 0)], [], hilly(), RULES, 300.0)

    assert spot.east_m <= 500.0  # the fence, too


def test_the_spot_is_clear_of_everyone_and_no_clear_spot_is_much_nearer() -> None:
    random_ = random.Random(3)
    ground = airspace(no_fly=())
    for _ in range(40):
        people = [Place(random_.uniform(-40, 40), random_.uniform(-40, 40)) for _ in range(6)]
        taken = [Place(random_.uniform(-20, 20), random_.uniform(-20, 20)) for _ in range(5)]

        def is_clear(at: Place, people: list[Place] = people, taken: list[Place] = taken) -> bool:
            return all(horizontal_m(p, at) >= 15.0 for p in people) and all(horizontal_m(t, at) >= 3.0 for t in taken)

        spot = safe_landing_spot(HERE, people, taken, ground, RULES, 200.0)
        far = horizontal_m(spot, HERE)
        nearer = [
            Place(r * math.sin(k / 100), r * math.cos(k / 100))
            for r in (max(0.0, far - 2.5) * i / 20 for i in range(21))
            for k in range(628)
        ]

        assert is_clear(spot)
        assert not any(is_clear(p) for p in nearer if horizontal_m(p, HERE) < far - 2.0)
