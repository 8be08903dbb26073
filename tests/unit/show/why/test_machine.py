"""`why` of a machine: who has it, which order stands on it, what its goals wait for, its task."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.causes import ClearanceHold
from formiga_bt.engine.kernel.records import Deadline, GoalRecord, Question, TaskHold
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import ClearanceDue
from formiga_bt.show.why.front import explain
from tests.golden import Wording
from tests.unit.services.fakes import NOW, machine, order, task


def told(state: EngineState) -> list[tuple[str, str, str]]:
    return [(line.code, line.text, line.hint) for line in explain(state, {}, "hwd_1", NOW)[1]]


@pytest.fixture
def state() -> EngineState:
    made = EngineState(now=NOW)
    made.agents["hwd_1"] = machine("hwd_1", role="drone")
    made.tasks["PickUp-3"] = task("PickUp-3", "hwd_1")
    return made


def test_its_order_its_gate_and_its_task(state: EngineState, wording: Wording) -> None:
    state.orders["hwd_1"] = order("hwd_1", "hold")
    state.goals["g"] = GoalRecord(
        id="g",
        agent="hwd_1",
        action="GoTo",
        task="PickUp-3",
        section="steps",
        state="gated",
        code="leg_busy",
        text="lwd_1",
    )

    wording(told(state))


@pytest.mark.parametrize(
    ("fields", "code", "text"),
    [
        ({"control": "pilot", "taken": True}, "control", "hwd_1 is in the hands of its pilot; nothing is sent to it"),
        ({"pool": "QUARANTINED", "quarantine": "cut"}, "quarantined", "hwd_1 is quarantined: cut; it gets no task"),
        ({"refused": "unlisted"}, "not_admitted", "hwd_1 is not admitted: unlisted"),
        ({"liveness": "LOST"}, "lost", "hwd_1 is not heard of; it counts as lost"),
        ({"pool": "PARKED_AWAY", "landed": "grounded"}, "parked_away", "hwd_1 stands away from its port"),
        ({"pool": "STANDBY"}, "free", "hwd_1 is free: it waits for a task that it fits"),
    ],
)
def test_what_keeps_it(state: EngineState, fields: dict[str, Any], code: str, text: str) -> None:
    state.agents["hwd_1"] = machine("hwd_1", **{"task": "", **fields})
    assert told(state)[0][:2] == (code, text)


@pytest.mark.parametrize(
    ("liveness", "quarantine", "hint"),
    [
        ("ALIVE", "abandoned", "look at it, then: formiga agents clear hwd_1"),
        ("ALIVE", "double", "two processes say that they are hwd_1: end one of them; it comes back by itself"),
        ("SUSPECT", "abandoned", "find it"),
        ("LOST", "lost", "find it; if you have taken it away: formiga agents removed hwd_1"),
        ("LOST", "removed", "when it is back and fit: formiga agents clear hwd_1"),
        ("ALIVE", "removed", "when it is back and fit: formiga agents clear hwd_1"),
    ],
)
def test_a_quarantine_tells_what_a_person_can_say(
    state: EngineState, liveness: str, quarantine: str, hint: str
) -> None:
    state.agents["hwd_1"] = machine("hwd_1", task="", pool="QUARANTINED", liveness=liveness, quarantine=quarantine)
    (line,) = [one for one in told(state) if one[0] == "quarantined"]
    assert line[2] == hint


def test_what_waits_for_people_to_stand_clear_tells_its_question_once_with_the_time_that_is_left(
    state: EngineState, wording: Wording
) -> None:
    state.tasks["PickUp-3"] = task("PickUp-3", "hwd_1", hold=TaskHold(causes=(ClearanceHold("hwd_1"),)))
    state.goals["g"] = GoalRecord(
        id="g", agent="hwd_1", action="LandIn", task="PickUp-3", section="steps", state="gated", code="clearance"
    )
    state.questions["clear/hwd_1/1"] = Question(
        id="clear/hwd_1/1", number="Q1", task="PickUp-3", priority="medium", kind="clearance", text="Clear?",
        options=("clear", "wait"), tiers=(("eve",),), asked_at=NOW, expires_at=NOW + 300 * SECOND,
        if_no_answer="hwd_1 does not land here",
    )  # fmt: skip
    state.deadlines[ClearanceDue("hwd_1")] = Deadline(NOW + 80 * SECOND, 1)

    lines = told(state)

    assert [code for code, _, _ in lines] == ["gate.clearance", "question", "task", "held.clearance"]
    wording(lines[1][1])
    assert not any("formiga continue" in hint for _, _, hint in lines)  # it would be refused
