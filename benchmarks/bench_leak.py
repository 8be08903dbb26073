"""Short tasks, one after another for ever: does memory stay flat? Beside it, what short trees leave behind in py_trees.

Each task orders one goal, which succeeds, and ends. The engine keeps its newest 10,000 ended tasks, so slopes are taken after
those: resident memory over all, and Python's own allocations (`tracemalloc`, in a process of its own, since it slows down).

    python benchmarks/bench_leak.py [--tasks 20000] [--traced 12000] [--out FILE]

`--tasks 1000000` takes minutes. Exit status 1 if Python's own allocations grow with the tasks.
"""

import argparse
import gc
import json
import statistics
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.peers.cell import rss_bytes
from benchmarks.peers.ours import OurFleet
from benchmarks.peers.trees import act, sequence, task_text

RESULTS = Path(__file__).parent / "results"
ROOT = Path(__file__).parents[1]
KEPT = 10_000
"""Ended tasks that the engine keeps."""
PORTION = 100
SAMPLES = 20
LIMIT_BYTES = 50.0
"""A slope of more than so many bytes a task is a leak: one entry in a dictionary is more."""


class Short:
    """An engine that is given short tasks."""

    def __init__(self) -> None:
        self.fleet = OurFleet(task_text("short", sequence(act("only"))), 0)

    def do(self, count: int) -> None:
        """Let so many tasks begin and end."""
        fleet = self.fleet
        for first in range(0, count, PORTION):
            new = fleet.submit(min(PORTION, count - first))
            fleet.results(range(len(new)), "only")
            for task in new:
                assert fleet.engine.state.tasks[task].status == "SUCCEEDED", task
            fleet.ids.clear()
            fleet.goals.clear()
            fleet.let(1_000_000)


def growth(
    do: Callable[[int], None], size: Callable[[], int], count: int, warm: int, samples: int = SAMPLES
) -> dict[str, Any]:
    """Return bytes a task, after so many that warm up, and what was sampled.

    `bytes_a_task` is the median of the parts: a dictionary that is made twice as large for a while is a jump, no slope.
    `bytes_in_all` is from the first sample to the last.
    """
    do(warm)
    part = max(1, (count - warm) // samples)
    points = []
    for number in range(samples + 1):
        points.append((number * part, size()))
        if number < samples:
            do(part)
    slopes = [(b - a) / part for (_, a), (_, b) in pairwise(points)]
    return {
        "tasks": warm + part * samples,
        "bytes_a_task": round(statistics.median(slopes), 2),
        "bytes_in_all": round((points[-1][1] - points[0][1]) / (part * samples), 2),
        "samples": points,
    }


def resident_bytes() -> int:
    """Return the resident memory, with nothing left to collect."""
    gc.collect()
    return rss_bytes()


def traced_bytes() -> int:
    """Return what Python has allocated, with nothing left to collect."""
    gc.collect()
    return tracemalloc.get_traced_memory()[0]


def traced(count: int, warm: int) -> dict[str, Any]:
    """Return the growth of Python's own allocations."""
    tracemalloc.start()
    try:
        return growth(Short().do, traced_bytes, count, warm)
    finally:
        tracemalloc.stop()


def py_trees_left(count: int, unregister: bool, samples: int = SAMPLES) -> dict[str, Any]:
    """Return what is left of so many py_trees trees that wrote one key each, ended, and were shut down.

    Args:
        count: of trees.
        unregister: whether their user thinks of taking each blackboard client out.
    """
    import py_trees

    class Writes(py_trees.behaviour.Behaviour):
        def __init__(self, name: str) -> None:
            super().__init__(name)
            self.board = self.attach_blackboard_client(name=name, namespace=name)
            self.board.register_key("done", py_trees.common.Access.WRITE)

        def update(self) -> py_trees.common.Status:
            self.board.done = True
            return py_trees.common.Status.SUCCESS

    made = 0

    def do(more: int) -> None:
        nonlocal made
        for _ in range(more):
            made += 1
            leaf = Writes(f"task_{made}")
            root = py_trees.composites.Sequence("root", memory=True, children=[leaf])
            root.tick_once()
            root.shutdown()
            if unregister:
                leaf.board.unregister(clear=True)

    board = py_trees.blackboard.Blackboard
    registries = {"clients": board.clients, "metadata": board.metadata, "values": board.storage}
    before = {name: len(registry) for name, registry in registries.items()}
    found = growth(do, resident_bytes, count, count // 10, samples)
    found |= {name: len(registry) - before[name] for name, registry in registries.items()}
    for client in [one for one in board.clients if board.clients[one].startswith("task_")]:
        del board.clients[client]
    for keys in (board.metadata, board.storage):
        for key in [one for one in keys if one.startswith("/task_")]:
            del keys[key]
    return found


def apart(*words: str) -> Any:
    """Run a part of this benchmark in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, "--part", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def part(words: list[str]) -> Any:
    """Return what one part found."""
    what, count, warm = words[0], int(words[1]), int(words[2])
    if what == "ours":
        return growth(Short().do, resident_bytes, count, warm)
    if what == "traced":
        return traced(count, warm)
    return py_trees_left(count, what == "unregistered")


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=2 * KEPT)
    parser.add_argument("--traced", type=int, default=KEPT + 2000)
    parser.add_argument("--warm", type=int, default=KEPT + PORTION, help="tasks before the slopes are taken")
    parser.add_argument("--part", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, default=RESULTS / "leak.json")
    options = parser.parse_args()
    if options.part:
        print(json.dumps(part(options.part)))
        return 0
    counts = {"ours": options.tasks, "traced": options.traced}
    short = min(20_000, options.tasks)
    counts |= {"py_trees": short, "unregistered": short}
    found = {name: apart(name, str(count), str(options.warm)) for name, count in counts.items()}
    ours, own = found["ours"], found["traced"]
    for one, what in ((ours, "resident memory"), (own, "Python's own allocations (traced)")):
        print(
            f"{one['tasks']:,} short tasks: {what} {one['bytes_a_task']:+.1f} bytes a task in the median of {SAMPLES} parts, "
            f"{one['bytes_in_all']:+.1f} from first to last"
        )
    for name, said in (("py_trees", "as it comes"), ("unregistered", "each client unregistered by hand")):
        left = found[name]
        print(
            f"py_trees, {left['tasks']:,} short trees, {said}: resident memory {left['bytes_in_all']:+.0f} bytes a tree; "
            f"left in its registries: {left['clients']:,} clients, {left['metadata']:,} keys, {left['values']:,} values"
        )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(f"written: {options.out}")
    return int(own["bytes_a_task"] > LIMIT_BYTES)


if __name__ == "__main__":
    sys.exit(main())
