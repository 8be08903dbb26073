"""Agents (execution: agents; safety: who is in command): liveness, bad news, quarantine and the way back."""

import math
from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.inputs import (
    AgentGoneInput,
    AgentSeenInput,
    CancelGoal,
    Operator,
    QueryGoal,
    SendGoal,
    WallDue,
)
from formiga_bt.engine.kernel.timers import AcceptDue, CancelDue, GraceDue, LiveDue
from formiga_bt.rehearsal.testing import alarms, effects
from formiga_bt.transport.cards import AgentCard
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard

MOVE = CART + "steps: [{do: cart.Move}]"
RISE = CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Park}]"


def up(make: Make) -> tuple[Yard, str]:
    """Let c1 be in the air, moving."""
    yard = make(RISE)
    task = yard.start()
    yard.cart.succeed()
    yard.run_for(0.2)
    return yard, task


@pytest.mark.parametrize(
    "lie",
    [
        {"battery": math.nan},
        {"battery": 300.0},
        {"battery": -1.0},
        {"position": Position(math.inf, 0.0, 0.0)},
        {"position": Position(5000.0, 0.0, 0.0)},
        {"id": "c2"},
        {"type": "person"},
    ],
)
def test_a_status_that_lies_is_counted_and_changes_nothing_else(make: Make, lie: dict[str, Any]) -> None:
    yard = make(MOVE)
    yard.cart.silent = True
    yard.run_for(1)
    before = yard.record("c1")

    yard.cart.tell(**lie)
    yard.run_for(0.1)

    after = yard.record("c1")
    assert after.bad == before.bad + 1
    assert (after.position, after.battery, after.heard_at) == (before.position, before.battery, before.heard_at)


def test_too_many_lies_quarantine_a_machine_and_end_its_goal(make: Make) -> None:
    yard = make(MOVE)
    task = yard.start()
    yard.cart.silent = True

    for _ in range(5):
        yard.cart.tell(battery=300.0)
        yard.run_for(0.1)

    assert yard.outcome(task) == ("FAILED", "agent_lost")
    assert yard.record("c1").pool == "QUARANTINED"
    assert alarms(yard) == ["bad_status"]


def test_a_true_status_between_lies_starts_the_count_again(make: Make) -> None:
    yard = make(MOVE)
    for _ in range(8):
        yard.cart.tell(battery=300.0)
        yard.cart.side.publish_status()
        yard.run_for(1)

    assert yard.record("c1").pool == "STANDBY"


def test_an_older_status_that_comes_late_is_ignored(make: Make) -> None:
    yard = make(MOVE)
    yard.run_for(3)

    yard.cart.tell(seq=1, stamp=yard.now - 3 * SECOND, battery=5.0)
    yard.run_for(0.1)

    assert yard.record("c1").battery == 100.0
    assert yard.record("c1").bad == 0


@pytest.mark.parametrize("announces", [True, False])
def test_a_new_process_may_be_anywhere(make: Make, announces: bool) -> None:
    yard = make(MOVE)
    yard.run_for(3)
    far = Position(400.0, 0.0, 0.0)
    if announces:
        yard.cart.kill()
        yard.cart._fields["position"] = far
        yard.cart.boot()
    else:
        yard.cart.tell(boot_id="another", seq=0, position=far)
    yard.run_for(0.1)

    assert (yard.record("c1").bad, yard.record("c1").position) == (0, far)

    record = yard.record("c1")
    yard.cart.tell(boot_id=record.boot_id, seq=record.seq + 1, position=Position(9000.0, 0.0, 0.0))
    yard.run_for(0.1)
    assert yard.record("c1").bad == 1  # but from then on it moves


def test_a_late_status_of_a_former_process_is_no_restart(make: Make) -> None:
    yard = make(MOVE)
    old = yard.cart.side.status.boot_id
    yard.cart.boot()
    yard.run_for(2)
    task = yard.start()

    yard.cart.tell(boot_id=old, stamp=1)
    yard.run_for(0.1)

    assert yard.task(task).status == "ACTIVE"
    yard.abort(task)


def test_a_result_carries_the_status_that_the_next_step_reads(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}, {check: cart.battery < 50 %}]")
    yard.cart.silent = True
    task = yard.start()

    yard.cart.succeed({"n": 1}, battery=40.0)

    assert yard.end(task) == ("SUCCEEDED", "")


def test_the_catalogues_effect_is_applied_with_the_success(make: Make) -> None:
    yard, task = up(make)

    assert yard.record("c1").landed == "airborne"
    yard.abort(task, how="abandon")


def test_an_accept_that_does_not_come_is_asked_for(make: Make) -> None:
    yard = make(MOVE)
    yard.hub.set_delay("c1", 30_000_000)  # the goal is under way for half a minute
    task = yard.submit("Try")
    yard.run_for(20)

    assert any(q.goal_ids == (f"{task}/1/steps/steps[0]",) for q in effects(yard, QueryGoal))
    yard.abort(task, how="abandon")


def test_no_query_follows_a_result_that_came(make: Make) -> None:
    yard = make(MOVE)
    task = yard.start()
    yard.cart.succeed({"n": 1})

    yard.end(task)

    assert effects(yard, QueryGoal) == []


def test_suspect_is_back_before_lost_and_nothing_happened(make: Make) -> None:
    yard = make(MOVE)
    task = yard.start()
    yard.cart.silent = True
    yard.run_for(10)
    assert yard.record("c1").liveness == "SUSPECT"

    yard.cart.silent = False
    yard.run_for(2)

    assert yard.record("c1").liveness == "ALIVE"
    assert any(q.goal_ids for q in effects(yard, QueryGoal))
    yard.cart.succeed({"n": 1})
    assert yard.end(task) == ("SUCCEEDED", "")


@pytest.mark.parametrize("silent_s", [4, 8])
def test_after_one_silence_the_next_is_noticed_as_soon(make: Make, silent_s: int) -> None:
    yard = make(MOVE)
    yard.run_for(3)
    yard.cart.silent = True
    yard.run_for(silent_s)
    assert yard.record("c1").liveness == "SUSPECT"
    yard.cart.silent = False
    yard.run_for(2)
    assert yard.record("c1").liveness == "ALIVE"

    yard.cart.silent = True
    heard = yard.record("c1").heard_wall
    assert yard.run_until(lambda: yard.record("c1").liveness == "SUSPECT", 60)
    assert yard.now - heard == 3 * SECOND


def test_a_process_that_is_known_to_live_is_not_silent_between_its_statuses(make: Make) -> None:
    yard = make(MOVE)
    yard.cart.link.beats = True
    yard.cart.silent = True  # it only gives signs of life
    yard.run_for(60)
    assert yard.record("c1").liveness == "ALIVE"

    stopped = yard.now
    yard.hub.freeze("c1")
    assert yard.run_until(lambda: yard.record("c1").liveness == "SUSPECT", 60)
    assert yard.now - stopped == 3 * SECOND


def test_a_goal_for_a_suspect_waits_until_it_is_back(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 10 s}, {do: cart.Home}]")
    task = yard.start()
    yard.cart.silent = True
    yard.run_for(12)

    goal = yard.engine.state.goals["Try-1/1/steps/steps[1]"]
    assert (goal.state, goal.code) == ("gated", "suspect")
    yard.cart.silent = False
    yard.run_for(2)
    yard.cart.succeed()
    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_machine_that_is_back_gets_goals_once_it_has_said_where_it_is(make: Make) -> None:
    """It may have been carried, or have come home by itself: its card says nothing of that."""
    yard = make(CART + "steps: [{wait: 1 s}, {do: cart.Home}]")
    yard.start()
    yard.cart.silent = True
    yard.driver.feed(AgentGoneInput("c1"))
    record = yard.record("c1")
    yard.driver.feed(AgentSeenInput(AgentCard(id="c1", type=record.type, boot_id=record.boot_id, wire=2,
                                              mobility=record.mobility, actions=record.actions)))  # fmt: skip
    yard.run_for(1.5)
    goal = yard.engine.state.goals["Try-1/1/steps/steps[1]"]
    assert (goal.state, goal.code) == ("gated", "suspect")
    yard.cart.say(position=Position(5.0, 0.0, 0.0))
    yard.run_for(1)

    assert yard.engine.state.goals["Try-1/1/steps/steps[1]"].in_flight
    assert yard.record("c1").liveness == "ALIVE"


def test_a_machine_in_quarantine_gets_nothing_but_queries(make: Make) -> None:
    yard, task = up(make)
    yard.abort(task, how="abandon")
    sent = len(effects(yard, SendGoal)) + len(effects(yard, CancelGoal))

    yard.run_for(120)

    assert len(effects(yard, SendGoal)) + len(effects(yard, CancelGoal)) == sent
    assert yard.record("c1").pool == "QUARANTINED"


def test_a_cleared_machine_is_asked_for_its_goals_which_are_canceled_before_it_comes_home(make: Make) -> None:
    yard, task = up(make)
    yard.cart.takes_cancel = False  # its Move goes on
    yard.abort(task, how="abandon")
    yard.run_for(5)

    yard.cart.takes_cancel = True
    yard.ask(Operator("clear", "c1"))
    yard.run_for(1)

    assert yard.cart.cancels[-1] == f"{task}/1/steps/steps[1]"
    assert yard.cart.goal.action == "Home"
    yard.cart.succeed()
    yard.run_for(0.2)
    assert yard.record("c1").pool == "STANDBY"


def test_a_query_that_gets_no_answer_is_asked_again(make: Make) -> None:
    yard = make(MOVE)
    yard.cart.kill()
    yard.run_for(60)
    yard.hub.set_faults("c1", __import__("formiga_bt.transport.memory", fromlist=["Faults"]).Faults(drop=0.6))

    yard.cart.boot()
    yard.run_for(120)

    assert yard.record("c1").pool == "STANDBY"


@pytest.mark.parametrize(("agent", "code"), [("c1", "not_quarantined"), ("x", "unknown_agent")])
def test_clear_is_for_quarantined_machines_only(make: Make, agent: str, code: str) -> None:
    yard = make(MOVE)

    with pytest.raises(TaskError) as caught:
        yard.ask(Operator("clear", agent))

    assert caught.value.code == code


def test_clear_of_one_that_cannot_be_reached_is_refused(make: Make, wording: Wording) -> None:
    yard = make(MOVE)
    yard.cart.kill()
    yard.run_for(60)

    with pytest.raises(TaskError) as caught:
        yard.ask(Operator("clear", "c1"))

    assert caught.value.code == "not_alive"
    wording(str(caught.value))


def test_people_are_never_lost_and_never_quarantined(make: Make) -> None:
    yard = make(MOVE)
    yard.ann.kill()

    yard.run_for(3600)

    assert yard.record("ann").liveness == "SUSPECT"
    assert yard.record("ann").pool == "STANDBY"


def test_while_a_pilot_has_the_machine_timers_stand_still(make: Make) -> None:
    yard = make("timeout: 2 min\n" + CART + "steps: [{do: cart.Home, timeout: 1 min}]")
    task = yard.start()
    yard.run_for(30)

    yard.cart.side.take_control("pilot")
    yard.run_for(1000)

    assert yard.task(task).hold.words == ("take-over:c1",)
    yard.cart.side.take_control("engine")
    yard.run_for(1)
    yard.ask(Operator("handback_end", "c1"))
    assert yard.outcome(task) == ("FAILED", "taken_over")


def test_a_wait_goes_on_after_the_hand_back_with_what_was_left(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 60 s}]")
    task = yard.start()
    yard.run_for(19.8)
    yard.cart.side.take_control("pilot")
    yard.run_for(100)
    yard.cart.side.take_control("engine")
    yard.run_for(1)

    yard.ask(Operator("handback_end", "c1"))
    handed = yard.now
    yard.end(task)

    left = ((yard.task(task).times.ended_at or 0) - handed) / 1e6
    assert left == pytest.approx(40, abs=0.1)


def test_a_goal_refused_because_a_pilot_just_took_over_counts_as_taken_over(make: Make) -> None:
    yard = make(CART + "steps: [{wait: 10 s}, {do: cart.Home}]")
    task = yard.start()
    yard.cart.silent = True
    yard.run_for(9.81)
    yard.cart.side.take_control("pilot")  # its status is under way when the goal leaves
    yard.run_for(2)

    assert yard.task(task).hold.words == ("take-over:c1",)
    yard.abort(task)


def test_a_cancel_is_sent_again_each_two_seconds_of_wall_time_until_its_grace_is_over(make: Make) -> None:
    yard, task = up(make)
    yard.cart.confirms_cancel = False
    yard.abort(task)
    asked = yard.now

    yard.run_for(40)

    times = [round((s.at - asked) / 1e6) for s in yard.steps for e in s.effects if isinstance(e, CancelGoal)]
    assert times == list(range(0, 30, 2))
    assert yard.record("c1").quarantine == "cancel_unconfirmed"
    assert yard.outcome(task) == ("CANCELED", "aborted")


def test_a_timeout_whose_cancel_is_never_confirmed_fails_so(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Home, timeout: 5 s, retry: {attempts: 3}}]")
    yard.cart.confirms_cancel = False
    task = yard.start()

    assert yard.end(task) == ("FAILED", "cancel_unconfirmed")
    assert "cancel_unconfirmed" in alarms(yard)
    assert len(yard.cart.requests) == 1


def test_a_wall_timer_for_what_is_gone_changes_nothing(make: Make) -> None:
    yard = make(MOVE)

    for timer in (AcceptDue("x"), CancelDue("x"), GraceDue("x"), LiveDue("x")):
        step = yard.driver.feed(WallDue(timer, yard.now))
        assert (step.changes, step.effects) == ((), ())


def test_a_step_whose_goal_was_stopped_fails_when_its_machine_is_quarantined(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]")
    task = yard.start()
    yard.cart.auto = {"Rise": 1.0, "Home": 1.0}
    yard.cart.succeed(landed="airborne")
    yard.run_for(0.5)
    yard.cart.ends = ["broken"] * 3
    yard.ask(Operator("return", "c1", "ann"))
    yard.run_for(120)

    assert yard.record("c1").quarantine == "recover_failed"
    assert yard.end(task) == ("FAILED", "agent_lost")


def test_a_machine_that_stood_and_is_in_the_air_with_no_task_is_brought_home(make: Make) -> None:
    """An engine that died with a full journal sent it, and this one knows nothing of it."""
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.cart.auto = {"Home": 1.0}
    yard.cart.say(landed="airborne")
    yard.run_for(8)

    assert alarms(yard) == ["found_airborne"]
    assert yard.cart.done == ["Home"]
    assert (yard.record("c1").pool, yard.record("c1").landed) == ("STANDBY", "grounded")


@pytest.mark.parametrize("between", ["unknown", ""])
def test_it_is_brought_home_whatever_it_said_between(make: Make, between: str) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.cart.auto = {"Home": 1.0}
    if between:
        yard.cart.say(landed=between)
        yard.run_for(0.5)
    yard.cart.say(landed="airborne")
    yard.run_for(8)

    assert alarms(yard) == ["found_airborne"]
    assert yard.cart.done == ["Home"]


def test_a_machine_that_joins_in_the_air_under_our_command_is_brought_home(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    made = yard.agent("c2", "cart", landed="airborne", auto={"Home": 1.0}, effects={"Home": "grounded"})
    yard.run_for(8)

    assert alarms(yard) == ["found_airborne"]
    assert made.done == ["Home"]


def test_a_machine_that_joins_in_the_air_may_be_ordered_otherwise_first(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    made = yard.agent("c2", "cart", landed="airborne")
    yard.ask(Operator("hold", "c2", "ann"))
    yard.run_for(20)

    assert (alarms(yard), made.done) == ([], [])


def test_a_machine_that_does_not_know_for_long_whether_it_stands_is_brought_home(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.cart.auto = {"Home": 1.0}
    yard.cart.say(landed="unknown")
    yard.run_for(4)
    assert alarms(yard) == []
    yard.run_for(6)

    assert alarms(yard) == ["found_airborne"]
    assert yard.cart.done == ["Home"]


def test_a_moment_without_knowing_is_nothing(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    for landed in ("unknown", "grounded") * 3:
        yard.cart.say(landed=landed)
        yard.run_for(4)

    assert (alarms(yard), yard.cart.done) == ([], [])


@pytest.mark.parametrize("why", ["pilot", "order", "task", "lost"])
def test_one_that_somebody_cares_for_is_no_stray(make: Make, why: str) -> None:
    yard = make(CART + "steps: [{wait: 10 min}]")
    match why:
        case "pilot":
            yard.cart.side.take_control("pilot")
        case "order":
            yard.ask(Operator("hold", "c1", "ann"))
        case "task":
            yard.start()
        case "lost":
            yard.cart.kill()
            yard.run_for(40)
    before = alarms(yard)
    if why != "lost":
        yard.cart.say(landed="unknown")
        yard.run_for(1)
        yard.cart.say(landed="airborne")
    yard.run_for(20)

    assert "found_airborne" not in alarms(yard)[len(before) :]
    assert yard.cart.done == []
