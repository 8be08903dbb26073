"""`why` of tasks that do not go on: the words for each cause of HELD, each order, each interruption, each broken limit."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.causes import HoldCause, LockdownHold, OperatorHold, ResumeHold, TakeOverHold
from formiga_bt.engine.kernel.records import (
    FoundMachine,
    GoalRecord,
    Lockdown,
    TaskFamily,
    TaskHold,
    TaskRestart,
    Verdict,
)
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.nodes.run import TaskOutcome
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.services.standing import lockdown_fact, order_fact
from formiga_bt.show.facts import Because
from formiga_bt.show.why.front import explain
from formiga_bt.show.why.standing import stands
from formiga_bt.show.why.text import in_words
from formiga_bt.show.why.words import GATE, HOLDS, REASONS, VERDICTS, say
from tests.golden import Wording
from tests.unit.services.fakes import NOW, machine, order, task


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return packaged_world()[1]


@pytest.fixture
def state() -> EngineState:
    made = EngineState(now=NOW)
    made.agents["hwd_1"] = machine("hwd_1", position=Position(10.0, 20.0, 60.0))
    made.tasks["PickUp-3"] = task("PickUp-3", "hwd_1")
    return made


def told(state: EngineState, catalogue: Catalogue | None = None, now: int = NOW) -> list[Because]:
    return explain(state, {}, "PickUp-3", now, catalogue=catalogue)[1]


def one(state: EngineState, code: str, catalogue: Catalogue | None = None) -> Because:
    (line,) = [line for line in told(state, catalogue) if line.code == code]
    return line


def held(state: EngineState, *causes: HoldCause, found: dict[str, FoundMachine] | None = None, **fields: Any) -> None:
    state.tasks["PickUp-3"] = task("PickUp-3", "hwd_1", hold=TaskHold(causes=causes, found=found or {}), **fields)


def goal(known: EngineState, **fields: Any) -> None:
    given = {
        "id": "PickUp-3/1/steps/steps[2]",
        "agent": "hwd_1",
        "action": "GoTo",
        "task": "PickUp-3",
        "section": "steps",
    }
    known.goals["g"] = GoalRecord(**{**given, **fields})


# -- HELD --------------------------------------------------------------------------------------------------------------------
def test_a_stop_of_one_machine_says_who_stopped_it_what_it_does_and_what_to_say(
    state: EngineState, wording: Wording
) -> None:
    held(state, OperatorHold("hwd_1"))
    state.orders["hwd_1"] = order("hwd_1", "hold")

    line = one(state, "held.operator")

    wording(line.text, line.hint)
    assert "order.hold" not in [line.code for line in told(state)]


def test_a_task_that_was_interrupted_by_a_lockdown_waits_for_a_word(state: EngineState, wording: Wording) -> None:
    held(state, OperatorHold())
    wording(one(state, "held.operator").text)


@pytest.mark.parametrize(
    ("found", "fields", "landed", "tail", "hint"),
    [
        ({}, {}, "grounded", "", "formiga continue PickUp-3 | formiga abort PickUp-3"),
        (
            {"hwd_1": FoundMachine("was moved")}, {}, "grounded", "; hwd_1 was moved while the engine was away",
            "formiga continue PickUp-3 | formiga abort PickUp-3",
        ),
        (
            {"hwd_1": FoundMachine("landed", flew=True)}, {}, "grounded",
            "; hwd_1 landed while the engine was away, and its next step may need hwd_1 in the air",
            "formiga restart PickUp-3 | formiga abort PickUp-3",
        ),
        (  # a pilot brought it up again
            {"hwd_1": FoundMachine("landed", flew=True)}, {}, "airborne", "; hwd_1 landed while the engine was away",
            "formiga continue PickUp-3 | formiga abort PickUp-3",
        ),
        (  # what ends is not begun anew
            {"hwd_1": FoundMachine("landed", flew=True)}, {"section": "on_failure"}, "grounded",
            "; hwd_1 landed while the engine was away", "formiga continue PickUp-3 | formiga abort PickUp-3",
        ),
    ],
)  # fmt: skip
def test_what_was_found_after_an_outage_is_told_and_says_whether_it_can_go_on(
    state: EngineState,
    found: dict[str, FoundMachine],
    fields: dict[str, Any],
    landed: str,
    tail: str,
    hint: str,
    wording: Wording,
) -> None:
    held(state, ResumeHold(), found=found, **fields)
    state.agents["hwd_1"] = machine("hwd_1", landed=landed)
    line = one(state, "held.resume")
    wording(line.text)
    assert line.hint == hint


def test_lockdown_says_by_whom_and_how_to_release_it(state: EngineState, wording: Wording) -> None:
    held(state, LockdownHold())
    state.lockdown = Lockdown("hold", "eve", NOW - 40 * SECOND)
    line = one(state, "held.lockdown")
    wording(line.text)
    assert line.hint == "formiga lockdown release"


@pytest.mark.parametrize(
    ("control", "text", "hint"),
    [
        (
            "engine",
            "HELD: a pilot, or its own failsafe, has taken hwd_1 over; it has been given back, and a person must say what"
            " becomes of it",
            "formiga handback hwd_1 --continue|--return|--end",
        ),
        (
            "pilot",
            "HELD: a pilot, or its own failsafe, has taken hwd_1 over; once its pilot gives it back:"
            " formiga handback hwd_1 --continue|--return|--end",
            "",
        ),
    ],
)
def test_a_take_over_says_whose_turn_it_is(state: EngineState, control: str, text: str, hint: str) -> None:
    held(state, TakeOverHold("hwd_1"))
    state.agents["hwd_1"] = machine("hwd_1", control=control, taken=True)
    line = one(state, "held.take-over")
    assert (line.text, line.hint) == (text, hint)


# -- orders, breaches ------------------------------------------------------------------------------------------------------
def test_an_order_of_the_engine_says_which_limit_was_broken(state: EngineState, wording: Wording) -> None:
    state.orders["hwd_1"] = order("hwd_1", "return", by="engine", scope="engine", why="envelope.keep_in")
    line = one(state, "order.return")
    wording(line.text)
    assert line.hint == ""


@pytest.mark.parametrize(
    ("breach", "code", "text"),
    [
        (
            "reserve", "envelope.reserve",
            "hwd_1 breaks its limit `reserve`: too little charge to come home with its reserve (battery 60 %)",
        ),
        (
            "keep_out", "envelope.keep_out",
            "hwd_1 breaks its limit `keep_out`: in or through a no-fly zone (at 10 E 20 N, 60 m up)",
        ),
        (
            "!wind_max", "envelope.wind_max",
            "hwd_1 breaks its limit `wind_max`: more wind than is allowed (5.0 m/s);"
            " its landing is finished first, then its task ends",
        ),
    ],
)  # fmt: skip
def test_a_breach_has_its_numbers(state: EngineState, breach: str, code: str, text: str) -> None:
    state.agents["hwd_1"] = machine("hwd_1", breach=breach, wind=(3.0, -4.0), position=Position(10.0, 20.0, 60.0))
    assert one(state, code).text == text


# -- interrupted -------------------------------------------------------------------------------------------------------------
def test_an_interrupted_goal_says_by_whom_and_that_continue_sends_it_again(
    state: EngineState, catalogue: Catalogue, wording: Wording
) -> None:
    state.orders["hwd_1"] = order("hwd_1", "hold")
    goal(state, state="interrupted", code="stopped")
    wording(one(state, "interrupted", catalogue).text)
    goal(state, state="interrupted", code="taken_over")
    wording(one(state, "interrupted", catalogue).text)


def test_what_may_not_be_done_twice_cannot_be_continued(
    state: EngineState, catalogue: Catalogue, wording: Wording
) -> None:
    goal(state, state="interrupted", code="stopped", action="Explore", repeatable=False)
    line = one(state, "cannot_continue", catalogue)
    wording(line.text, line.hint)


def test_a_flight_cannot_be_continued_on_the_ground(state: EngineState, catalogue: Catalogue, wording: Wording) -> None:
    state.agents["hwd_1"] = machine("hwd_1", landed="grounded")
    goal(state, state="interrupted", code="stopped")
    wording(one(state, "cannot_continue", catalogue).text)


@pytest.mark.parametrize(
    ("code", "whom", "text"),
    [
        ("stopped", "hold", "hwd_1.GoTo waits: the order `hold` stands on hwd_1"),
        ("lockdown", "return", "hwd_1.GoTo waits: the site is locked down (return)"),
        ("control", "pilot", "hwd_1.GoTo waits until the engine is in command again (now: pilot)"),
        (
            "control", "handback",
            "hwd_1.GoTo waits until a person hands it back: formiga handback hwd_1 --continue|--return|--end",
        ),
        ("epoch", "a newer engine", "hwd_1.GoTo is not sent any more: a newer engine commands this site"),
        ("port_busy", "hwd_2", "hwd_1.GoTo waits until hwd_2 has left the port"),
    ],
)  # fmt: skip
def test_each_code_of_the_gate_has_words(state: EngineState, code: str, whom: str, text: str) -> None:
    goal(state, state="gated", code=code, text=whom)
    assert one(state, f"gate.{code}").text == text


# -- beginning anew, waiting ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("again", "reason", "text"),
    [
        (
            "preempted", "for PickUp-9",
            "it steps aside: it is being preempted for PickUp-9; its machines come home, then it begins anew from its"
            " first step",
        ),
        (
            "restart", "by eve",
            "a person restarts it by eve; its machines come home, then it begins anew from its first step",
        ),
    ],
)  # fmt: skip
def test_a_task_that_begins_anew_says_why(state: EngineState, again: Any, reason: str, text: str) -> None:
    outcome = TaskOutcome(status="CANCELED", code="aborted", reason=reason)
    held(state, restart=TaskRestart(why=again), outcome=outcome, section="on_abort", status="ENDING")
    assert told(state)[0].text == text


def test_a_task_that_waits_in_lockdown_says_so_first(state: EngineState, wording: Wording) -> None:
    held(state, status="PENDING", section="")
    state.lockdown = Lockdown("return", "eve", NOW - 3 * SECOND)
    first = told(state)[0]
    assert (first.code, first.hint) == ("lockdown", "formiga lockdown release")
    wording(first.text)


@pytest.mark.parametrize("code", ["ordered", "preflight", "no_checks", "kept", "preempting"])
def test_each_refusal_of_the_allocator_has_words(code: str) -> None:
    assert say(VERDICTS, Verdict("drone", "hwd_1", code).code, detail="x") != f"{code} x"


@pytest.mark.parametrize("cause", ["operator", "lockdown", "take-over", "clearance", "resume"])
def test_each_cause_of_held_has_words(cause: str) -> None:
    assert say(HOLDS, cause, agent="hwd_1") != cause


def test_each_limit_of_the_envelope_has_words_and_an_unknown_one_too(wording: Wording) -> None:
    from formiga_bt.lang.site.envelope import BREACHES

    assert [name for name in BREACHES if f"envelope.{name}" not in REASONS] == []
    assert say(REASONS, "envelope.new") == REASONS["envelope"]
    wording(say(GATE, "stopped", text="cut", agent="a"))


# -- families ----------------------------------------------------------------------------------------------------------
def test_a_task_names_the_open_tasks_that_it_requested(state: EngineState, wording: Wording) -> None:
    state.tasks["PickUp-3"] = task("PickUp-3", family=TaskFamily(children=("Look-4", "Look-5", "Look-6")))
    state.tasks["Look-4"] = task("Look-4", family=TaskFamily(parent="PickUp-3"), section="done", status="SUCCEEDED")
    state.tasks["Look-5"] = task(
        "Look-5", family=TaskFamily(parent="PickUp-3"), hold=TaskHold(causes=(OperatorHold(),))
    )
    state.tasks["Look-6"] = task(
        "Look-6", family=TaskFamily(parent="PickUp-3", detached=True), status="PENDING", section=""
    )

    lines = [(line.text, line.hint) for line in told(state) if line.code == "child"]

    wording(lines)


@pytest.mark.parametrize(("detached", "then"), [(False, "ends with it"), (True, "outlives it")])
@pytest.mark.parametrize(("status", "section"), [("PENDING", ""), ("ACTIVE", "steps"), ("SUCCEEDED", "done")])
def test_a_requested_task_names_who_requested_it(
    state: EngineState, status: str, section: str, detached: bool, then: str, wording: Wording
) -> None:
    state.tasks["PickUp-3"] = task(
        "PickUp-3", family=TaskFamily(parent="Tour-1", detached=detached), status=status, section=section
    )

    line = one(state, "parent")

    assert line.hint == "formiga why Tour-1"
    wording(line.text)


def test_a_parent_whose_ended_child_was_forgotten_is_explained_all_the_same(
    state: EngineState, wording: Wording
) -> None:
    held(state, OperatorHold(), family=TaskFamily(children=("Look-4",)))
    wording(one(state, "held.operator").hint)


def test_an_explanation_does_not_send_to_itself_and_helps_once(state: EngineState) -> None:
    state.tasks["PickUp-3"] = task(
        "PickUp-3",
        "hwd_1",
        hold=TaskHold(causes=(OperatorHold(), OperatorHold("hwd_1"))),
        section="finally",
        status="ENDING",
    )
    state.orders["hwd_1"] = order("hwd_1", "hold")
    assert all("formiga why PickUp-3" not in line.hint for line in told(state))
    lines = [Because("a", "one", "formiga agents"), Because("b", "two", "formiga agents")]
    assert in_words("X ACTIVE", lines).count("-> formiga agents") == 1


def test_an_order_is_as_old_as_the_clock_says_not_as_the_newest_step(state: EngineState, wording: Wording) -> None:
    state.orders["hwd_1"] = order("hwd_1", "hold")
    state.lockdown = Lockdown("return", "eve", NOW)
    later = NOW + 600 * SECOND
    assert stands(state, state.orders["hwd_1"], later).startswith("HOLD by ")
    wording(stands(state, state.orders["hwd_1"], later))
    assert order_fact(state, state.orders["hwd_1"], later).since == NOW
    assert "since 10 min" in lockdown_fact(state, later).text
