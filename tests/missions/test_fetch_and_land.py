"""LandNear and FetchHome of the shipped library: down beside the drone, and home again from there."""

import pytest

from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.rehearsal.testing import effects, packaged_world, task_of
from tests.missions.conftest import Fly

TASK = """
imports: [lib/flying.yaml]
params:
  spot: place
  beside: distance
agents:
  drone: {type: hwd, id: hwd_1}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${spot}", height: 40 m}
  - call: LandNear
    with: {drone: "${drone}", at: "${offset(spot, east=beside)}"}
  - call: FetchHome
    with: {drone: "${drone}"}
"""


@pytest.mark.parametrize(("beside", "legs_before_landing"), [(4.0, 3), (12.0, 4)])
def test_a_drone_lands_where_it_is_told_and_is_fetched_from_there(
    fly: Fly, beside: float, legs_before_landing: int
) -> None:
    rehearsal = fly(task_of(TASK, *packaged_world(), "Visit"))
    task = rehearsal.submit("Visit", {"spot": Place(-60.0, -180.0), "beside": beside})
    drone = rehearsal.sim["hwd_1"].body

    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].landed == "airborne", 60)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].landed == "grounded", 300)
    assert horizontal_m(drone.position(), Place(-60.0 + beside, -180.0)) < 1.0
    goals = [goal.action for goal in effects(rehearsal, SendGoal) if goal.agent == "hwd_1"]
    assert goals == ["TakeOff", *["GoTo"] * legs_before_landing, "LandIn"]

    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert rehearsal.engine.state.agents["hwd_1"].landed == "grounded"
