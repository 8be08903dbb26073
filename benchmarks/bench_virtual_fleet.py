"""Missions a second in virtual time: 1,000 MoveTasks and PickUps on 200 simulated agents, the whole engine, one process.

    python benchmarks/bench_virtual_fleet.py [--tasks 1000] [--profile] [--no-referee]

Prints one line per figure. Exit status 1 if a task was lost or failed, an agent is left assigned, anything crashed, or two
drones came nearer than the gate keeps them: the separation, half of it where one takes off or lands. (Each task has one drone.)
"""

import argparse
import cProfile
import pstats
import resource
import sys
import time
import zlib
from collections import Counter

import msgspec

from agents_sim.referee import Pass, Referee, Verdict
from agents_sim.world import AgentSpec, grid_fleet
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel.inputs import EngineStep, Submit
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.loader import load_catalogue, load_task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.simulation import fleet_site

N_LWD, N_HWD, N_PICKERS, N_WATCHERS = 84, 84, 30, 2
ROUND_S = 420.0
"""A picker is asked for again after so long, and a drone sent home again."""
JUDGE_EVERY_S = 60.0
PATIENCE_S = 3600.0
"""Virtual time after the last request in which everything must have ended."""


def requests(specs: list[AgentSpec], count: int) -> list[tuple[float, Submit]]:
    """Return `count` requests with their times: in each round every picker calls once, and as many light drones go home."""
    pickers = [spec for spec in specs if spec.type == "picker"]
    light = [spec for spec in specs if spec.type == "lwd"]
    found: list[tuple[float, Submit]] = []
    while len(found) < count:
        round_, i = divmod(len(found), len(pickers) + len(light))
        at = ROUND_S * (round_ + i / (len(pickers) + len(light)))
        if i < len(pickers):
            target = pickers[i].at
            assert isinstance(target, Place)
            found.append((at, Submit("PickUp", {"target": target, "user": AgentRef(pickers[i].id)})))
        else:
            found.append((at, Submit("MoveTask", {"robot": AgentRef(light[i - len(pickers)].id)})))
    return found


class Run:
    """The world of one run."""

    def __init__(self, count: int, judged: bool) -> None:
        catalogue, problems, _ = load_catalogue(files("actions"))
        assert not problems, problems
        specs = grid_fleet(N_LWD, N_HWD, N_PICKERS, N_WATCHERS)
        site = self.site = fleet_site(specs)
        loaded = [
            load_task(folder("trees") / f"{name}.yaml", catalogue=catalogue, site=site)
            for name in ("move_task", "pick_up")
        ]
        tasks = [one.task for one in loaded if one.task is not None]
        self.world = Rehearsal(site, catalogue, tasks, specs, keep_steps=False)
        if not judged:
            self.world.referee = Referee()  # the fleet's recorder stays the first one, which is never asked
        self.judged = judged
        self.requests = requests(specs, count)
        self.ids: list[str] = []
        self.steps = 0
        self.digest = 0
        self.world.driver.listeners.append(self._count)

    def _count(self, step: EngineStep) -> None:
        self.steps += 1
        self.digest = zlib.crc32(msgspec.json.encode(step), self.digest)

    def fly(self) -> bool:
        """Fly all; return whether everything ended in time."""
        world = self.world
        world.run_for(1.0)
        zero = world.now

        def submit(request: Submit) -> None:
            reply = world.ask(request)
            assert isinstance(reply, Accepted)
            self.ids.append(reply.task)

        for at, request in self.requests:
            world.scheduler.call_at(zero + round(at * SECOND), lambda request=request: submit(request))
        if self.judged:
            self._judge()
        return world.run_until(
            lambda: len(self.ids) == len(self.requests) and world.ended(), limit_s=self.requests[-1][0] + PATIENCE_S
        )

    def _judge(self) -> None:
        self.world.referee.verdict(self.world.now)  # a little at a time, so that it may forget
        self.world.scheduler.call_at(self.world.now + round(JUDGE_EVERY_S * SECOND), self._judge)

    def verdict(self) -> Verdict:
        return self.world.referee.verdict(self.world.now)


ROUNDING_M = 0.01


def passes(verdict: Verdict, separation_m: float) -> tuple[str, bool]:
    """Return the closest passes in words, and whether one was nearer than the gate allows."""
    near, cruise = verdict.closest_pass, verdict.closest_cruise
    if near is None:
        return "closest pass: none", False
    text = f"closest pass: {_pass(near)}"
    if cruise is not None:
        text += f"; of two neither of which takes off or lands: {_pass(cruise)}"
    too_near = near.distance_m < separation_m / 2 - ROUNDING_M
    too_near = too_near or (cruise is not None and cruise.distance_m < separation_m - ROUNDING_M)
    return f"{text}; least allowed: {separation_m / 2:g} m and {separation_m:g} m", too_near


def _pass(near: Pass) -> str:
    return f"{near.distance_m:.1f} m ({near.a}, {near.b})"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--profile", action="store_true", help="print where the time goes (and be slower)")
    parser.add_argument("--no-referee", action="store_true")
    options = parser.parse_args()
    run = Run(options.tasks, not options.no_referee)
    profile = cProfile.Profile() if options.profile else None
    began, cpu_began = time.perf_counter(), time.process_time()
    if profile is not None:
        profile.enable()
    in_time = run.fly()
    if profile is not None:
        profile.disable()
    wall_s, cpu_s = time.perf_counter() - began, time.process_time() - cpu_began
    verdict = run.verdict()
    state = run.world.engine.state
    # A task that is gone from the state has ended and was forgotten; one that is there must have ended.
    outcomes = Counter(state.tasks[t].status if t in state.tasks else "forgotten" for t in run.ids)
    lost = (
        sum(t in state.tasks and state.tasks[t].section != "done" for t in run.ids) + len(run.requests) - len(run.ids)
    )
    assigned = [agent.id for agent in state.agents.values() if agent.task and not agent.human]
    crashes = len(verdict.crashes) + len(verdict.unsafe_starts) + len(verdict.low_flights)
    virtual_s = (run.world.now - 1_000_000 * SECOND) / SECOND
    print(f"agents: {len(state.agents)}, tasks: {len(run.ids)}, ended in time: {in_time}")
    print(f"outcomes: {dict(outcomes)}")
    print(
        f"wall: {wall_s:.2f} s for {virtual_s:.0f} s of virtual time, {run.steps} steps, {run.steps / wall_s:.0f} a second"
    )
    print(f"missions a second: {len(run.ids) / wall_s:.1f}; of processor time: {len(run.ids) / cpu_s:.1f}")
    print(f"tasks lost: {lost}, agents left assigned: {len(assigned)}, crashes: {crashes}")
    near, too_near = passes(verdict, run.site.separation_m)
    print(near)
    print(f"step log: {run.digest:08x}")
    print(f"memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    if profile is not None:
        pstats.Stats(profile).sort_stats("tottime").print_stats(25)
        pstats.Stats(profile).sort_stats("cumulative").print_stats(40)
    return int(
        bool(lost or assigned or crashes or outcomes["FAILED"] or outcomes["CANCELED"] or not in_time or too_near)
    )


if __name__ == "__main__":
    sys.exit(main())
