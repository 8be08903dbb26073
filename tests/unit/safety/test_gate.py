"""The gate as pure functions: who commands, what waits, for whom, and what is refused (safety: starting, keeping apart)."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.safety.envelope import Breach
from formiga_bt.safety.gate import GateInput, Go, Hold, Refuse, judge, needs_clearance
from formiga_bt.safety.traffic import TakenArea, Traffic, traffic_of
from formiga_bt.transport.messages import Clearance

PORT, OTHER_PORT = Place(0.0, 0.0), Place(30.0, 0.0)
HERE = Position(0.0, 0.0, 60.0)
NOW = 1000 * SECOND


def ask(**fields: Any) -> GateInput:
    given: dict[str, Any] = {
        "agent": "d1",
        "task": "T-1",
        "mobility": "air",
        "reachable": True,
        "control": "engine",
        "position": HERE,
        "landed": "airborne",
        "ports": (PORT, OTHER_PORT),
        "home": PORT,
    }
    return GateInput(**{**given, **fields})


def other(**fields: Any) -> Traffic:
    given: dict[str, Any] = {"agent": "d2", "task": "T-2", "landed": "airborne", "position": Position(100.0, 0.0, 60.0)}
    return traffic_of(**{**given, **fields})


def verdict(request: GateInput, *traffic: Traffic) -> object:
    return judge(request, traffic, NOW, 15.0)


@pytest.mark.parametrize("control", ["pilot", "failsafe", "unknown"])
def test_nothing_is_sent_while_another_is_in_command(control: str) -> None:
    assert verdict(ask(control=control)) == Hold("control", control)


@pytest.mark.parametrize(
    ("fields", "held"),
    [
        ({"reachable": False}, Hold("suspect", "d1")),
        ({"quarantined": True}, Hold("quarantined", "d1")),
        ({"busy": "T-1/1/steps/x"}, Hold("draining", "T-1/1/steps/x")),
        ({"held": True}, Hold("held", "T-1")),
        ({"taken": True}, Hold("control", "handback")),
        ({"stopped": "hold"}, Hold("stopped", "hold")),
        ({"locked": "return"}, Hold("lockdown", "return")),
        ({"deposed": True}, Hold("epoch", "a newer engine")),
        ({"deposed": True, "mobility": "people"}, Hold("epoch", "a newer engine")),
        ({"deposed": True, "safety": True}, Hold("epoch", "a newer engine")),
        ({"safety": True, "control": "pilot"}, Hold("control", "pilot")),
        ({"safety": True, "taken": True}, Hold("control", "handback")),
    ],
)
def test_what_waits(fields: dict[str, Any], held: Hold) -> None:
    assert verdict(ask(**fields)) == held


def test_a_safety_goal_replaces_what_runs() -> None:
    assert verdict(ask(busy="T-1/1/steps/x", safety=True)) == Go()


def test_people_only_wait_until_they_can_be_reached() -> None:
    assert verdict(ask(mobility="people", control="unknown")) == Go()
    assert verdict(ask(mobility="people", reachable=False)) == Hold("unreachable", "d1")


def test_a_goal_that_does_not_move_has_no_leg() -> None:
    assert verdict(ask(), other(position=HERE)) == Go()


# -- clearance -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fields", "needed"),
    [
        ({"lands": True, "target": PORT}, False),
        ({"lands": True, "target": Place(2.9, 0.0)}, False),
        ({"lands": True, "target": Place(3.1, 0.0)}, True),
        ({"starts_rotors": True, "position": Position(0.0, 0.0, 0.0)}, False),
        ({"starts_rotors": True, "position": Position(0.0, 9.0, 0.0)}, True),
        ({"starts_rotors": True, "position": None}, True),
        ({"starts_rotors": True, "position": Position(0.0, 9.0, 0.0), "exempt_clearance": True}, False),
        ({"target": Position(0.0, 90.0, 60.0)}, False),
    ],
)
def test_clearance_is_needed_away_from_ports_only(fields: dict[str, Any], needed: bool) -> None:
    assert needs_clearance(ask(**fields)) is needed


@pytest.mark.parametrize(("age_s", "goes"), [(0, True), (60, True), (60.001, False), (600, False)])
def test_a_word_holds_for_sixty_seconds(age_s: float, goes: bool) -> None:
    word = Clearance("ann", NOW - round(age_s * SECOND))
    request = ask(lands=True, target=Place(0.0, 9.0), clearance=word, cleared=Place(0.0, 9.0))

    assert isinstance(verdict(request), Go) is goes
    if not goes:
        assert verdict(request) == Hold("clearance")


@pytest.mark.parametrize(("off_m", "goes"), [(0.0, True), (5.0, True), (5.01, False)])
def test_a_word_counts_only_near_the_spot_that_it_was_given_for(off_m: float, goes: bool) -> None:
    word = Clearance("ann", NOW)
    landing = ask(lands=True, target=Place(0.0, 50.0), clearance=word, cleared=Place(off_m, 50.0))
    start = ask(
        starts_rotors=True,
        landed="grounded",
        position=Position(0.0, 50.0, 0.0),
        clearance=word,
        cleared=Place(0.0, 50.0 + off_m),
    )

    assert isinstance(verdict(landing), Go) is goes
    assert isinstance(verdict(start), Go) is goes


def test_nobody_is_asked_before_the_way_is_free() -> None:
    landing = ask(lands=True, target=Place(0.0, 50.0))
    start = ask(starts_rotors=True, landed="grounded", position=Position(0.0, 50.0, 0.0), rises_to_m=60.0)
    over_it = other(position=Position(0.0, 50.0, 30.0))

    for request in (landing, start):
        assert verdict(request, over_it) == Hold("leg_busy", "d2")
        assert verdict(request) == Hold("clearance")


def test_who_is_asked_already_is_not_called_off_when_the_way_is_taken_meanwhile() -> None:
    landing = ask(lands=True, target=Place(0.0, 50.0), asked=True)

    assert verdict(landing, other(position=Position(0.0, 50.0, 30.0))) == Hold("clearance")


def test_a_word_for_no_known_spot_does_not_count() -> None:
    assert verdict(ask(lands=True, target=Place(0.0, 50.0), clearance=Clearance("ann", NOW))) == Hold("clearance")


# -- the envelope ----------------------------------------------------------------------------------------------------------


def test_a_breach_of_the_envelope_is_refused_with_its_code_and_numbers() -> None:
    breach = Breach("max_height", "130 m over the ground, allowed are 120 m", 130.0, 120.0)

    found = judge(ask(target=Position(0.0, 0.0, 130.0)), (), NOW, 15.0, 3.0, lambda: breach)

    assert found == Refuse("envelope.max_height", "130 m over the ground, allowed are 120 m", 130.0)


def test_what_waits_for_command_is_not_judged_by_limits_yet() -> None:
    def limits() -> Breach:
        raise AssertionError("asked too early")

    assert judge(ask(held=True), (), NOW, 15.0, 3.0, limits) == Hold("held", "T-1")


def test_nobody_is_asked_to_clear_a_landing_that_may_not_be() -> None:
    breach = Breach("keep_out", "the lake is no place to land")
    landing = ask(lands=True, target=Place(0.0, 50.0))

    assert isinstance(judge(landing, (), NOW, 15.0, 3.0, lambda: breach), Refuse)


# -- spots and ports -------------------------------------------------------------------------------------------------------


def test_a_foreign_port_is_refused() -> None:
    found = verdict(ask(lands=True, target=OTHER_PORT, position=Position(30.0, 0.0, 60.0)))

    assert isinstance(found, Refuse)
    assert found.code == "foreign_port"


@pytest.mark.parametrize(
    "there",
    [
        {"landed": "grounded", "position": Position(0.0, 51.0, 0.0)},
        {"landed": "unknown", "position": Position(0.0, 51.0, 0.2)},
        {"leg": (Position(0.0, 51.0, 200.0), Position(0.0, 51.0, 0.0)), "position": Position(0.0, 51.0, 200.0)},
    ],
)
def test_nobody_lands_where_another_stands_or_will_land(there: dict[str, Any]) -> None:
    word = Clearance("ann", NOW)
    request = ask(
        lands=True,
        target=Place(0.0, 50.0),
        position=Position(0.0, 50.0, 60.0),
        clearance=word,
        cleared=Place(0.0, 50.0),
    )

    assert verdict(request, other(**there)) == Hold("spot_busy", "d2")


ON_MY_PORT = {"landed": "grounded", "position": Position(0.5, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("fields", "there", "found"),
    [
        # the leg home, and the landing, wait for who is on the port
        (
            {"target": Position(0.0, 0.0, 60.0), "position": Position(90.0, 0.0, 60.0)},
            ON_MY_PORT,
            Hold("port_busy", "d2"),
        ),
        ({"lands": True, "target": PORT}, ON_MY_PORT, Hold("port_busy", "d2")),
        # or who is about to land there, also one of the same task
        (
            {"lands": True, "target": PORT},
            {"leg": (HERE, Position(0.0, 0.0, 0.0)), "position": HERE},
            Hold("port_busy", "d2"),
        ),
        ({"lands": True, "target": PORT}, {**ON_MY_PORT, "task": "T-1"}, Hold("port_busy", "d2")),
        # a climb at the port does not
        ({"target": Position(0.0, 0.0, 75.0)}, ON_MY_PORT, None),
        # nor does a machine that stands beside it
        ({"lands": True, "target": PORT}, {"landed": "grounded", "position": Position(3.0, 0.0, 0.0)}, None),
    ],
)
def test_the_own_port_must_be_free(fields: dict[str, Any], there: dict[str, Any], found: Hold | None) -> None:
    got = verdict(ask(**fields), other(**there))

    assert got == found if found is not None else isinstance(got, Go)


def test_spots_are_as_far_apart_as_the_site_says() -> None:
    word = Clearance("ann", NOW)
    request = ask(lands=True, target=Place(0.0, 50.0), clearance=word, cleared=Place(0.0, 50.0))
    beside = other(landed="grounded", position=Position(0.0, 54.0, 0.0))

    assert isinstance(judge(request, [beside], NOW, 15.0, 4.0), Go)
    assert judge(request, [beside], NOW, 15.0, 4.1) == Hold("spot_busy", "d2")


# -- keeping apart ---------------------------------------------------------------------------------------------------------

ACROSS = {"target": Position(200.0, 0.0, 60.0)}


@pytest.mark.parametrize(
    ("there", "waits"),
    [
        ({"position": Position(100.0, 14.9, 60.0)}, True),
        ({"position": Position(100.0, 15.0, 60.0)}, False),
        ({"position": Position(100.0, 0.0, 75.0)}, False),
        ({"position": Position(100.0, 0.0, 74.0)}, True),
        ({"position": Position(100.0, 0.0, 0.0), "landed": "grounded"}, False),
        ({"position": Position(100.0, 0.0, 60.0), "task": "T-1"}, False),
        ({"position": Position(100.0, 0.0, 60.0), "task": ""}, True),
        ({"position": None}, False),
        ({"position": Position(100.0, 90.0, 60.0), "leg": (HERE, Position(100.0, -90.0, 60.0))}, True),
        # who stands below and will climb: fly over it, but do not stop there
        ({"position": Position(100.0, 0.0, 0.0), "landed": "grounded", "rises_to_m": 60.0}, False),
        ({"position": Position(200.0, 0.0, 0.0), "landed": "grounded", "rises_to_m": 60.0}, True),
        ({"position": Position(200.0, 0.0, 0.0), "landed": "grounded", "rises_to_m": 45.0}, False),
    ],
)
def test_a_leg_waits_for_who_is_within_the_separation(there: dict[str, Any], waits: bool) -> None:
    found = verdict(ask(**ACROSS), other(**there))

    if waits:
        assert found == Hold("leg_busy", "d2")
    else:
        assert found == Go((HERE, Position(200.0, 0.0, 60.0)))


def test_the_part_of_a_leg_that_was_flown_blocks_nobody() -> None:
    leg = (HERE, Position(0.0, 400.0, 60.0))
    gone = other(position=Position(0.0, 300.0, 60.0), leg=leg)

    assert isinstance(verdict(ask(target=Position(200.0, 0.0, 60.0)), gone), Go)


def test_an_explorer_takes_up_its_area_at_its_height() -> None:
    region = Region((Place(100.0, 0.0), Place(200.0, 0.0), Place(200.0, 80.0), Place(100.0, 80.0)))
    request = ask(region=region, rises_to_m=60.0, position=Position(150.0, 40.0, 60.0))

    found = verdict(request, other(position=Position(150.0, 40.0, 75.0)))

    assert found == Go(None, TakenArea(region.corners, 60.0))
    assert verdict(request, other(position=Position(110.0, 70.0, 74.0))) == Hold("leg_busy", "d2")


@pytest.mark.parametrize(
    ("there", "waits"),
    [
        (Position(8.0, 0.0, 30.0), False),
        (Position(7.0, 0.0, 30.0), True),
        (Position(14.9, 0.0, 60.0), True),  # where it ends it stays, and the other is at that height
        (Position(15.0, 0.0, 60.0), False),
    ],
)
def test_a_vertical_move_keeps_half_the_separation_but_where_it_stays(there: Position, waits: bool) -> None:
    request = ask(position=Position(0.0, 0.0, 0.0), landed="grounded", starts_rotors=True, rises_to_m=60.0)

    found = verdict(request, other(position=there))

    assert found == Hold("leg_busy", "d2") if waits else isinstance(found, Go)


def test_a_landing_keeps_half_the_separation() -> None:
    landing = ask(lands=True, target=PORT)

    assert isinstance(verdict(landing, other(position=Position(8.0, 0.0, 5.0))), Go)
    assert verdict(landing, other(position=Position(7.0, 0.0, 5.0))) == Hold("leg_busy", "d2")
