"""What the journal costs an engine: missions a second with and without it, and how soon a result leads to the next goal.

    python benchmarks/bench_journal_engine.py [--missions 200] [--tasks 10000] [--folder DIR] [--out FILE]

**Missions.** PickUps from request to end on 200 agents in virtual time: without a journal, with `normal`, with `full`, in
turns, in one run. Effects leave only after their steps are durable. Steps are grouped as the real driver groups them, for at
most 10 ms, and while the disk is waited for the engine goes on. Virtual time runs much faster than the clock (the engine works
as fast as it can), so the 10 ms are those of the clock: `--speed` virtual seconds are done in one. `--speed 1` groups by 10 ms
of virtual time, in which hardly two steps come: then nearly each effect is a commit of its own. The steps of all ways are the
same, which is looked at, and the journal's fold is the engine's state. `share`: of the missions a second without a journal;
`share_cpu`: the same of processor time, on a machine that has other things to do; `commit_ms`: how long the disk took.

Agents report each two seconds. (More often: the engine has more to do of which the journal keeps nothing. Less often: they are
taken for silent after three seconds, and not any more with the next report, and all of that is kept.)

**Reaction.** The real driver in its thread, a wire in this process, so many tasks active: from a goal's result handed in to the
next goal handed to the wire. By the clock, with threads that take turns as in `formiga up`, once all tasks have begun and
the first snapshot is written. `snapshots`: how many were written meanwhile; `p99_beside_us`: of the reactions while one was.
"""

import argparse
import gc
import json
import os
import sys
import tempfile
import threading
import time
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from agents_sim.referee import Referee
from agents_sim.world import AgentSpec, grid_fleet
from benchmarks.bench_reaction import figures
from benchmarks.peers.ours import OurFleet
from benchmarks.peers.trees import mission, task_text
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.packaged import files, folder
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.engine.drivers.persist import Ahead, Outcome
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.journal.database import Durability
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from formiga_bt.lang.loader import load_catalogue, load_task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.simulation import fleet_site
from formiga_bt.services.thread_switching import short_turns
from formiga_bt.transport import messages as msg

N_HWD, N_PICKERS, N_WATCHERS = 110, 88, 2
ROUND_S = 400.0
"""A picker asks again after so long."""
STATUS_US = 2 * SECOND
GROUP_US = 10_000
WAYS: tuple[Durability | None, ...] = (None, "normal", "full")


class Grouped(VirtualDriver):
    """A virtual driver that keeps steps in groups, as `RealtimeDriver` does: while the disk is waited for, the engine goes on.

    Effects of a group leave, and listeners are told, when it is durable: at the latest when the next group ends.
    """

    group_us: Micros = GROUP_US
    ahead: Ahead[list[inp.EngineStep]] | None = None

    def _handle(self, now: Micros, given: inp.Input) -> inp.EngineStep:
        step = self.engine.handle(now, given)
        for change in step.changes:
            if isinstance(change, ch.WallTimerSet):
                self._set_wall(change.timer, change.after_us)
        group: list[inp.EngineStep] = self.__dict__.setdefault("group", [])
        if not group:
            self.scheduler.call_at(self.scheduler.now() + self.group_us, self.group_ends)
        group.append(step)
        return step

    def group_ends(self) -> None:
        group: list[inp.EngineStep] = self.__dict__.pop("group")
        if self.ahead is not None:
            self.settle()
            self.ahead.begin(group, group)
        # All ways have the same delay, so that the worlds are the same.
        self.scheduler.call_at(self.scheduler.now() + self.group_us, partial(self._leave, group))

    def settle(self) -> None:
        """Wait for what is being committed."""
        if self.ahead is not None and self.ahead.is_under_way:
            _, kept = self.ahead.end()
            assert isinstance(kept, Outcome), kept
            assert kept.durable, kept

    def _leave(self, group: list[inp.EngineStep]) -> None:
        self.settle()
        for step in group:
            for listener in self.listeners:
                listener(step)
            for effect in step.effects:
                failed = self.switchboard.carry_out(effect, self._beat)
                if failed is not None:
                    self.scheduler.call_at(self.scheduler.now() + 1, partial(self._feed, failed))


class Timed:
    """Notes how long commits take."""

    def __init__(self, writer: Writer, took_s: list[float]) -> None:
        self.start, self.finish, self.keep = writer.start, writer.finish, writer.keep
        self._writer, self._took_s = writer, took_s

    def commit(self) -> None:
        began = time.perf_counter()
        self._writer.commit()
        self._took_s.append(time.perf_counter() - began)


class Fleet:
    """200 agents that fly PickUps."""

    def __init__(self, missions: int, group_us: Micros) -> None:
        catalogue, problems, _ = load_catalogue(files("actions"))
        assert not problems, problems
        specs = grid_fleet(0, N_HWD, N_PICKERS, N_WATCHERS)
        site = fleet_site(specs)
        task = load_task(folder("trees") / "pick_up.yaml", catalogue=catalogue, site=site).task
        assert task is not None
        self.world = Rehearsal(site, catalogue, [task], specs, keep_steps=False, status_every_us=STATUS_US)
        self.world.referee = Referee()
        self.world.driver.__class__ = Grouped
        self.driver: Any = self.world.driver
        self.driver.group_us = group_us
        self.pickers = [spec for spec in specs if spec.type == "picker"]
        self.missions, self.ids = missions, list[str]()
        self.commits_s: list[float] = []
        self.steps = self.digest = 0
        self.world.run_for(2.0)

    def attach(self, journal: Journal) -> Writer:
        """Keep what it does from now on."""
        state = self.world.engine.state
        writer = Writer(journal, lambda: state, wall=lambda: time.time_ns() // 1000, clock=time.monotonic, beside=True)
        writer.begin()
        self.driver.ahead = Ahead(Timed(writer, self.commits_s))
        return writer

    def count(self) -> None:
        """Note each step from now on, so that two flights can be compared."""
        self.world.driver.listeners.append(self._count)

    def _count(self, step: inp.EngineStep) -> None:
        self.steps += 1
        self.digest = zlib.crc32(b"%d %d %d" % (step.at, len(step.changes), len(step.effects)), self.digest)

    def fly(self) -> None:
        """Fly all missions."""
        world = self.world
        for n in range(self.missions):
            at = world.now + round(n * ROUND_S / len(self.pickers) * SECOND)
            world.scheduler.call_at(at, partial(self._ask, self.pickers[n % len(self.pickers)]))
        ended = world.run_until(lambda: len(self.ids) == self.missions and world.ended(), limit_s=100_000)
        assert ended, "not all missions ended"

    def _ask(self, picker: AgentSpec) -> None:
        assert isinstance(picker.at, Place)
        self.ids.append(self.world.submit("PickUp", {"target": picker.at, "user": AgentRef(picker.id)}))


def fly(way: Durability | None, missions: int, group_us: Micros, path: Path, profile: Any = None) -> dict[str, Any]:
    """Fly so many missions one way; return what it took."""
    fleet = Fleet(missions, group_us)
    fleet.count()
    journal = writer = None
    file = path / f"{way}.db"
    if way is not None:
        journal = Journal(file, "bench", durability=way)
        journal.take()
        writer = fleet.attach(journal)
    gc.collect()
    virtual, began, cpu = fleet.world.now, time.perf_counter(), time.process_time()
    if profile is not None:
        profile.enable()
    fleet.fly()
    if profile is not None:
        profile.disable()
    took, cpu_s = time.perf_counter() - began, time.process_time() - cpu
    found = {"wall_s": took, "cpu_s": cpu_s, "steps": fleet.steps, "digest": fleet.digest}
    found["speed"] = (fleet.world.now - virtual) / SECOND / took
    if journal is not None and writer is not None:
        state = fleet.world.engine.state
        if fleet.driver.__dict__.get("group"):
            fleet.driver.group_ends()
        fleet.driver.settle()
        writer.end()
        found |= {"commits": writer.commits, "kept": writer.kept, "bytes": file.stat().st_size}
        commits = sorted(fleet.commits_s)
        found["commit_ms"] = [round(1000 * commits[len(commits) * part // 100], 2) for part in (50, 90, 99)]
        found["fold_is_state"] = same(Past(journal).state(), writer.view(state))
        journal.close()
        for one in path.glob(f"{way}.db*"):
            one.unlink()
    return found


def same(folded: EngineState, live: EngineState) -> bool:
    """Return whether two states are equal, explanations of who waits for nothing left out."""
    for state in (folded, live):
        state.explanations = {task: why for task, why in state.explanations.items() if task in state.requests}
    return snapshot(folded) == snapshot(live)


def missions_of(missions: int, rounds: int, group_us: Micros, path: Path) -> dict[str, Any]:
    """Fly all ways in turns; return the best of each, and ratios."""
    flown: dict[str, list[dict[str, Any]]] = {str(way): [] for way in WAYS}
    for _ in range(rounds):
        for way in WAYS:
            flown[str(way)].append(fly(way, missions, group_us, path))
    assert len({(one["steps"], one["digest"]) for turns in flown.values() for one in turns}) == 1, "they differ"
    best = {way: min(turns, key=lambda one: one["wall_s"]) for way, turns in flown.items()}
    bare = best["None"]
    return {
        "missions": missions,
        "agents": N_HWD + N_PICKERS + N_WATCHERS,
        "group_virtual_ms": group_us / 1000,
        "speed_without_journal": round(bare["speed"], 1),
        "steps": bare["steps"],
        "ways": {
            ("none" if way == "None" else way): {
                "missions_per_s": round(missions / one["wall_s"], 1),
                "share": round(bare["wall_s"] / one["wall_s"], 3),
                "share_cpu": round(bare["cpu_s"] / one["cpu_s"], 3),
                **{key: one[key] for key in ("commits", "commit_ms", "kept", "bytes", "fold_is_state") if key in one},
            }
            for way, one in best.items()
        },
    }


# -- reaction --------------------------------------------------------------------------------------------------------------
class Wire:
    """A wire in this process with one worker: notes when goals come."""

    name = "bench"
    guarantees = GUARANTEES

    def __init__(self) -> None:
        self.events: list[msg.TransportEvent] = []
        self.goals: list[msg.GoalRequest] = []
        self.came = threading.Event()
        self.at = 0.0
        self.lock = threading.Lock()
        self.wake: Callable[[], None] = lambda: None

    def open(self, wake: Callable[[], None]) -> None:
        self.wake = wake

    def close(self) -> None:
        pass

    def tell(self, event: msg.TransportEvent) -> None:
        with self.lock:
            self.events.append(event)
        self.wake()

    def poll(self) -> Sequence[msg.TransportEvent]:
        with self.lock:
            events, self.events = self.events, []
        return events

    def send_goal(self, request: msg.GoalRequest) -> None:
        self.at = time.perf_counter()
        self.goals.append(request)
        self.came.set()

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        pass

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        pass

    def publish_clock(self, beat: msg.ClockBeat) -> None:
        pass


class Beside:
    """Notes when snapshots are written beside the engine."""

    def __init__(self, journal: Journal) -> None:
        self.spans: list[tuple[float, float]] = []
        self.began: float | None = None
        self._write = journal.snapshot_beside
        journal.snapshot_beside = self._timed  # type: ignore[method-assign]

    def _timed(self, *args: Any) -> None:
        self.began = time.perf_counter()
        try:
            self._write(*args)
        finally:
            self.spans.append((self.began, time.perf_counter()))
            self.began = None

    def settle(self) -> None:
        """Wait until none was written for a second."""
        while self.began is not None or (self.spans and time.perf_counter() - self.spans[-1][1] < 1.0):
            time.sleep(0.05)

    def figures(self, began: Sequence[float], took: Sequence[float]) -> dict[str, Any]:
        """Return how many there were since the first of these moments, and the reactions beside them."""
        spans = [(a, z) for a, z in self.spans if z > began[0]]
        if self.began is not None:
            spans.append((self.began, time.perf_counter()))
        beside = [t for b, t in zip(began, took, strict=True) if any(a < b + t and b < z for a, z in spans)]
        found: dict[str, Any] = {"snapshots": len(spans), "reactions_beside": len(beside)}
        if beside:
            found |= {f"{name.removesuffix('_us')}_beside_us": value for name, value in figures(beside).items()}
        return found


def reaction(way: Durability | None, tasks: int, goals: int, path: Path, gap_s: float) -> dict[str, Any]:
    """Hand in results one by one; return how long the next goal took."""
    # Engine time goes on from the time of day: begun earlier, all actions would have run out of their time.
    fleet = OurFleet(task_text("mission", mission()), tasks, time.time_ns() // 1000)
    wire, journal, writer, beside = Wire(), None, None, None
    engine = fleet.engine
    if way is not None:
        journal = Journal(path / f"reaction_{way}.db", "bench", durability=way)
        journal.take()
        beside = Beside(journal)
        writer = Writer(
            journal, lambda: engine.state, wall=lambda: time.time_ns() // 1000, clock=time.monotonic, beside=True,
        )  # fmt: skip
        writer.begin()
    driver = RealtimeDriver(engine, [wire], persist=writer, start_at=fleet.now)
    open_goals = [goal for task in fleet.ids[:2000] for goal in fleet.goals[task].values()]
    gc.collect()
    gc.freeze()
    driver.start()
    wire.tell(
        msg.AgentSeen(msg.AgentCard(id="worker_0", type="worker", boot_id="b", actions=("Work",), mobility="people"))
    )
    status = msg.AgentStatus(
        id="worker_0", type="worker", boot_id="b", seq=2, stamp=0, position=Position(0.0, 0.0, 0.0)
    )
    wire.tell(msg.StatusArrived(status))
    time.sleep(2.0)
    if beside is not None:
        beside.settle()
        wire.tell(msg.StatusArrived(replace(status, seq=3)))  # it was silent meanwhile
        time.sleep(0.5)
    starts, took = list[float](), list[float]()
    try:
        told = time.perf_counter()
        for n in range(goals):
            if time.perf_counter() - told > 1.0:
                told, status = time.perf_counter(), replace(status, seq=status.seq + 10)
                wire.tell(msg.StatusArrived(status))
            goal = open_goals[n % len(open_goals)]
            wire.came.clear()
            event = msg.GoalEvent(goal_id=goal, agent="worker_0", state="succeeded", n=fleet.n + n + 1)
            began = time.perf_counter()
            wire.tell(msg.GoalReported(event))
            assert wire.came.wait(20.0), f"no goal after result {n}: {driver.error}"
            starts.append(began)
            took.append(wire.at - began)
            open_goals[n % len(open_goals)] = wire.goals[-1].goal_id
            time.sleep(gap_s)
    finally:
        driver.stop()
        gc.unfreeze()
        if writer is not None and journal is not None:
            writer.end()
            journal.close()
    more = beside.figures(starts, took) if beside is not None else {}
    return {**figures(took), "worst_us": round(max(took) * 1e6, 1), **more}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--speed", type=float, default=100.0, help="virtual seconds that are done in one")
    parser.add_argument(
        "--tasks", type=int, default=10_000, help="active in the engine whose reaction is measured; 0 = not"
    )
    parser.add_argument("--goals", type=int, default=1000)
    parser.add_argument("--gap-ms", type=float, default=1.0, help="between a goal and the next result")
    parser.add_argument("--folder", type=Path, default=None, help="on the disk that is to be measured")
    parser.add_argument("--profile", choices=("none", "normal", "full"), help="only where the time goes, one way")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    found: dict[str, Any] = {"load": os.getloadavg()[0], "cores": os.cpu_count()}
    group = round(GROUP_US * options.speed)
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        path = Path(name)
        if options.profile:
            import cProfile
            import pstats

            profile = cProfile.Profile()
            fly(None if options.profile == "none" else options.profile, options.missions, group, path, profile)
            pstats.Stats(profile).sort_stats("tottime").print_stats(35)
            return 0
        if options.missions:
            found["missions"] = missions_of(options.missions, options.rounds, group, path)
        if options.tasks:
            with short_turns():
                found["reaction"] = {
                    str(way or "none"): reaction(way, options.tasks, options.goals, path, options.gap_ms / 1000)
                    for way in WAYS
                } | {"tasks": options.tasks, "goals": options.goals}
    print(json.dumps(found, indent=1))
    if options.out is not None:
        options.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    ways = found.get("missions", {}).get("ways", {})
    return int(not all(one.get("fold_is_state", True) for one in ways.values()))


if __name__ == "__main__":
    sys.exit(main())
