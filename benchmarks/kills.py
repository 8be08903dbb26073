"""Kill -9 of the engine's process, over and over, over real Zenoh beside agents that live on; their own ledgers judge.

    python benchmarks/kills.py --failpoints 100 --random 100 --double 10 --into kills.json
    python benchmarks/kills.py --into kills.json --table          what there is, as in docs/reliability.md
    python benchmarks/kills.py --into kills.json --again 7        run 7 once more, with the same kills
    python benchmarks/kills.py --into kills.json --judge 7        judge run 7 once more, whose folder was kept

A run is one fleet and the engines that die beside it (`tests/e2e/killing.py`), all at one kind of moment. Stopped and started
again, it goes on where the file leaves off. The folder of a run that is not as it should be is kept beside the file.
Exit code 1 if there is one.
"""

import argparse
import json
import os
import platform
import shutil
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any, Final

import msgspec

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from formiga_bt.engine.drivers.failpoints import POINTS
from tests.e2e.killing import Accepted, Death, Kill, Killing, Stuck
from tests.e2e.killing_judge import Finding, judge, middle

PASSINGS: Final[Mapping[str, int]] = {
    "before_commit": 12, "after_commit": 12, "after_send": 12, "after_result": 8, "in_cleanup": 6, "in_reconcile": 3,
    "in_snapshot": 1,
}  # fmt: skip
"""A point is chosen to kill at one of the first so many passings; a start writes one snapshot."""
RANDOM_S: Final = 6.0
DOUBLE_S: Final = 4.0


def wanted(options: argparse.Namespace) -> dict[str, int]:
    """Return how many deaths of each kind there shall be."""
    found = {point: options.failpoints // len(POINTS) for point in POINTS}
    for point in list(POINTS)[: options.failpoints % len(POINTS)]:
        found[point] += 1
    return {**found, "random": options.random, "double": options.double}


def done(runs: list[dict[str, Any]]) -> Counter[str]:
    """Return how many deaths of each kind there were in runs of that kind."""
    return Counter(
        death["point"]
        for run in runs
        for death in run["deaths"]
        if death["point"] == run["theme"] and not death["missed"]
    )


def chosen(theme: str, number: int, random: Random) -> list[Kill]:
    """Return the kills of a run."""
    if theme == "random":
        return [Kill(theme, after_s=round(random.uniform(0.2, RANDOM_S), 2)) for _ in range(number)]
    if theme == "double":
        return [Kill(theme, after_s=round(random.uniform(0.1, DOUBLE_S), 2)) for _ in range(number)]
    return [Kill(theme, random.randint(1, PASSINGS[theme])) for _ in range(number)]


def plan(options: argparse.Namespace, runs: list[dict[str, Any]]) -> Iterator[tuple[str, list[Kill], int]]:
    """Yield the runs that are left, of all kinds in turn."""
    while True:
        left = Counter(wanted(options))
        left.subtract(done(runs))
        open_ = {theme: number for theme, number in left.items() if number > 0}
        if not open_:
            return
        had = Counter(run["theme"] for run in runs)
        theme = min(open_, key=lambda one: had[one])
        seed = options.seed * 100_000 + len(runs)
        yield theme, chosen(theme, min(open_[theme], options.per_run), Random(seed)), seed


def play(folder: Path, theme: str, kills: list[Kill], seed: int, speed: float) -> dict[str, Any]:
    """Make a run; return what came of it."""
    shutil.rmtree(folder, ignore_errors=True)
    began = time.monotonic()
    rig = Killing(folder, seed=seed, speed=speed, patience_s=120.0)
    stuck = ""
    try:
        with rig:
            for kill in kills:
                rig.life(kill)
            rig.end()
    except Stuck as error:
        stuck = str(error)
    if stuck:
        found = Finding(len(rig.accepted), 0, [], [], [], [stuck], {})
    else:
        found = judge(folder, rig.accepted, rig.deaths, rig.held)
    return {
        "theme": theme, "seed": seed, "speed": speed, "date": time.strftime("%Y-%m-%d %H:%M", time.gmtime()),
        "kills": msgspec.to_builtins(kills), "deaths": msgspec.to_builtins(rig.deaths),
        "requests": msgspec.to_builtins(rig.accepted), "held": rig.held,
        **msgspec.to_builtins(found), "good": found.is_good, "seconds": round(time.monotonic() - began, 1),
    }  # fmt: skip


def told(number: int, run: Mapping[str, Any], folder: Path, into: Path) -> str:
    """Return a line on a run, more if it is not as it should be."""
    deaths = Counter(death["point"] for death in run["deaths"])
    line = (
        f"run {number:<3} {run['theme']:<14} {sum(deaths.values()):>3} deaths  {run['right']}/{run['accepted']} tasks right  "
        f"{run['seconds']:.0f} s  {'good' if run['good'] else 'NOT GOOD'}"
    )
    if run["good"]:
        return line
    parts = [
        f"  {name}: {what}" for name in ("begun_twice", "flown_twice", "asked_twice", "wrong") for what in run[name]
    ]
    return "\n".join(
        [line, *parts, f"  kept: {folder}", f"  again: python benchmarks/kills.py --into {into} --again {number}"]
    )


def table(runs: list[dict[str, Any]]) -> str:
    """Return all runs as a table in Markdown."""
    names = ["killed", "kills", "tasks accepted", "ended right", "of these `goal_expired`", "goals begun twice"]
    names += ["legs flown twice", "asked twice", "back after"]
    rows = [f"| {' | '.join(names)} |", f"|---|{'---:|' * (len(names) - 1)}"]
    kills = Counter(death["point"] for run in runs for death in run["deaths"])
    times: dict[str, list[float]] = {}
    for run in runs:
        for point, back in run["back_s"].items():
            times.setdefault(point, []).extend(back)

    def row(name: str, number: int, of: list[dict[str, Any]], back: list[float]) -> str:
        sums = [sum(_number(run.get(key, 0)) for run in of) for key in COLUMNS]
        return "| " + " | ".join([name, str(number), *map(str, sums), middle(back)]) + " |"

    for theme in (*POINTS, "random", "double"):
        mine = [run for run in runs if run["theme"] == theme]
        rows.append(row(f"`{theme}`" if theme in POINTS else theme, kills[theme], mine, times.get(theme, [])))
    everything = [time_s for back in times.values() for time_s in back]
    rows.append(row("all", sum(kills.values()), runs, everything))
    return "\n".join(rows)


def _number(found: Any) -> int:
    return found if isinstance(found, int) else len(found)


COLUMNS: Final = ("accepted", "right", "expired", "begun_twice", "flown_twice", "asked_twice")


def save(into: Path, kept: Mapping[str, Any]) -> None:
    """Replace the file."""
    new = into.with_name(f".{into.name}.new")
    new.write_text(json.dumps(kept, indent=1) + "\n")
    new.replace(into)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--failpoints", type=int, default=100, help="kills at failpoints, all points alike (%(default)s)"
    )
    parser.add_argument("--random", type=int, default=100, help="kills at random busy moments (%(default)s)")
    parser.add_argument("--double", type=int, default=10, help="kills of an engine that is coming back (%(default)s)")
    parser.add_argument(
        "--into", type=Path, required=True, metavar="FILE", help="what came of it, JSON; is gone on with"
    )
    parser.add_argument("--per-run", type=int, default=6, help="kills beside one fleet (%(default)s)")
    parser.add_argument("--speed", type=float, default=10.0, help="engine seconds per wall second (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of what is chosen (%(default)s)")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no run after so long")
    parser.add_argument(
        "--again", type=int, metavar="RUN", help="make this run of the file once more; FILE is left alone"
    )
    parser.add_argument(
        "--judge", type=int, metavar="RUN", help="judge this run of the file once more, and note it there"
    )
    parser.add_argument("--table", action="store_true", help="print what there is, and end")
    options = parser.parse_args()
    into: Path = options.into
    kept: dict[str, Any] = json.loads(into.read_text()) if into.exists() else {"runs": []}
    runs: list[dict[str, Any]] = kept["runs"]
    kept["machine"] = f"{os.cpu_count()} cores, {platform.platform()}, Python {platform.python_version()}"
    if options.table:
        print(table(runs))
        return 0
    folders = into.resolve().with_suffix(".runs")
    if options.again is not None:
        old = runs[options.again - 1]
        kills = msgspec.convert(old["kills"], list[Kill])
        folder = folders / f"run-{options.again}-again"
        run = play(folder, old["theme"], kills, old["seed"], old["speed"])
        print(told(options.again, run, folder, into))
        return 0 if run["good"] else 1
    if options.judge is not None:
        run, folder = runs[options.judge - 1], folders / f"run-{options.judge}"
        accepted = msgspec.convert(run["requests"], dict[str, Accepted])
        found = judge(folder, accepted, msgspec.convert(run["deaths"], list[Death]), run["held"])
        run.update(msgspec.to_builtins(found), good=found.is_good)
        save(into, kept)
        print(told(options.judge, run, folder, into))
        return 0 if run["good"] else 1
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # no process is left behind
    until = time.monotonic() + options.minutes * 60
    for theme, kills, seed in plan(options, runs):
        if time.monotonic() > until:
            print("time is up; the same command goes on")
            break
        folder = folders / f"run-{len(runs) + 1}"
        runs.append(play(folder, theme, kills, seed, options.speed))
        if runs[-1]["good"]:
            shutil.rmtree(folder)
        save(into, kept)
        print(told(len(runs), runs[-1], folder, into), flush=True)
    print(table(runs))
    return 0 if all(run["good"] for run in runs) else 1


if __name__ == "__main__":
    raise SystemExit(main())
