"""The gate as pure functions: who commands, what waits, for whom, and what is refused (safety: starting, keeping apart)."""

from typing import Any

import pytest

from formiga_bt.clock import SECOND
from formiga_bt.geo import Place, Position
from formiga_bt.safety.gate import Ask, Go, Hold, Refuse, judge, needs_clearance
from formiga_bt.safety.traffic import Traffic, traffic_of
from formiga_bt.transport.messages import Clearance

PORT, OTHER_PORT = Place(0.0, 0.0), Place(30.0, 0.0)
HERE = Position(0.0, 0.0, 60.0)
NOW = 1000 * SECOND


def ask(**fields: Any) -> Ask:
    given: dict[str, Any] = {
        "agent": "d1",
        "task": "T-1",
        "human": False,
        "reachable": True,
        "control": "engine",
        "position": HERE,
        "landed": "airborne",
        "ports": (PORT, OTHER_PORT),
        "home": PORT,
    }
    return Ask(**{**given, **fields})


def other(**fields: Any) -> Traffic:
    given: dict[str, Any] = {"agent": "d2", "task": "T-2", "landed": "airborne", "position": Position(100.0, 0.0, 60.0)}
    return traffic_of(**{**given, **fields})


def verdict(request: Ask, *traffic: Traffic) -> object:
    return judge(request, traffic, NOW, 15.0)


@pytest.mark.parametrize("control", ["pilot", "failsafe", "unknown"])
def test_nothing_is_sent_while_another_is_in_command(control: str) -> None:
    assert verdict(ask(control=control)) == Hold("control", control)


@pytest.mark.parametrize(
    ("fields", "held"),
    [
        ({"reachable": False}, Hold("suspect", "d1")),
        ({"busy": "T-1/1/steps/x"}, Hold("draining", "T-1/1/steps/x")),
        ({"held": True}, Hold("held", "T-1")),
        ({"taken": True}, Hold("control", "handback")),
        ({"stopped": "hold"}, Hold("stopped", "hold")),
        ({"locked": "return"}, Hold("lockdown", "return")),
        ({"deposed": True}, Hold("epoch", "a newer engine")),
        ({"deposed": True, "human": True}, Hold("epoch", "a newer engine")),
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
    assert verdict(ask(human=True, control="unknown")) == Go()
    assert verdict(ask(human=True, reachable=False)) == Hold("unreachable", "d1")


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
        ({"position": Position(100.0, 0.0, 0.0), "landed": "grounded", "rises_to_m": 60.0}, True),
        ({"position": Position(100.0, 0.0, 0.0), "landed": "grounded", "rises_to_m": 45.0}, False),
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


def test_a_vertical_move_keeps_half_the_separation() -> None:
    request = ask(position=Position(0.0, 0.0, 0.0), landed="grounded", starts_rotors=True, rises_to_m=60.0)

    assert isinstance(verdict(request, other(position=Position(8.0, 0.0, 60.0))), Go)
    assert verdict(request, other(position=Position(7.0, 0.0, 60.0))) == Hold("leg_busy", "d2")
