"""Points of charge for straight ways and for the way home."""

import math
from typing import Any, ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.energy import Power, ground_speed_m_s, home_pct, hover_pct, power_of, reach_m, way_pct
from formiga_bt.base.geo import Place, Position
from tests.unit.safety.grounds import HOME, POWER


def at(east: float, north: float, up: float) -> Position:
    return Position(float(east), float(north), float(up))


def test_a_level_way_costs_its_time_in_cruise() -> None:
    assert way_pct(at(0, 0, 60), at(600, 800, 60), POWER) == pytest.approx(10.0)


def test_climbing_costs_its_own_drain_and_descending_that_of_a_cruise() -> None:
    assert way_pct(at(0, 0, 0), at(0, 0, 100), POWER) == pytest.approx(10.0)
    assert way_pct(at(0, 0, 100), at(0, 0, 0), POWER) == pytest.approx(5.0)


def test_a_slanting_way_takes_as_long_as_its_slower_part() -> None:
    assert way_pct(at(0, 0, 0), at(100, 0, 100), POWER) == pytest.approx(10.0)  # 50 s of climb
    assert way_pct(at(0, 0, 0), at(1000, 0, 100), POWER) == pytest.approx(50 * 0.2 + 50 * 0.1)


def test_payload_costs_by_the_kilogram_in_every_kind_of_flight() -> None:
    power = Power(speed_m_s=10, climb_m_s=2, cruise_pct_s=0.1, hover_pct_s=0.08, climb_pct_s=0.2, payload_pct_kg_s=0.01)

    assert way_pct(at(0, 0, 60), at(1000, 0, 60), power, payload_kg=3.0) == pytest.approx(13.0)
    assert hover_pct(100.0, power, 3.0) == pytest.approx(11.0)


@pytest.mark.parametrize(
    ("wind", "speed"),
    [
        ((0.0, 0.0), 10.0),
        ((-4.0, 0.0), 6.0),  # against it
        ((4.0, 0.0), 10.0),  # along: not counted on
        ((0.0, 6.0), 8.0),  # across
        ((0.0, 10.0), 0.0),
        ((-10.0, 0.0), 0.0),
        ((-30.0, 0.0), 0.0),
    ],
)
def test_the_wind_changes_the_speed_over_ground_eastward(wind: tuple[float, float], speed: float) -> None:
    assert ground_speed_m_s(100.0, 0.0, 10.0, wind) == pytest.approx(speed)


def test_no_way_leads_against_a_wind_that_is_too_strong_but_up_and_down() -> None:
    assert way_pct(at(0, 0, 60), at(100, 0, 60), POWER, (-10.0, 0.0)) == math.inf
    assert way_pct(at(0, 0, 60), at(0, 0, 0), POWER, (-10.0, 0.0)) == pytest.approx(3.0)


def test_a_slower_goal_costs_more_and_a_faster_one_no_less() -> None:
    here, there = at(0, 0, 60), at(1000, 0, 60)

    assert way_pct(here, there, POWER, speed_m_s=5.0) == pytest.approx(20.0)
    assert way_pct(here, there, POWER, speed_m_s=50.0) == pytest.approx(10.0)


def test_the_way_home_goes_by_the_layer_and_down() -> None:
    assert home_pct(at(1000, 0, 20), HOME, 60.0, POWER) == pytest.approx(4.0 + 10.0 + 3.0)
    assert home_pct(at(1000, 0, 80), HOME, 60.0, POWER) == pytest.approx(1.0 + 10.0 + 3.0)
    assert home_pct(at(1000, 0, 60), HOME, 60.0, POWER, home_up_m=20.0) == pytest.approx(10.0 + 2.0)


def test_who_stands_at_home_needs_nothing_and_who_stands_elsewhere_takes_off_first() -> None:
    assert home_pct(at(1, 1, 0), HOME, 60.0, POWER, grounded=True) == 0.0
    assert home_pct(at(1000, 0, 0), HOME, 60.0, POWER, grounded=True) == pytest.approx(6.0 + 10.0 + 3.0)


def test_without_a_home_a_machine_lands_where_it_is() -> None:
    assert home_pct(at(1000, 0, 60), None, 60.0, POWER) == pytest.approx(3.0)
    assert home_pct(at(1000, 0, 0), None, 60.0, POWER, grounded=True) == 0.0


def test_reach_is_what_is_left_after_the_landing() -> None:
    assert reach_m(5.0, at(0, 0, 60), POWER) == pytest.approx(200.0)  # 3 points down, 2 for 200 m
    assert reach_m(5.0, at(0, 0, 60), POWER, (0.0, 5.0)) == pytest.approx(100.0)
    assert reach_m(2.0, at(0, 0, 60), POWER) == 0.0
    assert reach_m(5.0, at(0, 0, 60), POWER, (0.0, 12.0)) == 0.0


class TestPower:
    LIMITS: ClassVar = {"speed_m_s": 8.0, "climb_m_s": 2.5, "cruise_drain_pct_s": 0.066, "hover_drain_pct_s": 0.058}

    def test_what_a_type_leaves_out_is_as_in_cruise_or_nothing(self) -> None:
        assert power_of(self.LIMITS) == Power(
            speed_m_s=8.0, climb_m_s=2.5, cruise_pct_s=0.066, hover_pct_s=0.058, climb_pct_s=0.066
        )

    def test_what_a_machine_announces_replaces_its_types_numbers(self) -> None:
        power = power_of(self.LIMITS, {"speed_m_s": 12.0, "cruise_drain_pct_s": 0.05, "climb_drain_pct_s": 0.09})

        assert power is not None
        assert (power.speed_m_s, power.cruise_pct_s, power.climb_pct_s) == (12.0, 0.05, 0.09)

    @pytest.mark.parametrize("missing", ["speed_m_s", "climb_m_s"])
    def test_who_has_no_speed_or_no_drain_has_no_power(self, missing: str) -> None:
        assert power_of({name: n for name, n in self.LIMITS.items() if name != missing}) is None
        assert power_of({"speed_m_s": 1.4}) is None

    def test_odd_numbers_are_as_if_not_given(self) -> None:
        odd = {"climb_drain_pct_s": math.nan, "landing_s": -1.0, "payload_drain_pct_kg_s": math.inf}

        assert power_of({**self.LIMITS, **odd}) == power_of(self.LIMITS)


metres = st.floats(-2000, 2000)
heights = st.floats(0, 120)
gusts = st.floats(-6, 6)
LOADED = Power(speed_m_s=10, climb_m_s=2, cruise_pct_s=0.1, hover_pct_s=0.08, climb_pct_s=0.2, payload_pct_kg_s=0.01)


@settings(derandomize=True, deadline=None)
@given(metres, metres, heights, st.floats(1, 3), st.floats(0, 5), st.floats(0, 5), gusts, gusts)
def test_charge_grows_with_distance_and_payload(
    east: float, north: float, up: float, farther: float, payload: float, more: float, w_east: float, w_north: float
) -> None:
    here, there = at(0, 0, up), at(east, north, 60)
    beyond = at(east * farther, north * farther, 60)
    wind = w_east, w_north
    spent = way_pct(here, there, LOADED, wind, payload)

    assert way_pct(here, beyond, LOADED, wind, payload) >= spent - 1e-9
    assert way_pct(here, there, LOADED, wind, payload + more) >= spent
    assert home_pct(there, HOME, 60, LOADED, wind, payload + more) >= home_pct(there, HOME, 60, LOADED, wind, payload)


@settings(derandomize=True, deadline=None)
@given(metres, metres, st.floats(0, 15), st.floats(0, 15))
def test_charge_grows_with_head_wind(east: float, north: float, wind: float, more: float) -> None:
    length = math.hypot(east, north) or 1.0
    against, harder = ((-east / length * w, -north / length * w) for w in (wind, wind + more))

    assert way_pct(at(0, 0, 60), at(east, north, 60), LOADED, harder) >= way_pct(
        at(0, 0, 60), at(east, north, 60), LOADED, against
    )


@settings(derandomize=True, deadline=None, max_examples=200)
@given(metres, metres, heights, metres, metres, heights, gusts, gusts, st.floats(0, 1))
def test_midway_no_more_is_needed_than_at_the_worse_end(
    a_east: float, a_north: float, a_up: float, b_east: float, b_north: float, b_up: float,
    w_east: float, w_north: float, share: float,
) -> None:  # fmt: skip
    """What lets the gate look at the ends of a way only."""
    a, b, wind = at(a_east, a_north, a_up), at(b_east, b_north, b_up), (w_east, w_north)
    middle = at(*(p + share * (q - p) for p, q in ((a_east, b_east), (a_north, b_north), (a_up, b_up))))

    def home(here: Position) -> float:
        return home_pct(here, Place(0, 0), 60.0, LOADED, wind, 1.0)

    ends: list[Any] = [home(a), way_pct(a, b, LOADED, wind, 1.0) + home(b)]
    assert way_pct(a, middle, LOADED, wind, 1.0) + home(middle) <= max(ends) + 1e-6
