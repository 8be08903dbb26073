"""A drone's body on a virtual clock: exact times, exact charge, its refusals and its own mind."""

import pytest

from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from tests.unit.agents_sim.conftest import World, point

HWD = AgentSpec(id="hwd_1", type="hwd", at=Place(0.0, 20.0), battery=90.0, home=Place(0.0, 20.0))


def fly_up(world: World, up_m: float = 60.0) -> None:
    world.fleet.add(HWD)
    world.order("hwd_1", "TakeOff", altitude=up_m)
    world.run(up_m / 3.0)


def test_take_off_and_leg_arrive_at_the_exact_instant(world: World) -> None:
    world.fleet.add(HWD)
    up = world.order("hwd_1", "TakeOff", altitude=60.0)
    world.run(20.0)
    at, event = world.end(up)
    assert (at, event.state) == (20.0, "succeeded")
    assert event.status is not None
    assert event.status.position == Position(0.0, 20.0, 60.0)
    assert event.status.landed == "airborne"
    assert event.status.last_goal == up

    leg = world.order("hwd_1", "GoTo", to=point(300, 420, 60))  # 500 m at 10 m/s
    world.run(100.0)
    assert world.end(leg)[0] == pytest.approx(70.0)
    assert world.fleet["hwd_1"].drone.position() == Position(300.0, 420.0, 60.0)


@pytest.mark.parametrize(
    ("to", "fields", "seconds"),
    [
        ((100, 20, 60), {}, 10.0),
        ((0, 20, 90), {}, 10.0),  # up only: the climb counts
        ((100, 20, 120), {}, 20.0),  # the climb takes longer than the way
        ((100, 20, 60), {"speed": 5.0}, 20.0),
        ((100, 20, 60), {"speed": 50.0}, 10.0),  # never above its limit
    ],
)
def test_a_leg_takes_as_long_as_its_slower_part(
    world: World, to: tuple[int, int, int], fields: dict[str, float], seconds: float
) -> None:
    fly_up(world)
    leg = world.order("hwd_1", "GoTo", to=point(*to), **fields)
    world.run(60.0)
    assert world.end(leg)[0] == 20.0 + seconds


def test_charge_drains_by_what_it_does(world: World) -> None:
    drone = world.fleet.add(HWD).drone
    world.run(600.0)
    assert drone.battery() == 90.0  # at rest

    world.order("hwd_1", "TakeOff", altitude=60.0)
    world.run(20.0)
    assert drone.battery() == round(90.0 - 20 * 0.065, 3)

    world.run(100.0)
    assert drone.battery() == round(90.0 - 20 * 0.065 - 100 * 0.058, 3)


def test_cancel_stops_where_it_is_and_hovers(world: World) -> None:
    fly_up(world)
    leg = world.order("hwd_1", "GoTo", to=point(100, 20, 60))
    world.run(4.0)
    world.hub.transport.cancel_goal("hwd_1", leg)
    world.run(30.0)
    at, event = world.end(leg)
    assert (at, event.state) == (24.0, "canceled")
    assert event.status is not None
    assert event.status.position == Position(40.0, 20.0, 60.0)
    assert world.fleet["hwd_1"].drone.position() == Position(40.0, 20.0, 60.0)


def test_a_take_off_canceled_near_the_ground_first_gets_clear_of_it(world: World) -> None:
    world.fleet.add(HWD)
    up = world.order("hwd_1", "TakeOff", altitude=60.0)
    world.run(0.1)
    world.hub.transport.cancel_goal("hwd_1", up)
    world.run(5.0)
    assert [event.state for event in world.events(up)][-2:] == ["canceling", "canceled"]
    assert world.fleet["hwd_1"].drone.position().up_m == 2.0


def test_landed_is_unknown_just_above_the_ground(world: World) -> None:
    drone = world.fleet.add(HWD).drone
    assert drone.landed() == "grounded"
    world.order("hwd_1", "TakeOff", altitude=30.0)
    world.run(0.1)
    assert drone.landed() == "unknown"
    world.run(0.1)
    assert drone.landed() == "airborne"
    assert [s.landed for s in world.statuses("hwd_1")][-2:] == ["unknown", "airborne"]


def test_landing_goes_over_the_place_then_down(world: World) -> None:
    fly_up(world, 30.0)
    down = world.order("hwd_1", "LandIn", at=point(6, 28))  # 10 m away: just near enough
    world.run(30.0)
    at, event = world.end(down)
    assert (at, event.state) == (10.0 + 1.0 + 10.0, "succeeded")
    assert event.status is not None
    assert event.status.landed == "grounded"
    assert event.status.position == Position(6.0, 28.0, 0.0)
    assert "descending" in [event.phase for event in world.events(down)]


def test_landing_too_far_away_is_refused(world: World) -> None:
    fly_up(world)
    down = world.order("hwd_1", "LandIn", at=point(0, 31))
    assert (world.end(down)[1].state, world.end(down)[1].code) == ("rejected", "too_far")


@pytest.mark.parametrize(("after_s", "refused"), [(5.0, False), (9.0, True)])
def test_a_landing_is_not_broken_off_near_the_ground(world: World, after_s: float, refused: bool) -> None:
    fly_up(world, 30.0)
    down = world.order("hwd_1", "LandIn", at=point(0, 20))
    world.run(after_s)
    world.hub.transport.cancel_goal("hwd_1", down)
    world.run(10.0)
    assert any(event.cancel_refused for event in world.events(down)) is refused
    assert world.end(down)[1].state == ("succeeded" if refused else "canceled")


@pytest.mark.parametrize(
    ("airborne", "battery", "action", "fields", "code"),
    [
        (True, 90, "TakeOff", {"altitude": 60.0}, "already_airborne"),
        (False, 90, "GoTo", {"to": point(0, 0, 60)}, "not_airborne"),
        (False, 90, "LandIn", {"at": point(0, 0)}, "not_airborne"),
        (False, 4, "TakeOff", {"altitude": 60.0}, "battery_low"),
        (False, 90, "TakeOff", {"altitude": "high"}, "bad_field"),
        (False, 90, "TakeOff", {"altitude": 1.0}, "too_low"),
        (True, 90, "GoTo", {"to": point(0, 0)}, "bad_field"),
        (True, 90, "GoTo", {"to": point(0, 0, 0)}, "too_low"),
        (True, 90, "GoTo", {"to": point(0, 0, 60), "speed": 0.0}, "bad_field"),
        (True, 90, "GoTo", {}, "bad_field"),
        (True, 90, "Explore", {"region": [point(0, 0)], "altitude": 60.0}, "bad_field"),
    ],
)
def test_what_a_drone_refuses(
    world: World, airborne: bool, battery: float, action: str, fields: dict[str, object], code: str
) -> None:
    at = Position(0.0, 20.0, 60.0 if airborne else 0.0)
    world.fleet.add(AgentSpec(id="hwd_1", type="hwd", at=at, battery=battery))
    goal = world.order("hwd_1", action, **fields)
    assert (world.end(goal)[1].state, world.end(goal)[1].code) == ("rejected", code)


def test_a_sweep_covers_the_region_and_reports_progress(world: World) -> None:
    fly_up(world)
    region = [point(0, 0), point(100, 0), point(100, 60), point(0, 60)]
    goal = world.order("hwd_1", "Explore", region=region, altitude=60.0)
    world.run(120.0)
    assert world.end(goal)[1].state == "succeeded"
    progress = [event.progress for event in world.events(goal) if event.progress is not None]
    assert progress == sorted(progress)
    assert len(progress) > 3
    assert world.fleet["hwd_1"].drone.position() == Position(100.0, 50.0, 60.0)  # three tracks, 20 m apart


def test_a_drone_without_charge_lands_by_itself_and_says_who_commands(world: World) -> None:
    world.fleet.add(AgentSpec(id="hwd_1", type="hwd", at=Position(0.0, 0.0, 30.0), battery=5.65))
    leg = world.order("hwd_1", "GoTo", to=point(500, 0, 30))  # 50 s, charge for 10 s
    world.run(30.0)
    at, event = world.end(leg)
    assert (at, event.state) == (10.0, "taken_over")
    status = world.statuses("hwd_1")[-1]
    assert (status.control, status.landed, status.position) == ("failsafe", "grounded", Position(100.0, 0.0, 0.0))


def test_a_safety_goal_replaces_the_leg_from_where_the_drone_is(world: World) -> None:
    fly_up(world)
    leg = world.order("hwd_1", "GoTo", goal_id="leg", to=point(100, 20, 60))
    world.run(5.0)
    from formiga_bt.transport.messages import GoalRequest

    safe = GoalRequest(goal_id="s", agent="hwd_1", action="GoTo", fields={"to": point(50, 20, 90)}, safety=True)
    world.hub.transport.send_goal(safe)
    world.run(10.0)
    assert world.end(leg)[1].state == "superseded"
    assert world.end("s")[0] == 35.0
    assert world.fleet["hwd_1"].drone.position() == Position(50.0, 20.0, 90.0)


def test_status_comes_every_five_seconds_and_at_changes(world: World) -> None:
    world.fleet.add(HWD)
    world.run(20.0)
    stamps = [status.stamp // SECOND - 1000 for status in world.statuses("hwd_1")]
    assert stamps == [0, 5, 10, 15, 20]
