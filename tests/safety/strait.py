"""A strait that one drone at a time may fly through: random flights and faults, judged by where the drones truly are.

The region lies between the ports and the fields, so that every way out and home leads through it. `Strait` shares no rule with
the engine: it reads what was sent, what tasks hold, and the bodies' own positions.

    python -m tests.safety.strait --seeds 0-100
"""

import argparse
import contextlib
import sys
from random import Random
from typing import Any, Final

import shapely
from msgspec.structs import replace

from agents_sim.drone import Drone
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Region
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Resource, Site, SiteAgent, Task
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import packaged_world

RULES: Final = {
    "two": "no more drones are in the region than it has room for",
    "claims": "no more units are held than there are",
    "claim": "no goal of steps leads in whose task holds no unit",
    "let_go": "no task that ends otherwise than well gives a unit back before its machines are home",
    "shut": "no guarded action begins while a drone is in the region, and none comes in while it is under way",
    "hang": "every task ends",
}
NORTH_M: Final = (100.0, 140.0)
CORNERS: Final = ((-500.0, NORTH_M[0]), (500.0, NORTH_M[0]), (500.0, NORTH_M[1]), (-500.0, NORTH_M[1]))
FLEET: Final = (("lwd_1", "lwd", "p1"), ("lwd_2", "lwd", "p2"), ("lwd_3", "lwd", "p3"), ("hwd_1", "hwd", "p5"))
DOOR: Final = "hwd_1"
FIELDS: Final = (Place(20.0, 260.0), Place(-120.0, 240.0), Place(160.0, 280.0))
OVER = "call: FlyTo, with: {{drone: '${{{0}}}', to: '${{to}}', height: {1} m}}"
HOME = "call: ReturnHome, with: {{drone: '${{{0}}}'}}"


def _task(name: str, steps: str, roles: str = "drone: {type: lwd, near: '${to}'}", to: bool = True) -> str:
    params = "params: {to: place}\n" if to else ""
    return f"formiga: 1\ntask: {name}\nimports: [lib/flying.yaml]\n{params}agents: {{{roles}}}\nsteps: [{steps}]\n"


def _flight(role: str, height: int = 40) -> str:
    return f"{{{OVER.format(role, height)}}}, {{wait: 5 s}}, {{{HOME.format(role)}}}"


def _block(name: str, steps: str) -> str:
    return f"{{with_resource: {name}, wait: 20 min, steps: [{steps}]}}"


TEXTS: Final = (
    _task("Bare", _flight("drone")),
    _task("Look", _block("strait", _flight("drone"))),
    _task("Left", _block("strait", _block("mast", _flight("drone")))),
    _task("Right", _block("mast", "{wait: 1 s}, " + _block("strait", _flight("drone")))),
    _task(
        "Pair",
        "{with_resource: strait, wait: 20 min, steps: [{parallel: [{sequence: ["
        + _flight("one") + "]}, {sequence: [" + _flight("two", 60) + "]}]}]}",
        "one: {type: lwd, near: '${to}'}, two: {type: lwd, near: '${to}'}",
    ),
    _task(
        "Shut",
        "{do: door.TakeOff, retry: {attempts: 80, delay: 10 s}}, {wait: 5 s}, {call: ReturnHome, with: {drone: '${door}'}}",
        "door: {type: hwd}",
        to=False,
    ),
)  # fmt: skip


def site_of() -> Site:
    """Return the packaged site with a strait and a mast, and a drone whose start needs the strait to be empty."""
    site, _ = packaged_world()
    region = Region(tuple(Place(*corner) for corner in CORNERS))
    return replace(
        site,
        resources={"strait": Resource("strait", 1, region), "mast": Resource("mast", 1)},
        agents={
            **{name: SiteAgent(name, kind, port) for name, kind, port in FLEET if name != DOOR},
            DOOR: SiteAgent(DOOR, "hwd", "p5", guards={"TakeOff": "strait"}),
            "watcher_1": SiteAgent("watcher_1", "watcher"),
        },
    )


def tasks_of(site: Site) -> tuple[Task, ...]:
    """Return the checked tasks."""
    _, catalogue = packaged_world()
    found = []
    for text in TEXTS:
        loaded = load_task_text(text, "strait.yaml", catalogue=catalogue, site=site)
        assert loaded.task is not None, [str(d) for d in loaded.diagnostics]
        found.append(loaded.task)
    return tuple(found)


class Strait:
    """One run of a seed."""

    def __init__(self, seed: int) -> None:
        self.dice = Random(seed)
        self.site = site_of()
        _, catalogue = packaged_world()
        self.world = Rehearsal(self.site, catalogue, tasks_of(self.site), (), seed=seed, status_every_us=SECOND)
        self.region = shapely.Polygon(CORNERS)
        self.broken: dict[str, str] = {}
        self.held: dict[str, dict[str, int]] = {}
        self.world.driver.listeners.append(self.step)
        for name, kind, port in FLEET:
            self.world.sim.add(AgentSpec(id=name, type=kind, at=self.site.ports[port].at))
        self.world.sim.add(AgentSpec(id="watcher_1", type="watcher", at=Place(0.0, 0.0)))
        self.begin = self.world.now

    # -- judging -------------------------------------------------------------------------------------------------------
    def tell(self, rule: str, text: str) -> None:
        """Note a violation, the first of each rule."""
        assert rule in RULES
        self.broken.setdefault(rule, f"{(self.world.now - self.begin) / SECOND:.1f} s {rule}: {text}")

    def inside(self, slack_m: float = 0.0) -> list[str]:
        """Return the drones that are truly in the region, so far from its border."""
        found = []
        for name, _, _ in FLEET:
            body = self.world.sim[name].body
            assert isinstance(body, Drone)
            at = body.position()
            if self.region.buffer(-slack_m).covers(shapely.Point(at.east_m, at.north_m)):
                found.append(name)
        return found

    def step(self, step: inp.EngineStep) -> None:
        """Judge one step of the engine."""
        state = self.world.engine.state
        inside = self.inside()
        if len(inside) > 1:
            self.tell("two", ", ".join(inside))
        door = state.goals.get(state.agents[DOOR].goal) if DOOR in state.agents else None
        units = {task.id: task.resources.units for task in state.tasks.values() if not task.ended}
        for name, resource in self.site.resources.items():
            if sum(held.get(name, 0) for held in units.values()) > resource.capacity:
                self.tell("claims", f"{name}: {units}")
        for task_id, before in self.held.items():
            task = state.tasks[task_id]
            if (
                task.outcome.status in ("FAILED", "CANCELED")
                and not task.ended
                and sum(task.resources.units.values()) < sum(before.values())
            ):
                self.tell("let_go", f"{task_id} in {task.section}")
        self.held = units
        for effect in step.effects:
            if not isinstance(effect, inp.SendGoal):
                continue
            goal = state.goals.get(effect.goal_id)
            if effect.agent == DOOR and effect.action == "TakeOff" and inside:
                self.tell("shut", f"{', '.join(inside)} inside")
            if goal is None or goal.leg is None:
                continue
            way = shapely.LineString([(p.east_m, p.north_m) for p in goal.leg])
            leads_in = way.intersects(self.region) and effect.agent not in inside
            if leads_in and goal.section == "steps" and "strait" not in units.get(goal.task, {}):
                self.tell("claim", f"{effect.agent} of {goal.task}")
            if leads_in and door is not None and door.in_flight and door.action == "TakeOff" and goal.agent != DOOR:
                self.tell("shut", f"{effect.agent} is sent in while {DOOR} starts")

    # -- playing -------------------------------------------------------------------------------------------------------
    def play(self) -> "Strait":
        """Play flights and faults, then calm, and see that everything ends."""
        world, dice = self.world, self.dice
        world.run_for(1)
        for _ in range(dice.randint(3, 6)):
            self._at(
                dice.uniform(0, 200),
                self.submit,
                dice.choice(("Look", "Look", "Left", "Right", "Pair", "Shut")),
                dice.choice(FIELDS),
            )
        for _ in range(dice.randint(0, 4)):
            self._fault(dice.uniform(20, 400))
        world.run_for(500)
        if not world.run_until_ended(limit_s=4000):
            self.tell(
                "hang", ", ".join(f"{task} {world.engine.state.tasks[task].status}" for task in world.engine.open_tasks)
            )
        if any(one.outcome.code == "resource_timeout" for one in world.engine.state.tasks.values()):
            self.tell("hang", "a block waited 20 min")
        world.close()
        return self

    def _at(self, seconds: float, do: Any, *args: Any) -> None:
        at: Micros = self.begin + round(seconds * SECOND)
        self.world.scheduler.call_at(at, lambda: do(*args))

    def submit(self, name: str, to: Place) -> None:
        """Ask for a task."""
        with contextlib.suppress(TaskError):
            self.world.ask(inp.Submit(name, {} if name == "Shut" else {"to": to}, None, "watcher_1"))

    def abort(self, number: int) -> None:
        """Abort an open task."""
        still_open = list(self.world.engine.open_tasks)
        if still_open:
            with contextlib.suppress(TaskError):
                self.world.ask(
                    inp.Abort(still_open[number % len(still_open)], self.dice.choice(("", "now")), "watcher_1")
                )

    def _fault(self, at: float) -> None:
        sim, agent = self.world.sim, self.dice.choice(FLEET)[0]
        match self.dice.choice(("abort", "abort", "freeze", "mute", "kill")):
            case "abort":
                self._at(at, self.abort, self.dice.randint(0, 9))
            case "freeze":
                self._at(at, sim.freeze, agent)
                self._at(at + self.dice.choice((10.0, 60.0, 90.0)), sim.thaw, agent)
            case "mute":
                self._at(at, sim.never_confirm_cancel, agent)
                self._at(at + 1, self.abort, self.dice.randint(0, 9))
                self._at(at + 60, sim.never_confirm_cancel, agent, False)
            case _:
                self._at(at, sim.kill, agent)
                self._at(at + 20, sim.restart, agent)
                self._at(at + 60, self._clear, agent)

    def _clear(self, agent: str) -> None:
        with contextlib.suppress(TaskError):
            self.world.ask(inp.Operator("clear", agent, "watcher_1"))


def run(seed: int) -> dict[str, str]:
    """Play a seed; return the first violation of each rule."""
    return Strait(seed).play().broken


def main() -> int:
    """Play seeds from the command line."""
    parser = argparse.ArgumentParser(description="Flights through a strait for one, under faults.")
    parser.add_argument("--seeds", default="0-50", help="first-last (last excluded)")
    first, _, last = parser.parse_args().seeds.partition("-")
    bad = 0
    for seed in range(int(first), int(last)):
        found = run(seed)
        bad += bool(found)
        if found:
            print(f"seed {seed}: {found}", flush=True)
    print(f"{int(last) - int(first)} runs, {bad} not clean")
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
