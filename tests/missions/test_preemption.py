"""An alarm comes while every heavy drone is in the air for something else: WatchDogSOS gets one (execution: preemption)."""

from typing import Any

from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.lang.model import Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import effects, packaged_task, packaged_world, task_of
from tests.golden import Wording
from tests.missions.conftest import Fly

SITE, CATALOGUE = packaged_world()
SOS = packaged_task("watch_dog_sos")
HEAVY = tuple(agent.id for agent in SITE.agents.values() if agent.type == "hwd")

HOVER = """
imports: [lib/flying.yaml]
agents:
  drone: {type: hwd}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.camp}", height: 60 m}
  - wait: 2 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def hover(wait: str = "wait: 2 min") -> Task:
    return task_of(HOVER.replace("wait: 2 min", wait), SITE, CATALOGUE, "Hover")


def alone(fly: Fly, *tasks: Task, **options: Any) -> Rehearsal:
    """Start a rehearsal with one heavy drone."""
    return fly(SOS, *tasks, without=HEAVY[1:], **options)


def alarm(rehearsal: Rehearsal) -> str:
    return rehearsal.submit("WatchDogSOS", {"alarmtype": "sos", "target": SITE.places["north_field"]})


def flown_by(rehearsal: Rehearsal, agent: str) -> list[str]:
    """Return which tasks and runs sent goals to an agent, in order: `Hover-1/1`."""
    ids = [goal.goal_id for goal in effects(rehearsal, SendGoal) if goal.agent == agent]
    return list(dict.fromkeys("/".join(i.split("/")[:2]) for i in ids))


def test_the_drone_comes_home_flies_to_the_alarm_and_then_its_first_mission_from_the_start(
    fly: Fly, wording: Wording
) -> None:
    rehearsal = alone(fly, hover())
    mine = rehearsal.submit("Hover")
    rehearsal.run_for(60)
    assert rehearsal.engine.state.agents[HEAVY[0]].landed == "airborne"

    urgent = alarm(rehearsal)

    assert rehearsal.run_until_ended(mine, urgent, limit_s=3600)
    assert [rehearsal.task(t).status for t in (mine, urgent)] == ["SUCCEEDED", "SUCCEEDED"]
    assert rehearsal.task(mine).run == 2
    wording(rehearsal.task(mine).restart.past)
    assert flown_by(rehearsal, HEAVY[0]) == [f"{mine}/1", f"{urgent}/1", f"{mine}/2"]
    assert (rehearsal.task(urgent).times.ended_at or 0) <= (rehearsal.task(mine).times.active_at or 0)


def test_what_is_critical_is_done_first(fly: Fly) -> None:
    rehearsal = alone(fly, hover(wait="{wait: 40 s, critical: true}"))
    mine = rehearsal.submit("Hover")
    rehearsal.run_until(lambda: "steps/steps[1]" in rehearsal.engine.state.memory.get(mine, {}), limit_s=600)
    began = rehearsal.now

    urgent = alarm(rehearsal)
    rehearsal.run_until(lambda: rehearsal.task(mine).restart.why, limit_s=600)

    assert 39 <= (rehearsal.now - began) / 1e6 <= 43
    assert rehearsal.run_until_ended(mine, urgent, limit_s=3600)
    assert [rehearsal.task(t).status for t in (mine, urgent)] == ["SUCCEEDED", "SUCCEEDED"]


def test_a_drone_that_stands_in_the_field_is_no_help_and_is_left_there(fly: Fly) -> None:
    slow = [{"match": "loaded", "options": ["loaded"], "after": "5 min"}]
    rehearsal = alone(fly, scripts={"picker_1": slow, "watcher_1": slow})
    where = SITE.places["north_field"]
    pick_up = rehearsal.submit("PickUp", {"target": where, "user": AgentRef("picker_1")})
    drone = rehearsal.engine.state.agents
    rehearsal.run_until(lambda: rehearsal.engine.state.questions and drone[HEAVY[0]].landed == "grounded", limit_s=900)
    rehearsal.run_for(5)

    urgent = alarm(rehearsal)
    rehearsal.run_for(30)

    verdicts = {v.agent: v.code for v in rehearsal.engine.state.explanations[urgent] if v.role == "drone"}
    assert (verdicts[HEAVY[0]], rehearsal.task(pick_up).restart.why) == ("busy", "")
    assert rehearsal.run_until_ended(pick_up, urgent, limit_s=3600)
    assert rehearsal.task(pick_up).status == "SUCCEEDED"
