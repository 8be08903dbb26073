"""Random fault runs under the safety monitor, by the thousand.

    python benchmarks/soak_safety.py --runs 2000 [--jobs 2] [--first 0] [--json summary.json]

Shows how far it is; prints each run that is not clean with the command that plays it again, and a summary as JSON. Exit
status 1 if any promise of the safety layer was broken (docs: safety).
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # tests/ is no part of the installed package

from tests.safety.runs import Report, run


def main() -> int:
    parser = argparse.ArgumentParser(description="Random fault runs under the safety monitor.")
    parser.add_argument("--runs", type=int, default=2000, help="how many seeds (%(default)s)")
    parser.add_argument("--first", type=int, default=0, help="the first seed (%(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (%(default)s)")
    parser.add_argument("--json", type=Path, help="write the summary here too")
    options = parser.parse_args()

    began = time.perf_counter()
    rules: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    failed: dict[int, list[str]] = {}
    virtual_s = 0.0
    with ProcessPoolExecutor(options.jobs) as pool:
        seeds = range(options.first, options.first + options.runs)
        for done, report in enumerate(pool.map(run, seeds, chunksize=4), 1):
            counts += report.counts
            virtual_s += report.lasted_s
            if report.violations:
                rules.update({violation.rule for violation in report.violations})
                failed[report.seed] = [str(violation) for violation in report.violations]
                show(report)
            if done % 50 == 0 or done == options.runs:
                took = time.perf_counter() - began
                left = took / done * (options.runs - done)
                print(
                    f"{done}/{options.runs} runs, {len(failed)} not clean, {took:.0f} s, {left:.0f} s left",
                    file=sys.stderr,
                )
    summary = {
        "runs": options.runs,
        "first_seed": options.first,
        "not_clean": len(failed),
        "rules_broken": dict(rules),
        "virtual_hours": round(virtual_s / 3600, 1),
        "seconds": round(time.perf_counter() - began, 1),
        "counts": dict(sorted(counts.items())),
        "failed": {str(seed): lines for seed, lines in failed.items()},
    }
    text = json.dumps(summary, indent=1)
    print(text)
    if options.json is not None:
        options.json.write_text(text + "\n", encoding="utf-8")
    return bool(failed)


def show(report: Report) -> None:
    """Print a run that is not clean, shortly."""
    more = f" (and {len(report.violations) - 1} more)" if len(report.violations) > 1 else ""
    print(f"seed {report.seed}: {report.violations[0]}{more}\n    {report.command}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
