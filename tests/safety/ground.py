"""Random runs of machines on the ground with faults: rovers on routes, a room for one at a time, its door, a no-go region.

    python -m tests.safety.ground --seeds 0-1999              what the monitor finds; exit status 1 if anything
    python -m tests.safety.ground --bug NAME --seeds 0-40     which seeds show a planted bug

The monitor looks at where the bodies truly are, never at what the engine believes.
"""

import argparse
import random
import sys
import time
from collections import Counter
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from msgspec.structs import replace

from agents_sim.machine import Machine
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, horizontal_m, is_within
from formiga_bt.engine.kernel.inputs import Abort, LockdownOrder, Operator
from formiga_bt.lang.compose import compose
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.bodies import kind_of
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import task_of
from formiga_bt.transport.memory import NO_FAULTS, Faults
from tests.missions.route_traffic import grid
from tests.safety.ground_bugs import BUGS

HALL = """
formiga_site: 1
name: hall
base: {lat: 66.5, lng: 25.7}
actions: [base, ground, building]
no_go:
  - [{east: 11.5 m, north: 11.5 m}, {east: 13.5 m, north: 11.5 m}, {east: 13.5 m, north: 13.5 m}, {east: 11.5 m, north: 13.5 m}]
resources:
  room:
    region: [{east: 1.8 m, north: 1.8 m}, {east: 8.2 m, north: 1.8 m}, {east: 8.2 m, north: 8.2 m}, {east: 1.8 m, north: 8.2 m}]
agents:
  door_1: {type: door, at: {east: 5 m, north: 5 m}, guards: {Close: room}}
  r0: {type: rover}
  r1: {type: rover}
  r2: {type: rover}
  r3: {type: rover}
  r4: {type: rover}
"""
HEAD = (
    'params: {rover: {type: agent, of: [rover]}, to: place}\nagents: {it: {type: rover, id: "${rover}", away: true}}\n'
)
GO = HEAD + 'steps: [{do: it.Drive, with: {to: "${to}"}}]\n'
IN = HEAD + 'steps: [{with_resource: room, steps: [{do: it.Drive, with: {to: "${to}"}}, {do: it.Drop}]}]\n'
SHUT = "agents: {door: {type: door, id: door_1}}\nsteps: [{do: door.Close}, {do: door.Open}]\n"
ROVERS, COLUMNS, ROWS, BAYS = 5, 4, 4, 14
FAULTS_S, CALM_S, EVERY_S = 150.0, 40.0, 0.5


@cache
def hall(one_way: bool) -> tuple[Site, Catalogue]:
    with TemporaryDirectory() as name:
        (Path(name) / "site.yaml").write_text(HALL, encoding="utf-8")
        found = compose(Path(name) / "site.yaml")
    assert found.site is not None, found.diagnostics
    routes = grid(COLUMNS, ROWS, BAYS, one_way=one_way)
    # the cell with the no-go region has no bays
    gone = {"b1_1", "b1_1u"}
    nodes = {name: node for name, node in routes.nodes.items() if name not in gone}
    edges = tuple(edge for edge in routes.edges if edge.b not in gone)
    return replace(found.site, routes=replace(routes, nodes=nodes, edges=edges)), found.catalogue


class GroundRun(Rehearsal):
    """One run: what is asked, what goes wrong, and what the monitor sees."""

    def __init__(self, seed: int) -> None:
        self.dice = dice = random.Random(f"ground/{seed}")
        site, kinds = hall(dice.random() < 0.5)
        self.site = site
        self.ends = {name: node.at for name, node in site.routes.nodes.items() if node.is_end}
        region = site.resources["room"].region
        outside = [name for name, at in self.ends.items() if not is_within(at, region)]
        dice.shuffle(outside)
        specs = [
            AgentSpec(id=f"r{n}", type="rover", at=self.ends[outside[n]], does=kind_of(kinds, "rover"), seed=seed)
            for n in range(ROVERS)
        ]
        door = AgentSpec(id="door_1", type="door", at=Place(5.0, 5.0), does=kind_of(kinds, "door"), seed=seed)
        self.found: dict[str, str] = {}
        self.counts: Counter[str] = Counter()
        self.ids: list[str] = [spec.id for spec in specs]
        tasks = [task_of(text, site, kinds, name) for name, text in (("Go", GO), ("In", IN), ("Shut", SHUT))]
        super().__init__(site, kinds, tasks, [*specs, door], seed=seed, keep_steps=False)
        self.run_for(1.0)

    # -- the monitor -------------------------------------------------------------------------------------------------
    def look(self) -> None:
        """Look at where everybody truly is."""
        site, graph = self.site, self.engine.core.route_graph
        assert graph is not None
        spots = {one: self.sim[one].body.position() for one in self.ids}
        room = site.resources["room"].region
        inside = [one for one, at in spots.items() if is_within(at, room)]
        if len(inside) > 1:
            self.tell("two in the room", f"{inside}")
        closing = [goal for goal in self.engine.state.goals.values() if goal.action == "Close" and goal.in_flight]
        if closing and inside and any(goal.state == "running" for goal in closing):
            self.tell("a door closed on a robot", f"{inside}")
        for one, at in spots.items():
            if any(is_within(at, region) for region in site.no_go):
                self.tell("a no-go region entered", f"{one} at {at}")
        on: dict[str, str] = {}
        for one, at in spots.items():
            for name, edge in graph.edges.items():
                ends = (edge.a, edge.b)
                clear = all(horizontal_m(at, graph.nodes[end].at) > graph.clear_m[end] for end in ends)
                if clear and graph.touches(name, at):
                    if name in on:
                        self.tell("two on one edge", f"{one}, {on[name]} on {name}")
                    on[name] = one
        for crash in self.referee.verdict(self.now).crashes:
            self.tell("two touched", f"{crash}")

    def tell(self, what: str, text: str) -> None:
        self.found.setdefault(what, f"{self.now / SECOND - 1_000_000:.1f} s: {text}")

    # -- what happens ------------------------------------------------------------------------------------------------
    def play(self) -> None:
        """Play the run."""
        end = self.now + round(FAULTS_S * SECOND)
        while self.now < end:
            if self.dice.random() < 0.12 and len(self.engine.open_tasks) < 8:
                self._request()
            if self.dice.random() < 0.08:
                self._fault()
            self.run_for(EVERY_S)
            self.look()
        for one in (*self.ids, "door_1"):
            self._settle(one)
        self._order(LockdownOrder("release", by="eve"))
        self._order(Operator("continue", "", "eve"))
        for _ in range(int(CALM_S / EVERY_S)):
            self.run_for(EVERY_S)
            self.look()
        for task in list(self.engine.open_tasks):
            self._order(Abort(task, by="eve"))
        self.run_for(CALM_S)
        self.look()
        self.counts["tasks ended"] = sum(task.ended for task in self.engine.state.tasks.values())
        for task in self.engine.state.tasks.values():
            self.counts[task.outcome.status] += task.ended

    def _order(self, given: Any) -> None:
        try:
            self.ask(given)
        except TaskError:
            self.counts["orders refused"] += 1

    def _request(self) -> None:
        word = self.dice.choice(["Go", "Go", "Go", "In", "Shut"])
        try:
            if word == "Shut":
                self.submit(word)
                return
            room = self.site.resources["room"].region
            ends = [at for at in self.ends.values() if is_within(at, room) == (word == "In")]
            self.submit(word, {"rover": AgentRef(self.dice.choice(self.ids)), "to": self.dice.choice(ends)})
        except TaskError:
            self.counts["requests refused"] += 1

    def _fault(self) -> None:
        who, sim = self.dice.choice(self.ids), self.sim
        what = self.dice.choice(
            ["crash", "freeze", "cut", "pilot", "refuse", "lose", "mute", "wire", "hold", "return", "abort", "lockdown",
             "carry", "carry", "carry", "settle"]
        )  # fmt: skip
        self.counts[what] += 1
        match what:
            case "crash":
                sim.kill(who)
            case "freeze":
                sim.freeze(who)
            case "cut":
                sim.lose_link(who)
            case "pilot":
                sim.take_over(who)
            case "refuse":
                sim.refuse_next(who)
            case "lose":
                sim.lose_next_result(who)
            case "mute":
                sim.never_confirm_cancel(who)
            case "wire":
                self.hub.set_faults(who, Faults(drop=0.2, duplicate=0.2, reorder=0.2, jitter_us=20_000))
            case "hold" | "return":
                self._order(Operator(what, who, "eve"))  # type: ignore[arg-type]
            case "abort":
                still_open = self.engine.open_tasks
                if still_open:
                    self._order(Abort(self.dice.choice(still_open), by="eve"))
            case "lockdown":
                self._order(LockdownOrder(self.dice.choice(["hold", "return", "release"]), by="eve"))  # type: ignore[arg-type]
            case "carry":
                self._carry(who)
            case _:
                for one in self.ids:
                    self._settle(one)
                self._order(LockdownOrder("release", by="eve"))
                self._order(Operator("continue", "", "eve"))

    def _carry(self, who: str) -> None:
        """People put a machine that stands, and that nobody sends anywhere, beside the lanes."""
        body, record = self.sim[who].body, self.engine.state.agents.get(who)
        if not isinstance(body, Machine) or record is None or record.task or record.goal or body.position() is None:
            return
        spot = self.dice.choice([Place(14.2, 14.2), Place(16.0, 26.0)])
        taken = [self.sim[one].body.position() for one in self.ids if one != who]
        if horizontal_m(body.position(), spot) < 29.0 and all(horizontal_m(at, spot) > 6.0 for at in taken):
            body.carry(spot)

    def _settle(self, who: str) -> None:
        sim = self.sim
        for mended in (sim.restart, sim.thaw, sim.mend_link, sim.hand_back):
            if mended != sim.restart or sim[who].side is None:
                mended(who)
        sim.never_confirm_cancel(who, False)
        self.hub.set_faults(who, NO_FAULTS)
        for word in ("clear", "handback_continue"):
            self._order(Operator(word, who, "eve"))  # type: ignore[arg-type]


def play(seed: int, bug: str = "") -> GroundRun:
    """Play a seed, with a planted bug or none."""
    with pytest.MonkeyPatch.context() as patch:
        if bug:
            BUGS[bug](patch)
        run = GroundRun(seed)
        run.play()
    return run


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-19")
    parser.add_argument("--bug", default="", choices=["", *BUGS])
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    bad, counts, began = 0, Counter[str](), time.perf_counter()
    for seed in range(int(first), int(last or first) + 1):
        run = play(seed, options.bug)
        counts += run.counts
        if run.found:
            bad += 1
            print(f"seed {seed}: {run.found}", flush=True)
    print(f"{options.seeds}: {bad} runs with findings, {time.perf_counter() - began:.0f} s; {dict(counts)}")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
