"""How soon an engine that was killed with 10,000 open tasks asks what became of their goals: `formiga up` to RECONCILE begun.

    python benchmarks/bench_resume.py [--tasks 10000] [--profile] [--folder DIR] [--out FILE]

A journal is made as a running engine makes it: missions with goals in flight, ended without a clean end. Then a process is
started as a user starts it, and its journal is watched from outside: the step `Resumed`, with which RECONCILE begins, bears the
wall time at which it was taken. Processor time is the kernel's: what it takes on a machine that has nothing else to do.
"""

import argparse
import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.peers.ours import BACK, CATALOGUE, PORTION, SITE, START
from benchmarks.peers.trees import mission, task_text
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalEvent

PATIENCE_S = 300.0


def make(beside: Path, tasks: int, away_s: float = 0.0) -> tuple[int, int]:
    """Write a site and the journal of an engine that was killed; return how many goals were in flight, and bytes."""
    for name, text in (("catalogue.yaml", CATALOGUE), ("back.yaml", BACK), ("site.yaml", SITE)):
        (beside / name).write_text(text, encoding="utf-8")
    (beside / "trees").mkdir()
    (beside / "trees" / "peer.yaml").write_text(task_text("mission", mission()), encoding="utf-8")
    world = read_world([beside / "catalogue.yaml"], beside / "site.yaml")
    assert world.site is not None, world.diagnostics
    task = read_task(beside / "trees" / "peer.yaml", world).task
    assert task is not None
    engine = Engine(world.site, world.catalogue, {task.name: task})
    file = beside / ".formiga" / "bench" / "journal.db"
    file.parent.mkdir(parents=True)
    with Journal(file, "bench", durability="normal") as journal:
        journal.take()
        writer = Writer(
            journal, lambda: engine.state, wall=lambda: round((time.time() - away_s) * 1e6), clock=time.monotonic
        )
        writer.begin()
        now, batch = START, list[inp.EngineStep]()

        def give(given: inp.Input) -> inp.EngineStep:
            step = engine.handle(now, given)
            batch.append(step)
            if len(batch) >= 50:
                assert writer.keep(batch).durable
                batch.clear()
            return step

        give(inp.Started(1))
        give(
            inp.AgentSeenInput(
                AgentCard(id="worker_0", type="worker", boot_id="b", actions=("Work",), mobility="people")
            )
        )
        place = Position(0.0, 0.0, 0.0)
        give(
            inp.AgentStatusInput(AgentStatus(id="worker_0", type="worker", boot_id="b", seq=1, stamp=0, position=place))
        )
        n = 0
        while n < tasks:
            for _ in range(min(PORTION, tasks - n)):
                assert isinstance(give(inp.Submit(task.name, {})).reply, Accepted)
                n += 1
            until = now + SECOND
            while (due := engine.next_deadline()) is not None and due[0] <= until:
                now = max(now, due[0])
                give(inp.TimerDue(due[1]))
            now = until
        for number, goal in enumerate(list(engine.state.goals.values())[: tasks // 10]):
            give(inp.GoalEventInput(GoalEvent(goal_id=goal.id, agent="worker_0", state="succeeded", n=number + 2)))
        writer.keep(batch)
        flying = sum(goal.in_flight for goal in engine.state.goals.values())
        assert sum(one.section != "done" for one in engine.state.tasks.values()) == tasks
    return flying, file.stat().st_size


def start(beside: Path, profile: Path | None) -> dict[str, Any]:
    """Start an engine; return seconds until RECONCILE began."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    words = [
        "up",
        "--site",
        "site.yaml",
        "--actions",
        "catalogue.yaml",
        "--tasks",
        "trees/peer.yaml",
        "--http",
        "127.0.0.1:0",
        "--quiet",
    ]
    words += ["--listen", f"tcp/127.0.0.1:{port}"]
    command = [sys.executable, "-m", "formiga_bt", *words]
    if profile is not None:
        command = [sys.executable, "-m", "cProfile", "-o", str(profile), "-m", "formiga_bt", *words]
    before = time.time()
    engine = subprocess.Popen(command, cwd=beside, stdout=subprocess.PIPE, text=True)
    try:
        at, cpu_s = _resumed(beside / ".formiga" / "bench" / "journal.db", engine)
        assert engine.stdout is not None
        banner = [engine.stdout.readline() for _ in range(7)]
        if profile is not None:
            time.sleep(3.0)  # until it takes signals
            engine.send_signal(signal.SIGTERM)
            engine.wait(PATIENCE_S)
    finally:
        engine.kill()
        engine.wait()
    told = [line.strip()[:100] for line in banner if line.lstrip().startswith("resume")]
    return {"wall_s": round(at - before, 2), "cpu_s": round(cpu_s, 2), "told": told}


def _resumed(file: Path, engine: "subprocess.Popen[str]") -> tuple[float, float]:
    end = time.monotonic() + PATIENCE_S
    ticks = os.sysconf("SC_CLK_TCK")
    look = sqlite3.connect(f"file:{file}?mode=ro", uri=True)
    before = _count(look)[0]
    while True:
        assert engine.poll() is None, "it ended"
        assert time.monotonic() < end, "it does not come"
        fields = Path(f"/proc/{engine.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        cpu_s = (int(fields[11]) + int(fields[12])) / ticks
        count, wall = _count(look)
        if count > before:
            look.close()
            return wall / 1e6, cpu_s
        time.sleep(0.02)


def _count(look: sqlite3.Connection) -> tuple[int, int]:
    found = look.execute("SELECT count(*), max(wall_us) FROM formiga_steps WHERE kind = 'Resumed'").fetchone()
    return found[0], found[1] or 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=10_000)
    parser.add_argument(
        "--away-s", type=float, default=0.0, help="so long the engine was away; from 30 s on all tasks wait"
    )
    parser.add_argument("--profile", action="store_true", help="print where the time goes (and be slower)")
    parser.add_argument("--folder", type=Path, default=None, help="on the disk that is to be measured")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        beside = Path(name)
        flying, size = make(beside, options.tasks, options.away_s)
        found: dict[str, Any] = {"tasks": options.tasks, "goals_in_flight": flying, "journal_bytes": size}
        if options.profile:
            import pstats

            start(beside, beside / "profile")
            pstats.Stats(str(beside / "profile")).sort_stats("cumulative").print_stats(60)
            return 0
        found |= start(beside, None) | {"load": os.getloadavg()[0], "cores": os.cpu_count()}
    print(json.dumps(found, indent=1))
    if options.out is not None:
        options.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
