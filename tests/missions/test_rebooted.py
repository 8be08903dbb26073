"""A machine whose process was started anew and that stands gets nothing but stops, until a person clears it (safety.md 3).

Its way home is not begun again with a take-off, whoever restarts: the machine, the engine, or both.
"""

from collections.abc import Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.drivers.persist import Outcome
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, Operator, SendGoal
from formiga_bt.lang.model import Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, check_rehearsal, effects, packaged_task, packaged_world, task_of
from formiga_bt.show.why.causes import causes_of
from formiga_bt.show.why.going_on import ways_on
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.crashing import Crashing, Killed, Killer

FIELD = Place(-60.0, -180.0)
AWAY = {"lwd_1": {"at": FIELD}}
NEVER = [{"match": "clear", "never": True}]
SOON = [{"match": "clear", "options": ["clear"], "after": "3 s"}]
SITE, CATALOGUE = packaged_world()
HOME = SITE.ports[SITE.agents["lwd_1"].home].at


def order(rehearsal: Rehearsal, word: Any, target: str = "lwd_1") -> None:
    rehearsal.ask(Operator(word, target, "watcher_1"))


def sent(rehearsal: Rehearsal, action: str = "") -> list[str]:
    goals = [goal for goal in effects(rehearsal, SendGoal) if goal.agent == "lwd_1"]
    return [goal.goal_id for goal in goals if action in ("", goal.action)]


def reboot(rehearsal: Rehearsal, to: Place | None = None, away_s: float = 2.0) -> None:
    """Its process ends and is started again, at another place if people carried it there."""
    rehearsal.sim.kill("lwd_1")
    rehearsal.run_for(away_s)
    if to is not None:
        rehearsal.sim["lwd_1"].drone.carry(to)
    rehearsal.sim.restart("lwd_1")


def asked(rehearsal: Rehearsal) -> int:
    """Return whether people stand clear is asked how often now."""
    return sum(question.kind == "clearance" for question in rehearsal.engine.state.questions.values())


def drone(rehearsal: Rehearsal) -> Any:
    return rehearsal.engine.state.agents["lwd_1"]


# -- its way home ------------------------------------------------------------------------------------------------------
def test_one_that_was_carried_home_and_started_anew_stays_there(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    order(rehearsal, "return")
    rehearsal.run_for(10)
    assert asked(rehearsal) == 1

    reboot(rehearsal, HOME)
    rehearsal.run_for(600)

    assert sent(rehearsal) == []
    assert asked(rehearsal) == 0
    assert (drone(rehearsal).pool, drone(rehearsal).landed) == ("STANDBY", "grounded")
    assert rehearsal.engine.state.orders["lwd_1"].state == "done"
    assert rehearsal.ended()


def test_one_that_was_only_carried_home_stays_there_too(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": NEVER})
    order(rehearsal, "return")
    rehearsal.run_for(10)

    rehearsal.sim["lwd_1"].drone.carry(HOME)
    rehearsal.run_for(600)

    assert sent(rehearsal) == []
    assert rehearsal.engine.state.orders["lwd_1"].state == "done"
    assert rehearsal.ended()


def test_a_start_that_was_cleared_is_not_repeated_by_a_new_process(fly: Fly) -> None:
    """The word was for the process before, and for another place."""
    rehearsal = fly(change=AWAY, scripts={"watcher_1": SOON})
    order(rehearsal, "return")
    assert rehearsal.run_until(lambda: sent(rehearsal, "TakeOff") != [], 60)
    rehearsal.sim["lwd_1"].drone.stop()
    rehearsal.sim["lwd_1"].drone._move(rehearsal.sim["lwd_1"].drone._segment, "rest")  # it had not begun to climb

    reboot(rehearsal, HOME, away_s=1)
    rehearsal.run_for(600)

    assert len(sent(rehearsal)) == 1
    assert not rehearsal.sim["lwd_1"].drone.is_airborne
    assert rehearsal.ended()


def test_one_that_stands_away_waits_until_a_person_has_looked_at_it(fly: Fly) -> None:
    rehearsal = fly(change=AWAY, scripts={"watcher_1": [{"match": "clear", "options": ["clear"], "after": "20 s"}]})
    order(rehearsal, "return")
    rehearsal.run_for(10)
    assert asked(rehearsal) == 1
    reboot(rehearsal)
    rehearsal.run_for(300)

    assert sent(rehearsal) == []
    assert asked(rehearsal) == 0
    assert alarms(rehearsal).count("rebooted") == 1
    (task,) = [t for t in rehearsal.engine.state.tasks.values() if not t.ended]
    assert [cause.code for cause in causes_of(rehearsal.engine.state, task)] == ["gate.rebooted"]

    order(rehearsal, "clear")
    assert drone(rehearsal).rebooted is False
    rehearsal.run_for(5)
    assert asked(rehearsal) == 1  # anew: the word would be for the process before
    assert rehearsal.run_until(rehearsal.ended, 600)
    assert (drone(rehearsal).pool, rehearsal.sim["lwd_1"].drone.is_airborne) == ("STANDBY", False)


def test_one_in_the_air_goes_on_home(fly: Fly) -> None:
    rehearsal = fly()
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert rehearsal.run_until(lambda: sent(rehearsal, "GoTo") != [], 120)
    rehearsal.run_for(5)
    rehearsal.ask(Abort(task, "", "watcher_1"))
    rehearsal.run_for(2)

    reboot(rehearsal)

    assert rehearsal.run_until_ended(task, limit_s=600)
    assert (drone(rehearsal).pool, drone(rehearsal).landed) == ("STANDBY", "grounded")
    assert "rebooted" not in alarms(rehearsal)


def test_one_that_does_not_know_whether_it_stands_waits_and_goes_home_once_it_says_that_it_flies(fly: Fly) -> None:
    rehearsal = fly()
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert rehearsal.run_until(lambda: sent(rehearsal, "GoTo") != [], 120)
    rehearsal.run_for(5)
    body = rehearsal.sim["lwd_1"].drone
    knows = body.landed
    body.landed = lambda: "unknown"  # type: ignore[method-assign]
    reboot(rehearsal)
    before = len(sent(rehearsal))
    rehearsal.run_for(120)

    assert len(sent(rehearsal)) == before
    assert "rebooted" in alarms(rehearsal)
    body.landed = knows  # type: ignore[method-assign]
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert (drone(rehearsal).pool, drone(rehearsal).landed) == ("STANDBY", "grounded")


def test_one_that_was_lost_and_is_there_again_is_not_sent_up_by_its_former_task(fly: Fly) -> None:
    rehearsal = fly()
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    reboot(rehearsal, away_s=60)
    rehearsal.run_for(300)

    assert not rehearsal.sim["lwd_1"].drone.is_airborne
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "agent_lost")
    assert drone(rehearsal).rebooted
    with pytest.raises(TaskError, match="was not stopped"):
        order(rehearsal, "continue")

    again = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})  # a task is granted it anew
    assert rehearsal.run_until_ended(again)
    assert rehearsal.task(again).status == "SUCCEEDED"


def test_continue_is_refused_until_it_is_cleared(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    rehearsal.sim.kill("lwd_1")
    rehearsal.run_for(2)
    order(rehearsal, "hold", task)
    rehearsal.sim.restart("lwd_1")
    rehearsal.run_for(5)
    with pytest.raises(TaskError) as refused:
        order(rehearsal, "continue", task)
    wording(refused.value)
    assert refused.value.code == "rebooted"

    order(rehearsal, "clear")
    with pytest.raises(TaskError) as refused_2:
        order(rehearsal, "clear")
    wording(refused_2.value)
    order(rehearsal, "continue", task)
    assert rehearsal.run_until_ended(task)


def test_land_reaches_one_that_does_not_know_whether_it_stands(fly: Fly) -> None:
    rehearsal = fly()
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert rehearsal.run_until(lambda: sent(rehearsal, "GoTo") != [], 120)
    rehearsal.run_for(5)
    rehearsal.sim["lwd_1"].drone.landed = lambda: "unknown"  # type: ignore[method-assign]
    reboot(rehearsal)
    rehearsal.run_for(5)

    order(rehearsal, "land")
    rehearsal.run_for(2)

    assert sent(rehearsal, "LandIn") != []
    del rehearsal.sim["lwd_1"].drone.landed
    assert rehearsal.run_until(lambda: drone(rehearsal).landed == "grounded", 120)
    assert rehearsal.run_until_ended(task)


# -- the engine was away -----------------------------------------------------------------------------------------------
def parked(script: list[dict[str, Any]], *tasks: Task) -> Crashing:
    specs = fleet_of(SITE, CATALOGUE, scripts={"watcher_1": script})
    specs = [replace(one, at=FIELD) if one.id == "lwd_1" else one for one in specs]
    flight = Rehearsal(SITE, CATALOGUE, [packaged_task("move_task"), *tasks], specs)
    flight.run_for(1)
    return Crashing(flight)


def ends_well(flown: Crashing) -> None:
    check_rehearsal(flown.flight)
    flown.flight.close()


@pytest.mark.parametrize("script", [NEVER, SOON], ids=["asked", "cleared"])
@pytest.mark.parametrize("away_s", [2.0, 45.0])
def test_the_engine_restarts_and_finds_it_at_home_with_a_new_process(
    script: list[dict[str, Any]], away_s: float
) -> None:
    flown = parked(script)
    flight = flown.flight
    order(flight, "return")
    flight.run_for(3.5 if script is NEVER else 2.9)
    flown.die()
    flight.sim.kill("lwd_1")
    flight.sim["lwd_1"].drone.carry(HOME)
    flown.away(1)
    flight.sim.restart("lwd_1")
    flown.resume(away_s)
    flight.run_for(600)

    assert [one for one in flown.begun if one.agent == "lwd_1"] == []
    assert flight.ended() or "resume" in next(t for t in flight.engine.state.tasks.values() if not t.ended).hold.words
    ends_well(flown)


def test_the_engine_restarts_and_a_machine_that_stands_away_was_started_anew() -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    flight.run_for(1)
    flown.die()
    flight.sim.kill("lwd_1")
    flight.sim.restart("lwd_1")
    flown.resume(2)
    flight.run_for(300)

    assert [one for one in flown.begun if one.agent == "lwd_1"] == []
    order(flight, "clear")
    assert flight.run_until(flight.ended, 600)
    assert (drone(flight).pool, drone(flight).landed) == ("STANDBY", "grounded")
    ends_well(flown)


def test_after_a_long_outage_what_stands_waits_for_a_word() -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    flight.run_for(1)
    flown.die()
    flown.resume(2, since=flight.now - 60 * SECOND)
    flight.run_for(300)

    (task,) = [t for t in flight.engine.state.tasks.values() if not t.ended]
    assert (task.system.agent, task.hold.words) == ("lwd_1", ("resume",))
    assert [one for one in flown.begun if one.agent == "lwd_1"] == []
    assert "recover_slow" not in alarms(flight)
    order(flight, "continue", task.id)
    assert flight.engine.state.orders["lwd_1"].stop == "return"  # it goes on
    assert flight.run_until(flight.ended, 600)
    assert drone(flight).pool == "STANDBY"
    ends_well(flown)


def test_after_a_long_outage_continue_for_all_goes_on_with_what_waits() -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    flight.run_for(1)
    flown.die()
    flown.resume(2, since=flight.now - 60 * SECOND)
    flight.run_for(20)

    order(flight, "continue", "")
    assert flight.run_until(flight.ended, 600)
    assert (drone(flight).pool, flight.engine.state.orders["lwd_1"].state) == ("STANDBY", "done")
    ends_well(flown)


def test_after_a_long_outage_what_flies_goes_on_home() -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    assert flight.run_until(lambda: sent(flight, "GoTo") != [], 120)
    flight.run_for(2)
    flown.die()
    flown.resume(2, since=flight.now - 60 * SECOND)
    assert flight.run_until(flight.ended, 600)
    assert (drone(flight).pool, drone(flight).landed) == ("STANDBY", "grounded")
    ends_well(flown)


def test_after_a_long_outage_one_that_rose_meanwhile_goes_on_home() -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    assert flight.run_until(lambda: sent(flight, "TakeOff") != [], 120)
    flown.die()
    flown.resume(5, since=flight.now - 60 * SECOND)
    flight.run_for(3)
    assert not any(task.hold.words for task in flight.engine.state.tasks.values())
    assert flight.run_until(flight.ended, 600)
    assert (drone(flight).pool, drone(flight).landed) == ("STANDBY", "grounded")
    ends_well(flown)


# -- words that people stand clear ---------------------------------------------------------------------------------------
def cleared(fly: Fly) -> Rehearsal:
    """A word stands that is not used: the machine has a pilot."""
    rehearsal = fly(change=AWAY, scripts={"watcher_1": [{"match": "clear", "options": ["clear"], "after": "5 s"}]})
    order(rehearsal, "return")
    rehearsal.run_for(2)
    rehearsal.sim.take_over("lwd_1")
    rehearsal.run_for(6)
    assert rehearsal.engine.state.clearances["lwd_1"].state == "given"
    return rehearsal


def test_a_word_ends_with_the_process_of_its_machine(fly: Fly) -> None:
    rehearsal = cleared(fly)
    reboot(rehearsal)
    rehearsal.run_for(1)
    assert rehearsal.engine.state.clearances == {}


def test_a_word_ends_when_the_machine_is_moved_and_does_not_come_back_with_it(fly: Fly) -> None:
    rehearsal = cleared(fly)
    rehearsal.sim["lwd_1"].drone.carry(Place(-60.0, -188.0))
    rehearsal.run_for(5)
    rehearsal.sim["lwd_1"].drone.carry(FIELD)
    rehearsal.run_for(5)
    assert rehearsal.engine.state.clearances == {}


def test_a_word_ends_after_a_minute(fly: Fly) -> None:
    rehearsal = cleared(fly)
    at = rehearsal.engine.state.clearances["lwd_1"].given_at
    assert at is not None
    rehearsal.run_until(lambda: not rehearsal.engine.state.clearances, 120)
    assert rehearsal.now - at == 60 * SECOND


class AtTheStart(Killer):
    """Ends the engine when a TakeOff is sent: the step is kept, and the goal never leaves."""

    def keep(self, steps: Sequence[EngineStep]) -> Outcome:
        """Keep steps, or die."""
        if any(isinstance(e, SendGoal) and e.action == "TakeOff" for step in steps for e in step.effects):
            self.left = 1
        return super().keep(steps)


@pytest.mark.parametrize("to", [FIELD, Place(-60.0, -195.0)], ids=["here", "elsewhere"])
def test_a_start_that_never_left_waits_for_a_new_word_from_where_the_machine_is_now(to: Place) -> None:
    flown = parked(SOON)
    flight = flown.flight
    order(flight, "return")
    flight.driver._persist = AtTheStart(flight, 10**6, "kept")
    with pytest.raises(Killed):
        flight.run_for(30)
    flown.die()
    flight.sim["lwd_1"].drone.carry(to)
    flown.resume(2)
    assert flight.run_until(lambda: asked(flight) == 1, 30)
    flight.run_for(1)

    starts = [one.goal for one in flown.begun if one.action == "TakeOff"]
    assert starts == []
    assert asked(flight) == 1
    assert flight.engine.state.clearances["lwd_1"].place == to
    flight.close()


# -- a person's way out --------------------------------------------------------------------------------------------------
FAR = """\
agents: {drone: {type: lwd, id: lwd_2}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: {east: -60 m, north: -180 m, height: 60 m}}
  - do: drone.LandIn
    with: {at: {east: -60 m, north: -180 m}}
"""


def landed_away() -> tuple[Crashing, str]:
    """A task's machine was ordered to land and then to return; the engine is away for a minute before it starts."""
    flown = parked(NEVER, task_of(FAR, SITE, CATALOGUE, "Far"))
    flight = flown.flight
    task = flight.submit("Far")
    port = SITE.ports[SITE.agents["lwd_2"].home].at
    assert flight.run_until(lambda: horizontal_m(flight.engine.state.agents["lwd_2"].position, port) > 30, 120)
    order(flight, "land", "lwd_2")
    assert flight.run_until(lambda: flight.engine.state.orders["lwd_2"].state == "done", 120)
    order(flight, "return", "lwd_2")
    flight.run_for(1)
    flown.die()
    flown.resume(2, since=flight.now - 60 * SECOND)
    flight.run_for(20)
    return flown, task


def ways_of(flight: Rehearsal, task: str) -> list[str]:
    return ways_on(flight.engine.state, flight.task(task), CATALOGUE)


def follow(flight: Rehearsal, way: str) -> None:
    """Do what `formiga why` names."""
    word, target = way.removeprefix("formiga ").removeprefix("agents ").split()
    order(flight, word, target)


@pytest.mark.parametrize("anew", [False, True], ids=["same process", "started anew"])
def test_each_way_out_that_why_names_for_a_way_home_works_though_its_task_cannot_go_on(anew: bool) -> None:
    flown, task = landed_away()
    flight = flown.flight
    home = flight.engine.state.orders["lwd_2"].task
    assert "resume" in flight.task(home).hold.words
    with pytest.raises(TaskError) as refused:
        order(flight, "continue", "lwd_2")  # that would be a word for its task
    assert refused.value.code == "cannot_continue"
    if anew:
        flight.sim.kill("lwd_2")
        flight.sim.restart("lwd_2")
        flight.run_for(5)
        assert ways_of(flight, home) == ["formiga agents clear lwd_2"]
        follow(flight, ways_of(flight, home)[0])

    assert ways_of(flight, home) == [f"formiga continue {home}"]
    follow(flight, ways_of(flight, home)[0])

    assert flight.engine.state.orders["lwd_2"].stop == "return"
    assert [cause.code for cause in causes_of(flight.engine.state, flight.task(home))][-1] == "gate.clearance"
    assert ways_of(flight, task) == [f"formiga restart {task}", f"formiga abort {task}"]
    flight.ask(Abort(task, "", "watcher_1"))
    flight.close()


def test_a_task_that_gives_a_machine_back_goes_on_when_the_last_goal_of_an_order_on_it_ends(fly: Fly) -> None:
    text = "agents: {two: {type: lwd, id: lwd_2}}\nsteps: [{with_agents: {one: {type: lwd, id: lwd_1}}, steps: [{wait: 1 h}]}]"
    rehearsal = fly(task_of(text, SITE, CATALOGUE), scripts={"watcher_1": NEVER})
    task = rehearsal.submit("Try")
    rehearsal.run_for(5)
    assert drone(rehearsal).task == task
    rehearsal.sim["lwd_1"].drone.carry(FIELD)
    rehearsal.run_for(15)
    order(rehearsal, "return")
    rehearsal.run_for(10)
    assert asked(rehearsal) == 1
    rehearsal.ask(Abort(task, "", "watcher_1"))
    assert list(rehearsal.task(task).agents.releasing) == ["lwd_1"]

    order(rehearsal, "continue")  # its order ends, and with it the goal that waited

    assert (rehearsal.task(task).status, drone(rehearsal).task) == ("CANCELED", "")
