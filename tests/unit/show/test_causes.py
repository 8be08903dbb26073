"""The closed list of causes: complete, documented, and a wait whose cause has gone is told from the others."""

import re
from pathlib import Path
from typing import Any, get_args

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.engine.kernel.records import IN_FLIGHT, GoalState
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from formiga_bt.show.why.causes import CAUSES, causes_of
from formiga_bt.show.why.words import BLOCKED, GATE, HOLDS
from tests.missions.test_shipped import pick_up


@pytest.fixture
def flight() -> Any:
    site, catalogue = packaged_world()
    flown = Rehearsal(site, catalogue, [packaged_task("pick_up")], fleet_of(site, catalogue))
    flown.run_for(1)
    yield flown
    flown.close()


def codes(flight: Rehearsal, task: str, state: Any = None) -> list[str]:
    state = flight.engine.state if state is None else state
    return [cause.code for cause in causes_of(state, state.tasks[task])]


def test_every_code_of_a_gate_a_hold_and_a_block_is_a_cause() -> None:
    assert {f"gate.{code}" for code in GATE if code and ":" not in code} <= set(CAUSES)
    assert {f"held.{code}" for code in HOLDS if ":" not in code} <= set(CAUSES)
    assert {f"agents.{code}" for code in BLOCKED} <= set(CAUSES)
    assert {f"goal.{state}" for state in get_args(GoalState) if state in IN_FLIGHT} <= set(CAUSES)


def test_every_cause_is_documented() -> None:
    text = (Path(__file__).parents[3] / "docs/reasons.md").read_text()
    section = text.partition("## What a task waits for")[2].partition("\n## ")[0]

    assert dict(re.findall(r"^\| `([^`]+)` \| (.*) \|$", section, re.MULTILINE)) == dict(CAUSES)


def test_a_task_waits_for_its_goal_then_for_a_person(flight: Rehearsal) -> None:
    task = pick_up(flight)
    assert codes(flight, task) == ["agents"]
    flight.run_for(30)
    assert codes(flight, task) == ["goal.running"]

    flight.ask(Operator("hold", "hwd_1", "ann"))
    flight.run_for(5)

    assert codes(flight, task) == ["held.operator", "goal.interrupted"]


def test_a_wait_whose_cause_has_gone_has_none(flight: Rehearsal) -> None:
    task = pick_up(flight)
    flight.run_for(30)
    state = flight.engine.state
    (goal,) = [goal for goal in state.goals.values() if goal.task == task]

    ended = replace(state, goals={goal.id: replace(goal, state="succeeded")})
    gone = replace(state, goals={})
    unheard = replace(state, wall={})

    for broken in (ended, gone, unheard):
        assert "" in codes(flight, task, broken)
    assert "" not in codes(flight, task)
