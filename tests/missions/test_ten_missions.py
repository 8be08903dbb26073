"""The five further missions fly the figures that are meant, in virtual time, and never near one another."""

import math
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import GoalEventInput, SendGoal
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.lang.request.profiles import load_profile, profile_file
from formiga_bt.lang.scenario import load_scenario
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.rehearsal.testing import check_rehearsal, effects, packaged_task, packaged_world
from tests.missions.conftest import Fly

SITE, CATALOGUE = packaged_world()
FIELD, EAST = SITE.places["north_field"], SITE.places["east_field"]
NAMES = ("circle", "triangle", "zig_zag", "patrol_and_escort", "delivery")


def flown(fly: Fly, file: str, params: dict[str, Any], limit_s: float = 1800) -> tuple[Rehearsal, str]:
    task = packaged_task(file)
    rehearsal = fly(task)
    id_ = rehearsal.submit(task.name, params)
    assert rehearsal.run_until_ended(id_, limit_s=limit_s)
    assert rehearsal.task(id_).status == "SUCCEEDED"
    return rehearsal, id_


def sent(rehearsal: Rehearsal, agent: str, *actions: str) -> list[SendGoal]:
    return [g for g in effects(rehearsal, SendGoal) if g.agent == agent and (not actions or g.action in actions)]


def points(goals: list[SendGoal]) -> list[Position]:
    return [Position(**g.fields["to"]) for g in goals]


def times(rehearsal: Rehearsal, action: str) -> tuple[list[int], list[int]]:
    """Return when goals of an action were sent, and when they ended."""
    ids = {g.goal_id for g in effects(rehearsal, SendGoal) if g.action == action}
    out = [step.at for step in rehearsal.steps for e in step.effects if isinstance(e, SendGoal) and e.goal_id in ids]
    ends = [
        step.at
        for step in rehearsal.steps
        if isinstance(step.input, GoalEventInput)
        and step.input.event.goal_id in ids
        and step.input.event.state == "succeeded"
    ]
    return out, ends


def role(rehearsal: Rehearsal, task: str, name: str) -> str:
    """Return who has a role that is for one agent."""
    found = [c.roles for s in rehearsal.steps for c in s.changes if type(c).__name__ == "Granted" and c.task == task]
    return found[-1][name][0]


def stands(rehearsal: Rehearsal, agent: str) -> Position:
    at = rehearsal.engine.state.agents[agent].position
    assert at is not None
    return at


class TestCircle:
    def test_it_is_closed_and_level_with_the_radius_of_the_text(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "circle", {})
        drone = rehearsal.task(task).agents.granted[0]
        ring = points(sent(rehearsal, drone, "GoTo"))[3:-3]

        assert len(ring) == 37
        assert all(abs(math.hypot(p.east_m, p.north_m) - 3.0) < 0.01 for p in ring)
        assert {p.up_m for p in ring} == {20.0}
        assert ring[0] == ring[-1]
        turns = [math.degrees(math.atan2(p.east_m, p.north_m)) % 360 for p in ring[:-1]]
        assert [round(turn) % 360 for turn in turns] == [10 * i for i in range(36)]

    def test_it_goes_back_to_the_centre_then_home(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "circle", {"center": FIELD, "radius": 8.0, "altitude": 30.0})
        drone = rehearsal.task(task).agents.granted[0]
        home = SITE.ports[SITE.agents[drone].home].at

        back = points(sent(rehearsal, drone, "GoTo"))[-3]
        assert (back.east_m, back.north_m, back.up_m) == (FIELD.east_m, FIELD.north_m, 30.0)
        assert horizontal_m(stands(rehearsal, drone), home) < 0.1


class TestTriangle:
    def test_the_right_angle_stands_over_the_place_and_both_legs_are_10_m(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "triangle", {"corner": FIELD})
        corner, north, east = (stands(rehearsal, drone) for drone in sorted_by_corner(rehearsal, task))

        assert horizontal_m(corner, FIELD) < 0.1
        assert abs(horizontal_m(corner, north) - 10.0) < 0.1
        assert abs(horizontal_m(corner, east) - 10.0) < 0.1
        assert abs(horizontal_m(north, east) - math.hypot(10.0, 10.0)) < 0.1

    def test_all_are_up_before_any_leaves_and_all_there_before_any_lands(self, fly: Fly) -> None:
        rehearsal, _ = flown(fly, "triangle", {"corner": FIELD, "heading": 45.0})

        _, up = times(rehearsal, "TakeOff")
        left, there = times(rehearsal, "GoTo")
        landing, _ = times(rehearsal, "LandIn")
        assert len(up) == len(landing) == 3
        assert max(up) <= min(left)
        assert max(there) <= min(landing)

    def test_no_two_cross_at_one_height(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "triangle", {"corner": FIELD})

        across = [points(sent(rehearsal, drone, "GoTo"))[1].up_m for drone in rehearsal.task(task).agents.granted]
        assert len(set(across)) == 3


def sorted_by_corner(rehearsal: Rehearsal, task: str) -> list[str]:
    """Return the drones in the order of the spots: each was assigned to one of them."""
    return sorted(rehearsal.task(task).agents.granted, key=lambda d: (stands(rehearsal, d).east_m > FIELD.east_m + 5,
                                                               stands(rehearsal, d).north_m > FIELD.north_m + 5))  # fmt: skip


class TestZigZag:
    def test_it_swings_to_both_sides_and_ends_exactly_at_the_end(self, fly: Fly) -> None:
        start, end = FIELD, SITE.places["west_field"]
        rehearsal, task = flown(fly, "zig_zag", {"start": start, "end": end})
        drone = rehearsal.task(task).agents.granted[0]
        way = points(sent(rehearsal, drone, "GoTo"))[3:]
        length = horizontal_m(start, end)
        east, north = (end.east_m - start.east_m) / length, (end.north_m - start.north_m) / length
        sides = [(p.east_m - start.east_m) * north - (p.north_m - start.north_m) * east for p in way]

        assert len(way) == 11
        assert {p.up_m for p in way} == {20.0}
        assert (way[0].east_m, way[0].north_m) == (start.east_m, start.north_m)
        assert (way[-1].east_m, way[-1].north_m) == (end.east_m, end.north_m)
        assert [round(side, 2) for side in sides] == [0.0, *([5.0, -5.0] * 4), 5.0, 0.0]
        assert horizontal_m(stands(rehearsal, drone), end) < 0.1
        assert rehearsal.engine.state.agents[drone].pool == "PARKED_AWAY"


class TestPatrolAndEscort:
    def test_the_patrol_flies_all_of_the_circle_at_a_height_of_its_own(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "patrol_and_escort", {"target": FIELD})
        patrol, escort = role(rehearsal, task, "patrol"), role(rehearsal, task, "escort")
        ring = points(sent(rehearsal, patrol, "GoTo"))[2:]

        assert len(ring) == 25
        assert all(abs(horizontal_m(p, FIELD) - 10.0) < 0.01 for p in ring)
        turns = {
            round(math.degrees(math.atan2(p.east_m - FIELD.east_m, p.north_m - FIELD.north_m))) % 360 for p in ring
        }
        assert turns == {15 * i for i in range(24)}
        assert {p.up_m for p in ring} == {30.0}
        assert all(abs(p.up_m - 30.0) >= 15.0 for p in points(sent(rehearsal, escort, "GoTo")))

    def test_both_land_ten_metres_apart(self, fly: Fly) -> None:
        rehearsal, task = flown(fly, "patrol_and_escort", {"target": FIELD})
        patrol, escort = role(rehearsal, task, "patrol"), role(rehearsal, task, "escort")

        assert horizontal_m(stands(rehearsal, escort), FIELD) < 0.1
        assert abs(horizontal_m(stands(rehearsal, patrol), FIELD) - 10.0) < 0.1


class TestDelivery:
    def test_both_land_five_metres_apart_and_only_then_the_watcher_is_asked(self, fly: Fly) -> None:
        task = packaged_task("delivery")
        rehearsal = fly(task)
        id_ = rehearsal.submit("Delivery", {"target": FIELD, "next_stop": EAST})
        questions = rehearsal.engine.state.questions

        assert rehearsal.run_until(lambda: any(q.kind == "ask" for q in questions.values()))
        drones = [rehearsal.engine.state.agents[a] for a in rehearsal.task(id_).agents.granted if a.startswith("lwd")]
        assert [d.landed for d in drones] == ["grounded", "grounded"]
        assert abs(horizontal_m(*(stands(rehearsal, d.id) for d in drones)) - 5.0) < 0.1
        assert rehearsal.run_until_ended(id_)

    @pytest.mark.parametrize("both", [False, True])
    def test_the_first_comes_home_and_the_second_goes_on(self, fly: Fly, both: bool) -> None:
        rehearsal, task = flown(fly, "delivery", {"target": FIELD, "next_stop": EAST, "return_second": both})
        first, second = role(rehearsal, task, "going_home"), role(rehearsal, task, "going_on")
        homes = {agent: SITE.ports[SITE.agents[agent].home].at for agent in (first, second)}

        assert horizontal_m(stands(rehearsal, first), homes[first]) < 0.1
        assert horizontal_m(stands(rehearsal, second), homes[second] if both else EAST) < 0.1
        landed = [Place(**g.fields["at"]) for g in sent(rehearsal, second, "LandIn")]
        assert any(horizontal_m(at, EAST) < 0.01 for at in landed)


def test_drones_of_one_task_cross_at_different_layers_though_others_are_fewer_there(fly: Fly) -> None:
    rehearsal = fly(packaged_task("patrol_and_escort"))
    short = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    for place, picker in (("north_field", "picker_1"), ("east_field", "picker_2")):
        rehearsal.submit("PickUp", {"target": SITE.places[place], "user": AgentRef(picker)})
    assert rehearsal.run_until_ended(short)
    held = sorted(a.layer_m for a in rehearsal.engine.state.agents.values() if a.layer_m is not None)
    assert held == [75.0, 90.0]

    task = rehearsal.submit("PatrolAndEscort", {"target": SITE.places["west_field"]})

    rehearsal.run_for(1)
    drones = [rehearsal.engine.state.agents[agent] for agent in rehearsal.task(task).agents.granted]
    assert len({drone.layer_m for drone in drones}) == 2
    assert rehearsal.run_until_ended()


PARAMS: dict[str, dict[str, Any]] = {
    "circle": {"center": FIELD},
    "triangle": {"corner": FIELD},
    "zig_zag": {"start": FIELD, "end": EAST},
    "patrol_and_escort": {"target": FIELD},
    "delivery": {"target": FIELD, "next_stop": EAST, "return_second": True},
}


@pytest.mark.parametrize("at_s", range(7, 290, 31))
@pytest.mark.parametrize("file", NAMES)
def test_an_abort_at_any_time_ends_without_a_crash_and_with_nobody_in_the_air(fly: Fly, file: str, at_s: int) -> None:
    task = packaged_task(file)
    rehearsal = fly(task)
    id_ = rehearsal.submit(task.name, PARAMS[file])
    rehearsal.run_for(at_s)
    if not rehearsal.ended(id_):
        rehearsal.abort(id_)

    assert rehearsal.run_until_ended(id_, limit_s=3600)
    assert {a.landed for a in rehearsal.engine.state.agents.values() if not a.human} == {"grounded"}


# -- values ------------------------------------------------------------------------------------------------------------

TEXT = {
    ("WatchDogSOS", "height"): 60.0,
    ("WatchDogRequest", "height"): 60.0,
    ("WatchDogRequest", "period"): 15.0,
    ("Circle", "radius"): 3.0,
    ("Circle", "points"): 36,
    ("Triangle", "leg"): 10.0,
    ("ZigZag", "legs"): 10,
    ("PatrolAndEscort", "radius"): 10.0,
    ("PatrolAndEscort", "points"): 24,
    ("Delivery", "spacing"): 5.0,
    ("Delivery", "return_second"): False,
}
CODE = {
    ("WatchDogSOS", "height"): 150.0,
    ("WatchDogRequest", "height"): 148.0,
    ("WatchDogRequest", "period"): 15.0,
    ("Circle", "radius"): 5.0,
    ("Circle", "points"): 360,
    ("Triangle", "leg"): 5.0,
    ("ZigZag", "legs"): 10,
    ("PatrolAndEscort", "radius"): 10.0,
    ("PatrolAndEscort", "points"): 10,
    ("Delivery", "spacing"): 1.0,
    ("Delivery", "return_second"): True,
}
NEAREST = {("WatchDogSOS", "height"): 120.0, ("WatchDogRequest", "height"): 120.0, ("Delivery", "spacing"): 3.0}
"""What the profile says instead, where no flight may have the code's value."""
FILES = {task.name: task for task in map(packaged_task, ("watch_dog_sos", "watch_dog_request", *NAMES))}


def value(task: str, name: str, text: str) -> Any:
    """Return what a text means for a parameter, whatever its limits are."""
    loose = FILES[task]
    values, problems, _ = bind_params(loose, {name: text}, SITE)
    missing = [p for p in problems if p.code not in ("E051", "E062")]
    assert not missing
    return values.get(name, text)


def test_the_trees_have_the_values_of_the_text() -> None:
    defaults = {key: FILES[key[0]].params[key[1]].default for key in TEXT}

    assert {key: default.const for key, default in defaults.items() if default is not None} == TEXT


def test_the_profile_has_the_values_of_the_published_code() -> None:
    path = profile_file("paper-code")
    assert path == folder("trees") / "profiles" / "paper-code.yaml"
    profile = load_profile(path).profile
    assert profile is not None
    said = {(task, name): text for task in profile.tasks for name, text in profile.texts(task).items()}

    assert said.keys() == CODE.keys()
    assert {key: value(*key, text) for key, text in said.items()} == {**CODE, **NEAREST}


def test_what_the_code_says_and_no_flight_may_have_is_refused_and_the_nearest_stands_in_the_profile() -> None:
    for (task, name), number in NEAREST.items():
        param = FILES[task].params[name]
        assert number in [limit.const for limit in (param.min, param.max) if limit is not None]
        assert isinstance(value(task, name, f"{CODE[task, name]:g} m"), str)


def test_every_tree_of_the_folder_checks_clean_with_and_without_a_site() -> None:
    files = [p for p in sorted(folder("trees").glob("*.yaml")) if not p.name.endswith((".test.yaml", "site.yaml"))]

    assert len(files) == 10
    for path in files:
        for site in (SITE, None):
            assert load_task(Path(path), catalogue=CATALOGUE, site=site).diagnostics == []


def test_all_ten_at_once_on_a_larger_fleet_succeed_without_a_crash() -> None:
    loaded = load_scenario(folder("trees") / "scenarios" / "ten.yaml", catalogue=CATALOGUE)
    assert loaded.scenario is not None
    run = VirtualRun(loaded.scenario)

    assert run.run()
    tasks = run.rehearsal.engine.state.tasks
    assert {task.name: task.status for task in tasks.values()} == dict.fromkeys(
        ["MoveTask", "PickUp", "WatchDogSOS", "WatchDogRequest", "ExploreRegion", "Circle", "Triangle", "ZigZag",
         "PatrolAndEscort", "Delivery"], "SUCCEEDED",
    )  # fmt: skip
    assert run.verdict().is_clean
    check_rehearsal(run.rehearsal)
    run.close()
