"""Many rovers on a grid of routes in virtual time: each drives from one bay to the next, for ever; a referee watches.

The world of `tests/missions/test_route_traffic.py` and `benchmarks/bench_routes.py`.
"""

import random
from collections.abc import Sequence
from functools import cache
from typing import Any

from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.base.packaged import files
from formiga_bt.base.routes import RouteEdge, RouteNode, Routes
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.site import load_site_text
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.bodies import kind_of
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import task_of

STEP_M = 10.0
BAY_M = 3.0
GO = """
params: {rover: {type: agent, of: [rover]}, to: place}
agents: {it: {type: rover, id: "${rover}"}}
steps:
  - do: it.Drive
    with: {to: "${to}"}
"""
SITE = "formiga_site: 1\nname: hall\nbase: {lat: 66.5, lng: 25.7}\nactions: [base, ground]\n"


@cache
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue(files("actions"))
    assert not [one for one in problems if one.severity == "error"], problems
    return found


def grid(columns: int, rows: int, bays: int, *, one_way: bool = True) -> Routes:
    """Return lanes in a grid, and so many bays beside them, two in a cell: each leads to one crossing only.

    Lanes are one-way, in turns east and west, south and north; with even numbers of them each crossing can be reached.
    """
    nodes, edges = {}, []
    for row in range(rows):
        for column in range(columns):
            name = f"n{column}_{row}"
            nodes[name] = RouteNode(name, Place(column * STEP_M, row * STEP_M))
            if column:
                ends = f"n{column - 1}_{row}", name
                edges.append(RouteEdge(*(ends if row % 2 == 0 else ends[::-1]), one_way=one_way))
            if row:
                ends = f"n{column}_{row - 1}", name
                edges.append(RouteEdge(*(ends if column % 2 else ends[::-1]), one_way=one_way))
    cells = [(c, r, low) for low in (True, False) for r in range(rows - 1) for c in range(columns - 1)]
    assert bays <= len(cells), f"{bays} bays, room for {len(cells)}"
    for column, row, low in cells[:bays]:
        at = f"n{column}_{row}" if low else f"n{column + 1}_{row + 1}"
        off = BAY_M if low else -BAY_M
        here = nodes[at].at
        name = f"b{column}_{row}{'' if low else 'u'}"
        nodes[name] = RouteNode(name, Place(here.east_m + off, here.north_m + off), is_end=True)
        edges.append(RouteEdge(at, name))
    return Routes(nodes, tuple(edges))


class Traffic(Rehearsal):
    """Rovers that never rest.

    Args:
        routes: of the site; None: they drive straight ways.
        bays: where they drive to.
        rovers: how many.
        seed: of where they go.
    """

    def __init__(self, site: Site, bays: Sequence[Place], rovers: int, seed: int, **options: Any) -> None:
        kinds = catalogue()
        specs = [
            AgentSpec(
                id=f"r{n}", type="rover", at=bays[n], does=kind_of(kinds, "rover"), seed=seed,
                limits={"drive_drain_pct_s": 0.0},
            )
            for n in range(rovers)
        ]  # fmt: skip
        self.done = 0
        self.random = random.Random(seed)
        self.bays = list(bays)
        self.goes = {f"r{n}": n for n in range(rovers)}
        """Rover -> the bay that it stands in, or is to come to."""
        self.tasks: dict[str, str] = {}
        self.failed: list[tuple[str, str]] = []
        super().__init__(site, kinds, [task_of(GO, site, kinds, "Go")], specs, keep_steps=False, **options)
        self.driver.listeners.append(self._hear)
        self.run_for(1.0)

    def begin(self) -> None:
        """Send all of them out."""
        for rover in self.goes:
            self._next(rover)

    def _next(self, rover: str) -> None:
        taken = set(self.goes.values())
        bay = self.random.choice([n for n in range(len(self.bays)) if n not in taken])
        if self.random.random() < 0.5:  # also where another one stands, or comes to: it will leave
            other = self.random.choice(list(self.goes))
            if other != rover:
                bay, self.goes[other] = self.goes[other], self.goes[other]
        self.goes[rover] = bay
        task = self.submit("Go", {"rover": AgentRef(rover), "to": self.bays[bay]})
        self.tasks[task] = rover

    def _hear(self, step: EngineStep) -> None:
        for change in step.changes:
            task = getattr(change, "task", None)
            if getattr(task, "section", "") == "done" and task.id in self.tasks:
                rover = self.tasks.pop(task.id)
                self.done += task.status == "SUCCEEDED"
                if task.status != "SUCCEEDED":
                    self.failed.append((task.outcome.code, task.outcome.reason))
                self.scheduler.call_at(self.now, lambda rover=rover: self._next(rover))

    def run_judged(self, seconds: float) -> None:
        """Let it run; the referee judges a minute at a time, so that it may forget."""
        end = self.now + round(seconds * SECOND)
        while self.now < end:
            self.run_for(min(60.0, (end - self.now) / SECOND))
            self.referee.verdict(self.now)


def traffic(
    columns: int, rows: int, bays: int, rovers: int, *, seed: int = 0, straight: bool = False, one_way: bool = True
) -> Traffic:
    """Return the rovers of a grid in their bays; `straight`: the same bays without routes."""
    site, problems, _ = load_site_text(SITE, "site.yaml", catalogue())
    assert site is not None, problems
    routes = grid(columns, rows, bays, one_way=one_way)
    ends = [node.at for node in routes.nodes.values() if node.is_end]
    random.Random(seed).shuffle(ends)
    return Traffic(site if straight else replace(site, routes=routes), ends, rovers, seed)
