"""A fleet in this process: agents from plain data, and faults on demand."""

import pytest

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position
from formiga_bt.transport.messages import AgentGone, AgentSeen, BadMessage, QueryReplied, StatusArrived
from tests.unit.agents_sim.conftest import World, point

FLYING = AgentSpec(id="d", type="lwd", at=Position(0.0, 0.0, 60.0), limits={"speed_m_s": 10.0})


def test_a_killed_drone_is_found_hovering_with_a_new_boot_id(world: World) -> None:
    world.fleet.add(FLYING)
    leg = world.order("d", "GoTo", to=point(100, 0, 60))
    world.run(3.0)
    world.fleet.kill("d")
    world.run(60.0)
    world.fleet.restart("d")
    world.hub.transport.query_goals("d", [leg])
    world.run(0.0)
    cards = [event.card for _, event in world.heard if isinstance(event, AgentSeen)]
    assert [card.boot_id for card in cards] == ["d-boot-1", "d-boot-2"]
    assert any(isinstance(event, AgentGone) for _, event in world.heard)
    status = world.statuses("d")[-1]
    assert (status.position, status.landed, status.boot_id) == (Position(30.0, 0.0, 60.0), "airborne", "d-boot-2")
    assert world.fleet["d"].side is not None
    assert world.fleet["d"].side.state_of(leg) == "unknown"


def test_a_frozen_drone_flies_on_in_silence(world: World) -> None:
    world.fleet.add(FLYING)
    leg = world.order("d", "GoTo", to=point(100, 0, 60))
    world.fleet.freeze("d")
    world.run(20.0)
    assert [event.state for event in world.events(leg)] == ["accepted", "running"] or len(world.events(leg)) <= 2
    world.fleet.thaw("d")
    world.run(0.0)
    assert world.end(leg)[1].state == "succeeded"


def test_what_a_frozen_drone_meant_to_say_leaves_before_what_it_answers_now(world: World) -> None:
    world.fleet.add(FLYING)
    world.run(1.0)
    world.fleet.freeze("d")
    world.run(1.0)
    world.hub.transport.query_goals("d", [])  # it hears that after it was thawed
    world.run(4.0)
    before = len(world.heard)
    world.fleet.thaw("d")
    world.run(0.0)
    said = [type(event) for _, event in world.heard[before:] if isinstance(event, StatusArrived | QueryReplied)]
    assert said == [StatusArrived, QueryReplied]


def test_the_pilot_takes_over_and_hands_back(world: World) -> None:
    world.fleet.add(FLYING)
    leg = world.order("d", "GoTo", to=point(100, 0, 60))
    world.run(4.0)
    world.fleet.take_over("d")
    world.run(0.0)
    assert world.end(leg)[1].state == "taken_over"
    refused = world.order("d", "GoTo", to=point(0, 0, 60))
    assert world.end(refused)[1].state == "rejected"
    world.fleet.hand_back("d")
    world.run(0.0)
    assert [status.control for status in world.statuses("d")][-2:] == ["pilot", "engine"]
    taken = world.order("d", "GoTo", to=point(40, 0, 60))
    world.run(1.0)
    assert world.end(taken)[1].state == "succeeded"  # it hovered where it was taken


def test_faults_on_demand(world: World) -> None:
    world.fleet.add(FLYING)
    world.fleet.refuse_next("d", "not_today")
    assert world.end(world.order("d", "GoTo", to=point(9, 0, 60)))[1].code == "not_today"

    world.fleet.nan_status("d")
    world.fleet.wrong_id_status("d", "somebody")
    world.run(0.0)
    assert [type(event) for _, event in world.heard][-2:] == [BadMessage, BadMessage]

    lost = world.order("d", "GoTo", to=point(10, 0, 60))
    world.fleet.lose_next_result("d")
    world.run(10.0)
    assert "succeeded" not in [event.state for event in world.events(lost)]
    assert (world.statuses("d")[-1].last_goal, world.statuses("d")[-1].last_goal_state) == (lost, "succeeded")

    world.fleet.never_confirm_cancel("d")
    stuck = world.order("d", "GoTo", to=point(200, 0, 60))
    world.hub.transport.cancel_goal("d", stuck)
    world.run(60.0)
    assert world.events(stuck)[-1].state == "canceling"
    assert world.fleet["d"].drone.position() == Position(10.0, 0.0, 60.0)


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        (AgentSpec(id="x", type="boat"), "known: lwd, hwd, picker, watcher"),
        (AgentSpec(id="x", type="lwd", limits={"sped": 1.0}), "unknown limits sped"),
        (AgentSpec(id="x", type="lwd", limits={"speed_m_s": 0.0}), "must be a positive number"),
        (AgentSpec(id="x", type="lwd", battery=120.0), "must be 0..100"),
    ],
)
def test_a_wrong_spec_is_refused_with_what_would_be_right(world: World, spec: AgentSpec, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        world.fleet.add(spec)


def test_cards_tell_what_an_agent_can_do(world: World) -> None:
    world.fleet.add(FLYING)
    world.fleet.add(AgentSpec(id="w", type="watcher", at=Place(1.0, 1.0)))
    world.run(0.0)
    drone, person = (event.card for _, event in world.heard if isinstance(event, AgentSeen))
    assert (drone.mobility, drone.limits["speed_m_s"], drone.limits["climb_m_s"]) == ("air", 10.0, 2.5)
    assert (person.mobility, person.actions) == ("people", ("Confirm",))
    assert world.fleet.statistics() == {"agents": 2, "running": 2, "airborne": 1}


def test_two_equal_runs_hear_the_same(world: World) -> None:
    def run(world: World) -> list[object]:
        world.fleet.add(FLYING)
        world.order("d", "GoTo", goal_id="g", to=point(33, 44, 61))
        world.run(60.0)
        return list(world.heard)

    assert run(world) == run(World())


def test_a_pilot_stays_in_command_when_the_process_starts_anew(world: World) -> None:
    world.fleet.add(FLYING)
    world.fleet.take_over("d")
    world.fleet.restart("d")
    world.run(0.0)
    status = world.statuses("d")[-1]
    assert (status.boot_id, status.control) == ("d-boot-2", "pilot")


def test_a_drone_charges_at_home_only(world: World) -> None:
    charging = {"charge_percent_s": 0.5}
    for agent, home in (("a", Place(0.0, 0.0)), ("b", Place(30.0, 0.0))):
        world.fleet.add(AgentSpec(id=agent, type="lwd", battery=40.0, home=home, limits=charging))
    world.run(60.0)
    assert (world.fleet["a"].drone.battery(), world.fleet["b"].drone.battery()) == (70.0, 40.0)
    world.run(600.0)
    assert world.fleet["a"].drone.battery() == 100.0
