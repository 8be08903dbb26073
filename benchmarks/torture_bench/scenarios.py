"""Short stories, each of a defect that was found once by trying as an attacker or an operator would.

Each plays on a site of its own and returns what was wrong. On a tree that has the defect it must find it:

    python benchmarks/torture.py --scenarios --tree OLD
"""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from agents_sim.goalbook import read_books

from .deaf import Crowd
from .engine import pythons
from .judge import STOP_S, Finding
from .play import Torture
from .site import HOMES, PEOPLE, PLACES, PORTS

ONE: Final = ("lwd_1", "picker_1", "watcher_1")
"""Agents of a story that needs one machine."""


def forgets(folder: Path) -> list[Finding]:
    """The engine and others look into the live journal; it is killed; nothing that was accepted may be missing."""
    with Torture(folder, only=ONE, speed=10.0) as torture:
        torture.start()
        client = torture.client
        for _ in range(2):
            client.request("Look", {})
        client.ask("/v1/past")
        client.ask(f"/v1/past/tasks/{client.tasks()[0]}" if client.tasks() else "/v1/past")
        _formiga(folder, "journal", "stats")
        for _ in range(2):
            client.request("Stay", {})
        client.ask("/v1/past?at=-10%20s")
        _formiga(folder, "map", "--all", "--at", "-1 s")
        client.request("Look", {"target": "camp"})
        torture.engine.kill()
        torture.start()
        torture.engine.kill()
        return torture.judged()


def bad_folder(folder: Path) -> list[Finding]:
    """A task is loaded from a folder whose name ends as a file's; every later start must succeed."""
    with Torture(folder, only=ONE) as torture:
        torture.start()
        for name in ("trees/q.yaml/look.yaml", "trees/q.yaml", "trees/served.json/look.yaml", "trees/x/bundle.json"):
            torture.client.load(name)
        torture.engine.end()
        torture.start()
        torture.engine.end()
        return torture.judged()


def way_home(folder: Path) -> list[Finding]:
    """A machine that asked to start for home is carried home and started anew while no engine is there; it must stay there."""
    with Torture(folder, only=ONE, speed=5.0) as torture:
        torture.start()
        east, north = PORTS[HOMES["lwd_1"]]
        torture.crew.reboot("lwd_1", (*PLACES["ditch"], 0.0))
        torture.wait(lambda: _north(torture, "lwd_1") > 100.0, 40.0)  # it is heard of there
        time.sleep(2.0)
        torture.client.order("agents/lwd_1", "return")
        torture.wait(lambda: _asked(folder), 30.0)
        torture.engine.kill()
        time.sleep(1.5)  # the person says that it may start, and nobody hears it yet
        torture.crew.reboot("lwd_1", (east, north, 0.0))
        torture.start()
        torture.wait(torture.crew.airborne, 15.0)
        torture.engine.kill()
        return torture.judged()


def stray(folder: Path) -> list[Finding]:
    """A machine goes up that nobody sent, past the height where it cannot tell whether it stands; it must be brought home."""
    with Torture(folder, only=ONE, speed=10.0) as torture:
        torture.start()
        torture.wait(lambda: _landed(torture, "lwd_1") == "grounded", 20.0)
        torture.crew.lift("lwd_1")
        torture.wait(torture.crew.airborne, 10.0)
        if not torture.wait(lambda: not torture.crew.airborne(), 40.0):
            torture.find(
                "no_cause", "lwd_1 is in the air without a task and without an order, and nobody brings it home"
            )
        torture.engine.kill()
        return torture.judged()


def standstill(folder: Path, seconds: float = 7.0, *, hasty: bool = True) -> list[Finding]:
    """The engine's process stands still for longer than machines may be silent; no task may fail as if they had been."""
    with Torture(folder, speed=5.0, hasty=hasty, most_open=3) as torture:
        torture.start()
        for target in ("meadow", "pond", "ditch"):
            torture.client.request("Stay", {"target": target})
        torture.wait(lambda: len(torture.crew.airborne()) >= 2, 40.0)
        torture.engine.stop()
        time.sleep(seconds)
        torture.engine.go_on()
        time.sleep(3.0)
        torture.settle(150.0)
        for task, (status, code) in torture.ends().items():
            if code == "agent_lost":
                torture.find(
                    "agent_lost", f"{task} ended {status} {code} after the engine had stood still for {seconds:g} s"
                )
        torture.engine.end()
        return torture.judged()


def starve(folder: Path) -> list[Finding]:
    """A task wakes all the time; the steps of others go on in time beside it, and a stop gets through."""
    with Torture(folder, speed=5.0, spin=True) as torture:
        torture.start()
        torture.client.request("Spin", {}, within_s=20.0)
        task = torture.client.request("Look", {}, within_s=20.0)
        torture.wait(lambda: _flown(folder, task) >= 2, 60.0)  # it looks for 2 s now
        torture.wait(lambda: _flown(folder, task) >= 3, 20.0)
        late_s = _pause(folder, task) - 2.0
        if late_s > 5.0 * (2.0 + torture.lag.most_s):
            torture.find(
                "starved", f"{task} waited {late_s + 2.0:.0f} s instead of 2 s beside a task that wakes all the time"
            )
        began = time.monotonic()
        said = torture.client.order("", "land", within_s=30.0)
        took = time.monotonic() - began
        if not said.ok or took > STOP_S + torture.lag.most_s:
            torture.find(
                "starved",
                f"beside a task that wakes all the time land --all was answered {said.status} after {took:.1f} s",
            )
        time.sleep(4.0)
        torture.engine.kill()
        return torture.judged()


def _flown(folder: Path, task: str) -> int:
    """Return how many goals of a task have ended well."""
    return len([n for n in read_books(folder / "sim") if n.goal.startswith(f"{task}/") and n.state == "succeeded"])


def _pause(folder: Path, task: str) -> float:
    """Return for how long (engine time) the machine of `Look` had nothing to do at its place; until now if it still has not."""
    notes = [n for n in read_books(folder / "sim") if n.goal.startswith(f"{task}/")]
    ends = [n.wall for n in notes if n.state == "succeeded"][1:2]
    begins = [n.wall for n in notes if n.state == "begun"][2:3]
    return ((begins or [time.time_ns() // 1000])[0] - (ends or [time.time_ns() // 1000])[0]) / 1e6 * 5.0


def deaf_clients(folder: Path, number: int = 600) -> list[Finding]:
    """Half-open connections use up all descriptors of the engine; `formiga land --all` must get through."""
    with Torture(folder, only=ONE, engine={"prefix": ["prlimit", "--nofile=256:256"]}) as torture:
        torture.start()
        torture.client.request("Stay", {})
        torture.wait(torture.crew.airborne, 40.0)
        with Crowd(torture.engine.url, number):
            began = time.monotonic()
            ran = _formiga(folder, "land", "--all", "--by", "bench")
            took = time.monotonic() - began
        # A command of ours needs most of the time to start; what an engine without a crowd takes is taken off.
        own = time.monotonic()
        _formiga(folder, "agents")
        own = time.monotonic() - own
        if ran.returncode or took - own > STOP_S:
            torture.find(
                "stop_late",
                f"beside {number} half-open connections formiga land --all ended {ran.returncode} after {took:.1f} s "
                f"(a command takes {own:.1f} s here): {(ran.stdout + ran.stderr)[-300:]}",
            )
        torture.engine.kill()
        return torture.judged()


SCENARIOS: Final[Mapping[str, Callable[[Path], list[Finding]]]] = {
    "forgets": forgets, "bad_folder": bad_folder, "way_home": way_home, "stray": stray, "standstill": standstill,
    "starve": starve, "deaf_clients": deaf_clients,
}  # fmt: skip


def _formiga(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    try:
        return subprocess.run(
            [sys.executable, "-m", "formiga_bt", *words], cwd=folder, env=pythons(), stdin=subprocess.DEVNULL,
            capture_output=True, text=True, timeout=90.0, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(words, 124, "", "no end within 90 s")


def _asked(folder: Path) -> bool:
    """Return whether a person was asked something."""
    return any(note.state == "begun" and note.agent in PEOPLE for note in read_books(folder / "sim"))


def _north(torture: Torture, agent: str) -> float:
    said = torture.client.ask("/v1/agents")
    mine = [one for one in said.body["agents"] if one["id"] == agent] if said.ok else []
    return mine[0]["at"]["north_m"] if mine and mine[0]["at"] and mine[0]["liveness"] == "alive" else 0.0


def _landed(torture: Torture, agent: str) -> str:
    said = torture.client.ask("/v1/agents")
    return next((one["landed"] for one in said.body["agents"] if one["id"] == agent), "") if said.ok else ""


def run(name: str, folder: Path) -> list[Finding]:
    """Play one story; its folder is removed if all was right."""
    found = SCENARIOS[name](folder)
    if not found:
        shutil.rmtree(folder, ignore_errors=True)
    return found
