"""What `formiga check` costs as a whole process, beside `python -c pass` and beside importing PyYAML alone.

Wall time is what an author waits; processor time hardly depends on what else the machine does.

python benchmarks/bench_check.py [--rounds N]
"""

import argparse
import os
import statistics
import subprocess
import sys
import time

from formiga_bt.packaged import folder

COMMANDS = {
    "python -c pass": ["-c", "pass"],
    "python -c 'import yaml'": ["-c", "import yaml"],
    "formiga check pick_up.yaml": ["-m", "formiga_bt", "check", str(folder("trees") / "pick_up.yaml")],
}


def cost_ms(words: list[str]) -> tuple[float, float]:
    """Return the wall time and the processor time of one process in milliseconds."""
    start, before = time.perf_counter(), os.times()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return wall * 1e3, used * 1e3


def main() -> None:
    """Measure in turn, print medians and the ratio to an empty interpreter."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in COMMANDS}
    for _ in range(rounds):
        for name, words in COMMANDS.items():
            found[name].append(cost_ms(words))
    empty = statistics.median(wall for wall, _ in found["python -c pass"])
    for name, times in found.items():
        wall, used = (statistics.median(column) for column in zip(*times, strict=True))
        print(f"{name:32} {wall:7.0f} ms  {wall / empty:5.1f} x an empty interpreter  {used:7.0f} ms of processor time")


if __name__ == "__main__":
    main()
