"""Breaches of the envelope in flight: what the engine does by itself."""

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.inputs import Alarm, SendGoal
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, check_rehearsal, effects, packaged_task, packaged_world
from formiga_bt.transport.memory import Faults
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.test_faults import crossing, pool


def test_a_machine_whose_charge_drops_comes_home_at_once_and_its_task_ends(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)

    rehearsal.sim["hwd_1"].drone.set_battery(26.0)
    rehearsal.run_for(1)

    record = rehearsal.task(task)
    assert (record.outcome.status, record.outcome.code) == ("FAILED", "envelope.reserve")
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert pool(rehearsal) == ("STANDBY", "grounded")
    assert "envelope.reserve" in alarms(rehearsal)
    home = [g for g in effects(rehearsal, SendGoal) if g.goal_id.startswith("Return-")]
    assert [g.action for g in home] == ["GoTo", "GoTo", "LandIn"]
    assert rehearsal.engine.state.orders == {}


def test_a_landing_is_finished_before_the_task_ends(fly: Fly) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    drone = rehearsal.sim["hwd_1"].body
    assert rehearsal.run_until(lambda: any(g.phase == "descending" for g in rehearsal.engine.state.goals.values()), 300)

    rehearsal.sim["hwd_1"].drone.set_battery(20.0)
    rehearsal.run_for(1)

    assert rehearsal.task(task).outcome.status == ""
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "envelope.reserve")
    assert drone.position().up_m == 0.0
    assert pool(rehearsal) == ("PARKED_AWAY", "grounded")


def test_a_machine_that_does_not_get_on_is_called_home(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = crossing(rehearsal)
    drone = rehearsal.sim["hwd_1"].drone
    rehearsal.run_for(1)
    drone._stand_still()  # it hovers, and still says that its goal runs

    assert rehearsal.run_until(lambda: rehearsal.task(task).outcome.status != "", 900)

    assert rehearsal.task(task).outcome.code == "envelope.progress"
    alarm = next(a for a in effects(rehearsal, Alarm) if a.code == "envelope.progress")
    wording(alarm.text)
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_a_way_whose_end_was_not_heard_is_no_way_that_does_not_get_on() -> None:
    site, catalogue = packaged_world()
    patient = {"suspect_after_us": 600 * SECOND, "lost_after_us": 900 * SECOND}
    types = {
        name: replace(kind, **patient, limits={**kind.limits, "link_silence_s": 900.0})
        for name, kind in catalogue.types.items()
    }
    catalogue = replace(catalogue, types=types)
    rehearsal = Rehearsal(
        site, catalogue, [packaged_task("move_task"), packaged_task("pick_up")], fleet_of(site, catalogue)
    )
    rehearsal.run_for(1)
    task = crossing(rehearsal)
    rehearsal.hub.set_faults("hwd_1", Faults(drop=1.0))
    rehearsal.run_for(200)  # meanwhile the way ends, and its result is lost
    rehearsal.hub.set_faults("hwd_1", Faults())

    assert rehearsal.run_until_ended(task, limit_s=1200)

    assert rehearsal.task(task).status == "SUCCEEDED"
    assert "envelope.progress" not in alarms(rehearsal)
    check_rehearsal(rehearsal)
    rehearsal.close()
