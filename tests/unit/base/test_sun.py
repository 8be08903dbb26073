"""Daylight by the published formulae, against published times."""

from datetime import UTC, datetime

import pytest

from formiga_bt.base.sun import daylight, sun_elevation_deg, sun_is_up
from formiga_bt.safety.airspace import Airspace
from tests.unit.safety.grounds import site


def us(year: int, month: int, day: int, hour: int, minute: int = 0) -> int:
    return int(datetime(year, month, day, hour, minute, tzinfo=UTC).timestamp()) * 1_000_000


@pytest.mark.parametrize(
    ("lat", "lng", "rises", "sets"),
    [
        # London, 2024-03-20: 06:02 and 18:14 UTC
        (51.5074, -0.1278, us(2024, 3, 20, 6, 2), us(2024, 3, 20, 18, 14)),
        # Sydney, 2024-06-21: 07:00 and 16:54 AEST
        (-33.8688, 151.2093, us(2024, 6, 20, 21, 0), us(2024, 6, 21, 6, 54)),
    ],
)
def test_sunrise_and_sunset_are_right_to_a_few_minutes(lat: float, lng: float, rises: int, sets: int) -> None:
    slack = 4 * 60 * 1_000_000

    assert [sun_is_up(lat, lng, rises + by) for by in (-slack, slack)] == [False, True]
    assert [sun_is_up(lat, lng, sets + by) for by in (-slack, slack)] == [True, False]


def test_beyond_the_polar_circle_the_sun_stays_up_in_june_and_down_in_december() -> None:
    assert all(sun_is_up(69.0, 25.7, us(2025, 6, 21, hour)) for hour in range(24))
    assert not any(sun_is_up(69.0, 25.7, us(2025, 12, 21, hour)) for hour in range(24))


def test_daylight_is_between_the_two_instants_and_nowhere_else() -> None:
    noon = us(2025, 9, 1, 10)
    rise, fall = daylight(66.5, 25.7, noon, (0, 1))

    second = 1_000_000
    assert [sun_is_up(66.5, 25.7, rise + by) for by in (-second, second)] == [False, True]
    assert [sun_is_up(66.5, 25.7, fall + by) for by in (-second, second)] == [True, False]
    assert rise < noon < fall
    assert rise % second == fall % second == 0


def test_at_noon_of_an_equinox_the_sun_stands_in_the_zenith_of_the_equator() -> None:
    assert sun_elevation_deg(0.0, 0.0, us(2024, 3, 20, 12, 7)) > 89.0


def test_the_airspace_knows_the_sun_over_its_base() -> None:
    ground = Airspace(site())

    assert ground.sun_is_up(us(2025, 6, 21, 12))
    assert not ground.sun_is_up(us(2025, 12, 21, 22))
    assert ground.sun_is_up(us(2025, 6, 21, 12))
