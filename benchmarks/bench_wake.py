"""What a wake costs: the deepest leaf of a 12-node tree, woken by something that does not end it, beside py_trees' own tick.

Ours: `wake` asks the leaf whether it has anything to do, `run_passes` visits what has. Theirs: one `root.tick()` of a tree of
the same shape from py_trees' own nodes. Both in this process, alternating, medians of many rounds. Besides: a wake that ends
the leaf, so that everything from it to the root is decided and the next step begins, in deep and in wide trees; and what a tree
costs to make, in time and in memory, beside one of py_trees' nodes.

Beside it, where it is installed (extra `btcpp`), BehaviorTree.CPP's tick of that tree: with its one action in Python, and, to
know, with an action of its own.

    python benchmarks/bench_wake.py [--rounds N] [--json FILE]
"""

import argparse
import gc
import json
import statistics
import time
import tracemalloc
from collections.abc import Callable
from typing import Any

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from benchmarks.peers.btcpp import BtCpp
from benchmarks.peers.ours import Ours
from benchmarks.peers.protocol import Peer
from benchmarks.peers.trees import twelve
from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.nodes.compile import compile_section
from formiga_bt.rehearsal.rehearsal import Rehearsal

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


def load(text: str) -> tuple[Task, Rehearsal]:
    """Return a task and a world that has it."""
    catalogue, _, _ = load_catalogue(files("actions"))
    site, _, _ = load_site(folder("trees") / "demo-site.yaml")
    loaded = load_task_text(text, "deep.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None, loaded.diagnostics
    assert site is not None
    return loaded.task, Rehearsal(site, catalogue, [loaded.task], [])


def ours(text: str = TASK, end: str = "@1") -> Callable[[], None]:
    """Return a function that wakes the leaf whose key ends so, once."""
    task, rehearsal = load(text)
    task_id = rehearsal.submit(task.name)
    rehearsal.run_for(1.0)
    trees = rehearsal.engine.runs.open[task_id].trees
    core = rehearsal.engine.core
    leaf = next(key for key in trees.statuses() if key.endswith(end))

    def once() -> None:
        core.state.seq += 1  # a step of its own, so that the budget of visits starts anew
        trees.wake(leaf)
        trees.run_passes()

    return once


def ending(text: str) -> Callable[[], None]:
    """Return a function that ends a wait and lets the next one begin: everything on the way is decided."""
    task, rehearsal = load(text)
    task_id = rehearsal.submit(task.name)
    rehearsal.run_for(0.5)
    core, trees = rehearsal.engine.core, rehearsal.engine.runs.open[task_id].trees

    def once() -> None:
        due = core.next_deadline()
        assert due is not None
        core.begin(max(core.now, due[0]))
        assert isinstance(due[1], NodeDue)
        core.due.add((due[1].task, due[1].node))
        trees.wake(due[1].node)
        trees.run_passes()

    return once


def nested(depth: int) -> str:
    """Return a task whose wait is so deep."""
    lines = ["formiga: 1", "task: Nested", "steps:"]
    for level in range(depth):
        lines.append("  " * (2 * level + 1) + "- sequence:")
    pad = "  " * (2 * depth + 1)
    lines += [f"{pad}- repeat: 1000000", f"{pad}  steps:", f"{pad}    - wait: 1 s"]
    return "\n".join(lines)


def wide(width: int) -> str:
    """Return a task with a parallel of so many branches, of which the last one ends and begins again."""
    branches = "\n".join("      - wait: 1000 h" for _ in range(width - 1))
    return f"formiga: 1\ntask: Wide\nsteps:\n  - parallel:\n{branches}\n      - repeat: 1000000\n        steps: [{{wait: 1 s}}]"


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


def news(peer: Peer) -> Callable[[], None] | None:
    """Return a function that tells one tree of a peer that its action goes on; None: the peer is not installed."""
    try:
        peer.version()
        fleet = peer.build(twelve(), "twelve", 1)
    except ImportError:
        return None
    return lambda: fleet.news((0,))


def ticks(peer: BtCpp) -> tuple[Callable[[], None], Any] | None:
    """Return BehaviorTree.CPP's own tick of one tree, no harness around it, and what must outlive it; None: not installed."""
    try:
        peer.version()
        fleet = peer.build(twelve(), "twelve", 1)
    except ImportError:
        return None
    fleet.news((0,))
    return fleet.trees[0].tick_exactly_once, fleet


def beside_compiled(mine: Callable[[], None], rounds: int) -> dict[str, Any]:
    """Measure BehaviorTree.CPP's tick of the same tree beside our wake, and beside a goal's news through the whole engine."""
    ours = news(Ours())
    found: dict[str, Any] = {}
    for native, key, what in (
        (False, "btcpp", "with leaves in Python"),
        (True, "btcpp_native", "with leaves of its own"),
    ):
        theirs = ticks(BtCpp(native))
        if ours is None or theirs is None:
            print("BehaviorTree.CPP is not installed (pip install -e '.[btcpp]')")
            return found
        trios = [(batch(mine), batch(ours), batch(theirs[0])) for _ in range(rounds)]
        wake, told, tick = (statistics.median(side) for side in zip(*trios, strict=True))
        by_wake, by_news = (statistics.median(trio[2] / trio[at] for trio in trios) for at in (0, 1))
        found[key] = {"tick_us": tick, "news_us": told, "by_wake": by_wake, "by_news": by_news}
        print(
            f"BehaviorTree.CPP {what}: tick {tick:.2f} us, our wake {wake:.2f} us ({by_wake:.1f} times as much); "
            f"news of its action through our whole engine {told:.2f} us: {by_news:.2f} times as much"
        )
    return found


def batch(call: Callable[[], Any], times: int = BATCH) -> float:
    """Return microseconds of processor time a call over one batch."""
    start = time.thread_time()
    for _ in range(times):
        call()
    return (time.thread_time() - start) / times * 1e6


def median_us(call: Callable[[], Any], rounds: int = 15) -> float:
    """Return the median of some batches."""
    return statistics.median(batch(call) for _ in range(rounds))


def bytes_of(make: Callable[[], Any], count: int = 500) -> float:
    """Return how much memory one of what a function makes needs."""
    gc.collect()
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    kept = [make() for _ in range(count)]
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return (after - before) / len(kept)


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
    found: dict[str, Any] = {"wake_us": wake, "py_trees_tick_us": tick, "ratio": ratio}
    print(f"wake of the deepest leaf {wake:.2f} us, py_trees {py_trees.version.__version__} tick {tick:.2f} us")
    print(f"py_trees tick / our wake: {ratio:.1f} (median of {options.rounds} pairs of {BATCH})")
    whole = news(Ours())
    if whole is not None:
        pairs = [(batch(whole), batch(peer)) for _ in range(options.rounds)]
        told, found["ratio_whole_engine"] = (
            statistics.median(a for a, _ in pairs), statistics.median(b / a for a, b in pairs),
        )  # fmt: skip
        print(
            f"py_trees tick / news of an action through our whole engine ({told:.2f} us): {found['ratio_whole_engine']:.1f}"
        )
    found |= beside_compiled(mine, options.rounds)
    for depth in (2, 8, 24):
        found[f"ends_at_depth_{depth}_us"] = us = median_us(ending(nested(depth)))
        print(f"a wait ends and the next one begins, {depth + 1} levels below the root: {us:.1f} us")
    for width in (2, 20, 200):
        idle = median_us(ours(wide(width), ".steps[0]"))
        found[f"ends_in_width_{width}_us"] = us = median_us(ending(wide(width)))
        found[f"wake_in_width_{width}_us"] = idle
        print(f"the same in a parallel of {width}: {us:.1f} us; woken for nothing: {idle:.2f} us")
    task, _ = load(TASK)
    nodes = sum(1 for _ in compile_section("steps", task.steps).iterate())
    made = median_us(lambda: compile_section("steps", task.steps))
    size = bytes_of(lambda: compile_section("steps", task.steps)) / nodes
    their_made, their_size = median_us(lambda: Waiting("leaf")), bytes_of(lambda: Waiting("leaf"), 5000)
    found |= {"make_us": made, "nodes": nodes, "bytes_a_node": size, "py_trees_node_us": their_made}
    found["py_trees_bytes_a_node"] = their_size
    print(
        f"a tree of {nodes} nodes is made in {made:.0f} us: {made / nodes:.2f} us and {size:.0f} bytes a node;", end=" "
    )
    print(f"a node of py_trees: {their_made:.2f} us, {their_size:.0f} bytes")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as out:
            json.dump(found, out, indent=2)


if __name__ == "__main__":
    main()
