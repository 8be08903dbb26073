"""Does an engine's memory stay flat while missions are really flown? Real processes over Zenoh, drones that charge, a journal.

    python benchmarks/soak_memory.py --hours 2 [--speed 20] [--into soak.json] [--folder DIR]
    python benchmarks/soak_memory.py --into soak.json --table

Fourteen simulated drones, each a process of its own, fly missions one after another and charge at their ports. The engine
keeps its newest 10,000 ended tasks, so its memory grows until it has them; growth is printed for each 1,000 missions, before
that and after. Sizes are what the kernel says of the engine's process (`VmRSS`), in MB of 1,000,000 bytes; those of the
journal are of its files.
Exit status 1 if tasks ended otherwise than SUCCEEDED more than 1 time in 100.
"""

import argparse
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, Final
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

from msgspec.structs import replace

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from agents_sim.launch import FleetProcesses
from formiga_bt.base.packaged import folder as packaged
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.killing import free_port

KEPT: Final = 10_000
"""Ended tasks that the engine keeps."""
SITE: Final = "ten"
LAP: Final = """\
formiga: 1
task: Lap
description: Up, once to a place and back, and home.
imports: [lib/flying.yaml]
params:
  target: {type: place}
agents:
  drone: {any_of: [lwd, hwd], near: "${target}", battery_min: 60 %, wait: 12 h}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: 40 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
WAYS: Final = 14
"""Laps lead straight north of the ports, each on a line of its own, so that drones seldom wait for each other."""
CHARGES: Final = {"charge_percent_s": 0.5}
"""Full in about three minutes, points of charge a second."""
LOOK_EVERY_S: Final = 0.25
SAMPLE_EVERY_S: Final = 20.0


def work(number: int) -> tuple[str, dict[str, Any]]:
    """Return the mission of this number: seven laps of eight, and the shipped ones in turn."""
    place = {"east": f"{-195 + 30 * (number * 5 % WAYS)} m", "north": "100 m"}
    if number % 8:
        return "Lap", {"target": place}
    return (
        ("MoveTask", {}),
        ("Circle", {"center": place, "points": 6, "radius": "5 m"}),
        ("PickUp", {"target": "north_field", "user": "picker_1"}),
        ("Triangle", {"corner": place}),
    )[number // 8 % 4]


class Engine:
    """The engine under test and what is asked of it."""

    def __init__(self, folder: Path, endpoint: str, speed: float) -> None:
        words = ["up", "--http", "127.0.0.1:0", "--speed", f"{speed:g}", "--listen", endpoint, "--quiet"]
        with (folder / "engine.log").open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "formiga_bt", *words], cwd=folder, stdin=subprocess.DEVNULL,
                stdout=log, stderr=subprocess.STDOUT,
            )  # fmt: skip
        self.folder = folder
        self._address: EngineAddress | None = None

    def is_up(self) -> bool:
        """Return whether it serves."""
        found = [one for one in find_engines(self.folder) if one.pid == self.process.pid]
        self._address = found[0] if found else None
        return bool(found)

    def ask(self, path: str, body: Mapping[str, Any] | None = None) -> Any:
        """Return its answer; None if it refuses or does not answer in time."""
        assert self._address is not None
        data = None if body is None else json.dumps(body).encode()
        request = Request(f"{self._address.url}{path}", data, {"Content-Type": "application/json"})
        try:
            with urlopen(request, timeout=60) as answer:
                return json.loads(answer.read())
        except HTTPError as error:
            error.close()
            return None
        except (URLError, TimeoutError, OSError):
            return None

    def memory_mb(self) -> float:
        """Return its resident memory."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) * 1024 / 1e6
        raise ProcessLookupError(self.process.pid)

    def journal_mb(self) -> float:
        """Return the size of its journal's files."""
        files = (self.folder / ".formiga" / SITE).glob("journal.db*")
        return sum(path.stat().st_size for path in files) / 1e6


def make_site(folder: Path) -> None:
    """Write the site's files into a folder."""
    (folder / "trees").mkdir(parents=True, exist_ok=True)
    (folder / "trees" / "lap.yaml").write_text(LAP, encoding="utf-8")
    for name in ("move_task", "circle", "pick_up", "triangle"):
        text = (packaged("trees") / f"{name}.yaml").read_text(encoding="utf-8")
        (folder / "trees" / f"{name}.yaml").write_text(text, encoding="utf-8")
    site = (packaged("trees") / "ten-site.yaml").read_text(encoding="utf-8")
    (folder / "site.yaml").write_text(site.replace(":7447", ":0"), encoding="utf-8")


def soak(folder: Path, hours: float, speed: float, most_open: int) -> dict[str, Any]:
    """Fly missions for so long; return what was measured."""
    make_site(folder)
    world = read_world([], folder / "site.yaml")
    assert world.site is not None
    script = [
        {"match": "loaded", "options": ["loaded"], "after": "4 s"},
        {"match": "*", "options": ["clear"], "after": "3 s"},
    ]
    said = dict.fromkeys(("picker_1", "picker_2", "watcher_1", "watcher_2"), script)
    places = {"picker_1": "north_field", "picker_2": "east_field"}
    specs = [
        replace(spec, at=world.site.places[places.get(spec.id, "camp")])
        if spec.id in said
        else replace(spec, limits=CHARGES)
        for spec in fleet_of(world.site, world.catalogue, scripts=said)
    ]
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    stopped: list[int] = []
    previous = {number: signal.signal(number, _noting(stopped)) for number in (signal.SIGINT, signal.SIGTERM)}
    engine = Engine(folder, endpoint, speed)
    try:
        with FleetProcesses(specs, site=SITE, connect=endpoint, state_dir=folder / "sim"):
            while not engine.is_up():
                if engine.process.poll() is not None:
                    raise SystemExit((folder / "engine.log").read_text(encoding="utf-8"))
                time.sleep(0.1)
            return _fly(engine, hours, speed, most_open, stopped)
    finally:
        engine.process.terminate()
        try:
            engine.process.wait(120)
        except subprocess.TimeoutExpired:  # what was measured counts all the same
            engine.process.kill()
        for number, handler in previous.items():
            signal.signal(number, handler)


def _noting(stopped: list[int]) -> Any:
    def handler(number: int, _: FrameType | None) -> None:
        stopped.append(number)

    return handler


def _fly(engine: Engine, hours: float, speed: float, most_open: int, stopped: Sequence[int]) -> dict[str, Any]:
    began = time.monotonic()
    next_sample, requested = began, 0
    open_ids: set[str] = set()
    outcomes: Counter[str] = Counter()
    samples: list[dict[str, float]] = []
    while time.monotonic() - began < hours * 3600 and not stopped:
        if engine.process.poll() is not None:
            raise SystemExit(f"the engine ended with {engine.process.returncode}")
        seen = engine.ask("/v1/tasks?status=open&limit=1000")
        if seen is not None:
            still = {one["id"] for one in seen["tasks"]}
            for gone in sorted(open_ids - still):
                said = engine.ask(f"/v1/tasks/{gone}")
                outcomes[
                    f"{said['task']['status']} {said['task']['code']}".strip() if said is not None else "unknown"
                ] += 1
            open_ids &= still
            while len(open_ids) < most_open:
                name, params = work(requested)
                said = engine.ask("/v1/tasks", {"task": name, "params": params})
                requested += 1
                if said is None:
                    break
                open_ids.add(said["id"])
        if time.monotonic() >= next_sample:
            next_sample += SAMPLE_EVERY_S
            samples.append(
                {
                    "s": round(time.monotonic() - began, 1),
                    "missions": sum(outcomes.values()),
                    "rss_mb": round(engine.memory_mb(), 2),
                    "journal_mb": round(engine.journal_mb(), 2),
                }
            )
            if len(samples) % 15 == 1:
                print(json.dumps(samples[-1]), flush=True)
        time.sleep(LOOK_EVERY_S)
    return {
        "date": time.strftime("%Y-%m-%d %H:%M", time.gmtime()), "hours": round((time.monotonic() - began) / 3600, 3),
        "speed": speed, "machine": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "outcomes": dict(outcomes.most_common()), "samples": samples,
    }  # fmt: skip


def slope(samples: Sequence[Mapping[str, float]]) -> float | None:
    """Return MB of memory for each 1,000 missions, by least squares; None for too few samples."""
    if len(samples) < 5 or samples[-1]["missions"] - samples[0]["missions"] < 100:
        return None
    xs = [one["missions"] / 1000 for one in samples]
    ys = [one["rss_mb"] for one in samples]
    middle_x, middle_y = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - middle_x) * (y - middle_y) for x, y in zip(xs, ys, strict=True)) / sum(
        (x - middle_x) ** 2 for x in xs
    )


def table(found: Mapping[str, Any]) -> str:
    """Return what was measured, as in docs/reliability.md."""
    samples = found["samples"]
    rows = [
        "| missions flown | memory | journal | grown since the row above, each 1,000 missions |",
        "|---:|---:|---:|---:|",
    ]
    last: Mapping[str, float] | None = None
    step = max(1000, round(samples[-1]["missions"] / 12 / 1000) * 1000)
    for one in samples:
        if last is None or one["missions"] - last["missions"] >= step or one is samples[-1]:
            grown = ""
            if last is not None and one["missions"] > last["missions"]:
                grown = f"{(one['rss_mb'] - last['rss_mb']) / (one['missions'] - last['missions']) * 1000:+.2f} MB"
            rows.append(f"| {one['missions']:,} | {one['rss_mb']:.0f} MB | {one['journal_mb']:.0f} MB | {grown} |")
            last = one
    first = [one for one in samples if one["missions"] <= KEPT]
    after = [one for one in samples if one["missions"] > KEPT]
    parts = [
        f"{name}: {grown:+.2f} MB for each 1,000 missions"
        for name, grown in (("until 10,000 tasks are kept", slope(first)), ("after that", slope(after)))
        if grown is not None
    ]
    total = sum(found["outcomes"].values())
    ends = ", ".join(f"{number:,} {name}" for name, number in found["outcomes"].items())
    head = f"{total:,} missions in {found['hours']:g} h at speed {found['speed']:g} ({found['date']}): {ends}."
    return "\n".join([head, "", *rows, "", "; ".join(parts)])


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--hours", type=float, default=2.0, help="wall time")
    parser.add_argument("--speed", type=float, default=20.0, help="engine seconds per wall second")
    parser.add_argument("--open", type=int, default=16, help="tasks that are open at a time")
    parser.add_argument("--into", type=Path, default=Path("soak_memory.json"))
    parser.add_argument("--folder", type=Path, help="a new folder for the site; default: a temporary one")
    parser.add_argument("--table", action="store_true", help="print what the file says, measure nothing")
    options = parser.parse_args()
    if options.table:
        found = json.loads(options.into.read_text(encoding="utf-8"))
    else:
        with tempfile.TemporaryDirectory(prefix="soak-memory-") as name:
            found = soak(options.folder or Path(name), options.hours, options.speed, options.open)
        options.into.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(table(found))
    total = sum(found["outcomes"].values())
    return 1 if total - found["outcomes"].get("SUCCEEDED", 0) > total / 100 else 0


if __name__ == "__main__":
    sys.exit(main())
