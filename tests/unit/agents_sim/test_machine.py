"""A machine that drives, by what its catalogue says: ways, charge, silence, outcomes; and the referee on the ground."""

from typing import Any

import pytest

from agents_sim.kinds import Kind, Outcome, SimAction, lasts_us
from agents_sim.machine import Machine
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place
from formiga_bt.transport.messages import GoalRequest
from tests.unit.agents_sim.conftest import World
from tests.unit.agents_sim.test_link_loss import run

ROVER = Kind(
    mobility="ground",
    actions={
        "Drive": SimAction(moves_to="to"),
        "Look": SimAction(typical_us=10_000_000, result={"seen": 0, "word": "none"}),
    },
    limits={"speed_m_s": 2.0, "drive_drain_pct_s": 0.5, "charge_pct_s": 1.0, "max_speed_m_s": 3.0},
)
FAR = {"east_m": 40.0, "north_m": 0.0}


def add(world: World, agent: str = "r", **fields: Any) -> Machine:
    body = world.fleet.add(AgentSpec(**{"id": agent, "type": "rover", "does": ROVER, **fields})).body
    assert isinstance(body, Machine)
    return body


def test_it_drives_at_its_speed_or_at_the_one_that_is_asked_for(world: World) -> None:
    add(world)
    first = world.order("r", "Drive", to=FAR)
    world.run(21.0)
    second = world.order("r", "Drive", to={"east_m": 0.0, "north_m": 0.0}, speed=1.0)
    world.run(50.0)

    assert world.end(first)[0] == pytest.approx(20.0)
    assert world.end(second)[0] == pytest.approx(61.0)
    assert world.end(second)[1].state == "succeeded"


def test_it_drains_on_the_way_and_charges_where_a_charger_is(world: World) -> None:
    body = add(world, chargers=(Place(40.0, 1.0),))
    world.order("r", "Drive", to=FAR)
    world.run(20.0)
    assert body.battery() == pytest.approx(90.0)
    world.run(5.0)
    assert body.battery() == pytest.approx(95.0)
    world.run(10.0)
    assert body.battery() == 100.0


def test_at_the_end_of_its_charge_it_stands_and_drives_no_more(world: World) -> None:
    body = add(world, battery=10.0)
    goal = world.order("r", "Drive", to=FAR)
    world.run(15.0)

    assert (body.position().east_m, body.battery()) == (20.0, 5.0)
    assert world.end(goal)[1].state == "taken_over"
    body.hand_back()
    assert world.end(world.order("r", "Drive", to=FAR))[1].code == "battery_low"


@pytest.mark.parametrize("fields", [{}, {"to": "pit"}, {"to": FAR, "speed": 0}, {"to": {"east_m": float("inf")}}])
def test_fields_that_it_cannot_use_are_refused(world: World, fields: dict[str, Any]) -> None:
    body = add(world)

    assert world.end(world.order("r", "Drive", **fields))[1].code == "bad_field"
    assert body.position().east_m == 0.0


def test_it_stands_still_without_its_engine_and_yields_when_it_hears_it(world: World) -> None:
    body = add(world)
    fields = {"to": {"east_m": 400.0, "north_m": 0.0}}
    request = GoalRequest(goal_id="g", agent="r", action="Drive", fields=fields, link_silence_s=10.0, beat=1000)
    world.hub.transport.send_goal(request)
    world.run(0)
    run(world, 2)
    world.fleet.lose_link("r")
    world.run(30.0)
    stood = body.position()
    assert body.is_alone
    assert 20.0 < stood.east_m < 30.0
    world.run(10.0)
    assert body.position() == stood
    world.fleet.mend_link("r")
    run(world, 5)
    assert not body.is_alone


def test_an_outcome_changes_the_result_the_end_or_the_begin(world: World) -> None:
    outcomes = (
        Outcome(action="Look", nth=2, give={"seen": 3}),
        Outcome(action="Look", nth=3, fail="dark"),
        Outcome(action="Look", nth=4, delay_s=100.0),
    )
    add(world, outcomes=outcomes)
    ends, begun, now = [], [], 0.0
    for _ in range(4):
        begun.append(now)
        goal = world.order("r", "Look")
        world.run(120.0)
        ends.append(world.end(goal))
        now += 120.0

    assert [end.result for _, end in ends[:2]] == [{"seen": 0, "word": "none"}, {"seen": 3, "word": "none"}]
    assert (ends[2][1].state, ends[2][1].code) == ("failed", "dark")
    assert all(9.0 <= at - since <= 11.0 for (at, _), since in zip(ends[:3], begun[:3], strict=True))
    assert 109.0 <= ends[3][0] - begun[3] <= 111.0


def test_how_long_an_action_lasts_follows_from_the_seed_and_the_goal() -> None:
    action = ROVER.actions["Look"]
    times = {(seed, goal): lasts_us(action, seed, goal) for seed in range(20) for goal in ("a", "b")}

    assert times == {one: lasts_us(action, *one) for one in times}
    assert len(set(times.values())) > 30
    assert all(9_000_000 <= one <= 11_000_000 for one in times.values())


@pytest.mark.parametrize(("apart_m", "crashes"), [(0.4, 1), (0.8, 0)])
def test_machines_on_the_ground_crash_when_they_touch(world: World, apart_m: float, crashes: int) -> None:
    add(world, "a")
    add(world, "b", at=Place(20.0, apart_m))
    world.order("a", "Drive", to=FAR)
    world.run(30.0)

    assert len(world.referee.verdict(world.clock.now()).crashes) == crashes


def test_what_has_no_place_says_none_and_nothing_can_run_into_it(world: World) -> None:
    kind = Kind(mobility="none", actions={"Look": SimAction(typical_us=1)})
    add(world, "service", does=kind)
    add(world, "a", at=Place(-5.0, 0.0))
    world.order("a", "Drive", to=FAR)
    world.run(30.0)

    assert world.fleet["service"].side is not None
    assert world.fleet["service"].side.status.position is None
    assert world.referee.verdict(world.clock.now()).is_clean


def test_it_turns_to_another_target_on_its_way(world: World) -> None:
    body = add(world)
    goal = world.order("r", "Drive", to=FAR)
    world.run(10.0)
    assert body.update(goal, {"to": {"east_m": 20.0, "north_m": 30.0}}) == ""
    world.run(16.0)
    assert world.end(goal)[0] == pytest.approx(25.0)
    assert (body.position().east_m, body.position().north_m) == (20.0, 30.0)


@pytest.mark.parametrize(
    ("action", "fields", "code"),
    [
        ("Drive", {"to": "pit"}, "bad_field"),
        ("Drive", {"speed": 1.0}, "no_update"),
        ("Look", {"to": FAR}, "no_update"),
    ],
)
def test_what_it_cannot_follow_is_refused_and_it_goes_on(
    world: World, action: str, fields: dict[str, Any], code: str
) -> None:
    body = add(world)
    goal = world.order("r", action, to=FAR)
    world.run(1.0)
    assert body.update(goal, fields) == code
    assert body.update("other", {"to": FAR}) == "goal_ended"
    world.run(30.0)
    assert world.end(goal)[1].state == "succeeded"
