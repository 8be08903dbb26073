"""What the envelope says at each status of a machine in the air."""

from typing import Any

from msgspec import structs

from formiga_bt.base.energy import way_pct
from formiga_bt.base.geo import Place, Position
from formiga_bt.safety.envelope import Breach, FlightState, at_gate, in_flight
from tests.golden import Wording
from tests.unit.safety.grounds import HOME, POWER, RULES, airspace, flight, hilly, state

AIR = airspace()


def told(now: FlightState, ground: Any = AIR, **tighter: Any) -> list[str]:
    return [f"{b.name}: {b.text}" for b in in_flight(now, ground, structs.replace(RULES, **tighter))]


def test_within_all_limits_nothing_is_told() -> None:
    assert in_flight(state(Position(-300, 200, 60)), AIR, RULES) == ()


def test_where_it_is_and_how_deep_is_told(wording: Wording) -> None:
    wording(told(state(Position(-512.04, 0, 60))), told(state(Position(103, 0, 60))))
    wording(told(state(Position(0, 80, 121.5))), told(state(Position(-200, 0, 4))))


def test_the_reserve_is_for_the_way_home_from_here(wording: Wording) -> None:
    """1000 m of way would be 10 points; 400 m are 4, and the descent 3."""
    assert told(state(Position(-400, 0, 60), battery=32.0)) == []
    wording(told(state(Position(-400, 0, 60), battery=31.9)))
    assert told(state(Position(-400, 0, 60), battery=31.9), reserve_pct=20.0) == []


def test_a_landing_at_home_is_reckoned_as_such() -> None:
    low = state(Position(0, 0, 10), battery=25.6, spots=(HOME,))

    assert told(low) != []  # it would climb to its layer and come down again
    assert told(structs.replace(low, lands_at=HOME)) == []


def test_low_near_take_off_home_and_landing_spot_is_fine() -> None:
    low = Position(-200, 0, 2)

    assert told(state(low, lands_at=Place(-195, 0))) == []
    assert told(state(low, spots=(Place(-195, 0),))) == []
    assert told(state(Position(5, 0, 2))) == []
    assert told(state(low)) != []


def test_wind_and_night_are_told(wording: Wording) -> None:
    wording(told(state(Position(-100, 0, 60), wind=(8.0, 8.0))))
    wording(told(state(Position(-100, 0, 60), sun_up=False), daylight_only=True))


def test_a_landing_in_its_last_phase_is_finished_in_spite_of_charge_wind_and_night() -> None:
    spot = Place(-400, 0)
    now = state(
        Position(-400, 0, 8), battery=26.0, wind=(0.0, 10.5), sun_up=False, lands_at=spot, descending=True, layer_m=60.0
    )

    breaches = in_flight(now, AIR, structs.replace(RULES, daylight_only=True))

    assert [(b.name, b.only_alarm) for b in breaches] == [
        ("reserve", True),
        ("wind_max", True),
        ("daylight_only", True),
    ]
    in_the_lake = in_flight(structs.replace(now, here=Position(150, 0, 8), lands_at=Place(150, 0)), AIR, RULES)
    assert (in_the_lake[0].name, in_the_lake[0].only_alarm) == ("keep_out", False)


def test_several_are_told_the_gravest_first() -> None:
    worst = state(Position(150, 0, 130), battery=5.0, wind=(8.0, 8.0))

    assert [b.name for b in in_flight(worst, AIR, RULES)] == ["keep_out", "max_height", "reserve", "wind_max"]


def test_unknown_place_ground_and_charge_are_breaches(wording: Wording) -> None:
    assert in_flight(state(None), AIR, RULES) == (Breach("position", "it is not known where hwd_1 is"),)
    wording(told(state(Position(-490, 490, 60)), hilly()))
    wording(told(state(Position(-100, 0, 60), battery=None)))


def test_a_machine_without_known_drain_has_no_reserve_to_break() -> None:
    assert told(state(Position(-100, 0, 60), battery=None, power=None)) == []


def test_who_passed_the_gate_is_within_its_reserve_on_the_way() -> None:
    """The gate reckons with the worst point of a leg, so that a flight as reckoned is no breach on its way."""
    here, there = Position(-50, 20, 20), Position(-450, 300, 90)
    for tenths in range(300, 600):
        asked = flight(here, there, battery=tenths / 10, wind=(2.0, -3.0))
        if at_gate(asked, AIR, RULES) is None:
            break
    assert 30.0 < tenths / 10 < 50.0
    for k in range(51):
        share = k / 50
        now = Position(-50 - 400 * share, 20 + 280 * share, 20 + 70 * share)
        left = tenths / 10 - way_pct(here, now, POWER, (2.0, -3.0))

        assert told(state(now, battery=left, wind=(2.0, -3.0))) == []
