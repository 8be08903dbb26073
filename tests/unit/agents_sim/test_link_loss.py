"""A drone that no longer hears its engine does by itself what its card says, and yields when it hears it again."""

import pytest

from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from formiga_bt.transport.messages import AgentGone, AgentSeen, ClockBeat, GoalRequest
from tests.unit.agents_sim.conftest import World, point

HOME = Place(0.0, 0.0)


def beats(world: World, number: int = 1) -> None:
    now = world.clock.now()
    world.hub.transport.publish_clock(
        ClockBeat(wall_us=now, engine_us=now, speed=1.0, epoch=0, beat=now // SECOND + number)
    )


def run(world: World, seconds: int) -> None:
    """Let time pass with the engine's heartbeat each second."""
    for _ in range(seconds):
        beats(world)
        world.run(1.0)


def go(world: World, spec: AgentSpec, goal_id: str = "leg") -> None:
    world.fleet.add(spec)
    world.hub.transport.send_goal(
        GoalRequest(
            goal_id=goal_id,
            agent=spec.id,
            action="GoTo",
            fields={"to": point(400, 0, 60)},
            link_silence_s=10.0,
            beat=1000,
        )
    )
    world.run(0)


def drone(does: str = "return", **limits: float) -> AgentSpec:
    return AgentSpec(
        id="d",
        type="hwd",
        at=Position(100.0, 0.0, 60.0),
        home=HOME,
        on_link_loss=does,
        limits=limits,  # type: ignore[arg-type]
    )


def test_with_heartbeats_it_flies_on(world: World) -> None:
    go(world, drone())
    run(world, 30)
    assert world.end("leg")[1].state == "succeeded"


def test_it_returns_by_itself_after_ten_seconds_of_silence(world: World) -> None:
    go(world, drone())
    run(world, 5)
    world.fleet.lose_link("d")
    world.run(9.0)
    body = world.fleet["d"].drone
    assert world.fleet["d"].side is not None
    assert world.fleet["d"].side.control == "engine"
    world.run(3.0)
    assert world.fleet["d"].side.control == "failsafe"
    assert world.fleet["d"].side.state_of("leg") == "taken_over"
    world.run(60.0)
    assert (body.position(), body.landed()) == (Position(0.0, 0.0, 0.0), "grounded")
    assert world.fleet["d"].side.control == "failsafe"  # as long as nobody is heard
    assert world.events("leg")[-1].state == "running"  # nothing of it was told


def test_when_the_link_is_back_it_tells_and_yields(world: World) -> None:
    go(world, drone())
    run(world, 5)
    world.fleet.lose_link("d")
    run(world, 60)
    world.fleet.mend_link("d")
    run(world, 3)
    assert world.end("leg")[1].state == "taken_over"
    status = world.statuses("d")[-1]
    assert (status.control, status.landed, status.last_goal, status.last_goal_state) == (
        "engine",
        "grounded",
        "leg",
        "taken_over",
    )
    assert [s.control for s in world.statuses("d") if s.seq > 2][-2] == "failsafe"


def test_back_in_the_middle_of_the_way_home_it_comes_home_first(world: World) -> None:
    go(world, drone())
    run(world, 5)
    world.fleet.lose_link("d")
    run(world, 13)
    world.fleet.mend_link("d")
    run(world, 3)
    assert world.statuses("d")[-1].control == "failsafe"
    run(world, 60)
    assert (world.statuses("d")[-1].control, world.statuses("d")[-1].landed) == ("engine", "grounded")


@pytest.mark.parametrize("vanishes", [True, False])
def test_its_presence_goes_with_the_link_or_stays(world: World, vanishes: bool) -> None:
    go(world, drone())
    world.fleet.lose_link("d", vanishes=vanishes)
    run(world, 20)
    gone = [event for _, event in world.heard if isinstance(event, AgentGone)]
    assert len(gone) == (1 if vanishes else 0)
    world.fleet.mend_link("d")
    run(world, 1)
    seen = [event.card.boot_id for _, event in world.heard if isinstance(event, AgentSeen)]
    assert seen == ["d-boot-1"] * (2 if vanishes else 1)


def test_hold_hovers_where_it_is(world: World) -> None:
    go(world, drone("hold"))
    world.fleet.lose_link("d")
    world.run(13.0)
    here = world.fleet["d"].drone.position()
    world.run(60.0)
    assert world.fleet["d"].drone.position() == here
    assert here.up_m == 60.0
    world.fleet.mend_link("d")
    run(world, 3)
    assert world.statuses("d")[-1].control == "engine"


def test_land_lands_where_it_is(world: World) -> None:
    go(world, drone("land"))
    world.fleet.lose_link("d")
    world.run(60.0)
    here = world.fleet["d"].drone.position()
    assert (here.up_m, world.fleet["d"].drone.landed()) == (0.0, "grounded")
    assert here.east_m > 200.0


def test_return_first_climbs_to_its_return_height(world: World) -> None:
    go(world, drone(return_height_m=90.0))
    world.fleet.lose_link("d")
    heights = []
    for _ in range(120):
        world.run(1.0)
        heights.append(world.fleet["d"].drone.position().up_m)
    assert max(heights) == 90.0
    assert world.fleet["d"].drone.position() == Position(0.0, 0.0, 0.0)


def test_a_landing_near_the_ground_is_finished_where_it_is(world: World) -> None:
    spec = AgentSpec(id="d", type="hwd", at=Position(100.0, 0.0, 30.0), home=HOME)
    world.fleet.add(spec)
    world.hub.transport.send_goal(
        GoalRequest(
            goal_id="land", agent="d", action="LandIn", fields={"at": point(100, 0)}, link_silence_s=8.0, beat=1000
        )
    )
    world.fleet.lose_link("d", vanishes=False)
    world.run(0)
    assert world.fleet["d"].side is not None
    assert world.fleet["d"].side.state_of("land") == "unknown"  # it was lost on the way
    world.fleet.mend_link("d")
    world.hub.transport.send_goal(
        GoalRequest(
            goal_id="land", agent="d", action="LandIn", fields={"at": point(100, 0)}, link_silence_s=8.0, beat=1000
        )
    )
    world.run(0)
    world.fleet.lose_link("d")
    world.run(30.0)
    assert world.fleet["d"].drone.position() == Position(100.0, 0.0, 0.0)


def test_a_drone_on_the_ground_waits(world: World) -> None:
    world.fleet.add(AgentSpec(id="d", type="hwd", at=HOME, home=HOME))
    world.hub.transport.send_goal(
        GoalRequest(goal_id="up", agent="d", action="TakeOff", fields={"altitude": 3.0}, link_silence_s=10.0, beat=1000)
    )
    run(world, 2)
    world.hub.transport.send_goal(
        GoalRequest(goal_id="down", agent="d", action="LandIn", fields={"at": point(0, 0)}, beat=1000)
    )
    run(world, 3)
    world.fleet.lose_link("d")
    world.run(60.0)
    assert world.fleet["d"].side is not None
    assert world.fleet["d"].side.control == "engine"


def test_a_pilot_who_has_it_keeps_it(world: World) -> None:
    go(world, drone())
    world.fleet.take_over("d")
    world.fleet.lose_link("d")
    world.run(60.0)
    assert world.fleet["d"].drone.position().up_m == 60.0
    world.fleet.mend_link("d")
    run(world, 3)
    assert world.statuses("d")[-1].control == "pilot"


def test_a_frozen_process_does_not_take_its_own_deafness_for_silence(world: World) -> None:
    go(world, drone())
    world.fleet.freeze("d")
    run(world, 60)
    world.fleet.thaw("d")
    run(world, 2)
    assert world.end("leg")[1].state == "succeeded"
    assert world.statuses("d")[-1].control == "engine"


def test_one_whose_process_died_on_its_way_home_yields_once_the_engine_is_heard(world: World) -> None:
    go(world, drone())
    run(world, 5)
    world.fleet.lose_link("d")
    world.run(12.0)
    world.fleet.kill("d")
    world.run(1.0)
    world.fleet.restart("d")
    side = world.fleet["d"].side
    assert side is not None
    assert side.control == "failsafe"

    run(world, 5)

    assert side.control == "engine"
