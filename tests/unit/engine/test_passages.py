"""Resources with a region at the gate, with machines on the ground: who goes in, who is in, and a door that guards."""

import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.model import Catalogue, Resource, Site, Station
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, task_of
from formiga_bt.safety.gate import Hold, Refuse
from formiga_bt.safety.resources import ResourceUse, may_pass, may_shut

CATALOGUE = """\
types:
  rover:
    mobility: ground
    label: rover
    actions: [Drive]
    rest: parked
    limits: {speed: 1 m/s}
  door:
    mobility: fixed
    shared: true
    label: door
    actions: [Open, Close]
actions:
  Drive: {fields: {to: {type: place}}, moves_to: to, repeatable: true, typical: 10 s}
  Open: {repeatable: true, typical: 2 s}
  Close: {repeatable: true, typical: 2 s}
"""
SITE = """\
formiga_site: 1
name: hall
base: {lat: 66.5, lng: 25.7}
places: {west: {east: 0 m, north: 0 m}, east: {east: 20 m, north: 0 m}, middle: {east: 10 m, north: 0 m}}
resources:
  doorway: {region: [{east: 8 m, north: -2 m}, {east: 12 m, north: -2 m}, {east: 12 m, north: 2 m}, {east: 8 m, north: 2 m}]}
agents:
  r1: {type: rover, at: west}
  r2: {type: rover, at: {east: 0 m, north: 10 m}}
  d1: {type: door, at: middle, guards: {Close: doorway}}
"""
ROVER = "agents: {rover: {type: rover, id: r1}}\n"
DRIVE = "{do: rover.Drive, with: {to: '${%s}'}}"
THROUGH = f"{ROVER}steps: [{{with_resource: doorway, steps: [{DRIVE % 'site.places.east'}]}}]"
BARE = f"{ROVER}steps: [{DRIVE % 'site.places.east'}]"
SHUT = "agents: {door: {type: door, id: d1}}\nsteps: [{do: door.Close}]"


@cache
def hall() -> tuple[Site, Catalogue]:
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        (here / "catalogue.yaml").write_text(CATALOGUE, encoding="utf-8")
        (here / "site.yaml").write_text(SITE, encoding="utf-8")
        catalogue, found, _ = load_catalogue([here / "catalogue.yaml"], [here])
        assert not [one for one in found if one.severity == "error"], found
        site, found, _ = load_site(here / "site.yaml", catalogue)
        assert site is not None, found
        return site, catalogue


class Hall(Bench):
    """Two rovers west of a doorway, and its door."""

    def __init__(self, **tasks: str) -> None:
        super().__init__(*hall(), [task_of(text, *hall(), name=name) for name, text in tasks.items()])
        self.r1, self.r2 = self.agent("r1", "rover", at=Place(0.0, 0.0)), self.agent("r2", "rover", at=Place(0.0, 10.0))
        self.door = self.agent("d1", "door", at=Place(10.0, 0.0))
        self.run_for(0.5)

    def start(self, name: str) -> str:
        found = self.submit(name, {})
        self.run_for(0.5)
        return found

    def gated(self) -> list[tuple[str, str, str]]:
        return [
            (goal.agent, goal.code, goal.text) for goal in self.engine.state.goals.values() if goal.state == "gated"
        ]

    def inside(self) -> list[str]:
        return [agent.id for agent in self.engine.state.agents.values() if "doorway" in agent.inside]


@pytest.fixture
def hold() -> Iterator[list[Hall]]:
    made: list[Hall] = []
    yield made
    for one in made:
        one.close()


def at(rover: ScriptedAgent, east: float) -> None:
    rover.say(position=Position(east, 0.0, 0.0))


def test_a_machine_takes_the_region_up_from_when_it_is_sent_until_all_of_it_is_out(hold: list[Hall]) -> None:
    bench = Hall(Through=THROUGH)
    hold.append(bench)
    mine = bench.start("Through")

    assert bench.inside() == ["r1"], "it is on its way"
    at(bench.r1, 10.0)
    bench.run_for(0.2)
    assert bench.inside() == ["r1"]
    at(bench.r1, 12.3)
    bench.run_for(0.2)
    assert bench.inside() == ["r1"], "half of it is in still"
    at(bench.r1, 12.6)
    bench.run_for(0.2)
    assert bench.inside() == []
    bench.r1.succeed(position=Position(20.0, 0.0, 0.0))
    bench.run_for(0.5)
    assert bench.task(mine).status == "SUCCEEDED"


def test_a_leg_of_a_task_that_holds_no_unit_waits(hold: list[Hall]) -> None:
    bench = Hall(Bare=BARE)
    hold.append(bench)
    bench.start("Bare")
    bench.run_for(5)

    assert bench.gated() == [("r1", "no_claim", "doorway")]
    assert bench.inside() == []


def test_it_stays_occupied_when_its_machine_is_lost_and_nobody_is_granted_it(hold: list[Hall]) -> None:
    other = THROUGH.replace("id: r1", "id: r2")
    bench = Hall(Through=THROUGH, Other=other)
    hold.append(bench)
    mine = bench.start("Through")
    at(bench.r1, 10.0)
    bench.run_for(0.5)
    bench.r1.silent = True
    bench.r1.kill()
    bench.run_for(60)
    assert bench.record("r1").liveness == "LOST"
    assert bench.task(mine).ended

    second = bench.start("Other")
    bench.run_for(5)

    assert bench.inside() == ["r1"]
    assert not bench.task(second).resources.claims
    assert [v.detail for v in bench.engine.state.explanations[f"{second}|steps/steps[0]"]] == ["doorway: r1"]


def test_a_door_is_not_closed_on_a_machine_and_nobody_goes_in_while_it_closes(hold: list[Hall]) -> None:
    bench = Hall(Through=THROUGH, Shut=SHUT)
    hold.append(bench)
    mine = bench.start("Through")
    shut = bench.start("Shut")
    assert bench.task(shut).outcome.code == "occupied"
    assert "r1" in bench.task(shut).outcome.reason
    at(bench.r1, 20.0)
    bench.r1.succeed(position=Position(20.0, 0.0, 0.0))
    bench.run_for(0.5)
    assert bench.task(mine).status == "SUCCEEDED"

    bench.start("Shut")
    assert bench.door.goal.action == "Close"
    bench.start("Through")
    # r1 stands east of it already: its leg is none through the region. Put it back.
    bench.r1.succeed()
    bench.run_for(0.5)
    at(bench.r1, 0.0)
    bench.run_for(0.2)
    bench.start("Through")
    assert bench.gated() == [("r1", "resource_busy", "doorway: d1")]
    bench.door.succeed()
    bench.run_for(0.5)
    assert bench.gated() == []
    assert bench.inside() == ["r1"]


def use(claimed: dict[str, int], inside: dict[str, str], capacity: int = 1) -> ResourceUse:
    return ResourceUse(name="bridge", capacity=capacity, claimed=claimed, inside=inside)


@pytest.mark.parametrize(
    ("now", "passage", "rescue", "shutting", "verdict"),
    [
        (use({"A": 1}, {}), "enters", False, "", None),
        (use({"A": 1}, {}), "enters", False, "d1", Hold("resource_busy", "bridge: d1")),
        (use({"A": 1}, {"m": "A"}), "stays", False, "d1", None),
        (use({}, {}), "enters", False, "", Hold("no_claim", "bridge")),
        (use({"B": 1}, {}), "enters", False, "", Hold("no_claim", "bridge")),
        (use({}, {"m": "A"}), "stays", False, "", Hold("no_claim", "bridge")),
        (use({}, {"m": "A"}), "leaves", False, "", None),
        (use({}, {"m": "A"}), "stays", True, "", None),
        (use({}, {}), "enters", True, "", None),
        (use({"B": 1}, {}), "enters", True, "", Hold("resource_busy", "bridge: B")),
        (use({"B": 1}, {}, 2), "enters", True, "", None),
        (use({"A": 1}, {"n": "A"}), "enters", False, "", Hold("resource_busy", "bridge: n")),
        (use({"A": 2}, {"n": "A"}, 2), "enters", False, "", None),
        (use({"A": 1}, {"n": ""}), "enters", False, "", Hold("resource_busy", "bridge: n")),
        (use({"A": 1}, {"n": "B"}), "enters", False, "", Hold("resource_busy", "bridge: n")),
        (use({"A": 1}, {}), "enters", True, "", None),
    ],
)
def test_what_a_leg_through_a_region_waits_for(
    now: ResourceUse, passage: str, rescue: bool, shutting: str, verdict: Hold | None
) -> None:
    assert may_pass(now, "m", "A", passage, rescue=rescue, shutting=shutting) == verdict  # type: ignore[arg-type]


def test_a_guard_is_refused_while_another_machine_is_inside() -> None:
    assert may_shut(use({}, {"n": "B"}), "d1") == Refuse("occupied", "bridge is occupied by n")
    assert may_shut(use({"A": 1}, {}), "d1") is None


def test_a_way_home_counts_as_a_need_of_who_holds_something(hold: list[Hall]) -> None:
    site, catalogue = hall()
    across = Region(tuple(Place(*corner) for corner in ((30.0, -9.0), (34.0, -9.0), (34.0, 9.0), (30.0, 9.0))))
    west_of_it = {**site.agents, "r1": replace(site.agents["r1"], home="s1")}
    far = replace(
        site,
        agents=west_of_it,
        stations={"s1": Station("s1", Place(50.0, 0.0))},
        resources={"lift": Resource("lift", 1), "bridge": Resource("bridge", 1, across)},
    )
    holds = "agents: {rover: {type: rover, id: r1}}\nsteps: [{with_resource: lift, steps: [{wait: 10 s}]}]"
    inner = "{with_resource: lift, steps: [{wait: 1 s}]}"
    wants = f"agents: {{rover: {{type: rover, id: r2}}}}\nsteps: [{{with_resource: bridge, steps: [{inner}]}}]"
    tasks = [task_of(holds, far, catalogue, name="Holds"), task_of(wants, far, catalogue, name="Wants")]
    bench = Bench(far, catalogue, tasks)
    hold.append(bench)  # type: ignore[arg-type]
    for name, north in (("r1", 0.0), ("r2", 10.0)):
        bench.agent(name, "rover", at=Place(0.0, north))
    mine = bench.submit("Holds", {})
    bench.run_for(0.5)
    other = bench.submit("Wants", {})
    bench.run_for(0.5)

    assert bench.task(mine).resources.units == {"lift": 1}
    assert not bench.task(other).resources.claims
    verdicts = bench.engine.state.explanations[f"{other}|steps/steps[0]"]
    assert [(v.code, v.detail) for v in verdicts] == [("safe_order", mine)]
    assert bench.run_until_ended(mine, limit_s=60)
    assert bench.run_until_ended(other, limit_s=60)
    assert bench.task(other).status == "SUCCEEDED"
