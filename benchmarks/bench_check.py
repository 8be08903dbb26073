"""What `formiga check` costs as a whole process, beside `python -c pass` and beside importing PyYAML alone.

python benchmarks/bench_check.py [--rounds N]
"""

import argparse
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


def wall_ms(words: list[str]) -> float:
    """Return the wall time of one process in milliseconds."""
    start = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    return (time.perf_counter() - start) * 1e3


def main() -> None:
    """Measure in turn, print medians and the ratio to an empty interpreter."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    found: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(rounds):
        for name, words in COMMANDS.items():
            found[name].append(wall_ms(words))
    empty = statistics.median(found["python -c pass"])
    for name, times in found.items():
        median = statistics.median(times)
        print(f"{name:32} {median:7.0f} ms  {median / empty:5.1f} x an empty interpreter")


if __name__ == "__main__":
    main()
