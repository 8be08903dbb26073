"""What a wire does not guarantee: who is admitted, what the gate refuses, what a restart takes for done."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.wires import missing
from formiga_bt.cli.operator.agents import _row
from formiga_bt.engine.kernel.inputs import AgentSeenInput, Alarm, GoalEventInput, SendGoal
from formiga_bt.lang.model import Site
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, effects, packaged_world, task_of
from formiga_bt.show.history.records import agent_fact
from formiga_bt.transport.messages import GoalEvent, PreflightCheck

SITE, CATALOGUE = packaged_world()
REAL = replace(SITE, mode="real", pilots={"anna": 5})
LESS = ("epoch", "expiry")
FLY = task_of(
    """
agents: {drone: {type: hwd}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${at_height(base, 75 m)}"}
  - do: drone.GoTo
    with: {to: "${at_height(drone.home, 60 m)}"}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
""",
    SITE,
    CATALOGUE,
)


def bench(site: Site = SITE) -> tuple[Bench, ScriptedAgent]:
    made = Bench(site, CATALOGUE, [FLY])
    drone = made.agent("hwd_1", "hwd")
    made.run_for(2)
    return made, drone


def on_wire(made: Bench, drone: ScriptedAgent, lacks: tuple[str, ...] = LESS, wire: str = "mqtt") -> None:
    made.driver.feed(AgentSeenInput(drone.side.card, made.now, wire, lacks))
    made.run_for(1)


def test_the_wires_that_ship_guarantee_everything() -> None:
    made, _ = bench()
    assert missing(made.hub.transport.guarantees) == ()
    assert (made.record("hwd_1").wire, made.record("hwd_1").lacks) == ("memory", ())


@pytest.mark.parametrize(
    ("site", "refused"),
    [
        (SITE, ""),
        (REAL, "wire_lacks"),
        (replace(REAL, accept_missing={"mqtt": ("epoch",)}), "wire_lacks"),
        (replace(REAL, accept_missing={"zenoh": ("epoch", "expiry")}), "wire_lacks"),
        (replace(REAL, accept_missing={"mqtt": ("epoch", "expiry")}), ""),
    ],
)
def test_mode_real_demands_every_guarantee_but_those_it_accepts_by_name(site: Site, refused: str) -> None:
    made, drone = bench(site)
    on_wire(made, drone)
    agent = made.record("hwd_1")
    assert agent.refused == refused
    said = [one.text for one in effects(made, Alarm) if one.code == "not_admitted"]
    assert bool(said) == bool(refused)
    assert all("expiry" in one for one in said)
    assert "mqtt lacks epoch, expiry" in _row(agent_fact(made.engine.state, agent, made.now, 0), None)[-1]

    on_wire(made, drone, ())
    assert made.record("hwd_1").refused == ""


def test_a_machine_in_use_that_comes_back_on_a_lesser_wire_comes_home_and_gets_nothing_else() -> None:
    made, drone = bench()
    task = made.submit("Try", {})
    made.run_for(10)
    drone.succeed()
    made.run_for(2)
    assert drone.goal.action == "GoTo"
    made.engine.core.site = REAL
    on_wire(made, drone)
    agent = made.record("hwd_1")
    assert (agent.refused, agent.refused_at_rest) == ("", "wire_lacks")
    drone.succeed()
    made.run_for(2)
    assert made.task(task).outcome.code == "wire_lacks"
    assert drone.goal.goal_id.split("/")[2].startswith("recover")

    on_wire(made, drone, ())
    assert made.record("hwd_1").refused_at_rest == ""


@pytest.mark.parametrize("lacks", [(), ("goal_memory",), ("expiry",), ("epoch",)])
def test_a_goal_that_may_not_be_repeated_is_sent_again_only_where_it_is_begun_once_at_most(
    lacks: tuple[str, ...],
) -> None:
    made, drone = bench()
    task = made.submit("Try", {})
    made.run_for(10)
    goal = next(one for one in made.engine.state.goals.values() if one.agent == "hwd_1")
    made.engine.core.put_goal(goal.id, state="sent", repeatable=False)
    on_wire(made, drone, lacks)
    sent = len(effects(made, SendGoal))
    made.driver.feed(GoalEventInput(GoalEvent(goal_id=goal.id, agent="hwd_1", state="unknown"), made.now, made.now))
    again = len(effects(made, SendGoal)) - sent
    assert again == (0 if set(lacks) & {"goal_memory", "expiry"} else 1)
    if not again:
        assert made.task(task).outcome.code != "" or made.record("hwd_1").pool == "QUARANTINED"


def test_what_flies_is_granted_only_with_the_site_as_it_is_where_checks_are_required() -> None:
    made = Bench(replace(SITE, preflight=True), CATALOGUE, [FLY])
    drone = made.agent("hwd_1", "hwd")
    drone.say(checks=(PreflightCheck("gnss", True),))
    made.run_for(1)
    assert [(one.check, one.ok) for one in made.record("hwd_1").checks] == [("gnss", True), ("site", True)]
    drone.side._site = None  # as one that never heard of it
    drone.say(battery=90.0)
    made.run_for(1)
    task = made.submit("Try", {})
    made.run_for(5)
    assert made.task(task).status == "PENDING"
    assert made.record("hwd_1").checks[-1].ok is False
    made.driver.switchboard.publish_site(made.engine.core.site_message, 1)
    made.run_for(5)
    assert made.task(task).status == "ACTIVE"
