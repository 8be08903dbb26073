"""Machines on the routes of a site: one goal an edge, what they take up, and that nobody waits for ever."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.index import StateIndex
from formiga_bt.engine.kernel.inputs import Abort, AgentSeenInput, Operator, UpdateGoal
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.lang.compose import compose
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import Bench, alarms, task_of
from formiga_bt.show.history.charting import chart
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.history.records import goal_fact
from formiga_bt.transport.cards import AgentCard

SITE = """
formiga_site: 1
name: hall
base: {lat: 66.5, lng: 25.7}
actions: [base, ground]
stations:
  s1: {at: {east: 0 m, north: 10 m}, charges: true}
  s2: {at: {east: 60 m, north: 10 m}}
routes:
  nodes:
    a: {at: {east: 0 m, north: 0 m}}
    b: {at: {east: 20 m, north: 0 m}}
    c: {at: {east: 40 m, north: 0 m}}
    d: {at: {east: 60 m, north: 0 m}}
    bay: {at: {east: 40 m, north: 10 m}, park: true}
  edges: [[s1, a], [a, b, {speed: 1 m/s}], [b, c], [c, d], [d, s2], [c, bay]]
places: {off: {east: 20 m, north: 0 m}}
agents:
  r1: {type: rover, at: s1}
  r2: {type: rover, at: s2}
  r3: {type: rover, at: {east: 40 m, north: 10 m}}
"""
GO = """
params: {rover: {type: agent, of: [rover]}, to: place}
agents: {it: {type: rover, id: "${rover}"}}
steps:
  - do: it.Dock
    with: {at: "${to}"}
"""
SPOTS = {
    "s1": (0, 10), "a": (0, 0), "b": (20, 0), "c": (40, 0), "d": (60, 0), "s2": (60, 10), "bay": (40, 10)
}  # fmt: skip


@pytest.fixture
def made(tmp_path: Path) -> tuple[Site, Catalogue]:
    text = SITE.replace("at: s1", "at: {east: 0 m, north: 10 m}").replace("at: s2", "at: {east: 60 m, north: 10 m}")
    (tmp_path / "site.yaml").write_text(text)
    found = compose(tmp_path / "site.yaml")
    assert [str(one) for one in found.diagnostics] == []
    assert found.site is not None
    return found.site, found.catalogue


class Hall(Bench):
    def __init__(self, made: tuple[Site, Catalogue], *rovers: str, **options: Any) -> None:
        super().__init__(*made, [task_of(GO, *made, "Go")])
        self.rovers = {name: self.agent(name, "rover", **options) for name in rovers}
        self.run_for(0.5)

    def go(self, rover: str, to: str) -> str:
        task = self.submit("Go", {"rover": AgentRef(rover), "to": Place(*SPOTS[to])})
        self.run_for(0.5)
        return task

    def held(self, rover: str) -> set[str]:
        return set(self.record(rover).on_route)

    def gated(self, rover: str) -> tuple[str, str]:
        goal = next(goal for goal in self.engine.state.goals.values() if goal.agent == rover)
        return goal.code, goal.text

    def arrive(self, rover: str) -> None:
        agent = self.rovers[rover]
        target = next(iter(v for k, v in agent.goal.fields.items() if k in ("to", "at")))
        agent.succeed(position=Position(target["east_m"], target["north_m"], 0.0))
        self.run_for(0.5)

    def move(self, rover: str, east: float, north: float) -> None:
        self.rovers[rover].say(position=Position(east, north, 0.0))
        self.run_for(0.3)


def test_a_step_becomes_one_goal_an_edge_and_the_last_is_its_own(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    task = hall.go("r1", "bay")
    sent = []
    for _ in range(4):
        goal = hall.rovers["r1"].goal
        sent.append((goal.action, {k: v for k, v in goal.fields.items() if k == "speed"}))
        hall.arrive("r1")

    assert sent == [("Drive", {}), ("Drive", {"speed": 1.0}), ("Drive", {}), ("Dock", {})]
    assert hall.task(task).status == "SUCCEEDED"
    assert hall.held("r1") == {"bay"}
    hall.check()


def test_watch_shows_the_way_on_the_routes_and_a_map_the_routes(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    hall.go("r1", "s2")
    (goal,) = (goal for goal in hall.engine.state.goals.values() if not goal.ended)

    assert goal_fact(goal).target == "at 0 E 0 N by a, b, c, d, s2"

    drawn = chart(Ledger(), made[0], 0)
    assert [lane.name for lane in drawn.lanes] == ["s1-a", "a-b", "b-c", "c-d", "d-s2", "c-bay"]
    assert [mark.name for mark in drawn.marks if mark.kind == "park"] == ["bay"]


def test_what_it_is_sent_over_is_its_own_until_a_status_says_that_it_is_out(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    hall.go("r1", "s2")
    assert hall.held("r1") == {"s1", "s1-a", "a"}
    hall.move("r1", 0.0, 5.0)
    assert hall.held("r1") == {"s1-a", "a"}
    hall.arrive("r1")
    assert hall.held("r1") == {"a", "a-b", "b"}
    hall.move("r1", 10.0, 0.0)
    assert hall.held("r1") == {"a-b", "b"}
    hall.check()


def test_an_edge_stays_taken_by_a_machine_that_is_lost(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1", "r3")
    hall.go("r1", "s2")
    hall.arrive("r1")
    hall.arrive("r1")
    hall.move("r1", 30.0, 0.0)
    assert hall.held("r1") == {"b-c", "c"}
    hall.rovers["r1"].silent = True
    hall.rovers["r1"].kill()
    hall.run_for(60)
    assert hall.record("r1").liveness == "LOST"

    hall.go("r3", "s1")
    assert hall.gated("r3") == ("route_busy", "r1")
    assert hall.held("r1") == {"b-c", "c"}
    hall.check()


def test_who_is_stopped_between_nodes_gives_the_node_ahead_back_and_drives_home_by_the_other(
    made: tuple[Site, Catalogue],
) -> None:
    hall = Hall(made, "r1")
    task = hall.go("r1", "s2")
    hall.arrive("r1")
    hall.move("r1", 10.0, 0.0)
    hall.ask(Abort(task))
    hall.run_for(1.0)
    hall.move("r1", 10.1, 0.0)

    assert hall.held("r1") == {"a-b", "a"}
    assert hall.rovers["r1"].goal.fields == {"to": {"east_m": 0.0, "north_m": 0.0}, "speed": 1.0}


@pytest.mark.parametrize("to", ["b", "c"])
def test_routes_end_at_stations_and_where_one_may_park(made: tuple[Site, Catalogue], to: str) -> None:
    hall = Hall(made, "r1")
    task = hall.go("r1", to)

    assert hall.task(task).outcome.code == "off_routes"
    assert hall.rovers["r1"].done == []
    hall.check()


def test_two_that_would_meet_on_one_lane_pass_at_the_bay(made: tuple[Site, Catalogue]) -> None:
    """Straight at each other: whichever comes first, nobody gets where the other could never come past."""
    hall = Hall(made, "r1", "r2")
    tasks = [hall.go("r1", "s2"), hall.go("r2", "s1")]
    for _ in range(60):
        for name in hall.rovers:
            if hall.record(name).goal:
                hall.arrive(name)
        owned = [part for name in hall.rovers for part in hall.record(name).on_route]
        assert len(owned) == len(set(owned)), "nothing is two machines' at once"
        if all(hall.task(task).ended for task in tasks):
            break
        hall.run_for(2.0)

    assert [hall.task(task).status for task in tasks] == ["SUCCEEDED", "SUCCEEDED"]
    assert (hall.held("r1"), hall.held("r2")) == ({"s2"}, {"s1"})
    hall.check()


def test_nobody_leaves_for_a_station_that_is_taken(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1", "r2")
    hall.go("r1", "s2")
    hall.run_for(20)

    assert hall.rovers["r1"].done == []
    assert hall.gated("r1") in (("route_busy", "r2"), ("route_order", "r1"))
    hall.check()


def test_the_step_of_a_goal_that_waited_and_may_never_go_is_told(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1", "r2")
    task = hall.go("r1", "s2")
    assert hall.gated("r1")[0] == "route_busy"
    hall.rovers["r1"].say(battery=15.1)
    hall.run_for(11)

    assert hall.task(task).outcome.code == "envelope.reserve"
    hall.check()


def test_who_is_ordered_home_while_all_stations_are_taken_parks_elsewhere(made: tuple[Site, Catalogue]) -> None:
    """It would wait on the lanes, in the way of others, perhaps for ever."""
    hall = Hall(made, "r1", "r2")
    hall.rovers["r3"] = hall.agent("r3", "rover", at=Place(20.0, 0.0))
    hall.run_for(0.5)
    hall.ask(Operator("return", "r3", "eve"))
    hall.run_for(0.5)
    while hall.record("r3").goal:
        hall.arrive("r3")

    assert hall.held("r3") == {"bay"}
    assert hall.engine.state.orders["r3"].state == "done"
    assert "agent_needs_help" in alarms(hall)
    hall.check()


def test_a_way_home_leads_elsewhere_once_another_machine_stands_there(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    hall.rovers["r3"] = hall.agent("r3", "rover", at=Place(40.0, 0.0))
    hall.run_for(0.5)
    hall.ask(Operator("return", "r3", "eve"))
    hall.run_for(0.5)
    assert hall.rovers["r3"].goal.fields == {"to": {"east_m": 60.0, "north_m": 0.0}}, "on the way to s2"
    hall.rovers["r2"] = hall.agent("r2", "rover", at=Place(60.0, 10.0))
    hall.arrive("r3")
    hall.run_for(11)
    while hall.record("r3").goal:
        hall.arrive("r3")

    assert hall.held("r3") == {"bay"}
    hall.check()


def test_a_machine_beside_the_routes_joins_them_at_the_nearest_node(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1", at=Place(20.0, 15.0))
    assert hall.held("r1") == set()
    hall.go("r1", "s1")

    assert hall.rovers["r1"].goal.fields == {"to": {"east_m": 20.0, "north_m": 0.0}}
    assert hall.held("r1") == {"b"}
    hall.check()


def test_what_a_machine_takes_up_survives_a_start_anew(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    hall.go("r1", "s2")
    fresh = StateIndex(hall.engine.state)

    assert fresh.on_route.of("a") == ("r1",)
    assert fresh.driving == {"r1": hall.record("r1").goal}


def test_on_routes_a_target_does_not_change_on_the_way(made: tuple[Site, Catalogue]) -> None:
    hall = Hall(made, "r1")
    hall.go("r1", "s2")
    goal = hall.rovers["r1"].goal
    before, held = hall.engine.state.goals[goal.goal_id], hall.held("r1")
    reply = hall.driver.feed(UpdateGoal(goal.goal_id, {next(iter(goal.fields)): Place(40.0, 10.0)})).reply
    assert isinstance(reply, Refusal)
    assert reply.code == "no_update"
    assert (hall.engine.state.goals[goal.goal_id], hall.held("r1")) == (before, held)


def test_on_routes_a_target_that_moves_is_refused_by_the_checker(made: tuple[Site, Catalogue]) -> None:
    text = """\
formiga: 1
task: Meet
agents: {it: {type: rover}, picker: {type: picker}}
steps:
  - do: it.Dock
    with: {at: "${ground(picker.position)}"}
    track: {every: 2 s}
    timeout: 5 min
"""
    found = load_task_text(text, "meet.yaml", catalogue=made[1], site=made[0]).diagnostics
    assert [("no_update" in one.message, "routes" in one.message) for one in found if one.code == "E054"] == [
        (True, True)
    ]


FREE = """
formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
actions: [base, ground]
agents:
  r1: {type: rover}
  r2: {type: rover}
"""
DRIVE = GO.replace("it.Dock", "it.Drive").replace("{at:", "{to:")


@pytest.mark.parametrize("who", ["nobody", "one", "both"])
def test_two_that_both_avoid_obstacles_share_free_ground(tmp_path: Path, who: str) -> None:
    (tmp_path / "site.yaml").write_text(FREE)
    found = compose(tmp_path / "site.yaml")
    assert found.site is not None
    site, catalogue = found.site, found.catalogue
    yard = Bench(site, catalogue, [task_of(DRIVE, site, catalogue, "Go")])
    first = yard.agent("r1", "rover", at=Place(0.0, 0.0))
    yard.agent("r2", "rover", at=Place(20.0, 0.0))
    for name, says in (("r1", who != "nobody"), ("r2", who == "both")):
        yard.driver.feed(AgentSeenInput(AgentCard(id=name, type="rover", boot_id=yard.record(name).boot_id, wire=2,
                                                  mobility="ground", actions=("Drive",), avoids=says)))  # fmt: skip
    yard.submit("Go", {"rover": AgentRef("r1"), "to": Place(40.0, 0.0)})
    yard.run_for(1.0)

    assert bool(first.done) == (who == "both")
