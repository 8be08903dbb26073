"""The picker's tracker names the next point of the way to the base, and says when its person is near it."""

import pytest

from agents_sim.finder import Finder
from agents_sim.limits import PersonLimits
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position, horizontal_m
from tests.unit.agents_sim.conftest import World, point

BASE = Place(0.0, 0.0)
LOST = AgentSpec(id="picker_1", type="picker", at=Place(200.0, 100.0))
EXACT = PersonLimits(fix_error_m=0.0, fix_floor_m=0.0)


def ask(world: World, task: str = "T-1") -> dict[str, object]:
    goal = world.order("picker_1", "MiniFinder", base=point(0, 0))
    world.run(2.0)
    _, event = world.end(goal)
    assert event.state == "succeeded"
    return event.result


def ahead_m(finder: Finder, here: Place, search: str = "T-1") -> float:
    to = finder.answer(here, BASE, search)["go_to"]
    return horizontal_m(here, Place(to["east_m"], to["north_m"]))


def test_each_fix_of_a_search_is_half_as_far_off_down_to_the_best() -> None:
    finder = Finder("p", PersonLimits(fix_error_m=32.0))
    here = Place(10.0, 20.0)
    for number, error_m in enumerate((32.0, 16.0, 8.0, 4.0, 3.0, 3.0)):
        assert horizontal_m(here, finder.fix(here, number)) == pytest.approx(error_m, abs=0.002)
        assert finder.error_m(number) == error_m
    assert Finder("p", PersonLimits(fix_error_m=32.0)).fix(here, 0) == finder.fix(here, 0)


def test_another_search_begins_with_the_first_fix() -> None:
    finder = Finder("p", PersonLimits())
    here = Place(300.0, 0.0)
    once = finder.answer(here, BASE, "T-1")
    assert finder.answer(here, BASE, "T-1") != once
    assert finder.answer(here, BASE, "T-2") == once


def test_the_next_point_lies_on_the_way_and_at_most_40_m_ahead() -> None:
    finder = Finder("p", EXACT)
    assert finder.answer(Place(300.0, 400.0), BASE, "T-1")["go_to"] == {"east_m": 276.0, "north_m": 368.0}
    assert finder.answer(Place(0.0, 30.0), BASE, "T-1")["go_to"] == {"east_m": 0.0, "north_m": 0.0}


def test_who_does_not_come_on_gets_nearer_points_until_they_do() -> None:
    finder = Finder("p", EXACT)
    far = Place(200.0, 0.0)
    assert [ahead_m(finder, far) for _ in range(4)] == [40.0, 20.0, 10.0, 10.0]
    assert ahead_m(finder, Place(194.0, 0.0)) == 40.0
    assert ahead_m(finder, Place(230.0, 0.0)) == 20.0


@pytest.mark.parametrize(("away_m", "in_range"), [(17.0, True), (17.1, False), (50.0, False)])
def test_in_range_is_who_is_near_the_base_whatever_the_error(away_m: float, in_range: bool) -> None:
    finder = Finder("p", PersonLimits(fix_error_m=3.0))
    for angle in range(8):  # wherever the errors point to
        here = finder.fix(Place(0.0, 0.0), angle)
        off = horizontal_m(here, BASE)
        spot = Place(-here.east_m / off * (away_m - off), -here.north_m / off * (away_m - off))
        said = Finder("p", PersonLimits(fix_error_m=3.0)).answer(spot, BASE, "T-1")["in_range"]
        assert said is False or horizontal_m(spot, BASE) <= 20.0
    exact = Finder("p", PersonLimits(fix_error_m=3.0))
    shift = exact.fix(Place(0.0, 0.0), 0)
    assert exact.answer(Place(away_m - shift.east_m, -shift.north_m), BASE, "T-1")["in_range"] is in_range


def test_a_drone_over_a_picker_far_from_the_base_is_not_what_is_asked(world: World) -> None:
    world.fleet.add(AgentSpec(id="d", type="lwd", at=Position(200.0, 100.0, 60.0)))
    world.fleet.add(LOST)
    assert ask(world)["in_range"] is False


def test_a_base_that_is_no_place_is_refused(world: World) -> None:
    world.fleet.add(LOST)
    assert world.end(world.order("picker_1", "MiniFinder", base="home"))[1].code == "bad_field"


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
