"""Hours of rounds: what is played next, what came of it in a JSON file that a run goes on with, and tables of it."""

import json
import shutil
import subprocess
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random
from typing import Any, Final

import msgspec

from .judge import Finding, summary
from .kills import kills
from .play import Round, play
from .scenarios import SCENARIOS, run, standstill

THEMES: Final = {"round": 14, "kills": 3, "standstill": 2, "scenario": 2}
KILLS: Final = 15
STANDSTILL_S: Final = 31.0
"""Longer than machines may be silent."""


def play_round(
    folder: Path,
    seed: int,
    sites: int,
    seconds: float,
    privileges: frozenset[str],
    *,
    gentle: bool = False,
    only: int | None = None,
) -> list[Round]:
    """Play a round on several sites at once; return what came of each."""
    numbers = range(sites) if only is None else [only]
    with ThreadPoolExecutor(len(numbers)) as pool:
        return list(pool.map(lambda n: play(folder / f"site-{n}", seed, n, seconds, privileges, gentle), numbers))


def play_kills(folder: Path, seed: int, sites: int, deaths: int, *, readers: bool) -> list[Round]:
    """Kill engines of several sites at once, so often in all."""
    shares = [deaths // sites + (n < deaths % sites) for n in range(sites)]
    with ThreadPoolExecutor(sites) as pool:
        return list(pool.map(lambda n: kills(folder / f"site-{n}", seed, n, shares[n], readers=readers), range(sites)))


def story(name: str, folder: Path, found: Sequence[Finding], seconds: float) -> Round:
    """Return a story as what came of a round."""
    return Round(0, 0, round(seconds, 1), 0, 0, 0, {name: 1}, {}, list(found), 0.0, {}, str(folder))


def play_story(name: str, folder: Path) -> Round:
    """Play a story."""
    began = time.monotonic()
    return story(name, folder, run(name, folder), time.monotonic() - began)


def play_standstill(folder: Path, seconds: float) -> Round:
    """Let an engine stand still beside machines that fly."""
    began = time.monotonic()
    found = standstill(folder, seconds, hasty=False)
    return story(f"standstill {seconds:g} s", folder, found, time.monotonic() - began)


class Soak:
    """One job's file of results.

    Args:
        into: the file; what is there is gone on with.
        job: number of the job: its seeds are its own.
        tree: what is under test.
    """

    def __init__(self, into: Path, job: int, tree: Path) -> None:
        self.into, self.job, self._tree = into, job, tree
        self.units: list[dict[str, Any]] = json.loads(into.read_text())["units"] if into.exists() else []

    @property
    def seconds(self) -> float:
        """Return how long this job has played."""
        return sum(unit["seconds"] for unit in self.units)

    def go_on(self, hours: float, sites: int, seconds: float, privileges: frozenset[str]) -> None:
        """Play until this job has played so many hours."""
        while self.seconds < hours * 3600:
            seed = 1000 * (self.job + 1) + len(self.units)
            random = Random(f"soak/{seed}")
            theme = random.choices(list(THEMES), list(THEMES.values()))[0]
            folder = self.into.resolve().with_suffix(".rounds") / str(seed)
            began = time.monotonic()
            match theme:
                case "kills":
                    rounds = play_kills(folder, seed, sites, KILLS * sites, readers=True)
                case "standstill":
                    rounds = [play_standstill(folder / "site-0", STANDSTILL_S)]
                case "scenario":
                    name = random.choice(list(SCENARIOS))
                    theme, rounds = name, [play_story(name, folder / "site-0")]
                case _:
                    rounds = play_round(folder, seed, sites, seconds, privileges)
            self.keep(theme, seed, rounds, time.monotonic() - began)
            if not any(one.findings for one in rounds):
                shutil.rmtree(folder, ignore_errors=True)
            print(told(theme, seed, rounds), flush=True)

    def keep(self, theme: str, seed: int, rounds: Sequence[Round], seconds: float) -> None:
        """Add what came of a unit to the file."""
        self.units.append({
            "theme": theme, "seed": seed, "seconds": round(seconds, 1), "date": time.strftime("%Y-%m-%d %H:%M", time.gmtime()),
            "commit": commit(self._tree), "rounds": [msgspec.to_builtins(one) for one in rounds],
        })  # fmt: skip
        self.into.parent.mkdir(parents=True, exist_ok=True)
        new = self.into.with_name(f".{self.into.name}.new")
        new.write_text(json.dumps({"units": self.units}, indent=1) + "\n")
        new.replace(self.into)


def commit(tree: Path) -> str:
    """Return which version a tree is; empty if it is no checkout."""
    ran = subprocess.run(
        ["git", "-C", str(tree), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    return ran.stdout.strip()


def told(theme: str, seed: int, rounds: Sequence[Round], again: str = "") -> str:
    """Return a unit in a line, more if something was found."""
    found = [one for part in rounds for one in part.findings]
    tasks, deaths = sum(one.tasks for one in rounds), sum(one.deaths for one in rounds)
    faults = sum(sum(one.faults.values()) for one in rounds)
    took = max((one.seconds for one in rounds), default=0.0)
    line = f"{theme} {seed}: {len(rounds)} sites, {tasks} tasks, {faults} faults, {deaths} kills, {took:.0f} s: "
    if not found:
        return line + "nothing wrong"
    lines = [line + ", ".join(f"{kind} {n}" for kind, n in summary(found).items())]
    lines += [f"  {one.what}: {one.text}" for one in found]
    lines += [f"  kept: {one.folder}" for one in rounds if one.findings]
    return "\n".join([*lines, *([f"  again: {again}"] if again else [])])


def table(units: Sequence[Mapping[str, Any]]) -> str:
    """Return all units as tables in Markdown: what was played, what was broken, what was found."""
    columns = ("what", "rounds", "sites", "hours", "tasks", "acknowledged", "kills", "faults", "reads", "findings")
    rows = [f"| {' | '.join(columns)} |", f"|---|{'---:|' * (len(columns) - 1)}"]
    themes = sorted({unit["theme"] for unit in units})
    for theme in [*themes, "all"]:
        mine = [unit for unit in units if theme in (unit["theme"], "all")]
        parts = [part for unit in mine for part in unit["rounds"]]
        cells = [
            theme, len(mine), len(parts), f"{sum(unit['seconds'] for unit in mine) / 3600:.2f}",
            sum(p["tasks"] for p in parts), sum(p["acknowledged"] for p in parts), sum(p["deaths"] for p in parts),
            sum(sum(p["faults"].values()) for p in parts), sum(sum(p["read"].values()) for p in parts),
            sum(len(p["findings"]) for p in parts),
        ]  # fmt: skip
        rows.append("| " + " | ".join(map(str, cells)) + " |")
    broken: Counter[str] = Counter()
    read: Counter[str] = Counter()
    ends: Counter[str] = Counter()
    found: Counter[str] = Counter()
    for part in (part for unit in units for part in unit["rounds"]):
        broken.update(part["faults"])
        read.update(part["read"])
        ends.update(part["ends"])
        found.update(one["what"] for one in part["findings"])
    for name, counts in (("faults", broken), ("reads", read), ("tasks ended", ends), ("findings", found)):
        rows += ["", f"{name}: " + (", ".join(f"{what} {n}" for what, n in counts.most_common()) or "none")]
    return "\n".join(rows)
