"""Missions over real processes and real Zenoh: flown to the end, aborted in flight."""

from collections.abc import Callable

import pytest

from tests.e2e.rig import Rig, missions

pytestmark = pytest.mark.network

Fly = Callable[..., Rig]


def test_a_move_and_two_pick_ups_fly_at_once_and_nothing_crashes(fly: Fly) -> None:
    rig = fly()
    ids = rig.submit(missions(rig.site))
    rig.wait(lambda: rig.ended(ids), within_s=45.0, what="the missions ended")
    assert [rig.task(t).status for t in ids] == ["SUCCEEDED"] * 3
    assert rig.log.all_succeeded()
    assert rig.at_rest(["hwd_1", "hwd_2", "lwd_1", "lwd_2"])
    verdict = rig.verdict()
    assert verdict.is_clean
    assert verdict.closest_pass is not None  # they were in the air at once
    assert verdict.closest_pass.distance_m > 10.0
    assert rig.fleet is not None
    assert rig.fleet.ended() == {}
    rig.close()
    rig.close()  # twice is harmless
    assert set(rig.fleet.ended().values()) == {0}


def test_a_pick_up_aborted_in_flight_brings_its_drone_home(fly: Fly) -> None:
    rig = fly()
    task = rig.pick_up()
    rig.wait(lambda: (drone := rig.flying(task)) is not None and rig.far(drone.agent, 100.0), what="on its way")
    goal = rig.flying(task)
    assert goal is not None
    rig.abort(task)
    rig.wait(lambda: rig.ended([task]), what="aborted")

    assert (rig.task(task).status, rig.task(task).outcome.code) == ("CANCELED", "aborted")
    canceled = next(row for row in rig.log.actions if row.goal == goal.id)
    assert canceled.state == "canceled"  # the agent's word: nothing else ends it so within the grace
    home = [row.action for row in rig.log.rows_of([task]) if row.start >= (canceled.end or 0)]
    assert home[-1] == "LandIn"
    assert "TakeOff" not in home
    assert all(row.state == "succeeded" for row in rig.log.rows_of([task]) if row.goal.split("/")[2].startswith("rec"))
    assert rig.at_rest([goal.agent])
    drone = rig.agent(goal.agent)
    port = rig.site.ports[drone.home].at
    assert drone.position is not None
    assert abs(drone.position.east_m - port.east_m) < 1.0
    assert rig.verdict().is_clean


def test_an_abort_before_the_grant_or_after_the_end_is_answered(fly: Fly) -> None:
    from formiga_bt.base.errors import TaskError

    rig = fly()
    task = rig.move("lwd_1")
    rig.wait(lambda: rig.log.state.agents["lwd_1"].task == task, what="granted")
    second = rig.move("lwd_1")
    rig.abort(second)
    rig.abort(task)
    with pytest.raises(TaskError, match="has ended: CANCELED"):
        rig.abort(second)
    rig.wait(rig.all_ended, what="both ended")
    assert [rig.task(t).status for t in (task, second)] == ["CANCELED", "CANCELED"]
    assert rig.at_rest(["lwd_1"])
