"""A benchmark of this checkout beside that of another one, run in turns; the ratio of each figure, the median of all pairs.

python benchmarks/paired.py OTHER [--bench bench_wake.py] [--pairs 9] [--args "--rounds 40"]

OTHER is a checkout, such as of `git worktree add --detach ../before COMMIT`. The benchmark writes its figures with --json. Who
goes first changes from pair to pair, so that a busy machine troubles both alike.
"""

import argparse
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--bench", default="bench_wake.py")
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--args", default="--rounds 40")
    given = parser.parse_args()
    before, after = given.other.resolve(), HERE
    pairs: list[dict[Path, dict[str, float]]] = []
    for number in range(given.pairs):
        order = (before, after) if number % 2 else (after, before)
        pairs.append({folder: figures(folder, given.bench, given.args) for folder in order})
    print(f"{given.pairs} pairs; this checkout by the other: below 1 it costs less")
    for name in pairs[0][after]:
        both = [(pair[after][name], pair[before][name]) for pair in pairs if pair[before].get(name)]
        if both:
            mine, other = (statistics.median(side) for side in zip(*both, strict=True))
            ratios = sorted(a / b for a, b in both)
            print(
                f"{name}: {statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f}); {mine:.3g} by {other:.3g}"
            )
    print("load of the machine over the last minute, and its cores:", os.getloadavg()[0], os.cpu_count())


def figures(folder: Path, bench: str, args: str) -> dict[str, float]:
    """Run a benchmark of a checkout; return its figures by name."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "figures.json"
        command = [sys.executable, f"benchmarks/{bench}", *shlex.split(args), "--json", str(out)]
        subprocess.run(
            command, cwd=folder, env={**os.environ, "PYTHONPATH": str(folder)}, check=True, capture_output=True
        )
        found = json.loads(out.read_text(encoding="utf-8"))
    return {name: value for name, value in found.items() if isinstance(value, int | float)}


if __name__ == "__main__":
    main()
