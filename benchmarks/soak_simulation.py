"""The engine under seeded fault plans, by the ten thousand.

    python benchmarks/soak_simulation.py --seeds 20000 [--first 1000] [--jobs 2] [--into soak.json] [--limit-s 3600]

Goes on where the file left off, so that a long run can be done in pieces. Prints each seed that is not clean with the command
that plays it again. Exit status 1 if anything that always holds did not (docs: reliability).
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # tests/ is no part of the installed package

from tests.simulation.runs import Report, play

BLOCK = 20
"""Seeds that a process plays in one go."""
SAVE_EVERY_S = 30.0


def block(first: int, last: int) -> tuple[int, int, float, list[Report]]:
    """Play the seeds of a block; return it, with how much time of a core it took."""
    began = time.process_time()
    reports = [play(seed) for seed in range(first, last)]
    return first, last, time.process_time() - began, reports


def main() -> int:
    parser = argparse.ArgumentParser(description="The engine under seeded fault plans.")
    parser.add_argument("--seeds", type=int, default=20_000, help="how many (%(default)s)")
    parser.add_argument("--first", type=int, default=1000, help="the first; those below 1000 draw less (%(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (%(default)s)")
    parser.add_argument("--into", type=Path, help="keep the summary here, and go on from it")
    parser.add_argument("--limit-s", type=float, default=float("inf"), help="begin nothing new after so long")
    options = parser.parse_args()
    last = options.first + options.seeds
    found = load(options.into, options.first)
    began = saved = time.perf_counter()
    before_s, asked = found["seconds"], found["next"]
    with ProcessPoolExecutor(options.jobs) as pool:
        firsts = range(found["next"], last, BLOCK)
        waiting = []
        todo = iter(firsts)
        while True:
            while len(waiting) < 2 * options.jobs and time.perf_counter() - began < options.limit_s:
                first = next(todo, None)
                if first is None:
                    break
                waiting.append(pool.submit(block, first, min(first + BLOCK, last)))
            if not waiting:
                break
            _, done, core_s, reports = waiting.pop(0).result()
            take(found, done, core_s, reports)
            found["seconds"] = round(before_s + time.perf_counter() - began, 1)
            if time.perf_counter() - saved > SAVE_EVERY_S:
                saved = time.perf_counter()
                save(options.into, found)
                rate = (time.perf_counter() - began) / max(1, done - asked)
                print(
                    f"{done} of {last}, {len(found['failed'])} not clean, {rate * (last - done):.0f} s left",
                    file=sys.stderr,
                )
    save(options.into, found)
    print(json.dumps({key: found[key] for key in ("next", "seeds", "seconds", "core_s_per_seed", "failed")}, indent=1))
    return bool(found["failed"])


def load(file: Path | None, first: int) -> dict[str, Any]:
    """Return what a run goes on from."""
    if file is not None and file.exists():
        return dict(json.loads(file.read_text(encoding="utf-8")))
    return {
        "first": first, "next": first, "seeds": 0, "seconds": 0.0, "core_s": 0.0, "core_s_per_seed": 0.0, "steps": 0,
        "virtual_hours": 0.0, "counts": {}, "transitions": [], "causes": [], "failed": {},
    }  # fmt: skip


def take(found: dict[str, Any], done: int, core_s: float, reports: list[Report]) -> None:
    """Add the reports of a block."""
    counts = Counter(found["counts"])
    for report in reports:
        counts.update(dict(report.counts))
        found["steps"] += report.steps
        found["virtual_hours"] = round(found["virtual_hours"] + report.lasted_s / 3600, 3)
        found["transitions"] = sorted({*map(tuple, found["transitions"]), *report.transitions})
        found["causes"] = sorted({*found["causes"], *report.causes})
        if report.violations:
            found["failed"][str(report.seed)] = [str(violation) for violation in report.violations]
            more = f" (and {len(report.violations) - 1} more)" if len(report.violations) > 1 else ""
            print(f"seed {report.seed}: {report.violations[0]}{more}\n    {report.command}", flush=True)
    found["counts"] = dict(sorted(counts.items()))
    found["seeds"] += len(reports)
    found["next"] = done
    found["core_s"] = round(found["core_s"] + core_s, 1)
    found["core_s_per_seed"] = round(found["core_s"] / max(1, found["seeds"]), 3)


def save(file: Path | None, found: dict[str, Any]) -> None:
    """Keep the summary."""
    if file is not None:
        beside = file.with_suffix(".new")
        beside.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        beside.replace(file)


if __name__ == "__main__":
    sys.exit(main())
