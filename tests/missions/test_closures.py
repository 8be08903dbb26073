"""A region is closed while machines fly: the gate, ways under way, ways home, and a new start of the engine."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position, Region, is_within
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Abort, CloseRegion, OpenRegion, Operator
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, packaged_task, packaged_world
from tests.missions.test_faults import crossing, pool
from tests.reloading import reloaded

SITE, CATALOGUE = packaged_world()


def square(east: float, north: float, half: float) -> Region:
    return Region(tuple(Place(east + half * x, north + half * y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))))


def flying() -> tuple[Rehearsal, str, Position, Position]:
    """Return a drone that has just begun a long way, where it is, and where it goes."""
    rehearsal = fly_with({})
    task = crossing(rehearsal)
    drone = rehearsal.engine.state.agents["hwd_1"]
    leg = rehearsal.engine.state.goals[drone.goal].leg
    assert drone.position is not None
    assert leg is not None
    return rehearsal, task, drone.position, leg[1]


def fly_with(regions: dict[str, Region]) -> Rehearsal:
    site = replace(SITE, regions={**SITE.regions, **regions})
    tasks = [packaged_task("move_task"), packaged_task("pick_up")]
    rehearsal = Rehearsal(site, CATALOGUE, tasks, fleet_of(site, CATALOGUE))
    rehearsal.run_for(1)
    return rehearsal


def on_the_way(share: float, half: float = 15.0) -> tuple[Rehearsal, str, Region]:
    """Return a flight, and a region `meadow` at a share of the way that is left of its leg."""
    _, _, here, end = flying()
    spot = (here.east_m + share * (end.east_m - here.east_m), here.north_m + share * (end.north_m - here.north_m))
    region = square(*spot, half)
    rehearsal = fly_with({"meadow": region})
    return rehearsal, crossing(rehearsal), region


def test_a_way_under_way_into_a_closed_region_is_stopped_before_it() -> None:
    rehearsal, task, region = on_the_way(0.6)
    rehearsal.ask(CloseRegion("meadow", "sheep", "ann"))

    entered = False

    def over() -> bool:
        nonlocal entered
        entered = entered or is_within(rehearsal.sim["hwd_1"].body.position(), region)
        return rehearsal.task(task).section == "done"

    assert rehearsal.run_until(over, 900)
    assert rehearsal.task(task).outcome.code == "envelope.keep_out"
    assert "sheep" in rehearsal.task(task).outcome.reason
    assert not entered
    rehearsal.run_for(300)
    assert pool(rehearsal) == ("STANDBY", "grounded")


def test_who_is_in_it_goes_out_and_home() -> None:
    rehearsal, task, region = on_the_way(0.0)
    rehearsal.ask(CloseRegion("meadow", "sheep", "ann"))
    assert is_within(rehearsal.sim["hwd_1"].body.position(), region)

    assert rehearsal.run_until_ended(task, limit_s=900)
    assert rehearsal.task(task).outcome.code == "envelope.keep_out"
    rehearsal.run_for(300)
    assert pool(rehearsal)[1] == "grounded"
    assert not is_within(rehearsal.sim["hwd_1"].body.position(), region)


@pytest.mark.parametrize("given", [Abort("", "", "ann"), Operator("return", "hwd_1", "ann")])
def test_who_was_on_the_way_home_to_a_closed_port_lands_outside(given: Abort | Operator) -> None:
    home = SITE.ports[fly_with({}).engine.state.agents["hwd_1"].home].at
    region = square(home.east_m, home.north_m, 12.0)
    rehearsal = fly_with({"port": region})
    task = crossing(rehearsal)
    drone = rehearsal.sim["hwd_1"].body
    assert rehearsal.run_until(lambda: not is_within(drone.position(), region), 60)
    rehearsal.ask(replace(given, task=task) if isinstance(given, Abort) else given)
    rehearsal.run_for(4)
    leg = rehearsal.engine.state.goals[rehearsal.engine.state.agents["hwd_1"].goal].leg
    assert leg is not None
    assert is_within(leg[1], region)

    rehearsal.ask(CloseRegion("port", "people", "ann"))

    entered = []

    def down() -> bool:
        entered.append(is_within(drone.position(), region))
        return rehearsal.engine.state.agents["hwd_1"].landed == "grounded"

    assert rehearsal.run_until(down, 900)
    assert not any(entered)
    assert "envelope.keep_out" in alarms(rehearsal)


def test_what_was_closed_stays_closed_over_a_start_and_a_way_elsewhere_is_none_of_it() -> None:
    rehearsal = fly_with({"meadow": square(-400.0, -400.0, 10.0)})
    task = crossing(rehearsal)
    rehearsal.ask(CloseRegion("meadow", "sheep", "ann"))
    assert rehearsal.run_until_ended(task, limit_s=900)
    assert rehearsal.task(task).status == "SUCCEEDED"
    state = reloaded(rehearsal.engine.state)
    core = Core(rehearsal.engine.core.site, CATALOGUE, {}, state, lambda _: None)
    assert [zone.name for zone in core.airspace.zones[:1]] == ["meadow (closed: sheep)"]

    rehearsal.ask(OpenRegion("meadow", "ann"))
    assert rehearsal.engine.core.airspace.closed == ()
    with pytest.raises(TaskError) as raised:
        rehearsal.ask(OpenRegion("meadow", "ann"))
    assert raised.value.code == "not_closed"
    with pytest.raises(TaskError) as raised:
        rehearsal.ask(CloseRegion("medow", "sheep", "ann"))
    assert raised.value.code == "unknown_place"
    assert alarms(rehearsal) == []
