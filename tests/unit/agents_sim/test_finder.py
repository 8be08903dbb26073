"""The picker's tracker: out of range it names a place, each time a better one; near a flying drone it is in range."""

import pytest

from agents_sim.finder import Finder
from agents_sim.limits import PersonLimits
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position, horizontal_m
from tests.unit.agents_sim.conftest import World, point

LOST = AgentSpec(id="picker_1", type="picker", at=Place(200.0, 100.0))


def ask(world: World, task: str = "T-1") -> dict[str, object]:
    goal = world.order("picker_1", "MiniFinder", base=point(0, 0))
    world.run(2.0)
    _, event = world.end(goal)
    assert event.state == "succeeded"
    return event.result


def test_each_fix_of_a_search_is_half_as_far_off() -> None:
    finder = Finder("p", PersonLimits(fix_error_m=32.0))
    here = Place(10.0, 20.0)
    for error_m in (32.0, 16.0, 8.0, 4.0):
        fix = finder.answer(here, "T-1")["go_to"]
        assert horizontal_m(here, Place(fix["east_m"], fix["north_m"])) == pytest.approx(error_m, abs=0.002)
    again = finder.answer(here, "T-2")["go_to"]
    assert horizontal_m(here, Place(again["east_m"], again["north_m"])) == pytest.approx(32.0, abs=0.002)
    assert Finder("p", PersonLimits(fix_error_m=32.0)).answer(here, "T-1")["go_to"] == again


@pytest.mark.parametrize(
    ("drone", "in_range"),
    [(Position(180.0, 100.0, 60.0), True), (Position(179.9, 100.0, 60.0), False), (Position(200.0, 100.0, 0.0), False)],
    ids=["20 m away", "farther", "on the ground"],
)
def test_a_drone_that_flies_within_20_m_over_ground_is_in_range(world: World, drone: Position, in_range: bool) -> None:
    world.fleet.add(AgentSpec(id="d", type="lwd", at=drone))
    world.fleet.add(LOST)
    assert ask(world)["in_range"] is in_range


def test_a_watcher_has_no_tracker(world: World) -> None:
    world.fleet.add(AgentSpec(id="w", type="watcher"))
    assert world.end(world.order("w", "MiniFinder", base=point(0, 0)))[1].code == "unknown_action"


def test_a_lost_picker_walks_on_while_asked(world: World) -> None:
    world.fleet.add(
        AgentSpec(id="picker_1", type="picker", at=Place(0.0, 0.0), walk=(Place(14.0, 0.0), Place(14.0, 7.0)))
    )
    person = world.fleet["picker_1"].person
    world.run(5.0)
    assert person.position() == Position(7.0, 0.0, 0.0)
    world.run(7.0)
    assert person.position() == Position(14.0, 2.8, 0.0)
    world.run(60.0)
    assert person.position() == Position(14.0, 7.0, 0.0)
    assert world.statuses("picker_1")[-1].position == person.position()


def test_an_agent_that_knows_the_base_reports_degrees(world: World) -> None:
    world.fleet.add(AgentSpec(id="picker_1", type="picker", at=Place(0.0, 0.0), base=(66.5, 25.7)))
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Place(0.0, 100.0), base=(66.5, 25.7)))
    world.run(0.0)
    status = world.statuses("picker_1")[-1]
    assert (status.lat, status.lng) == pytest.approx((66.5, 25.7))
    status = world.statuses("d")[-1]
    assert (status.lat, status.lng) == pytest.approx((66.5009, 25.7), abs=1e-5)
