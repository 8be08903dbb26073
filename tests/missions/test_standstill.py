"""The engine's process stands still - stopped, asleep, in a long commit - while the fleet goes on: nobody was silent for it."""

from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.changes import ResumePut
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, Operator, Outage, QueryGoal, SendGoal, TimerDue, WallDue
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.rehearsal.testing import check_rehearsal
from tests.missions.crashing import Crashing
from tests.missions.test_resume import MISSIONS, Plain, begin

STOPS_S = (3, 45, 110)


@pytest.fixture(scope="module")
def plain() -> dict[str, Plain]:
    return {name: Plain(name) for name in MISSIONS}


def stand(flown: Crashing, seconds: float) -> EngineStep:
    return flown.flight.driver.stand_still(round(seconds * SECOND))


@pytest.mark.parametrize("name", MISSIONS)
def test_a_short_standstill_changes_nothing(name: str, plain: dict[str, Plain]) -> None:
    for at in STOPS_S:
        flown, _ = begin(name)
        flown.flight.run_for(at)
        stand(flown, 8.0)
        assert flown.run()
        plain[name].compare(flown, later=True)


@pytest.mark.parametrize("name", MISSIONS)
def test_after_half_a_minute_no_task_has_lost_a_machine(name: str) -> None:
    for at in STOPS_S:
        flown, task = begin(name)
        flight = flown.flight
        flight.run_for(at)
        if flight.task(task).section == "done":
            break
        stand(flown, 35.0)
        flight.run_for(15)
        kept = flight.task(task)
        assert kept.section == "done" or kept.hold.words, flown.story()
        _go_on(flown, task)
        ended = flight.task(task)
        assert "agent_lost" not in (ended.outcome.code, kept.outcome.code), flown.story()
        assert flown.twice() == []
        assert not [a for a in flight.engine.state.agents.values() if a.pool == "QUARANTINED"], flown.story()
        check_rehearsal(flight)
        flight.close()


def _go_on(flown: Crashing, task: str) -> None:
    flight = flown.flight
    for _ in range(3):
        flight.run_for(60)  # what flies home by itself lands
        for agent, record in flight.engine.state.agents.items():
            if record.control == "failsafe" and record.landed == "grounded":
                flight.sim.hand_back(agent)
                flight.run_for(1)
            if flight.engine.state.agents[agent].taken:
                ways = (Operator(how, agent, "watcher_1") for how in ("handback_continue", "handback_end"))
                next((way for way in ways if flight.driver.feed(way).reply == Done()), None)
        if flight.task(task).hold.words:
            flight.driver.feed(Operator("continue", task, "watcher_1"))
    flown.run()


def test_agents_are_asked_before_any_deadline_is_judged() -> None:
    flown, task = begin("pick_up")
    flown.flight.run_for(20)
    busy = [goal.agent for goal in flown.flight.engine.state.goals.values() if goal.in_flight]
    assert busy
    first = stand(flown, 20.0)
    assert isinstance(first.input, Outage)
    assert {effect.agent for effect in first.effects if isinstance(effect, QueryGoal)} >= set(busy)
    flown.flight.run_for(15)
    after = flown.seen[flown.seen.index(first) :]
    phases = [(n, c.resume) for n, step in enumerate(after) for c in step.changes if isinstance(c, ResumePut)]
    asked = next(n for n, resume in phases if resume is None or resume.phase != "asking")
    assert not [step for step in after[:asked] if isinstance(step.input, TimerDue | WallDue)]
    assert flown.flight.task(task).outcome.code == ""
    assert "resume" not in flown.flight.task(task).hold.words
    flown.flight.close()


def test_a_long_standstill_holds_tasks_and_nothing_new_leaves() -> None:
    flown, task = begin("pick_up")
    flown.flight.run_for(20)
    step = stand(flown, 31.0)
    assert "resume" in flown.flight.task(task).hold.words
    assert [effect.code for effect in step.effects if isinstance(effect, Alarm)] == ["held_by_resume"]
    before = len(flown.seen)
    flown.flight.run_for(120)
    sent: list[Any] = [e for one in flown.seen[before:] for e in one.effects if isinstance(e, SendGoal)]
    assert not [effect for effect in sent if effect.task == task and not effect.safety]
    flown.flight.close()


def test_a_machine_that_was_gone_before_is_lost_by_its_own_silence_after_it() -> None:
    flown, task = begin("pick_up")
    flight = flown.flight
    flight.run_for(20)
    (agent,) = [a for goal in flight.engine.state.goals.values() if goal.in_flight for a in [goal.agent] if "wd" in a]
    flight.sim.kill(agent)
    flight.run_for(2)
    stand(flown, 29.0)
    flight.run_for(20)
    assert flight.engine.state.agents[agent].liveness == "SUSPECT"
    assert flight.task(task).outcome.code == ""
    flight.run_for(25)
    assert flight.engine.state.agents[agent].liveness == "LOST"
    flight.close()
