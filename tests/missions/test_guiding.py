"""T5 guides the picker back to the base, and is judged by where the picker is."""

from typing import Any

import pytest

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.kernel.inputs import NotifyPeople, SendGoal
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import effects, packaged_task
from tests.missions.conftest import Fly
from tests.missions.guiding import RANGE_M, guided

BASE = Place(0.0, 0.0)
LOST = Place(300.0, 200.0)
TASK = packaged_task("watch_dog_request")


def lost(fly: Fly, change: dict[str, Any] | None = None, **options: Any) -> tuple[Rehearsal, str]:
    charges = {"hwd_1": {"limits": {"charge_percent_s": 0.0}}}
    rehearsal = fly(TASK, change={"picker_2": {"at": LOST, **(change or {})}, **charges}, **options)
    params = {"alarmtype": "lost", "target": LOST, "username": AgentRef("picker_2"), "robot": AgentRef("hwd_1")}
    return rehearsal, rehearsal.submit("WatchDogRequest", params)


def left_m(rehearsal: Rehearsal) -> float:
    return horizontal_m(rehearsal.sim["picker_2"].person.position(), BASE)


def guide(rehearsal: Rehearsal) -> Position:
    return rehearsal.sim["hwd_1"].drone.position()


@pytest.mark.parametrize("seed", range(8))
def test_the_picker_stands_near_the_base_at_the_end_or_the_task_says_why_not(seed: int) -> None:
    found = guided(seed)

    assert found.is_right, found.line()


def test_the_picker_stays_at_the_base_when_the_drone_flies_home(fly: Fly) -> None:
    rehearsal, task = lost(fly)
    assert rehearsal.run_until_ended(task)
    there = left_m(rehearsal)
    rehearsal.run_for(600)

    assert rehearsal.task(task).status == "SUCCEEDED"
    assert left_m(rehearsal) == there <= RANGE_M


def test_each_point_of_the_way_is_nearer_to_the_base_and_at_most_40_m_ahead(fly: Fly) -> None:
    rehearsal, task = lost(fly, {"limits": {"fix_error_m": 0.0}})
    assert rehearsal.run_until_ended(task)

    goals = [g for g in effects(rehearsal, SendGoal) if g.task == task and g.action == "GoTo"]
    to = [Position(**goal.fields["to"]) for goal in goals][3:-2]  # without the way there and the way home
    away = [horizontal_m(one, BASE) for one in to]
    assert len(away) > 10
    assert away[0] == pytest.approx(horizontal_m(LOST, BASE) - 40.0, abs=0.1)
    assert away == sorted(away, reverse=True)
    assert away[-1] == 0.0
    assert {one.up_m for one in to} == {60.0}


def test_who_loses_sight_of_the_drone_stops_and_the_drone_comes_back(fly: Fly) -> None:
    rehearsal, task = lost(fly)
    assert rehearsal.run_until(lambda: left_m(rehearsal) < 250)
    rehearsal.sim["picker_2"].person.stand_at(Place(400.0, 100.0))  # out of sight, somewhere else
    rehearsal.run_for(5)
    assert rehearsal.sim["picker_2"].person.position() == Position(400.0, 100.0, 0.0)
    assert horizontal_m(guide(rehearsal), Place(400.0, 100.0)) > 80.0

    assert rehearsal.run_until(lambda: horizontal_m(guide(rehearsal), Place(400.0, 100.0)) < 45.0, limit_s=60)
    assert rehearsal.run_until_ended(task)
    assert left_m(rehearsal) <= RANGE_M


@pytest.mark.parametrize("sight_m", [15.0, 30.0, 80.0])
def test_who_sees_less_far_than_the_drone_goes_ahead_is_guided_in_shorter_steps(fly: Fly, sight_m: float) -> None:
    rehearsal, task = lost(fly, {"at": Place(120.0, 0.0), "limits": {"sight_m": sight_m, "fix_error_m": 0.0}})

    assert rehearsal.run_until_ended(task)
    assert left_m(rehearsal) <= RANGE_M


def test_another_drone_takes_over_before_the_reserve_and_brings_the_picker_home(fly: Fly) -> None:
    rehearsal, task = lost(fly)
    assert rehearsal.run_until(lambda: left_m(rehearsal) < 300)
    rehearsal.sim["hwd_1"].body.set_battery(39.0)

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert left_m(rehearsal) <= RANGE_M
    ups = [g.agent for g in effects(rehearsal, SendGoal) if g.task == task and g.action == "TakeOff"]
    assert ups == ["hwd_1", "hwd_2"]


def test_without_another_drone_people_are_notified_and_the_picker_waits(fly: Fly) -> None:
    rehearsal, task = lost(fly, without=("hwd_2",))
    assert rehearsal.run_until(lambda: left_m(rehearsal) < 300)
    rehearsal.sim["hwd_1"].body.set_battery(30.0)

    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "no_agent")
    assert [n.severity for n in effects(rehearsal, NotifyPeople) if n.task == task] == ["alarm"]
    assert rehearsal.engine.state.agents["hwd_1"].landed == "grounded"
    assert 100.0 < left_m(rehearsal) < 300.0


def test_who_never_walks_is_given_up_after_two_hours(fly: Fly) -> None:
    rehearsal, task = lost(fly, {"limits": {"reaction_s": 1e5}})

    assert rehearsal.run_until_ended(task, limit_s=3 * 3600.0)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "timeout")
    assert left_m(rehearsal) == pytest.approx(horizontal_m(LOST, BASE), abs=0.1)


def test_a_drone_of_another_task_leads_nobody_away(fly: Fly) -> None:
    other = AgentSpec(id="far", type="lwd", at=Position(LOST.east_m + 30.0, LOST.north_m + 60.0, 90.0))
    rehearsal, task = lost(fly, more=(other,))

    assert rehearsal.run_until(lambda: left_m(rehearsal) < 250, limit_s=400)
    assert rehearsal.run_until_ended(task)
    assert left_m(rehearsal) <= RANGE_M


@pytest.mark.parametrize(
    ("seed", "what"),
    [
        (54, "their phone was started anew while it was asked for the next point"),
        (80, "the drone lost its link and came home by itself, and a person let it go on"),
    ],
)
def test_the_picker_comes_home_although(seed: int, what: str) -> None:
    flight = guided(seed)

    assert (flight.status, flight.came_home) == ("SUCCEEDED", True), what
