"""Whole explanations as people read them, each pinned to its text: an engine in virtual time, and states made by hand."""

import re
from collections.abc import Iterator
from textwrap import dedent
from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.policy import closest_charged
from formiga_bt.engine.kernel.inputs import Abort, Operator
from formiga_bt.engine.kernel.records import (
    AgentRequest,
    GoalRecord,
    Question,
    Recovering,
    RoleRequest,
    TaskAgents,
    TaskFamily,
    TaskTimes,
    Verdict,
)
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.nodes.run import Failure, TaskOutcome
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of, simulated
from formiga_bt.rehearsal.testing import packaged_task, packaged_world, task_of
from formiga_bt.show.facts import ActionFact
from formiga_bt.show.why.chosen import chosen
from formiga_bt.show.why.front import explain
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.text import in_words
from tests.golden import Wording
from tests.unit.services.fakes import NOW, machine, order, task

SITE, CATALOGUE = packaged_world()
HOVER = """\
agents: {drone: {type: hwd}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: '${above(drone.home, 60 m)}'}
  - wait: 20 min
  - do: drone.LandIn
    with: {at: '${drone.home}'}
"""
ASK = """\
agents: {w: {type: picker, id: picker_1}, drone: {type: lwd, prefer: '${robot}'}}
params: {robot: {type: agent, of: [lwd], default: lwd_2}}
steps:
  - ask: Go?
    of: [w]
    options: [y, n]
    timeout: 30 s
"""
TEAM = "agents: {drone: {type: hwd, count: 3, wait: 1 min}}\nsteps: [{wait: 1 s}]\n"


class Field:
    """The demo site in virtual time; the silent never answer."""

    def __init__(self, *texts: tuple[str, str], silent: tuple[str, ...] = ("picker_1",)) -> None:
        never = [{"match": "*", "never": True}]
        site = simulated(SITE)
        made = [packaged_task("pick_up"), *(task_of(text, SITE, CATALOGUE, name=name) for name, text in texts)]
        self.run = Rehearsal(site, CATALOGUE, made, fleet_of(site, CATALOGUE, scripts=dict.fromkeys(silent, never)))
        self.run.run_for(1.0)

    def start(self, name: str, **params: str) -> str:
        values, problems, _ = bind_params(self.run.engine.core.models[name], params, SITE, self.run.now)
        assert not problems
        return self.run.submit(name, values)

    def told(self, of: str, *desk: str) -> str:
        run = self.run
        models = run.engine.core.models
        found = explain(run.engine.state, models, of, run.now, catalogue=CATALOGUE, wall=run.now, desk=desk)
        return re.sub(r"\S*/trees/", "trees/", in_words(*found)) + "\n"


@pytest.fixture
def field() -> Iterator[Field]:
    made = Field(("Hover", HOVER), ("Ask", ASK), ("Team", TEAM))
    yield made
    made.run.close()


def text(words: str) -> str:
    return dedent(words).lstrip("\n")


# -- by a real engine --------------------------------------------------------------------------------------------------
def test_who_waits_is_told_his_place_each_machine_and_what_stands_behind_it(field: Field, wording: Wording) -> None:
    for target, user in (("north_field", "picker_1"), ("east_field", "picker_2"), ("south_field", "picker_2")):
        field.start("PickUp", target=target, user=user)
    last = field.start("PickUp", target="south_field", user="picker_2")
    field.run.run_for(100.0)

    wording(field.told(last, "picker_1"))


def test_a_question_says_whom_it_asks_and_the_choice_what_it_cost(field: Field, wording: Wording) -> None:
    mine = field.start("PickUp", target="north_field", user="picker_1")
    field.run.run_for(100.0)

    wording(field.told(mine), field.told("hwd_1").splitlines()[:3], field.told("hwd_1").splitlines()[3])
    wording(field.told("picker_1").splitlines()[1])


def test_who_must_say_that_people_stand_clear_and_what_happens_if_nobody_does(wording: Wording) -> None:
    field = Field(silent=("picker_1", "watcher_1"))
    mine = field.start("PickUp", target="north_field", user="picker_1")
    field.run.run_for(100.0)

    wording(field.told(mine, "watcher_1"))
    field.run.close()


def test_a_wait_says_for_how_long_still_and_a_choice_who_was_passed_over(field: Field, wording: Wording) -> None:
    first = field.start("Hover")
    field.run.run_for(45.0)
    second = field.start("Hover")
    field.run.run_for(2.0)

    wording(field.told(first), field.told(second))


def test_a_failure_names_its_code_and_its_step_and_a_preference_is_told(field: Field, wording: Wording) -> None:
    mine = field.start("Ask")
    field.run.run_for(45.0)

    wording(field.told(mine))


def test_a_team_that_this_fleet_cannot_make_up_ends_with_who_fitted(field: Field, wording: Wording) -> None:
    mine = field.start("Team")
    field.run.run_for(20.0)

    wording(field.told(mine))


def test_a_stopped_machine_and_who_waits_for_it(field: Field, wording: Wording) -> None:
    first = field.start("Hover")
    field.run.run_for(45.0)
    field.run.ask(Operator("hold", "hwd_1", "eve"))
    field.run.ask(Operator("hold", "hwd_2", "eve"))
    second = field.start("Hover")
    field.run.run_for(2.0)

    wording(field.told(first), field.told(second))


def test_who_ended_a_task(field: Field, wording: Wording) -> None:
    mine = field.start("Hover")
    field.run.run_for(45.0)
    field.run.ask(Abort(mine, by="eve"))
    field.run.run_for(2.0)

    wording(field.told(mine).splitlines()[:2])
    field.run.run_for(300.0)
    wording(field.told(mine).splitlines()[1])


# -- by hand -----------------------------------------------------------------------------------------------------------
@pytest.fixture
def state() -> EngineState:
    made = EngineState(now=NOW)
    made.tasks["PickUp-3"] = task("PickUp-3", "hwd_1")
    made.agents["hwd_1"] = machine("hwd_1")
    return made


def by_hand(state: EngineState, of: str = "PickUp-3", actions: tuple[ActionFact, ...] = ()) -> str:
    return in_words(*explain(state, {}, of, NOW, catalogue=CATALOGUE, wall=NOW, actions=actions)) + "\n"


def flies(known: EngineState, agent: str, task_id: str, **fields: Any) -> None:
    """Let a machine of a task have a goal."""
    if task_id not in known.tasks:
        known.tasks[task_id] = task(task_id, agent)
    known.agents[agent] = machine(agent, task=task_id, **fields.pop("machine", {}))
    given = {"id": f"{task_id}/{agent}", "agent": agent, "action": "GoTo", "task": task_id, "section": "steps"}
    known.goals[agent] = GoalRecord(**{**given, "at": NOW - 20 * SECOND, **fields})


def gated(state: EngineState, agent: str, task_id: str, behind: str, code: str = "leg_busy") -> None:
    flies(state, agent, task_id, state="gated", code=code, text=behind)


def test_a_chain_of_machines_in_the_way_ends_with_what_moves(state: EngineState, wording: Wording) -> None:
    gated(state, "hwd_1", "PickUp-3", "lwd_1")
    gated(state, "lwd_1", "Look-4", "lwd_2", "port_busy")
    flies(state, "lwd_2", "Look-5", state="running", sent_at=NOW - 9 * SECOND, progress=0.4, action="LandIn")

    wording(by_hand(state))


def test_a_chain_of_machines_in_the_way_ends_with_a_person(state: EngineState, wording: Wording) -> None:
    gated(state, "hwd_1", "PickUp-3", "lwd_1")
    state.tasks["Look-4"] = task("Look-4", "lwd_1")
    state.agents["lwd_1"] = machine("lwd_1", task="Look-4")
    state.questions["q"] = Question(
        id="q", number="Q7", task="Look-4", priority="medium", kind="ask", text="Seen it?", options=("yes", "no"),
        tiers=(("eve",),), asked_at=NOW - 60 * SECOND, expires_at=NOW + 30 * SECOND, if_no_answer="it flies on",
    )  # fmt: skip

    wording(by_hand(state))


def test_machines_that_wait_for_each_other_are_told_once(state: EngineState, wording: Wording) -> None:
    gated(state, "hwd_1", "PickUp-3", "lwd_1")
    gated(state, "lwd_1", "Look-4", "hwd_1")

    wording(by_hand(state))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (
            {"liveness": "SUSPECT", "heard_wall": NOW - 7 * SECOND},
            "lwd_1 has not been heard of for 7 s; it counts as lost after 30 s\n"
            "        -> is its process running, and connected to this engine? formiga agents",
        ),
        (
            {"pool": "QUARANTINED", "quarantine": "crash"},
            "lwd_1 is quarantined: crash\n        -> look at it, then: formiga agents clear lwd_1",
        ),
        ({"control": "pilot", "taken": True}, "lwd_1 is in the hands of its pilot"),
        (
            {"task": "", "landed": "grounded", "pool": "PARKED_AWAY"},
            "lwd_1 is on the ground and has no task\n        -> bring it home: formiga return lwd_1",
        ),
    ],
)
def test_what_keeps_a_machine_in_the_way(state: EngineState, fields: dict[str, Any], words: str) -> None:
    gated(state, "hwd_1", "PickUp-3", "lwd_1")
    state.agents["lwd_1"] = machine("lwd_1", **{"task": "Look-4", **fields})

    assert by_hand(state).split("\n    ", 1)[1] == words + "\n"


def test_an_order_keeps_a_machine_in_the_way(state: EngineState, wording: Wording) -> None:
    gated(state, "hwd_1", "PickUp-3", "lwd_1")
    state.agents["lwd_1"] = machine("lwd_1", task="")
    state.orders["lwd_1"] = order("lwd_1", "hold")

    wording(by_hand(state).splitlines()[2:])


def test_a_failure_tells_what_was_tried_what_the_cleanup_did_and_who_stayed_out(
    state: EngineState, wording: Wording
) -> None:
    key = "steps/steps[1].steps[0]@3"
    state.tasks["PickUp-3"] = task(
        "PickUp-3",
        "hwd_1",
        status="FAILED",
        section="done",
        outcome=TaskOutcome(
            status="FAILED",
            code="failed:motor",
            reason="no thrust",
            failure=Failure("failed:motor", "no thrust", key, "hwd_2"),
            notes=("finally: rejected",),
        ),
        family=TaskFamily(children=("Look-4",)),
        agents=TaskAgents(
            roles={"drone": ("hwd_1",)}, granted=("hwd_1",), recovering=(Recovering("hwd_1", 3, "failed"),)
        ),
    )
    state.tasks["Look-4"] = task(
        "Look-4", status="FAILED", section="done", outcome=TaskOutcome(status="FAILED", code="agent_lost")
    )
    state.goals.clear()

    def sent(agent: str, path: str, action: str = "GoTo", **fields: str) -> ActionFact:
        return ActionFact(task="PickUp-3", agent=agent, action=action, start=1, end=2, path=path, **fields)

    step = "steps/steps[1].steps[0]"
    actions = (
        sent("hwd_1", step, state="failed", code="failed:motor"),
        sent("hwd_1", step, state="lost"),
        sent("hwd_2", step, state="failed", code="motor"),
        sent("hwd_2", "on_failure/steps[0]", "Land", state="succeeded"),
    )

    wording(by_hand(state, actions=actions))


def test_many_agents_refused_for_one_reason_are_counted(state: EngineState, wording: Wording) -> None:
    state.tasks["PickUp-3"] = task(
        "PickUp-3", status="PENDING", section="", times=TaskTimes(submitted_at=NOW - 5 * SECOND)
    )
    state.requests["PickUp-3"] = AgentRequest(
        holder="PickUp-3", priority="high", order=1, at=NOW,
        roles=(RoleRequest(role="drone", types=("hwd",), shared=False),), expires=NOW + 90 * SECOND,
    )  # fmt: skip
    state.explanations["PickUp-3"] = (
        Verdict("drone", "hwd_0", "quarantined", detail="crash"),
        *(Verdict("drone", f"hwd_{n}", "battery", detail=f"{n} % < 40 %") for n in range(1, 8)),
        Verdict("drone", "lwd_1", "wrong_type", detail="lwd"),
    )

    wording(by_hand(state))


def test_a_parent_follows_its_child_down_to_what_moves(state: EngineState, wording: Wording) -> None:
    state.agents.clear()
    state.tasks["PickUp-3"] = task("PickUp-3", family=TaskFamily(children=("Look-4",)))
    state.tasks["Look-4"] = task("Look-4", family=TaskFamily(parent="PickUp-3", children=("Look-5",)))
    state.tasks["Look-5"] = task("Look-5", "lwd_1", family=TaskFamily(parent="Look-4"))
    flies(state, "lwd_1", "Look-5", state="running", sent_at=NOW - 9 * SECOND)

    wording(by_hand(state))


@pytest.mark.parametrize(
    ("of", "words"),
    [
        ("PickUp-33", "there is no task or agent 'PickUp-33' (any more); did you mean PickUp-3?"),
        ("zzz", "there is no task or agent 'zzz' (any more)"),
        ("../../etc/passwd", "there is no task or agent '../../etc/passwd' (any more)"),
        ("\x1b[31m", "there is no task or agent '?[31m' (any more)"),
        ("x" * 5000, f"there is no task or agent '{'x' * 60}...' (any more)"),
        ("", "there is no task or agent '' (any more)"),
    ],
)
def test_an_unknown_id_is_refused_with_near_ones(state: EngineState, of: str, words: str) -> None:
    with pytest.raises(TaskError) as refused:
        by_hand(state, of)
    assert (refused.value.code, str(refused.value)) == ("unknown_task", words)


def test_a_choice_by_charge_gives_the_numbers_of_those_with_little(wording: Wording) -> None:
    wish = RoleRequest(role="drone", types=("lwd",), shared=False)
    full, low = (
        Candidate(
            id=f"lwd_{number}", type="lwd", order=number, shared=False, mobility="air", actions=(), refused="", pool="STANDBY",
            liveness="ALIVE", control="engine", task="", goal="", word="STANDBY", landed="grounded", at_port=True,
            battery=battery, position=Position(0.0, 0.0, 0.0),
        )
        for number, battery in ((2, 100.0), (1, 27.0))
    )  # fmt: skip
    asked = AgentRequest(holder="T-1", priority="medium", order=1, at=0, roles=(wish,))
    verdicts = closest_charged([asked], [low, full]).verdicts["T-1"]
    done = task("T-1", status="SUCCEEDED", section="done", agents=TaskAgents(roles={}))
    scene = WhyScene(EngineState(tasks={"T-1": done}, explanations={"T-1": verdicts}), {}, NOW)

    (line,) = chosen(scene, done)

    wording(line.text)
