"""What the envelope says before a goal leaves."""

from typing import Any

import pytest
from msgspec import structs

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.safety.envelope import Breach, GateFlight, at_gate, ways_of
from tests.golden import Wording
from tests.unit.safety.grounds import FENCE, HOME, LAKE, POWER, RULES, airspace, flight, hilly

OVER_HOME = Position(0, 0, 60)
AIR = airspace()


def refused(asked: GateFlight, ground: Any = AIR, **tighter: Any) -> str:
    breach = at_gate(asked, ground, structs.replace(RULES, **tighter))
    return f"{breach.name}: {breach.text}" if breach is not None else ""


def test_a_goal_within_all_limits_may_leave() -> None:
    assert at_gate(flight(OVER_HOME, Position(-300, 200, 60)), AIR, RULES) is None


@pytest.mark.parametrize(
    ("to", "text"),
    [
        (Position(-512, 40, 60), "keep_in: the leg leaves the fence: 12 m outside at east -512 m, north 40 m"),
        (Position(300, 0, 60), "keep_out: the leg enters the no-fly region lake: 50 m deep at east 150 m, north 0 m"),
        (
            Position(-300, 0, 130),
            "max_height: the leg would be 130.0 m over the ground at east -300 m, north 0 m, at most 120 m are allowed",
        ),
        (
            Position(-300, 0, 3),
            "terrain_clearance: the leg would be 3.0 m over the ground at east -300 m, north 0 m, "
            "at least 5 m must be kept",
        ),
    ],
)
def test_a_leg_is_refused_with_what_how_much_and_where(to: Position, text: str) -> None:
    assert refused(flight(OVER_HOME, to)) == text


def test_a_leg_that_touches_a_no_fly_region_is_refused(wording: Wording) -> None:
    wording(refused(flight(OVER_HOME, Position(100, 0, 60))))


def test_a_region_without_a_name_is_called_by_its_number(wording: Wording) -> None:
    ground = airspace(regions={})

    wording(refused(flight(OVER_HOME, Position(150, 0, 60), ground), ground))


def test_a_leg_across_a_bay_of_the_fence_is_refused_though_both_ends_lie_inside() -> None:
    corners = (*FENCE.corners, Place(-500, 100), Place(-20, 100), Place(-20, 90), Place(-500, 90))
    ground = airspace(fence=Region(corners), no_fly=())

    assert refused(flight(Position(-100, 50, 60), Position(-100, 150, 60), ground), ground).startswith("keep_in: ")
    assert refused(flight(Position(-10, 50, 60), Position(-10, 150, 60), ground), ground) == ""


class TestHeights:
    def test_over_a_hill_the_leg_counts_not_only_its_end(self, wording: Wording) -> None:
        ground = hilly()

        wording(refused(flight(Position(100, 0, 30), Position(480, 0, 30), ground), ground))
        assert refused(flight(Position(100, 0, 46), Position(480, 0, 46), ground), ground) == ""

    def test_over_ground_that_is_not_known_a_leg_is_refused(self, wording: Wording) -> None:
        ground = hilly()

        wording(refused(flight(Position(-300, 480, 60), Position(-480, 480, 60), ground), ground))

    def test_near_take_off_and_landing_spots_a_machine_may_be_low(self) -> None:
        field = Place(-200, 0)
        low, near = Position(-200, 0, 3), Position(-191, 0, 3)

        assert refused(flight(low, near, spots=(field,))) == ""
        assert refused(flight(low, Position(-189, 0, 3), spots=(field,))).startswith("terrain_clearance: ")
        assert refused(flight(near, field, lands_at=field)) == ""
        assert refused(flight(low, near)).startswith("terrain_clearance: ")
        assert refused(flight(Position(2, 0, 2.5), Position(0, 0, 60))) == ""  # over its own port

    def test_a_take_off_begins_on_the_ground(self, wording: Wording) -> None:
        here = Position(-200, 0, 0)
        up = flight(here, None, ways=ways_of(here, None, AIR, rises_to_m=60.0), grounded=True)

        assert refused(up) == ""
        wording(refused(up, max_height_m=50.0))

    def test_ground_that_is_not_the_bases_is_told(self, wording: Wording) -> None:
        ground = airspace(relief_m=5.0)

        wording(refused(flight(OVER_HOME, Position(-300, 0, 2), ground), ground))


class TestWays:
    def test_a_landing_goes_level_to_the_place_and_straight_down(self) -> None:
        over, down = Position(5, 0, 60), Position(5, 0, 0)

        assert ways_of(OVER_HOME, Place(5, 0), AIR) == ((OVER_HOME, over), (over, down))
        assert ways_of(OVER_HOME, Place(0, 0), AIR) == ((OVER_HOME, Position(0, 0, 0)),)

    def test_on_a_hill_it_ends_on_the_hill(self) -> None:
        assert ways_of(OVER_HOME, Place(300, 0), hilly())[-1][1] == Position(300, 0, 40)

    def test_of_a_machine_that_is_nowhere_only_the_end_is_known(self) -> None:
        assert ways_of(None, OVER_HOME, AIR) == ((OVER_HOME, OVER_HOME),)
        assert ways_of(None, None, AIR) == ()


class TestWeatherAndLight:
    def test_wind_above_the_limit_is_refused_and_at_the_limit_not(self, wording: Wording) -> None:
        assert refused(flight(OVER_HOME, Position(-100, 0, 60), wind=(3.0, 4.0)), wind_max_m_s=5.0) == ""
        wording(refused(flight(OVER_HOME, Position(-100, 0, 60), wind=(3.0, 4.2)), wind_max_m_s=5.0))

    @pytest.mark.parametrize(
        ("sun_up", "text"),
        [
            (True, ""),
            (False, "daylight_only: the sun is down, and flights are allowed by daylight only"),
            (None, "daylight_only: it is not known whether the sun is up, and flights are allowed by daylight only"),
        ],
    )
    def test_by_daylight_only_means_that_the_sun_is_known_to_be_up(self, sun_up: bool | None, text: str) -> None:
        asked = flight(OVER_HOME, Position(-100, 0, 60), sun_up=sun_up)

        assert refused(asked, daylight_only=True) == text
        assert refused(asked) == ""


class TestReserve:
    def test_there_and_home_against_the_reserve(self, wording: Wording) -> None:
        """400 m there and 400 m home cost 4 points each, the descent 3, and half a point is kept: 11.5."""
        there = Position(-400, 0, 60)

        assert refused(flight(OVER_HOME, there, battery=36.5)) == ""
        wording(refused(flight(OVER_HOME, there, battery=36.4)))

    def test_who_is_short_already_may_not_fly_on_for_a_task(self, wording: Wording) -> None:
        """By its layer the way home costs 11 from here; the slanting leg home and the descent would cost only 9."""
        here = Position(-400, 0, 20)

        assert refused(flight(here, OVER_HOME, battery=36.5)) == ""
        wording(refused(flight(here, OVER_HOME, battery=36.0)))

    def test_what_the_goal_does_there_counts(self, wording: Wording) -> None:
        wording(refused(flight(OVER_HOME, None, battery=30.0, hover_s=30.0)))

    def test_a_landing_at_home_needs_no_way_home_after_it_and_one_elsewhere_does(self, wording: Wording) -> None:
        over = Position(-200, 0, 60)

        assert refused(flight(OVER_HOME, HOME, lands_at=HOME, battery=28.5)) == ""
        wording(refused(flight(over, over.ground, lands_at=over.ground, battery=39.4)))

    def test_one_that_stands_at_home_needs_nothing_to_come_home(self) -> None:
        on_port = Position(0, 0, 0)

        assert refused(flight(on_port, None, grounded=True, battery=25.5)) == ""
        assert refused(flight(on_port, None, grounded=True, battery=25.4)).startswith("reserve: ")

    def test_payload_and_wind_count(self) -> None:
        there = Position(-400, 0, 60)
        loaded = structs.replace(POWER, payload_pct_kg_s=0.01)

        assert refused(flight(OVER_HOME, there, battery=37.0)) == ""
        assert refused(flight(OVER_HOME, there, battery=37.0, payload_kg=2.0, power=loaded)).startswith("reserve: ")
        assert refused(flight(OVER_HOME, there, battery=37.0, wind=(3.0, 0.0))).startswith("reserve: ")

    def test_a_wind_that_holds_it_back_is_told(self, wording: Wording) -> None:
        slow = structs.replace(POWER, speed_m_s=8.0)

        wording(refused(flight(OVER_HOME, Position(-100, 0, 60), wind=(9.0, 0.0), power=slow)))

    def test_an_unknown_charge_is_not_enough_and_an_unknown_drain_is_not_reckoned(self, wording: Wording) -> None:
        there = Position(-400, 0, 60)

        wording(refused(flight(OVER_HOME, there, battery=None)))
        assert refused(flight(OVER_HOME, there, battery=None, power=None)) == ""


class TestArea:
    FIELD = Region((Place(-300, 100), Place(-100, 100), Place(-100, 300), Place(-300, 300)))

    def asked(self, region: Region = FIELD, here: Position = OVER_HOME, **changes: Any) -> GateFlight:
        return flight(here, None, region=region, **{"region_up_m": 60.0, **changes})

    def test_a_field_inside_the_fence_may_be_covered(self) -> None:
        assert refused(self.asked()) == ""

    def test_its_way_there_and_all_of_it_must_be_legal(self, wording: Wording) -> None:
        beyond = Region((Place(300, -20), Place(400, -20), Place(400, 20), Place(300, 20)))
        around = Region((Place(50, -100), Place(250, -100), Place(250, 100), Place(50, 100)))

        for region in (beyond, around):
            wording(refused(self.asked(region)))
        assert refused(self.asked(LAKE, here=Position(150, 0, 60))).startswith("keep_out: ")

    def test_a_bay_of_the_fence_within_it_is_found(self, wording: Wording) -> None:
        corners = (*FENCE.corners, Place(-500, 210), Place(-200, 205), Place(-500, 200))
        ground = airspace(fence=Region(corners), no_fly=())
        here = Position(-200, 150, 60)

        wording(refused(self.asked(here=here), ground))

    def test_its_height_counts_over_all_of_its_ground(self, wording: Wording) -> None:
        hill = Region((Place(200, -100), Place(400, -100), Place(400, 100), Place(200, 100)))
        here = Position(300, 50, 60)

        wording(refused(self.asked(hill, here=here, region_up_m=44.0), hilly()))
        assert refused(self.asked(hill, here=here, region_up_m=46.0), hilly()) == ""
        wording(refused(self.asked(region_up_m=121.0)))

    def test_its_lanes_count_against_the_reserve(self, wording: Wording) -> None:
        """Into the far corner 4.2, ten lanes of 200 m 21.8, home from the far corner 7.2, half a point kept."""
        assert refused(self.asked(battery=58.8)) == ""
        wording(refused(self.asked(battery=58.6)))


class TestUnknown:
    def test_a_machine_that_is_nowhere_goes_nowhere_for_a_task(self) -> None:
        assert at_gate(flight(None, OVER_HOME), AIR, RULES) == Breach("position", "it is not known where hwd_1 is")
        assert at_gate(flight(None, None, power=None), AIR, RULES) is None

    def test_but_it_is_rescued_to_where_it_is_allowed(self) -> None:
        assert at_gate(flight(None, OVER_HOME, rescue=True), AIR, RULES) is None
        assert refused(flight(None, Position(150, 0, 60), rescue=True)).startswith("keep_out: ")

    def test_a_target_that_is_no_number_is_refused_to_everyone(self, wording: Wording) -> None:
        nowhere = Position(0, 0, float("nan"))

        for rescue in (False, True):
            wording(refused(flight(OVER_HOME, nowhere, rescue=rescue)))
            wording(refused(flight(OVER_HOME, None, region=TestArea.FIELD, region_up_m=float("inf"), rescue=rescue)))


class TestRescue:
    def test_reserve_wind_and_night_do_not_hold_it(self) -> None:
        worn = flight(Position(-400, 0, 60), OVER_HOME, battery=3.0, wind=(9.0, 9.0), sun_up=False, rescue=True)

        assert refused(worn, daylight_only=True) == ""
        assert refused(structs.replace(worn, battery=None), daylight_only=True) == ""

    def test_zones_and_heights_do(self) -> None:
        assert refused(flight(OVER_HOME, Position(300, 0, 60), rescue=True)).startswith("keep_out: ")
        assert refused(flight(OVER_HOME, Position(-520, 0, 60), rescue=True)).startswith("keep_in: ")
        assert refused(flight(OVER_HOME, Position(-300, 0, 130), rescue=True)).startswith("max_height: ")
        assert refused(flight(Position(100, 0, 30), Position(480, 0, 30), rescue=True), hilly()).startswith("terrain_")

    @pytest.mark.parametrize(
        ("here", "to"),
        [
            (Position(-540, 0, 60), OVER_HOME),  # outside the fence
            (Position(-540, 0, 30), Position(-540, 0, 60)),  # first to its layer
            (Position(110, 0, 60), OVER_HOME),  # in the lake
            (Position(0, 0, 140), Position(0, 0, 60)),  # too high
            (Position(-300, 0, 140), Position(0, 0, 140)),
            (Position(-300, 0, 3), Position(-300, 0, 60)),  # too low
        ],
    )
    def test_out_of_a_breach_it_may_go(self, here: Position, to: Position) -> None:
        assert refused(flight(here, to, rescue=True)) == ""
        assert refused(flight(here, to)) != ""

    @pytest.mark.parametrize(
        ("here", "to", "name"),
        [
            (Position(-540, 0, 60), Position(-560, 0, 60), "keep_in"),
            (Position(-540, 0, 60), Position(150, 0, 60), "keep_out"),  # another zone
            (Position(0, 0, 140), Position(0, 0, 150), "max_height"),
            (Position(-300, 0, 4), Position(-200, 0, 2), "terrain_clearance"),
        ],
    )
    def test_into_more_of_it_or_into_another_it_may_not(self, here: Position, to: Position, name: str) -> None:
        breach = at_gate(flight(here, to, rescue=True), AIR, RULES)

        assert breach is not None
        assert breach.name == name
        assert breach.code == f"envelope.{name}"

    def test_unknown_ground_does_not_hold_it_but_a_hill_behind_does(self) -> None:
        ground = hilly()

        assert refused(flight(Position(-500, 500, 60), OVER_HOME, ground, rescue=True), ground) == ""
        assert refused(flight(Position(-500, 500, 60), Position(480, -180, 30), ground, rescue=True), ground) == ""
        assert refused(flight(Position(-490, 500, 38), Position(300, 0, 38), ground, rescue=True), ground).startswith(
            "terrain_clearance: "
        )
