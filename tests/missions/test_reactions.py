"""Following who walks, and seizing busy machines: recipes of the cookbook, flown while others fly too."""

from typing import Any

from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.kernel.inputs import UpdateGoalFields
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import effects, packaged_task, packaged_world, task_of
from tests.missions.conftest import Fly

SITE, CATALOGUE = packaged_world()
ESCORT, DRILL = packaged_task("cookbook/escort"), packaged_task("cookbook/fire_drill")
HOVER = """
imports: [lib/flying.yaml]
params: {height: distance}
agents:
  drone: {type: lwd}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.camp}", height: "${height}"}
  - wait: 5 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def escort(fly: Fly, *way: Place, at: Place) -> tuple[Rehearsal, str]:
    rehearsal = fly(ESCORT, change={"picker_1": {"at": at, "walk": way}})
    return rehearsal, rehearsal.submit("Escort", {"user": AgentRef("picker_1"), "watch": 300.0})


def far(rehearsal: Rehearsal, one: str, other: str) -> float:
    here, there = (rehearsal.engine.state.agents[agent].position for agent in (one, other))
    assert here is not None
    assert there is not None
    return horizontal_m(here, there)


def test_two_drones_follow_a_person_who_walks_one_behind_the_other(fly: Fly) -> None:
    rehearsal, task = escort(fly, Place(400.0, 0.0), at=Place(40.0, 0.0))
    rehearsal.run_until(lambda: "steps/steps[1]" in rehearsal.engine.state.memory.get(task, {}), limit_s=300)
    rehearsal.run_for(60)
    (lead,), (tail,) = (rehearsal.task(task).agents.roles[role] for role in ("lead", "tail"))
    for _ in range(10):  # 1.4 m/s, and what they were told is at most 2 s and 3 m old
        rehearsal.run_for(10)
        assert 5 <= far(rehearsal, lead, "picker_1") <= 18
        assert 15 <= far(rehearsal, tail, lead) <= 30
    assert {one.agent for one in effects(rehearsal, UpdateGoalFields)} == {lead, tail}
    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_who_leaves_the_fence_is_followed_no_further(fly: Fly) -> None:
    rehearsal, task = escort(fly, Place(1500.0, 0.0), at=Place(540.0, 0.0))
    assert rehearsal.run_until_ended(task, limit_s=1800)
    outcome = rehearsal.task(task).outcome
    assert (outcome.status, outcome.code) == ("FAILED", "no_update")
    assert "envelope.keep_in" in outcome.reason


def test_a_drill_brings_busy_drones_home_and_keeps_them_until_all_is_well(fly: Fly) -> None:
    fleet = tuple(agent.id for agent in SITE.agents.values() if agent.type in ("lwd", "hwd"))
    rehearsal = fly(task_of(HOVER, SITE, CATALOGUE, "Hover"), DRILL)
    busy = [rehearsal.submit("Hover", {"height": 40.0 + 20.0 * n}) for n in range(2)]
    rehearsal.run_for(90)
    drill = rehearsal.submit("FireDrill", {"place": SITE.places["north_field"]})
    granted: dict[str, Any] = {}

    def begun() -> bool:
        granted.update(rehearsal.task(drill).agents.roles)
        return "drones" in granted

    assert rehearsal.run_until(begun, limit_s=900)
    assert sorted((*granted["drones"], *granted["looker"])) == sorted(fleet)
    assert [rehearsal.task(one).run for one in busy] == [2, 2]
    assert rehearsal.run_until_ended(drill, *busy, limit_s=7200)
    assert [rehearsal.task(one).status for one in (drill, *busy)] == ["SUCCEEDED"] * 3
