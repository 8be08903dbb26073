"""Numbers of an agent that nothing can reckon with: its goal fails, or it is counted; the engine goes on."""

import sys
from typing import Any

import pytest

from formiga_bt.base.geo import Place, Position, distance_m
from formiga_bt.engine.goals.wire_values import read_result
from formiga_bt.engine.kernel.inputs import BadStatusInput
from formiga_bt.lang.types import Type
from formiga_bt.rehearsal.testing import alarms
from formiga_bt.transport.messages import GoalEvent, QueryReplied
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART

MOVE = CART + "steps: [{do: cart.Move}]"
PLACE, POSITION, NUMBER = Type("place"), Type("position"), Type("distance")


@pytest.mark.parametrize(
    ("kind", "raw"),
    [
        (PLACE, {"east_m": "", "north_m": ""}),
        (PLACE, {"east_m": "nan", "north_m": 1}),
        (PLACE, {"east_m": "1", "north_m": 1}),
        (PLACE, {"east_m": 1e8, "north_m": 1}),
        (PLACE, {"east_m": 1}),
        (PLACE, "here"),
        (POSITION, {"east_m": 1, "north_m": 1, "up_m": sys.float_info.max}),
        (NUMBER, 1e300),
        (NUMBER, float("nan")),
        (Type("int"), 2**62),
        (Type("time"), -(2**62)),
        (Type("list", NUMBER), "12"),
        (Type("list", PLACE), [{"east_m": 1, "north_m": 1}, {}]),
        (Type("any"), {"deep": [[[{"n": 2**62}]]]}),
    ],
)
def test_a_result_that_cannot_be_read_is_refused(kind: Type, raw: Any) -> None:
    with pytest.raises((KeyError, TypeError, ValueError)):
        read_result({"x": kind}, {"x": raw})


def test_a_result_is_read_as_its_type_says() -> None:
    types = {"at": PLACE, "over": POSITION, "far": NUMBER, "n": Type("int"), "all": Type("list", NUMBER)}
    raw = {
        "at": {"east_m": 1, "north_m": -2.5},
        "over": {"is": "position", "east_m": 1, "north_m": 2, "up_m": 1e7},
        "far": 3,
        "n": 2**61,
        "all": [1, 2.5],
        "more": "left out",
    }
    assert read_result(types, raw) == {
        "at": Place(1.0, -2.5), "over": Position(1.0, 2.0, 1e7), "far": 3.0, "n": 2**61, "all": (1.0, 2.5),
    }  # fmt: skip


@pytest.mark.parametrize("n", [2**61 + 1, "many", None])
def test_a_result_out_of_bounds_fails_its_step(make: Make, n: Any) -> None:
    yard = make(MOVE)
    task = yard.start()

    yard.cart.succeed({"n": n})
    if n == 2**61 + 1:  # the wire refuses it: what became of the goal is asked for, and not told either
        yard.run_for(1)
        assert yard.task(task).status == "ACTIVE"
        bad = [step.input.text for step in yard.steps if isinstance(step.input, BadStatusInput)]
        assert set(bad) == {"an event whose result holds a whole number beyond 2**61"}
        yard.abort(task, how="abandon")
    else:
        assert yard.end(task) == ("FAILED", "failed:bad_result")


def test_an_agent_that_says_the_largest_float_for_no_fix_is_quarantined(make: Make) -> None:
    yard = make(MOVE)
    yard.cart.say(position=Position(sys.float_info.max, 0.0, 0.0))
    yard.run_for(6)

    assert (yard.record("c1").pool, yard.record("c1").quarantine) == ("QUARANTINED", "bad_status")
    assert yard.record("c1").position == Position(0.0, 0.0, 0.0)
    assert alarms(yard) == ["bad_status"]

    yard.cart.say(position=Position(0.0, 0.0, 0.0))
    yard.run_for(2)
    assert yard.record("c1").pool == "STANDBY"


def test_a_goal_with_a_number_of_five_thousand_digits_is_no_number(make: Make) -> None:
    yard = make(MOVE)
    boot = yard.record("c1").boot_id
    known = [f"Try-{'9' * 5000}/1/x", f"safety/c1/{'9' * 5000}", "Try-7/1/x"]
    events = tuple(GoalEvent(goal_id=one, agent="c1", state="succeeded", n=1) for one in known)
    yard.hub.transport.arrived(QueryReplied("c1", boot, events))
    yard.run_for(1)

    assert yard.engine.state.counters["task"] == 7
    assert "safety" not in yard.engine.state.counters


def test_a_distance_never_overflows() -> None:
    most = sys.float_info.max
    assert distance_m(Position(most, 0.0, 0.0), Position(-most, 0.0, 0.0)) == float("inf")
    assert distance_m(Position(3.0, 0.0, 0.0), Position(0.0, 4.0, 12.0)) == 13.0
