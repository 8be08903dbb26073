"""Keeping apart (safety 5): a leg waits while another is in the way, and goes on when it is free."""

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.inputs import Abort, Operator
from formiga_bt.engine.kernel.records import GoalRecord
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import packaged_task, packaged_world, task_of
from tests.missions.conftest import Fly
from tests.missions.test_shipped import SITE, pick_up

BLOCK = """
imports: [lib/flying.yaml]
params: {robot: {type: agent, of: [lwd]}, spot: place}
agents: {drone: {type: lwd, id: "${robot}"}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${spot}", height: 60 m}
  - wait: 2 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def test_a_leg_waits_for_a_drone_that_hovers_in_its_way_and_says_for_whom(fly: Fly) -> None:
    rehearsal = fly(task_of(BLOCK, *packaged_world(), name="Block"))
    block = rehearsal.submit("Block", {"robot": AgentRef("lwd_1"), "spot": SITE.places["north_field"]})
    rehearsal.run_for(70)

    task = pick_up(rehearsal)
    rehearsal.run_for(100)

    waiting = [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"]
    assert waiting == [("leg_busy", "lwd_1")]
    assert rehearsal.run_until_ended(block, task, limit_s=1800)
    assert {rehearsal.task(t).status for t in (block, task)} == {"SUCCEEDED"}


def test_an_idle_hovering_drone_is_in_the_way_too(fly: Fly) -> None:
    field = SITE.places["north_field"]
    there = Position(field.east_m, field.north_m, 60.0)
    rehearsal = fly(change={"lwd_1": {"at": there}})
    rehearsal.ask(Operator("hold", "lwd_1"))  # else it is brought home
    task = pick_up(rehearsal)
    rehearsal.run_for(200)
    assert any(g.code == "leg_busy" and g.text == "lwd_1" for g in rehearsal.engine.state.goals.values())

    rehearsal.ask(Operator("continue", "lwd_1"))

    assert rehearsal.run_until_ended(task, limit_s=1800)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_nobody_lands_on_a_drone_that_is_parked_there(fly: Fly) -> None:
    field = SITE.places["north_field"]
    parked = AgentSpec(id="lwd_9", type="lwd", at=Place(field.east_m, field.north_m + 1.0))
    rehearsal = fly(more=[parked])
    task = pick_up(rehearsal)
    rehearsal.run_for(300)

    assert any(g.code == "spot_busy" and g.text == "lwd_9" for g in rehearsal.engine.state.goals.values())
    assert rehearsal.run_until_ended(task)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "spot_busy")
    drone = rehearsal.engine.state.agents["hwd_1"]
    assert (drone.pool, drone.landed) == ("STANDBY", "grounded")
    assert (drone.battery or 0.0) > 25.0


def test_flights_of_several_tasks_cross_in_layers_of_their_own(fly: Fly) -> None:
    rehearsal = fly()
    tasks = [pick_up(rehearsal, "east_field"), pick_up(rehearsal, "west_field", "picker_2")]
    rehearsal.run_for(10)

    layers = [rehearsal.engine.state.agents[a].layer_m for a in ("hwd_1", "hwd_2")]

    assert sorted(layers) == [60.0, 75.0]  # type: ignore[type-var]
    assert rehearsal.run_until_ended(*tasks)


def test_the_whole_way_of_a_lost_drone_stays_reserved_for_it_may_have_gone_on(fly: Fly) -> None:
    rehearsal = fly()
    lost = pick_up(rehearsal)
    rehearsal.run_for(24)
    rehearsal.sim.freeze("hwd_1")  # its body flies on, and hovers over the field
    rehearsal.run_for(60)
    assert rehearsal.task(lost).outcome.code == "agent_lost"

    task = pick_up(rehearsal)
    rehearsal.run_for(200)

    assert [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"] == [
        ("leg_busy", "hwd_1")
    ]
    rehearsal.sim.thaw("hwd_1")
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert rehearsal.engine.state.agents["hwd_1"].lost_leg is None


def test_nobody_crosses_an_area_while_it_is_explored(fly: Fly) -> None:
    rehearsal = fly(packaged_task("explore_region"))
    survey = rehearsal.submit("ExploreRegion", {"region": SITE.regions["bog"], "altitude": 75.0})
    assert rehearsal.run_until(lambda: any(g.action == "Explore" for g in rehearsal.engine.state.goals.values()), 600)
    explorer = next(g for g in rehearsal.engine.state.goals.values() if g.action == "Explore")
    assert explorer.area is not None
    assert (explorer.leg, explorer.area.up_m) == (None, 75.0)

    # the second task's layer is 75 m: its way to the north field ends at the corner of the bog
    task = pick_up(rehearsal)
    rehearsal.run_for(60)
    waiting = [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"]
    assert waiting == [("leg_busy", explorer.agent)]

    assert rehearsal.run_until_ended(survey, task, limit_s=3600)
    assert {rehearsal.task(t).status for t in (survey, task)} == {"SUCCEEDED"}


def test_the_area_of_a_lost_explorer_stays_reserved(fly: Fly) -> None:
    rehearsal = fly(packaged_task("explore_region"))
    rehearsal.submit("ExploreRegion", {"region": SITE.regions["bog"], "altitude": 75.0})
    rehearsal.run_until(lambda: any(g.action == "Explore" for g in rehearsal.engine.state.goals.values()), 600)
    goal = next(g for g in rehearsal.engine.state.goals.values() if g.action == "Explore")
    rehearsal.sim.freeze(goal.agent)
    rehearsal.run_for(60)

    lost = rehearsal.engine.state.agents[goal.agent]
    assert (lost.pool, lost.lost_area) == ("QUARANTINED", goal.area)
    rehearsal.sim.thaw(goal.agent)
    assert rehearsal.run_until_ended()


def explores(rehearsal: Rehearsal) -> GoalRecord:
    """Let a drone explore the bog at 75 m; return its goal."""
    rehearsal.submit("ExploreRegion", {"region": SITE.regions["bog"], "altitude": 75.0})
    assert rehearsal.run_until(lambda: any(g.action == "Explore" for g in rehearsal.engine.state.goals.values()), 600)
    goal = next(g for g in rehearsal.engine.state.goals.values() if g.action == "Explore")
    assert goal.area is not None
    return goal


def waiting_at_75_m(rehearsal: Rehearsal) -> list[tuple[str, str]]:
    """Request a second task, whose way in its layer of 75 m ends at the corner of the bog; tell its waits."""
    pick_up(rehearsal)
    rehearsal.run_for(60)
    return [(g.code, g.text) for g in rehearsal.engine.state.goals.values() if g.state == "gated"]


def test_a_drone_that_never_confirmed_that_it_stopped_keeps_its_area(fly: Fly) -> None:
    rehearsal = fly(packaged_task("explore_region"))
    goal = explores(rehearsal)
    rehearsal.sim.never_confirm_cancel(goal.agent)
    rehearsal.ask(Abort(goal.task))
    rehearsal.run_for(40)
    kept = rehearsal.engine.state.agents[goal.agent]
    assert (kept.quarantine, kept.lost_area) == ("cancel_unconfirmed", goal.area)

    assert waiting_at_75_m(rehearsal) == [("leg_busy", goal.agent)]

    rehearsal.ask(Operator("clear", goal.agent))
    assert rehearsal.run_until_ended()
    assert rehearsal.engine.state.agents[goal.agent].lost_area is None
