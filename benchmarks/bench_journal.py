"""What the journal costs: microseconds a step beside a bare SQLite insert, bytes a day, time to seek.

    python benchmarks/bench_journal.py [--minutes 30] [--folder DIR]

A site of 50 agents that report each second works for half a virtual hour: a mission each ten seconds. All that
it does is kept as `formiga up` keeps it; then its steps are written again, each way, for the time that a step takes.
"""

import argparse
import sqlite3
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from agents_sim.world import AgentSpec, grid_fleet
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel.inputs import EngineStep, Submit
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.journal.database import Durability
from formiga_bt.journal.keep import stats
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer, kind_of, tasks_of
from formiga_bt.lang.loader import load_catalogue, load_task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.rehearsal.simulation import fleet_site

EACH_S = 10.0
"""A mission is requested so often."""
AGAIN: dict[Durability, int] = {"normal": 2000, "full": 300}
"""So many steps are written again."""
BATCH = 10


def site_at_work() -> tuple[Rehearsal, list[AgentSpec]]:
    """Return a site of 50 agents that report each second."""
    catalogue, problems, _ = load_catalogue(files("actions"))
    assert not problems, problems
    specs = grid_fleet(20, 20, 8, 2)
    site = fleet_site(specs)
    read = [
        load_task(folder("trees") / f"{name}.yaml", catalogue=catalogue, site=site) for name in ("move_task", "pick_up")
    ]
    tasks = [one.task for one in read if one.task is not None]
    return Rehearsal(site, catalogue, tasks, specs, keep_steps=False, status_every_us=SECOND), specs


def work(world: Rehearsal, specs: Sequence[AgentSpec], minutes: float) -> None:
    """Request missions for so long."""
    pickers = [spec for spec in specs if spec.type == "picker"]
    light = [spec for spec in specs if spec.type == "lwd"]
    for n in range(int(minutes * 60 / EACH_S)):
        target = pickers[n % len(pickers)]
        assert isinstance(target.at, Place)
        given = Submit("PickUp", {"target": target.at, "user": AgentRef(target.id)})
        if n % 2:
            given = Submit("MoveTask", {"robot": AgentRef(light[n % len(light)].id)})
        world.scheduler.call_at(world.now + round(n * EACH_S * SECOND), lambda given=given: world.driver.feed(given))
    world.run_for(minutes * 60)


def writer_of(journal: Journal, state: EngineState, **options: bool) -> Writer:
    return Writer(journal, lambda: state, wall=lambda: time.time_ns() // 1000, clock=time.monotonic, **options)


def write_again(path: Path, steps: Sequence[EngineStep], durability: Durability, batch: int) -> tuple[float, float]:
    """Return microseconds a step in the journal, and in a bare insert of the same bytes into a table without index."""
    with Journal(path / "again.db", "bench", durability=durability) as journal:
        journal.take()
        writer = writer_of(journal, EngineState(), thin=False)
        writer.begin()
        warm = min(len(steps) // 2, 300)
        writer.keep(steps[:warm])
        some = steps[warm : warm + AGAIN[durability]]
        rows = [(s.seq, s.at, 0, kind_of(s.input), " ".join(tasks_of(s)), journal.codec.encode(s)) for s in some]
        began = time.perf_counter()
        for first in range(0, len(some), batch):
            assert writer.keep(some[first : first + batch]).durable
        mine = time.perf_counter() - began
    bare = sqlite3.connect(path / "bare.db", isolation_level=None)
    for pragma in ("page_size = 8192", "journal_mode = WAL", f"synchronous = {durability.upper()}"):
        bare.execute(f"PRAGMA {pragma}")
    bare.execute("CREATE TABLE steps (seq INTEGER PRIMARY KEY, at, wall, kind, tasks, blob)")
    began = time.perf_counter()
    for first in range(0, len(rows), batch):
        bare.execute("BEGIN IMMEDIATE")
        bare.executemany("INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?)", rows[first : first + batch])
        bare.execute("COMMIT")
    plain = time.perf_counter() - began
    bare.close()
    for name in ("again.db", "bare.db"):
        (path / name).unlink()
    return mine / len(some) * 1e6, plain / len(some) * 1e6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--folder", type=Path, default=None, help="on the disk that is to be measured")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        path = Path(name)
        world, specs = site_at_work()
        journal = Journal(path / "journal.db", "bench", durability="normal")
        journal.take()
        state = world.engine.state
        writer = writer_of(journal, state)
        writer.begin()
        batch: list[EngineStep] = []
        kept_s = busy = looks = 0.0
        all_steps = 0

        def keep(step: EngineStep) -> None:
            nonlocal kept_s, all_steps, busy, looks
            batch.append(step)
            all_steps += 1
            if len(batch) >= BATCH:
                began = time.perf_counter()
                writer.keep(batch)
                kept_s += time.perf_counter() - began
                batch.clear()
                busy += sum(agent.landed == "airborne" for agent in state.agents.values())
                looks += 1

        world.driver.listeners.append(keep)
        began = time.perf_counter()
        work(world, specs, options.minutes)
        whole_s = time.perf_counter() - began
        writer.keep(batch)
        writer.end()
        found = stats(journal)
        days = options.minutes / (24 * 60)
        print(f"{len(specs)} agents, {options.minutes:.0f} virtual minutes, {busy / looks:.0f} in the air on average")
        share, per_step = 100 * found.steps / all_steps, kept_s / all_steps * 1e6
        print(f"engine's steps: {all_steps}; kept: {found.steps} ({share:.1f} %), way points: {found.points}")
        print(f"whole run: {whole_s:.1f} s, of which journal: {kept_s:.2f} s, {per_step:.0f} us a step of the engine")
        step_bytes, point_bytes = found.bytes_steps / found.steps, found.bytes_points / found.points
        print(f"bytes of a kept step: {step_bytes:.0f}; of a way point: {point_bytes:.1f}")
        print(
            f"megabytes a day without tables and indices: steps {found.bytes_steps / days / 1e6:.0f}, "
            f"way points {found.bytes_points / days / 1e6:.0f}, snapshots {found.bytes_snapshots / days / 1e6:.0f}"
        )
        print(f"steps by kind: {found.kinds}")
        steps = [kept.step for kept in journal.read()]
        past = Past(journal)
        first, last = steps[0].at, steps[-1].at
        took = []
        for n in range(1, 21):
            began = time.perf_counter()
            past.state(first + (last - first) * n // 20)
            took.append(time.perf_counter() - began)
        print(f"seek: {sorted(took)[10] * 1e3:.0f} ms median, {max(took) * 1e3:.0f} ms worst of 20")
        same = snapshot(past.state()) == snapshot(writer.view(state))
        journal.close()
        with Journal(path / "empty.db", "bench") as nothing:
            nothing.take()
        size = (path / "journal.db").stat().st_size - (path / "empty.db").stat().st_size
        print(
            f"the file: {size / 1e6:.1f} MB, {size / days / 1e6:.0f} MB a day, {size / found.steps:.0f} bytes a kept step"
        )
        for durability in AGAIN:
            for size_ in (1, BATCH):
                mine, bare = write_again(path, steps, durability, size_)
                print(
                    f"durability {durability}, commits of {size_}: {mine:.0f} us a step ({1e6 / mine:.0f} a second), "
                    f"bare insert {bare:.0f} us, {mine / bare:.1f} times"
                )
    print(f"the journal tells the state at the end: {same}")
    return int(not same)


if __name__ == "__main__":
    sys.exit(main())
