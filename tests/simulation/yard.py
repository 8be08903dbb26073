"""A yard: rovers on routes, a room with a door, a lift, a loader, chargers, people. Seeds from `YARD_FROM` on are played in it.

    python -m tests.simulation.runs --seeds 60000-62000

What goes wrong is what `plan` and `more` draw for drones, and a little that only a yard knows. `ground` judges it.
"""

import json
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Final

from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, is_within
from formiga_bt.base.routes import Routes
from formiga_bt.lang.compose import compose
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.bodies import kind_of
from formiga_bt.rehearsal.testing import task_of
from tests.missions.route_traffic import grid
from tests.simulation.more import story
from tests.simulation.plan import SCRIPTS, Ask, Deed, Plan, deeds
from tests.simulation.rarer import BESIDE

COLUMNS, ROWS, BAYS = 4, 4, 18
ROVERS: Final = ("r0", "r1", "r2", "r3", "r4", "r5")
FIXED: Final = ("door_1", "lift_1", "loader_1")
PEOPLE: Final = (("watcher_1", "watcher"), ("picker_1", "picker"))
EDGE_SPEED_M_S: Final = 1.0
"""How fast the lanes in the south may be driven on."""
OWN: Final = """
types:
  loader:
    label: loader
    mobility: fixed
    shared: true
    actions: [Load]
    suspect_after: 10 s
    lost_after: 1 min
actions:
  Load:
    help: Put a load on whoever stands below.
    result: {weight: mass}
    repeatable: false
    typical: 6 s
"""
ROVER: Final = '  it: {type: rover, id: "${rover}", away: true}\n'
HEAD: Final = (
    "params: {rover: {type: agent, of: [rover]}, to: place, on: place, speed: {type: speed, default: 1.5 m/s}}\n"
)
DOOR, LIFT, LOADER, PICKER = (
    "  door: {type: door, id: door_1}\n", "  lift: {type: lift, id: lift_1}\n", "  loader: {type: loader, id: loader_1}\n",
    "  picker: {type: picker}\n",
)  # fmt: skip
TEXTS: Final = {
    "Go": (ROVER, "[{do: it.Drive, with: {to: '${to}', speed: '${speed}'}}]"),
    "Any": (
        "  it: {type: rover, near: '${to}', away: true, wait: 30 s, if_lost: rebind}\n",
        "[{do: it.Drive, with: {to: '${to}'}}, {do: it.Drive, with: {to: '${on}'}}]",
    ),
    "In": (ROVER, "[{with_resource: room, wait: 40 s, steps: [{do: it.Drive, with: {to: '${to}'}}, {do: it.Drop}]}]"),
    "Through": (
        ROVER + DOOR,
        "[{with_resource: room, wait: 60 s, steps: [{do: door.Open}, {do: it.Drive, with: {to: '${to}'}}, {do: it.Pick},"
        " {do: it.Drive, with: {to: '${on}'}}]}, {do: door.Close}]",
    ),
    "Shut": (DOOR, "[{do: door.Close, retry: {attempts: 2, delay: 3 s}}, {do: door.Open}]"),
    "Ride": (
        ROVER + LIFT,
        "[{with_resource: cabin, wait: 60 s, steps: [{do: lift.CallTo, with: {floor: ground}}, {do: lift.OpenDoor},"
        " {do: it.Drive, with: {to: '${to}'}}, {wait: 3 s}, {do: it.Drive, with: {to: '${on}'}}]}, {do: lift.CloseDoor}]",
    ),
    "Call": (LIFT, "[{do: lift.CallTo, with: {floor: first}, retry: {attempts: 3, delay: 2 s}}, {do: lift.OpenDoor}]"),
    "Haul": (
        ROVER + LOADER + PICKER,
        "[{with_resource: [loading, bay], wait: 90 s, steps: [{do: it.Drive, with: {to: '${to}'}}, {do: loader.Load},"
        " {ask: Is it loaded?, of: [picker], options: [loaded, not_yet], timeout: 20 s, ignore_failure: true}]},"
        " {do: it.Drive, with: {to: '${on}'}}]",
    ),
    "Fill": (ROVER, "[{do: it.Dock, with: {at: '${to}'}}, {do: it.Charge, with: {until: 90 %}}, {do: it.Undock}]"),
    "Cut": (
        ROVER,
        "[{parallel: [{do: it.Drive, with: {to: '${to}'}}, {wait: 9 s}], need: any}, {do: it.Drive, with: {to: '${on}'}}]",
    ),
    "Two": (
        "  one: {type: rover, away: true}\n  other: {type: rover, away: true}\n",
        "[{parallel: [{do: one.Drive, with: {to: '${to}'}}, {do: other.Drive, with: {to: '${on}'}}]}]",
    ),
    "Try": (
        "",
        "[{with_agents: {it: {type: rover, near: '${to}', away: true}}, retry: {attempts: 2, delay: 3 s, agent: another},"
        " steps: [{do: it.Drive, with: {to: '${to}'}}]}]\nfinally: [{wait: 2 s}]",
    ),
}  # fmt: skip
WISHED: Final = (
    "Go", "Go", "Go", "Go", "Any", "Any", "In", "In", "Through", "Through", "Shut", "Shut", "Ride", "Ride", "Call", "Call",
    "Haul", "Haul", "Fill", "Cut", "Cut", "Two", "Try",
)  # fmt: skip
STORIES: Final = (
    "fail", "fail", "hang", "spoil", "hurry", "hurry", "superseded", "late_word", "stuck", "strict", "lockdown", "blame",
    "no_answer", "abandon", "given_up",
)  # fmt: skip


def _square(east: float, north: float, size: float) -> list[dict[str, str]]:
    corners = ((0.0, 0.0), (size, 0.0), (size, size), (0.0, size))
    return [{"east": f"{east + x} m", "north": f"{north + y} m"} for x, y in corners]


@cache
def yard(one_way: bool) -> tuple[Site, Catalogue]:
    """Return the site, with lanes that are one-way or not, and its catalogue."""
    stations = {"s1": (13.0, 23.0), "s2": (27.0, 17.0)}
    fixed = {
        "door_1": {"type": "door", "at": {"east": "5 m", "north": "5 m"}, "guards": {"Close": "room"}},
        "lift_1": {
            "type": "lift", "at": {"east": "25 m", "north": "5 m"},
            "guards": {"CallTo": "cabin", "CloseDoor": "cabin"},
        },
        "loader_1": {"type": "loader", "at": {"east": "5 m", "north": "25 m"}},
    }  # fmt: skip
    file = {
        "formiga_site": 1, "name": "yard", "base": {"lat": 66.5, "lng": 25.7},
        "actions": ["base", "ground", "building", "own.yaml"],
        "no_go": [_square(11.5, 11.5, 2.0)],
        "stations": {
            name: {"at": {"east": f"{e} m", "north": f"{n} m"}, "charges": True} for name, (e, n) in stations.items()
        },
        "resources": {
            "room": {"region": _square(1.8, 1.8, 6.4)},
            "cabin": {"region": _square(21.8, 1.8, 6.4)},
            "loading": {"region": _square(1.8, 21.8, 6.4), "capacity": 1},
            "bay": {"capacity": 2},
        },
        "agents": {
            **{name: {"type": "rover"} for name in ROVERS}, **fixed, **{name: {"type": kind} for name, kind in PEOPLE},
        },
    }  # fmt: skip
    with TemporaryDirectory() as folder:
        (Path(folder) / "own.yaml").write_text(OWN, encoding="utf-8")
        (Path(folder) / "site.yaml").write_text(json.dumps(file), encoding="utf-8")
        found = compose(Path(folder) / "site.yaml")
    assert found.site is not None, [str(one) for one in found.diagnostics]
    return replace(found.site, routes=_lanes(one_way)), found.catalogue


def _lanes(one_way: bool) -> Routes:
    """Return the lanes: a grid with bays. Two of them are the stations; the cell of the no-go region has none."""
    routes = grid(COLUMNS, ROWS, BAYS, one_way=one_way)
    gone, named = {"b1_1", "b1_1u"}, {"b1_2": "s1", "b2_1u": "s2"}
    name = {node: named.get(node, node) for node in routes.nodes}
    nodes = {name[n]: replace(node, name=name[n]) for n, node in routes.nodes.items() if n not in gone}
    edges = [replace(edge, a=name[edge.a], b=name[edge.b]) for edge in routes.edges if edge.b not in gone]
    slow = [replace(edge, speed_m_s=EDGE_SPEED_M_S) if edge.name.endswith("_0") else edge for edge in edges]
    return Routes(nodes, tuple(slow))


@cache
def _model(name: str, one_way: bool) -> Task:
    agents, steps = TEXTS[name]
    return task_of(
        f"{HEAD}agents:\n{agents}steps: {steps}\n" if agents else f"{HEAD}steps: {steps}\n", *yard(one_way), name
    )


class YardPlan(Plan, frozen=True):
    """All that decides a run in the yard."""

    one_way: bool = False
    stand: tuple[str, ...] = ()
    """The node where each rover begins."""

    @property
    def site(self) -> Site:
        return yard(self.one_way)[0]

    @property
    def catalogue(self) -> Catalogue:
        return yard(self.one_way)[1]

    def models(self) -> dict[str, Task]:
        return {name: _model(name, self.one_way) for name in TEXTS}

    def specs(self) -> list[AgentSpec]:
        site, kinds = yard(self.one_way)
        chargers = tuple(station.at for station in site.stations.values())
        limits = {"drive_drain_pct_s": 0.1, "charge_percent_s": 1.0}
        found = [
            AgentSpec(
                id=rover, type="rover", at=site.routes.nodes[node].at, does=kind_of(kinds, "rover"), seed=self.seed,
                battery=battery, chargers=chargers, limits=limits,
            )
            for rover, node, battery in zip(ROVERS, self.stand, self.batteries, strict=False)
        ]  # fmt: skip
        for name in FIXED:
            kind, at = site.agents[name].type, site.agents[name].at
            assert at is not None
            found.append(AgentSpec(id=name, type=kind, at=at, does=kind_of(kinds, kind), seed=self.seed))
        for number, (name, kind, script) in enumerate(self.people):
            found.append(
                AgentSpec(id=name, type=kind, at=Place(-10.0, 5.0 * number), script=SCRIPTS[script], kind="person")
            )
        return found


def yard_plan(seed: int) -> YardPlan:
    """Return the plan of a seed in the yard."""
    dice = Random(f"yard/{seed}")
    one_way, rovers = dice.random() < 0.5, dice.randint(4, len(ROVERS))
    site = yard(one_way)[0]
    ends = {name: node.at for name, node in site.routes.nodes.items() if node.is_end}
    inside = {
        name: [at for at in ends.values() if is_within(at, one.region)]
        for name, one in site.resources.items()
        if one.region is not None
    }
    outside = {name: at for name, at in ends.items() if not any(at in spots for spots in inside.values())}
    free = sorted(outside.keys() - site.stations.keys())
    lasts = dice.choice((90.0, 150.0, 200.0))
    machines = [*ROVERS[:rovers]]
    people = tuple((name, kind, dice.choice(("answers", "answers", "slow", "never"))) for name, kind in PEOPLE)
    asks = [_ask(dice, lasts, machines, list(outside.values()), inside, site) for _ in range(dice.randint(14, 24))]
    wrong = [*deeds(dice, [*machines, *machines, *FIXED], [name for name, _ in PEOPLE], lasts)]
    for _ in range(dice.randint(1, 4)):
        wrong += story(dice, dice.choice(STORIES), round(dice.uniform(5.0, lasts - 5.0), 3), machines, ["picker_1"])
    wrong += [_of_the_yard(dice, lasts, machines) for _ in range(dice.randint(1, 6))]
    asks.sort(key=lambda ask: ask.at)
    wrong.sort(key=lambda deed: deed.at)
    return YardPlan(
        seed, rovers, people, tuple(asks), tuple(wrong), lasts,
        batteries=tuple(dice.choice((100.0, 100.0, 100.0, 60.0, 30.0)) for _ in machines), one_way=one_way,
        stand=tuple(dice.sample(free, rovers)), ahead=dice.random() < 0.2,
    )  # fmt: skip


def _ask(
    dice: Random, lasts: float, machines: list[str], outside: list[Place], inside: dict[str, list[Place]], site: Site
) -> Ask:
    task = dice.choice(WISHED)
    match task:
        case "In" | "Through":
            to = dice.choice(inside["room"])
        case "Ride":
            to = dice.choice(inside["cabin"])
        case "Haul":
            to = dice.choice(inside["loading"])
        case "Fill":
            to = dice.choice([station.at for station in site.stations.values()])
        case _:
            to = dice.choice(outside) if dice.random() < 0.95 else site.routes.nodes["n1_1"].at
    speed = dice.choice((1.5, 1.5, 1.0, 3.0)) if task == "Go" else 1.5
    params = {"rover": AgentRef(dice.choice(machines)), "to": to, "on": dice.choice(outside), "speed": speed}
    return Ask(round(dice.uniform(0.0, lasts * 0.8), 3), task, params, dice.choice((None, None, None, "high", "low")))


def _of_the_yard(dice: Random, lasts: float, machines: list[str]) -> Deed:
    """People carry a machine beside the lanes, or its charge fails."""
    at, rover = round(dice.uniform(2.0, lasts - 5.0), 3), dice.choice(machines)
    if dice.random() < 0.7:
        return Deed(at, "beside", rover, much=float(dice.randrange(len(BESIDE))))
    return Deed(at, "battery", rover, much=dice.choice((18.0, 14.0, 9.0)))
