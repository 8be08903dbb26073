"""The shipped missions end as they should, in virtual time, without a crash."""

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.inputs import PublishState, SendGoal
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import effects, packaged_world
from tests.missions.conftest import Fly

SITE = packaged_world()[0]


def pick_up(rehearsal: Rehearsal, where: str = "north_field", who: str = "picker_1", **options: object) -> str:
    return rehearsal.submit("PickUp", {"target": SITE.places[where], "user": AgentRef(who)}, **options)


def actions(rehearsal: Rehearsal, agent: str) -> list[str]:
    return [goal.action for goal in effects(rehearsal, SendGoal) if goal.agent == agent]


def test_pick_up_succeeds_and_everyone_is_home(fly: Fly) -> None:
    rehearsal = fly()

    task = pick_up(rehearsal)

    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"
    drone = rehearsal.engine.state.agents["hwd_1"]
    assert (drone.pool, drone.landed, drone.layer_m) == ("STANDBY", "grounded", None)


def test_pick_up_asks_again_after_not_yet(fly: Fly) -> None:
    rehearsal = fly(scripts={"picker_1": [{"match": "loaded", "options": ["not_yet", "loaded"], "after": "4 s"}]})

    task = pick_up(rehearsal)

    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"
    asked = [q for q in rehearsal.sim["picker_1"].person.asked if "loaded" in q]
    assert len(asked) == 2


def test_the_answer_that_they_stand_clear_saves_a_second_question(fly: Fly) -> None:
    rehearsal = fly()

    rehearsal.run_until_ended(pick_up(rehearsal))

    assert [q for q in rehearsal.sim["picker_1"].person.asked if "start here" in q] == []


def test_pick_up_ends_failed_with_the_drone_home_when_nobody_ever_says_loaded(fly: Fly) -> None:
    never = [{"match": "loaded", "options": ["not_yet"], "after": "4 s"}]
    rehearsal = fly(scripts={"picker_1": never, "watcher_1": never})

    task = pick_up(rehearsal)

    assert rehearsal.run_until_ended(task, limit_s=7200)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "expect")
    # On the ground away from its port: recover brings no such machine home, and it is told.
    assert rehearsal.engine.state.agents["hwd_1"].pool == "PARKED_AWAY"


def test_move_task_at_the_port_flies_a_round(fly: Fly) -> None:
    rehearsal = fly()

    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})

    assert rehearsal.run_until_ended(task, limit_s=600)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert actions(rehearsal, "lwd_1") == ["TakeOff", "GoTo", "GoTo", "LandIn"]


def test_move_task_fetches_a_drone_that_stands_away_from_its_port_after_a_watcher_said_clear(fly: Fly) -> None:
    rehearsal = fly(change={"lwd_1": {"at": Place(-60.0, -180.0)}})
    assert rehearsal.engine.state.agents["lwd_1"].pool == "PARKED_AWAY"

    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})

    rehearsal.run_for(2)
    assert rehearsal.task(task).hold.words == ("clearance:lwd_1",)
    assert effects(rehearsal, PublishState)[-1].status == "HELD"
    assert rehearsal.run_until_ended(task, limit_s=600)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert ["start here" in q for q in rehearsal.sim["watcher_1"].person.asked] == [True]
    assert rehearsal.engine.state.agents["lwd_1"].pool == "STANDBY"
    start = next(g for g in effects(rehearsal, SendGoal) if g.action == "TakeOff")
    assert start.clearance is not None
    assert start.clearance.by == "watcher_1"


def test_move_task_brings_home_a_drone_that_hovers_idle(fly: Fly) -> None:
    rehearsal = fly(change={"lwd_1": {"at": Position(-60.0, -180.0, 40.0)}})

    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})

    assert rehearsal.run_until_ended(task, limit_s=600)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert actions(rehearsal, "lwd_1") == ["GoTo", "GoTo", "LandIn"]
    assert rehearsal.sim["watcher_1"].person.asked == []


def test_two_pick_ups_at_once_share_their_people(fly: Fly) -> None:
    rehearsal = fly()

    first, second = pick_up(rehearsal, "north_field"), pick_up(rehearsal, "east_field")

    def one_each() -> bool:
        goals = rehearsal.engine.state.goals.values()
        shown = [g.agent for g in goals if g.owner == "!question" and not g.ended]
        assert len(shown) == len(set(shown)), "two prompts at once for one person"
        return rehearsal.ended(first, second)

    assert rehearsal.run_until(one_each)
    assert {rehearsal.task(t).status for t in (first, second)} == {"SUCCEEDED"}
    assert rehearsal.task(first).agents.granted[0] != rehearsal.task(second).agents.granted[0]


def test_two_pick_ups_and_a_move_at_one_place_end_without_a_crash(fly: Fly) -> None:
    rehearsal = fly(more=[AgentSpec(id="hwd_9", type="hwd", at=Place(-15.0, 40.0))])

    tasks = [pick_up(rehearsal, where) for where in ("north_field", "east_field", "west_field")]
    tasks.append(rehearsal.submit("MoveTask"))

    assert rehearsal.run_until_ended(*tasks, limit_s=7200)
    assert {rehearsal.task(t).status for t in tasks} == {"SUCCEEDED"}


def test_two_pick_ups_to_one_spot_wait_for_each_other(fly: Fly) -> None:
    rehearsal = fly()

    tasks = [pick_up(rehearsal, who="picker_1"), pick_up(rehearsal, who="picker_2")]

    assert rehearsal.run_until_ended(*tasks, limit_s=7200)
    assert {rehearsal.task(t).status for t in tasks} == {"SUCCEEDED"}
