"""A take-off that is broken off on its way up, by a person, a pilot or a lockdown, and what `continue` makes of it."""

from collections.abc import Callable, Iterator

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import LockdownOrder, Operator, SendGoal
from formiga_bt.engine.kernel.records import GoalRecord, family
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, check_rehearsal, effects, packaged_task, packaged_world, task_of
from formiga_bt.show.history.notes import goal_words
from formiga_bt.show.history.records import goal_fact
from formiga_bt.show.history.rows import row_of
from formiga_bt.show.why.front import explain
from tests.golden import Wording
from tests.missions.conftest import Fly
from tests.missions.test_shipped import pick_up
from tests.safety.monitor import Monitor

TAKE_OFF = "steps/steps[0].call.steps[0]"
NEXT = "steps/steps[0].call.steps[1]"


@pytest.fixture
def watched() -> Iterator[Callable[[], Rehearsal]]:
    """Start rehearsals under the safety monitor; it must have seen nothing wrong."""
    flown: list[tuple[Rehearsal, Monitor]] = []

    def start() -> Rehearsal:
        site, catalogue = packaged_world()
        world = Rehearsal(site, catalogue, [packaged_task("move_task"), packaged_task("pick_up")], ())
        monitor = Monitor(world)
        for spec in fleet_of(site, catalogue):
            monitor.add(spec)
        world.run_for(1)
        flown.append((world, monitor))
        return world

    yield start
    for world, monitor in flown:
        monitor.finish()
        assert [str(one) for one in monitor.violations] == []
        check_rehearsal(world)
        world.close()


def order(rehearsal: Rehearsal, word: str, target: str = "hwd_1") -> str:
    return rehearsal.ask(Operator(word, target, "ann"))  # type: ignore[arg-type]


def height(rehearsal: Rehearsal) -> float:
    return rehearsal.sim["hwd_1"].body.position().up_m


def climbing(rehearsal: Rehearsal, metres: float) -> str:
    """Start PickUp and stop the clock when its machine is so high in its take-off."""
    task = pick_up(rehearsal)
    while height(rehearsal) < metres:
        rehearsal.run_for(0.05)
    assert rehearsal.engine.state.agents["hwd_1"].action == "TakeOff"
    return task


def flown(rehearsal: Rehearsal) -> list[tuple[str, str, float | None]]:
    """Return action, path and target height of what hwd_1 got for the steps of its task."""
    goals = [g for g in effects(rehearsal, SendGoal) if g.agent == "hwd_1" and "/steps/" in g.goal_id]
    return [(g.action, g.goal_id.split("/", 2)[2], g.fields["to"]["up_m"] if "to" in g.fields else None) for g in goals]


def goal_of(rehearsal: Rehearsal) -> GoalRecord:
    return rehearsal.engine.state.goals[rehearsal.engine.state.agents["hwd_1"].goal]


def why(rehearsal: Rehearsal, task: str, code: str) -> str:
    catalogue = rehearsal.engine.core.catalogue
    found = explain(rehearsal.engine.state, {}, task, rehearsal.now, catalogue=catalogue)[1]
    return next(line.text for line in found if line.code == code)


@pytest.mark.parametrize("minutes", [0.1, 3])
@pytest.mark.parametrize("up", [1.0, 3.0, 30.0])
def test_what_was_held_on_its_way_up_climbs_the_rest(
    up: float, minutes: float, watched: Callable[[], Rehearsal]
) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, up)
    order(rehearsal, "hold")
    rehearsal.run_for(60 * minutes)
    low = height(rehearsal)
    assert up <= low < up + 2.0

    order(rehearsal, "continue")
    assert rehearsal.run_until(lambda: len(flown(rehearsal)) > 1, 5)
    goal = goal_of(rehearsal)

    assert flown(rehearsal) == [("TakeOff", TAKE_OFF, None), ("GoTo", f"{TAKE_OFF}+2", 60.0)]
    assert (goal.action, goal.rest_of, goal.section) == ("GoTo", "TakeOff", "steps")
    assert goal.leg is not None
    assert goal.leg[0].ground == goal.leg[1].ground
    assert rehearsal.run_until(lambda: flown(rehearsal)[-1][1] == NEXT, 60)
    assert height(rehearsal) == pytest.approx(60.0)
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert alarms(rehearsal) == []


def test_what_was_held_at_its_altitude_has_taken_off(watched: Callable[[], Rehearsal], wording: Wording) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, 59.3)
    order(rehearsal, "hold")
    rehearsal.run_for(5)
    assert 59.0 < height(rehearsal) < 60.0
    wording(why(rehearsal, task, "interrupted"))

    order(rehearsal, "continue")
    assert rehearsal.run_until(lambda: len(flown(rehearsal)) > 1, 5)

    assert [path for _, path, _ in flown(rehearsal)][:2] == [TAKE_OFF, NEXT]
    assert rehearsal.run_until_ended(task)


@pytest.mark.parametrize("up", [1.0, 30.0])
def test_continue_before_the_machine_has_stopped_goes_on_as_soon_as_it_has(
    up: float, watched: Callable[[], Rehearsal]
) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, up)
    order(rehearsal, "hold")
    assert goal_of(rehearsal).state == "canceling"
    assert order(rehearsal, "continue") == Done()
    rehearsal.run_for(3)

    assert flown(rehearsal)[1:] == [("GoTo", f"{TAKE_OFF}+2", 60.0)]
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_a_second_hold_before_it_has_stopped_takes_the_continue_back(watched: Callable[[], Rehearsal]) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, 30.0)
    for word in ("hold", "continue", "hold"):
        order(rehearsal, word)
    rehearsal.run_for(30)

    assert len(flown(rehearsal)) == 1
    assert rehearsal.task(task).hold.words == ("operator:hwd_1",)
    order(rehearsal, "continue")
    assert rehearsal.run_until_ended(task)


def test_a_climb_that_is_held_too_climbs_the_rest_and_after_a_landing_it_takes_off_anew(
    watched: Callable[[], Rehearsal], wording: Wording
) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, 3.0)
    order(rehearsal, "hold")
    rehearsal.run_for(5)
    order(rehearsal, "continue")
    rehearsal.run_for(5)
    order(rehearsal, "hold")
    rehearsal.run_for(5)
    assert 10 < height(rehearsal) < 40
    text = why(rehearsal, task, "interrupted")
    wording(text)

    order(rehearsal, "continue")
    rehearsal.run_for(2)
    assert flown(rehearsal)[-1] == ("GoTo", f"{TAKE_OFF}+3", 60.0)

    order(rehearsal, "return")
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].landed == "grounded", 300)
    rehearsal.run_for(5)
    order(rehearsal, "continue")
    rehearsal.run_for(2)
    assert flown(rehearsal)[-1] == ("TakeOff", f"{TAKE_OFF}+4", None)
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


@pytest.mark.parametrize("up", [3.0, 30.0])
def test_what_a_pilot_took_over_on_its_way_up_climbs_the_rest(up: float, watched: Callable[[], Rehearsal]) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, up)
    rehearsal.sim["hwd_1"].body.take_over()
    rehearsal.run_for(60)
    rehearsal.sim["hwd_1"].body.hand_back()
    rehearsal.run_for(2)

    order(rehearsal, "handback_continue")
    assert rehearsal.run_until(lambda: len(flown(rehearsal)) > 1, 5)

    assert flown(rehearsal)[1:] == [("GoTo", f"{TAKE_OFF}+2", 60.0)]
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


@pytest.mark.parametrize("up", [1.0, 30.0])
def test_what_lockdown_held_on_its_way_up_climbs_the_rest(up: float, watched: Callable[[], Rehearsal]) -> None:
    rehearsal = watched()
    task = climbing(rehearsal, up)
    rehearsal.ask(LockdownOrder("hold", "ann"))
    rehearsal.run_for(60)
    rehearsal.ask(LockdownOrder("release", "ann"))
    rehearsal.run_for(5)
    assert len(flown(rehearsal)) == 1

    order(rehearsal, "continue", task)
    assert rehearsal.run_until(lambda: len(flown(rehearsal)) > 1, 5)

    assert flown(rehearsal)[1:] == [("GoTo", f"{TAKE_OFF}+2", 60.0)]
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"


def test_people_are_told_that_it_climbs(fly: Fly, wording: Wording) -> None:
    rehearsal = fly()
    task = climbing(rehearsal, 30.0)
    order(rehearsal, "hold")
    rehearsal.run_for(5)
    order(rehearsal, "continue")
    rehearsal.run_for(2)
    goal = goal_of(rehearsal)

    wording(goal_words(goal), row_of(goal, rehearsal.now).detail, goal_fact(goal).target)
    assert goal.rest_of == "TakeOff"
    assert rehearsal.run_until_ended(task)


def test_a_landing_that_is_held_low_over_the_field_breaks_no_limit_and_goes_on(
    watched: Callable[[], Rehearsal],
) -> None:
    rehearsal = watched()
    task = pick_up(rehearsal)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].action == "LandIn", 600)
    landing = rehearsal.engine.state.agents["hwd_1"].goal
    while height(rehearsal) > 6:
        rehearsal.run_for(0.05)
    order(rehearsal, "hold")
    rehearsal.run_for(90)
    assert 5 < height(rehearsal) < 6
    assert rehearsal.engine.state.agents["hwd_1"].breach == ""

    order(rehearsal, "continue")
    assert rehearsal.run_until(lambda: height(rehearsal) == 0.0, 300)

    assert flown(rehearsal)[-1][:2] == ("LandIn", f"{landing.split('/', 2)[2]}+2")
    assert rehearsal.run_until_ended(task)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert alarms(rehearsal) == []


def test_low_elsewhere_than_where_it_was_to_land_still_breaks_the_limit() -> None:
    site, catalogue = packaged_world()
    rehearsal = Rehearsal(site, catalogue, [packaged_task("pick_up")], fleet_of(site, catalogue))
    rehearsal.run_for(1)
    pick_up(rehearsal)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].action == "LandIn", 600)
    while height(rehearsal) > 6:
        rehearsal.run_for(0.05)
    order(rehearsal, "hold")
    rehearsal.run_for(5)
    body = rehearsal.sim["hwd_1"].body
    here = body.position()
    record = rehearsal.engine.core.put_agent("hwd_1", position=type(here)(here.east_m + 20.0, here.north_m, here.up_m))
    rehearsal.engine.breaches.look(record.id, "")

    assert rehearsal.engine.state.agents["hwd_1"].breach == "terrain_clearance"
    rehearsal.close()


def test_an_explorer_that_has_not_stopped_yet_cannot_be_continued(fly: Fly, wording: Wording) -> None:
    survey = """imports: [lib/flying.yaml]
agents: {drone: {type: lwd}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${site.places.lake_shore}", height: 60 m}
  - do: drone.Explore
    with: {region: "${site.regions.lake}"}
    timeout: 30 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
    rehearsal = fly(task_of(survey, *packaged_world(), "Survey"))
    task = rehearsal.submit("Survey")
    assert rehearsal.run_until(lambda: any(a.action == "Explore" for a in rehearsal.engine.state.agents.values()), 600)
    rehearsal.run_for(5)
    drone = rehearsal.task(task).agents.granted[0]
    order(rehearsal, "hold", drone)
    with pytest.raises(TaskError) as refused:
        order(rehearsal, "continue", drone)
    wording(refused.value)
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)


def test_a_landing_away_from_where_it_was_broken_off_cannot_be_continued(
    watched: Callable[[], Rehearsal], wording: Wording
) -> None:
    rehearsal = watched()
    task = pick_up(rehearsal)
    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].action == "LandIn", 600)
    order(rehearsal, "return")
    rehearsal.run_for(15)
    order(rehearsal, "hold")
    rehearsal.run_for(15)

    with pytest.raises(TaskError) as caught:
        order(rehearsal, "continue")
    wording(caught.value)

    assert caught.value.code == "cannot_continue"
    rehearsal.abort(task)
    assert rehearsal.run_until_ended(task)


def test_a_copy_of_the_state_may_have_forgotten_requested_tasks(fly: Fly) -> None:
    rehearsal = fly()
    task = pick_up(rehearsal)
    record = rehearsal.engine.state.tasks[task]
    parent = replace(record, id="A-1", family=replace(record.family, children=("Gone-2", task)))
    assert family({"A-1": parent, task: record}, "A-1") == ("A-1",)
