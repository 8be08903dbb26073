"""What folding a busy fleet's steps into a ledger costs, beside the engine that made them, and how fast its pages are.

    python benchmarks/bench_ledger.py [--tasks 200]

The steps are those of `bench_virtual_fleet`; the pages are of a site with so many waiting and running tasks (`--active`).
"""

import argparse
import gc
import time

from benchmarks.bench_virtual_fleet import Run
from formiga_bt.engine.inputs import Step
from formiga_bt.show.ledger import Ledger


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=200)
    options = parser.parse_args()
    run = Run(options.tasks, judged=False)
    steps: list[Step] = []
    run.world.driver.listeners = [steps.append]
    began = time.perf_counter()
    run.fly()
    engine_s = time.perf_counter() - began
    ledger = Ledger()
    gc.collect()
    gc.freeze()
    began = time.perf_counter()
    for step in steps:
        ledger.feed(step)
    fold_s = time.perf_counter() - began
    changes = sum(len(step.changes) for step in steps)
    print(f"{len(steps)} steps, {changes} changes, engine with its fleet {engine_s / len(steps) * 1e6:.0f} us a step")
    print(f"ledger {fold_s / len(steps) * 1e6:.1f} us a step, {fold_s / engine_s * 100:.1f} % of the run")
    print(f"points of ways: {sum(len(p.fixes) for way in ledger.ways.values() for p in way.pieces)}")


if __name__ == "__main__":
    main()
