"""What a wake costs: the deepest leaf of a 12-node tree, woken by something that does not end it, beside py_trees' own tick.

Ours: `wake` marks the way from the leaf to the root, `run_passes` decides from root to leaf, memory is written. Theirs: one
`root.tick()` of a tree of the same shape from py_trees' own nodes. Both in this process, alternating, medians of many rounds.

    python benchmarks/bench_wake.py [--rounds N] [--json FILE]
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.packaged import files, folder
from formiga_bt.rehearsal import Rehearsal

TASK = """
formiga: 1
task: Deep
params: {n: {type: number, default: 1}}
steps:
  - check: n > 0
  - sequence:
      - check: n > 0
      - fallback:
          - sequence:
              - check: n > 0
              - wait: 1 h
                timeout: 2 h
                retry: {attempts: 3}
              - check: n > 0
          - check: n > 0
    timeout: 3 h
"""
BATCH = 200


class Waiting(Behaviour):
    """A leaf that keeps running."""

    def update(self) -> Status:
        return Status.RUNNING


def ours() -> Callable[[], None]:
    """Return a function that wakes the deepest leaf once."""
    catalogue, _, _ = load_catalogue(files("actions"))
    site, _, _ = load_site(folder("trees") / "demo-site.yaml")
    loaded = load_task_text(TASK, "deep.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None, loaded.diagnostics
    assert site is not None
    rehearsal = Rehearsal(site, catalogue, [loaded.task], [])
    task_id = rehearsal.submit("Deep")
    rehearsal.run_for(1.0)
    trees = rehearsal.engine.tasks.runs[task_id].trees
    core = rehearsal.engine.core
    (leaf,) = [key for key in trees.statuses() if key.endswith("@1")]
    assert len(trees.statuses()) >= 8, trees.statuses()

    def once() -> None:
        core.state.seq += 1  # a step of its own, so that the budget of visits starts anew
        trees.wake(leaf)
        trees.run_passes()

    return once


def theirs() -> Callable[[], None]:
    """Return a function that ticks a py_trees tree of the same shape once."""

    def done(name: str) -> Behaviour:
        return py_trees.behaviours.Success(name)

    deep = py_trees.decorators.Timeout("t", py_trees.decorators.Retry("r", Waiting("leaf"), 3), 7200.0)
    inner = py_trees.composites.Sequence("inner", memory=True, children=[done("c"), deep, done("d")])
    choice = py_trees.composites.Selector("choice", memory=True, children=[inner, done("e")])
    middle = py_trees.composites.Sequence("middle", memory=True, children=[done("b"), choice])
    outer = py_trees.decorators.Timeout("o", middle, 10800.0)
    root = py_trees.composites.Sequence("root", memory=True, children=[done("a"), outer])

    def once() -> None:
        for _ in root.tick():
            pass

    once()
    return once


def batch(call: Callable[[], None]) -> float:
    """Return microseconds a call over one batch."""
    start = time.perf_counter()
    for _ in range(BATCH):
        call()
    return (time.perf_counter() - start) / BATCH * 1e6


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--json", default="")
    options = parser.parse_args()
    mine, peer = ours(), theirs()
    pairs = [(batch(mine), batch(peer)) for _ in range(options.rounds)]
    wake = statistics.median(a for a, _ in pairs)
    tick = statistics.median(b for _, b in pairs)
    ratio = statistics.median(b / a for a, b in pairs)
    print(f"wake of the deepest leaf {wake:.2f} us, py_trees {py_trees.version.__version__} tick {tick:.2f} us")
    print(f"py_trees tick / our wake: {ratio:.1f} (median of {options.rounds} pairs of {BATCH})")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as out:
            json.dump({"wake_us": wake, "py_trees_tick_us": tick, "ratio": ratio}, out, indent=2)


if __name__ == "__main__":
    main()
