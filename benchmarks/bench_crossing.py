"""Two fleets of 20 drones cross one field for an hour, in opposite directions, again and again: how near do they come?

    python benchmarks/bench_crossing.py [--minutes 60] [--each 20] [--without]

Prints JSON: the closest passes of drones of different tasks that both fly (from their own motion, by the simulator), apart
for cruise legs and for vertical moves at a place; waits and what they were for; the mean mission with separation, and (with
`--without`) what it is with a separation of 0, where passes are no longer kept apart. Exit status 1 if two drones on their
cruise legs came nearer than the separation, or a mission did not end. A mission that waited for a way until its reserve was
near comes home and counts as `leg_busy`.
"""

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from typing import Any

from msgspec.structs import replace

from agents_sim.motion import Segment, closest_approach
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.kernel.changes import GoalPut
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.lang.model import Port, Site, SiteAgent
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.testing import packaged_world, task_of
from formiga_bt.safety.traffic import VERTICAL_M

CROSS = """
imports: [lib/flying.yaml]
params: {robot: {type: agent, of: [hwd]}, to: place}
agents: {drone: {type: hwd, id: "${robot}"}}
timeout: 60 min
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${to}", height: "${drone.transit_height}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
LATEST_US: Micros = 3600 * SECOND
"""After the last mission began, all must have ended within this time."""
WIDE_M, DEEP_M = 30.0, 250.0
"""Ports of a side stand so far apart; the sides face each other over so much field."""


class Track:
    """A recorder of one drone's motion with the task that it flew for."""

    def __init__(self) -> None:
        self.moves: dict[str, list[tuple[Segment, str]]] = {}

    def moved(self, agent: str, segment: Segment, kind: str) -> None:
        moves = self.moves.setdefault(agent, [])
        while moves and moves[-1][0].t0 >= segment.t0:
            moves.pop()
        moves.append((segment, kind))

    def rotors_started(self, *_: Any) -> None:
        """Not looked at."""

    def person_at(self, *_: Any) -> None:
        """Not looked at."""


def field(each: int, separation_m: float) -> tuple[Site, list[AgentSpec]]:
    """Return a site with two rows of ports that face each other, and a drone on each."""
    site, _ = packaged_world()
    ports, agents, specs = {}, {}, []
    for side, north in (("s", -DEEP_M), ("n", DEEP_M)):
        for i in range(each):
            name, at = f"{side}{i + 1}", Place(WIDE_M * (i - (each - 1) / 2), north)
            ports[name] = Port(name, at)
            agents[f"hwd_{name}"] = SiteAgent(f"hwd_{name}", "hwd", name)
            specs.append(
                AgentSpec(id=f"hwd_{name}", type="hwd", at=at, home=at, kind="drone", limits={"charge_percent_s": 5.0})
            )
    return replace(site, ports=ports, agents=agents, people={}, separation_m=separation_m), specs


class Run:
    """An hour of crossing."""

    def __init__(self, each: int, minutes: float, separation_m: float) -> None:
        site, specs = field(each, separation_m)
        _, catalogue = packaged_world()
        self.site, self.each = site, each
        self.track = Track()
        self.waits: Counter[str] = Counter()
        self.hops = 0
        self.missions: dict[str, str] = {}
        self.lasted: list[float] = []
        self.codes: Counter[str] = Counter()
        self.world = Rehearsal(site, catalogue, [task_of(CROSS, site, catalogue, "Cross")], (), keep_steps=False)
        self.world.driver.listeners.append(self._listen)
        self.world.sim._recorder = self.track  # all motion is kept here, and judged at the end
        for spec in specs:
            self.world.sim.add(spec)
        self.owners: dict[str, list[tuple[Micros, str]]] = {}
        self.until = self.world.now + round(minutes * 60 * SECOND)
        self.rounds: Counter[str] = Counter()
        self.lowest_pct = 100.0
        self.not_ended = 0

    def _listen(self, step: EngineStep) -> None:
        for change in step.changes:
            if isinstance(change, GoalPut):
                goal = change.goal
                if goal.state == "gated" and goal.code in ("leg_busy", "spot_busy", "port_busy"):
                    self.waits[f"{goal.id} {goal.code}"] += 1
                if goal.state == "sent" and goal.id.startswith("safety/"):
                    self.hops += 1

    def fly(self) -> None:
        """Keep every drone on a mission until the time is over, then let all come home."""
        world = self.world
        world.run_for(2.0)
        drones = sorted(a for a in world.engine.state.agents)
        while True:
            self.lowest_pct = min(self.lowest_pct, *(a.battery or 100.0 for a in world.engine.state.agents.values()))
            for drone in drones:
                task = self.missions.get(drone, "")
                if task and not world.ended(task):
                    continue
                if task:
                    self._ended(task)
                    self.missions[drone] = ""
                if world.now < self.until and self._ready(drone):
                    self.missions[drone] = world.submit("Cross", {"robot": AgentRef(drone), "to": self._target(drone)})
                    self.owners.setdefault(drone, []).append((world.now, self.missions[drone]))
            if world.now >= self.until and (not any(self.missions.values()) or world.now >= self.until + LATEST_US):
                self.not_ended = sum(map(bool, self.missions.values()))
                return
            world.run_for(5.0)

    def _ready(self, drone: str) -> bool:
        agent = self.world.engine.state.agents[drone]
        return agent.pool == "STANDBY" and (agent.battery or 0.0) >= 60.0

    def _target(self, drone: str) -> Place:
        """Return a spot on the other side that is nobody's but its own, another each round, so that ways cross at an angle."""
        side, number = drone[4], int(drone[5:]) - 1
        self.rounds[drone] += 1
        to = (number + (self.rounds[drone] * 3) % 7 - 3) % self.each
        north = (DEEP_M - 60.0) * (1 if side == "s" else -1)
        return Place(WIDE_M * (to - (self.each - 1) / 2), north)

    def _ended(self, task_id: str) -> None:
        task = self.world.task(task_id)
        self.codes[task.outcome.code or task.status] += 1
        if task.status == "SUCCEEDED" and task.times.ended_at is not None and task.times.active_at is not None:
            self.lasted.append((task.times.ended_at - task.times.active_at) / SECOND)

    def passes(self) -> Iterator[tuple[float, Micros, str, str, bool]]:
        """Give each near pass in flight: metres, when, who, whether both were on a cruise leg."""
        for a, b in combinations(sorted(self.track.moves), 2):
            yield from self._pair(a, b)

    def _pair(self, a: str, b: str) -> Iterator[tuple[float, Micros, str, str, bool]]:
        mine, theirs = self.track.moves[a], self.track.moves[b]
        i = j = 0
        while i < len(mine) and j < len(theirs):
            (one, one_kind), (two, two_kind) = mine[i], theirs[j]
            one_ends = mine[i + 1][0].t0 if i + 1 < len(mine) else self.world.now
            two_ends = theirs[j + 1][0].t0 if j + 1 < len(theirs) else self.world.now
            since, until = max(one.t0, two.t0), min(one_ends, two_ends)
            if since < until and "rest" not in (one_kind, two_kind):
                found = closest_approach(one, two, since, until)
                cruises = all(_is_cruise(s, k) for s, k in ((one, one_kind), (two, two_kind)))
                yield found.distance_m, found.at, a, b, cruises
            if one_ends <= two_ends:
                i += 1
            else:
                j += 1


def _is_cruise(segment: Segment, kind: str) -> bool:
    return kind == "hover" or (kind == "cruise" and horizontal_m(segment.p0, segment.p1) > VERTICAL_M)


def report(run: Run) -> dict[str, Any]:
    """Return the figures of a run."""
    closest: dict[bool, tuple[float, Micros, str, str]] = {}
    for metres, at, a, b, cruises in run.passes():
        if cruises not in closest or metres < closest[cruises][0]:
            closest[cruises] = (metres, at, a, b)

    def shown(cruises: bool) -> dict[str, Any] | None:
        if cruises not in closest:
            return None
        metres, at, a, b = closest[cruises]
        return {"metres": round(metres, 2), "at_s": round(at / SECOND - 1e6, 1), "a": a, "b": b}

    goals = Counter(key.rsplit(" ", 1)[1] for key in run.waits)
    return {
        "missions": len(run.lasted),
        "outcomes": dict(run.codes),
        "not_ended": run.not_ended,
        "mean_mission_s": round(sum(run.lasted) / max(1, len(run.lasted)), 1),
        "longest_mission_s": round(max(run.lasted, default=0.0), 1),
        "goals_that_waited": dict(goals),
        "moves_aside": run.hops,
        "lowest_battery_pct": round(run.lowest_pct, 1),
        "closest_cruise_pass": shown(True),
        "closest_vertical_pass": shown(False),
    }


def fly(each: int, minutes: float, separation_m: float) -> dict[str, Any]:
    """Fly and return the figures."""
    began = time.perf_counter()
    run = Run(each, minutes, separation_m)
    run.fly()
    wall_s = round(time.perf_counter() - began, 1)
    return {"separation_m": separation_m, "wall_s": wall_s, **report(run)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--each", type=int, default=20)
    parser.add_argument("--separation", type=float, default=15.0)
    parser.add_argument("--without", action="store_true", help="fly it once more with a separation of 0")
    options = parser.parse_args()
    found = {"with": fly(options.each, options.minutes, options.separation)}
    if options.without:
        found["without"] = fly(options.each, options.minutes, 0.0)
        found["cost_s"] = round(found["with"]["mean_mission_s"] - found["without"]["mean_mission_s"], 1)  # type: ignore[assignment]
    print(json.dumps(found, indent=2))
    cruise = found["with"]["closest_cruise_pass"]
    return int(found["with"]["not_ended"] > 0 or (cruise is not None and cruise["metres"] < options.separation - 0.01))


if __name__ == "__main__":
    sys.exit(main())
