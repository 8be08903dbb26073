"""How long garbage collection stops an engine that fills up with tasks: as Python does it, and as `formiga up` has it done.

Each in a process of its own: tasks are requested until so many are active, then some minutes go by in which goals end and tasks
end and are requested. Processor time of the longest look of the collector, and of all; and what memory is left at the end.

    python benchmarks/bench_stalls.py [--tasks 100000]
"""

import argparse
import gc
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
CHURN = 3000
"""So many tasks end, and as many are requested, when all are there."""


def one(policy: str, tasks: int) -> None:
    """Fill an engine and print what collecting cost."""
    from benchmarks.bench_scale import World, rss_bytes
    from formiga_bt.services.collector import Collector

    began, looks = 0.0, list[float]()

    def on_look(phase: str, told: dict[str, Any]) -> None:
        nonlocal began
        del told
        if phase == "start":
            began = time.thread_time()
        else:
            looks.append(time.thread_time() - began)

    with Collector() if policy == "formiga" else nullcontext():
        gc.callbacks.insert(0, on_look)
        world = World(tasks, 1000)
        world.fill()
        filling, looks = looks, []
        for _ in range(min(CHURN, tasks // 3 - 1)):
            for given in (*world.ended()[0], *world.request()[0]):
                world.give(given)
        gc.callbacks.remove(on_look)
    for what, times in (("filling up", filling), (f"{CHURN:,} tasks end and begin", looks)):
        worst, total = max(times, default=0.0) * 1e3, sum(times) * 1e3
        print(f"{policy}: {what}: longest look {worst:.0f} ms, {len(times):,} looks, {total:.0f} ms in all")
    print(f"{policy}: {rss_bytes() / 1e6:.0f} MB")


def main() -> None:
    """Measure each in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=100_000)
    parser.add_argument("--policy", choices=("python", "formiga"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.policy:
        one(options.policy, options.tasks)
        return
    for policy in ("python", "formiga"):
        words = ["--policy", policy, "--tasks", str(options.tasks)]
        subprocess.run([sys.executable, "-m", "benchmarks.bench_stalls", *words], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()
