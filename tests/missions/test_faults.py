"""Missions in which something goes wrong: aborts, lost machines, pilots, cancels that nobody confirms."""

import msgspec
import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import CancelGoal, Operator, QueryGoal, SendGoal
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import alarms, effects
from tests.missions.conftest import Fly
from tests.missions.test_shipped import pick_up


def crossing(rehearsal: Rehearsal, seconds: float = 30) -> str:
    """Start PickUp and fly until hwd_1 is on its way across."""
    task = pick_up(rehearsal)
    rehearsal.run_for(seconds)
    assert rehearsal.engine.state.agents["hwd_1"].action == "GoTo"
    return task


def pool(rehearsal: Rehearsal, agent: str = "hwd_1") -> tuple[str, str]:
    record = rehearsal.engine.state.agents[agent]
    return record.pool, record.landed


def test_an_abort_in_flight_cancels_waits_and_flies_home(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.abort(task, by="ann")

    assert len(effects(rehearsal, CancelGoal)) == 1
    assert rehearsal.run_until_ended(task, limit_s=600)
    record = rehearsal.task(task)
    assert (record.status, record.outcome.code, record.outcome.reason) == ("CANCELED", "aborted", "by ann")
    assert pool(rehearsal) == ("STANDBY", "grounded")
    home = [g.goal_id for g in effects(rehearsal, SendGoal) if "/recover:" in g.goal_id]
    assert [goal.split("/")[2] for goal in home] == ["recover:hwd_1#1"] * 3


def test_an_abort_while_pending_ends_at_once(fly: Fly) -> None:
    rehearsal = fly(without=("hwd_1", "hwd_2"))
    task = pick_up(rehearsal)
    rehearsal.run_for(1)

    assert rehearsal.task(task).status == "PENDING"
    rehearsal.abort(task)

    assert rehearsal.task(task).status == "CANCELED"


def test_an_abort_during_recover_is_already_ending(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(3)

    with pytest.raises(TaskError) as caught:
        rehearsal.abort(task)

    assert caught.value.code == "already_ending"
    assert rehearsal.run_until_ended(task)
    with pytest.raises(TaskError) as caught:
        rehearsal.abort(task)
    assert caught.value.code == "already_ended"


@pytest.mark.parametrize("recovering", [False, True])
def test_abandon_ends_the_task_and_leaves_the_drone_quarantined_until_cleared(fly: Fly, recovering: bool) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    if recovering:
        rehearsal.abort(task)
        rehearsal.run_for(2)

    rehearsal.abort(task, how="abandon", by="ann")

    rehearsal.run_for(60)
    assert rehearsal.task(task).status == "CANCELED"
    assert pool(rehearsal)[0] == "QUARANTINED"
    assert "quarantined_airborne" in alarms(rehearsal)
    rehearsal.ask(Operator("clear", "hwd_1"))
    rehearsal.run_for(1)
    assert rehearsal.run_until_ended()
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_killed_drone_is_lost_and_found_hovering_and_brought_home(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim.kill("hwd_1")

    rehearsal.run_for(5)
    assert rehearsal.engine.state.agents["hwd_1"].liveness == "SUSPECT"
    assert rehearsal.task(task).status == "ACTIVE"
    rehearsal.run_for(40)
    assert rehearsal.engine.state.agents["hwd_1"].liveness == "LOST"
    assert pool(rehearsal)[0] == "QUARANTINED"
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "agent_lost")
    assert pool(rehearsal, "hwd_2") == ("STANDBY", "grounded")
    assert rehearsal.engine.state.agents["hwd_1"].layer_m is not None

    rehearsal.sim.restart("hwd_1")
    rehearsal.run_for(2)

    assert [t.name for t in rehearsal.engine.state.tasks.values()] == ["PickUp", "Recover"]
    assert any(q.agent == "hwd_1" and not q.goal_ids for q in effects(rehearsal, QueryGoal))
    assert rehearsal.run_until_ended()
    assert pool(rehearsal) == ("STANDBY", "grounded")
    assert rehearsal.engine.state.agents["hwd_1"].layer_m is None


def test_a_drone_restarted_before_it_is_lost_is_in_doubt_and_recovered_by_its_task(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim.kill("hwd_1")
    rehearsal.run_for(6)
    rehearsal.sim.restart("hwd_1")

    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "in_doubt")
    assert pool(rehearsal) == ("STANDBY", "grounded")
    assert len(rehearsal.engine.state.tasks) == 1


def test_a_drone_frozen_for_a_while_goes_on_as_if_nothing_happened(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim.freeze("hwd_1")
    rehearsal.run_for(15)
    assert rehearsal.engine.state.agents["hwd_1"].liveness == "SUSPECT"
    rehearsal.sim.thaw("hwd_1")

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert any(q.agent == "hwd_1" and q.goal_ids for q in effects(rehearsal, QueryGoal))


def test_a_drone_frozen_until_it_is_lost_comes_back_by_a_system_task(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal, 25)

    rehearsal.sim.freeze("hwd_1")
    rehearsal.run_for(60)
    assert rehearsal.task(task).outcome.code == "agent_lost"
    rehearsal.sim.thaw("hwd_1")

    rehearsal.run_for(2)
    assert rehearsal.run_until_ended()
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_drone_lost_on_its_way_home_ends_the_task_and_is_brought_home_later(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)
    rehearsal.run_for(4)

    rehearsal.sim.kill("hwd_1")
    rehearsal.run_for(60)

    assert rehearsal.task(task).status == "CANCELED"
    rehearsal.sim.restart("hwd_1")
    rehearsal.run_for(1)
    assert rehearsal.run_until_ended()
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_cancel_that_is_never_confirmed_is_sent_again_and_ends_in_quarantine(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal, 25)
    rehearsal.hub.lose_results("hwd_1", 99)
    rehearsal.sim.never_confirm_cancel("hwd_1")

    rehearsal.abort(task)
    rehearsal.run_for(60)

    cancels = effects(rehearsal, CancelGoal)
    assert len(cancels) == 15  # at once, then every 2 s below the 30 s of grace
    assert rehearsal.task(task).status == "CANCELED"
    assert pool(rehearsal)[0] == "QUARANTINED"
    assert rehearsal.engine.state.agents["hwd_1"].quarantine == "cancel_unconfirmed"
    assert "quarantined_airborne" in alarms(rehearsal)


def test_a_lost_result_is_found_by_the_status_that_names_it(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim.lose_next_result("hwd_1")

    assert rehearsal.run_until_ended(task, limit_s=900)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_a_drone_that_was_killed_at_its_port_is_free_again_without_a_flight(fly: Fly) -> None:
    rehearsal = fly()
    rehearsal.sim.kill("hwd_1")
    rehearsal.run_for(60)
    assert pool(rehearsal)[0] == "QUARANTINED"

    rehearsal.sim.restart("hwd_1")
    rehearsal.run_for(2)

    assert pool(rehearsal) == ("STANDBY", "grounded")
    assert rehearsal.engine.state.tasks == {}


def test_a_goal_for_a_drone_that_just_vanished_waits_and_is_not_sent_without_end(fly: Fly) -> None:
    rehearsal = fly()
    task = pick_up(rehearsal)
    rehearsal.sim.kill("hwd_1")  # its presence token is still believed

    rehearsal.run_for(10)

    assert len([g for g in effects(rehearsal, SendGoal) if g.agent == "hwd_1"]) <= 1
    rehearsal.sim.restart("hwd_1")
    rehearsal.run_for(60)
    assert len([g for g in effects(rehearsal, SendGoal) if g.agent == "hwd_1"]) <= 1  # it stands there, started anew
    rehearsal.ask(Operator("clear", "hwd_1", "watcher_1"))
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_a_pilot_takes_over_and_hands_back(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)

    assert rehearsal.task(task).hold.words == ("take-over:hwd_1",)
    assert "taken_over" in alarms(rehearsal)
    sent = len(effects(rehearsal, SendGoal))
    with pytest.raises(TaskError) as caught:
        rehearsal.ask(Operator("handback_end", "hwd_1"))
    assert caught.value.code == "not_in_command"
    rehearsal.run_for(600)
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(60)
    assert len(effects(rehearsal, SendGoal)) == sent  # only a person hands back
    assert rehearsal.task(task).hold.words == ("take-over:hwd_1",)

    rehearsal.ask(Operator("handback_end", "hwd_1"))

    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "taken_over")
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_an_abort_while_a_pilot_flies_waits_for_the_hand_back_before_it_recovers(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)

    rehearsal.abort(task)
    rehearsal.run_for(5)
    rehearsal.sim.hand_back("hwd_1")
    sent = len(effects(rehearsal, SendGoal))
    rehearsal.run_for(30)

    assert len(effects(rehearsal, SendGoal)) == sent
    rehearsal.ask(Operator("handback_end", "hwd_1"))
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "CANCELED"
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_take_over_during_a_cancel_leaves_the_drain_set(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.abort(task)

    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)

    assert rehearsal.task(task).ending.drain == ()
    assert rehearsal.task(task).section == "recover"
    rehearsal.sim.hand_back("hwd_1")
    rehearsal.run_for(1)
    rehearsal.ask(Operator("handback_end", "hwd_1"))
    assert rehearsal.run_until_ended(task)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_an_idle_drone_that_a_pilot_has_is_not_granted(fly: Fly) -> None:
    rehearsal = fly()
    rehearsal.sim.take_over("hwd_1")
    rehearsal.run_for(1)

    task = pick_up(rehearsal)
    rehearsal.run_for(1)

    assert rehearsal.task(task).agents.roles["drone"] == ("hwd_2",)
    codes = {v.agent: v.code for v in rehearsal.engine.state.explanations[task] if v.role == "drone"}
    assert codes["hwd_1"] == "control"
    assert rehearsal.run_until_ended(task)


def test_a_landing_that_is_nearly_done_refuses_the_cancel_and_its_effect_is_applied(fly: Fly) -> None:
    rehearsal = fly()
    task = pick_up(rehearsal)
    state = rehearsal.engine.state
    assert rehearsal.run_until(lambda: state.agents["hwd_1"].action == "LandIn")
    rehearsal.run_until(lambda: rehearsal.sim["hwd_1"].drone.position().up_m < 4.0)

    rehearsal.abort(task)

    assert rehearsal.run_until_ended(task, limit_s=120)
    assert rehearsal.task(task).status == "CANCELED"
    assert pool(rehearsal) == ("PARKED_AWAY", "grounded")
    assert "parked_away" in alarms(rehearsal)


def test_a_drone_that_refuses_to_come_home_is_tried_three_times_and_then_needs_help(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.sim.refuse_next("hwd_1", count=3)

    rehearsal.abort(task)

    assert rehearsal.run_until_ended(task, limit_s=120)
    assert rehearsal.task(task).status == "CANCELED"
    assert pool(rehearsal)[0] == "QUARANTINED"
    assert "agent_needs_help" in alarms(rehearsal)
    tries = [g.goal_id.split("/")[2] for g in effects(rehearsal, SendGoal) if "recover" in g.goal_id]
    assert tries == ["recover:hwd_1#1", "recover:hwd_1#2", "recover:hwd_1#3"]


def test_a_recover_that_fails_twice_comes_home_at_the_third_try(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    rehearsal.sim.refuse_next("hwd_1", count=2)

    rehearsal.abort(task)

    assert rehearsal.run_until_ended(task, limit_s=600)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_statuses_that_lie_are_counted_and_at_last_quarantine(fly: Fly) -> None:
    rehearsal = fly()
    rehearsal.sim.nan_status("lwd_1", 2)
    rehearsal.run_for(0.1)
    assert rehearsal.engine.state.agents["lwd_1"].bad == 1
    rehearsal.run_for(20)
    assert rehearsal.engine.state.agents["lwd_1"].bad == 0

    rehearsal.sim.wrong_id_status("lwd_1", "lwd_2", 5)
    for _ in range(4):
        rehearsal.sim["lwd_1"].body.report()
    rehearsal.run_for(0.1)

    assert pool(rehearsal, "lwd_1")[0] == "QUARANTINED"
    assert "bad_status" in alarms(rehearsal)
    rehearsal.run_for(10)
    assert pool(rehearsal, "lwd_1") == ("STANDBY", "grounded")


def test_equal_missions_give_equal_steps_byte_for_byte(fly: Fly) -> None:
    journals = []
    for _ in range(2):
        rehearsal = fly()
        task = crossing(rehearsal)
        rehearsal.sim.kill("hwd_1")
        rehearsal.run_for(50)
        rehearsal.sim.restart("hwd_1")
        rehearsal.run_for(200)
        assert rehearsal.ended(task)
        journals.append(msgspec.json.encode(rehearsal.steps))

    assert journals[0] == journals[1]
