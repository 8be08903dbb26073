"""An engine's process that is killed again and again beside a fleet that lives on: real processes, real Zenoh, a journal.

    with Killing(folder) as run:  run.life(Kill("after_commit", 3));  ...;  run.end()

One folder is one site; its agents are started once, with ledgers of their own. Each `life` starts the engine, keeps it busy and
sees it die; `end` starts it a last time and waits until every task has ended. `killing_judge` then reads what the agents noted.
Used by `test_kills.py` and `benchmarks/kills.py`.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from http.client import HTTPException
from pathlib import Path
from random import Random
from typing import Any, Final
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from msgspec import Struct
from msgspec.structs import replace

from agents_sim.launch import FleetProcesses
from agents_sim.world import AgentSpec
from formiga_bt.base.packaged import folder as packaged
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.inputs import read_world
from formiga_bt.engine.drivers.failpoints import VARIABLE
from formiga_bt.rehearsal.rehearsal import fleet_of

SITE: Final = "rovaniemi"
BACK: Final = re.compile(r"resumed after \d[\d.]* (?:s|min): .* (?:on|HELD)")
"""What the engine prints when it has asked all agents."""
RESUMES: Final = re.compile(r"  resumed after \d[\d.]* (?:s|min): (.*); what became of their goals is asked now")
"""What it prints at once, with the tasks that it goes on with."""
READY: Final = "next, in another terminal"
"""The last line of what it prints when it serves."""
TIDY: Final = """\
formiga: 1
task: Tidy
description: A flight that a person aborts; what must be done then, and in any case, are legs too.
imports: [lib/flying.yaml]
params:
  target: {type: place}
agents:
  drone: {type: lwd, near: "${target}", wait: 12 h}
steps:
  - sequence:
      - do: drone.TakeOff
      - do: drone.GoTo
        with: {to: "${at_height(ground(drone.position), drone.transit_height)}"}
      - do: drone.GoTo
        with: {to: "${at_height(target, drone.transit_height)}"}
      - wait: 20 min
    finally:
      - do: drone.GoTo
        with: {to: "${at_height(ground(drone.position), drone.transit_height)}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
on_abort:
  - do: drone.GoTo
    with: {to: "${at_height(offset(drone.home, north=60 m), drone.transit_height)}"}
finally:
  - notify: The flight is over.
cleanup_timeout: 30 min
"""
ASKED: Final = """\
formiga: 1
task: Asked
description: A person is asked on the ground and in the air.
agents:
  drone: {type: lwd, wait: 12 h}
  watcher: {type: watcher}
steps:
  - ask: May it fly?
    of: [watcher]
    options: [yes, no]
    timeout: 2 h
    expect: result.answer == 'yes'
  - do: drone.TakeOff
  - ask: Shall it come down?
    of: [watcher]
    options: [come_down, go_on]
    timeout: 2 h
    expect: result.answer == 'come_down'
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
MORE: Final = (
    "  hwd_1: {type: hwd, home: p5}\n",
    "  lwd_4: {type: lwd, home: p4}\n  lwd_5: {type: lwd, home: p7}\n  hwd_1: {type: hwd, home: p5}\n",
)
"""Drones enough for all that is open: time in which no engine is there counts for a task that waits for one."""
SCRIPTS: Final[Mapping[str, Sequence[Mapping[str, Any]]]] = {
    "picker_1": [{"match": "loaded", "options": ["loaded"], "after": "30 s"}],
    "picker_2": [{"match": "loaded", "options": ["loaded"], "after": "15 s"}],
    "watcher_1": [
        {"match": "come_down", "options": ["come_down"], "after": "25 s"},
        {"match": "loaded", "options": ["loaded"], "after": "40 s"},
        {"match": "*", "options": ["yes"], "after": "20 s"},
        {"match": "*", "options": ["clear"], "after": "5 s"},
    ],
}
WORK: Final[Sequence[tuple[str, Mapping[str, Any]]]] = (
    ("PickUp", {"target": "north_field", "user": "picker_1"}),
    ("Delivery", {"target": "lake_shore", "next_stop": "east_field", "return_second": "true"}),
    ("Tidy", {"target": "west_field"}),
    ("Asked", {}),
    ("MoveTask", {}),
    ("PickUp", {"target": "west_field", "user": "picker_2"}),
)
"""What is requested, in turn."""


class Kill(Struct, frozen=True):
    """How an engine dies."""

    point: str
    """A failpoint; `random`: a moment at which a machine flies; `double`: while it comes back from a death before."""
    at: int = 0
    """Of a failpoint: which passing."""
    after_s: float = 0.0
    """Of a random one: so long after it was back; of a double one: after its process was started."""


class Death(Struct, frozen=True):
    """An engine that died."""

    point: str
    at: int
    wall_us: int
    missed: bool = False
    """The point was not passed so often; it was killed all the same."""


class Accepted(Struct, frozen=True):
    """A request that the engine said yes to, and whether its abort was accepted too (None: nobody knows)."""

    id: str
    task: str
    aborted: bool | None = False


class Stuck(Exception):  # noqa: N818 - it names the state
    """The engine did not start, or tasks did not end; the text says how things stand."""


def fleet(world: Any, only: Sequence[str] = ()) -> list[AgentSpec]:
    """Return the site's agents; their batteries last, and people answer by `SCRIPTS`."""
    lasting = {"cruise_drain_pct_s": 0.005, "hover_drain_pct_s": 0.005, "charge_percent_s": 0.1}
    specs = [spec for spec in fleet_of(world.site, world.catalogue, scripts=SCRIPTS) if not only or spec.id in only]
    places = {"picker_1": "north_field", "picker_2": "west_field", "watcher_1": "camp"}
    return [
        replace(spec, at=world.site.places[places[spec.id]]) if spec.id in places else replace(spec, limits=lasting)
        for spec in specs
    ]


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Killing:
    """One site, its fleet, and an engine that dies.

    Args:
        folder: becomes the site's; a new one.
        seed: of what is chosen.
        speed: engine seconds per wall second.
        most_open: so many tasks are open at a time.
        work: what is requested, in turn.
        only: agents; none named = all of the site.
        patience_s: wall time within which an engine starts, a point is passed; tasks end within ten times that.
    """

    def __init__(
        self,
        folder: Path,
        *,
        seed: int = 0,
        speed: float = 10.0,
        most_open: int = 4,
        work: Sequence[tuple[str, Mapping[str, Any]]] = WORK,
        only: Sequence[str] = (),
        patience_s: float = 60.0,
    ) -> None:
        self.folder, self.speed, self.patience_s = folder, speed, patience_s
        self.deaths: list[Death] = []
        self.accepted: dict[str, Accepted] = {}
        self.held: list[str] = []
        self._random = Random(seed)
        self._most_open, self._work, self._only = most_open, work, only
        self._requested = 0
        self._lives = 0
        self._endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._address: EngineAddress | None = None
        self._engine: subprocess.Popen[bytes] | None = None
        self._fleet: FleetProcesses | None = None
        self._make_site()

    def _make_site(self) -> None:
        trees = self.folder / "trees"
        trees.mkdir(parents=True)
        (trees / "tidy.yaml").write_text(TIDY, encoding="utf-8")
        (trees / "asked.yaml").write_text(ASKED, encoding="utf-8")
        site = (packaged("trees") / "demo-site.yaml").read_text(encoding="utf-8")
        assert ":7447" in site
        assert MORE[0] in site
        # An engine of many deaths is away for long: neither its people nor its machines shall take that for the end of it.
        site = site.replace(":7447", ":0").replace(*MORE) + "resume_hold_after: 10 min\nactions: []\n"
        (self.folder / "site.yaml").write_text(site, encoding="utf-8")
        actions = (packaged("actions") / "base.yaml").read_text(encoding="utf-8")
        assert "link_silence: 10 s" in actions
        text = actions.replace("link_silence: 10 s", "link_silence: 10 min")
        (self.folder / "actions.yaml").write_text(text, encoding="utf-8")

    @property
    def sim(self) -> Path:
        """Return where the agents' files are."""
        return self.folder / "sim"

    @property
    def journal(self) -> Path:
        """Return the engine's journal."""
        return self.folder / ".formiga" / SITE / "journal.db"

    def log(self) -> str:
        """Return what the newest engine printed."""
        return self._log_file.read_text(encoding="utf-8", errors="replace")

    @property
    def _log_file(self) -> Path:
        return self.folder / f"engine-{self._lives}.log"

    def __enter__(self) -> "Killing":
        try:
            world = read_world([self.folder / "actions.yaml"], self.folder / "site.yaml")
            assert world.site is not None
            self._fleet = FleetProcesses(
                fleet(world, self._only), site=SITE, connect=self._endpoint, state_dir=self.sim
            ).__enter__()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End all processes."""
        if self._engine is not None and self._engine.poll() is None:
            self._engine.kill()
            self._engine.wait()
        if self._fleet is not None:
            self._fleet.close()

    # -- one engine --------------------------------------------------------------------------------------------------
    def _start(self, failpoint: str = "") -> None:
        self._lives += 1
        words = ["up", "--http", "127.0.0.1:0", "--speed", f"{self.speed:g}", "--actions", "actions.yaml"]
        words += ["--listen", self._endpoint]
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        environment.pop(VARIABLE, None)
        if failpoint:
            environment[VARIABLE] = failpoint
        with self._log_file.open("wb") as log:
            self._engine = subprocess.Popen(
                [sys.executable, "-m", "formiga_bt", *words], cwd=self.folder, env=environment,
                stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
            )  # fmt: skip
        self._address = None

    def _wait_up(self) -> bool:
        """Wait until the engine serves; return False if it died before."""
        assert self._engine is not None
        until = time.monotonic() + self.patience_s
        while self._engine.poll() is None:
            found = [one for one in find_engines(self.folder) if one.pid == self._engine.pid]
            if found:
                self._address = found[0]
                return True
            if time.monotonic() > until:
                raise Stuck(f"the engine does not start within {self.patience_s:g} s\n{self.log()}")
            time.sleep(0.03)
        if self._engine.returncode != -signal.SIGKILL:
            raise Stuck(f"the engine ended with {self._engine.returncode}\n{self.log()}")
        return False

    def _api(self, path: str, body: Mapping[str, Any] | None = None) -> Any:
        """Ask the engine; None if it is not there (any more), or says no."""
        if self._address is None:
            return None
        data = None if body is None else json.dumps(body).encode()
        request = Request(f"{self._address.url}{path}", data, {"Content-Type": "application/json"})
        try:
            with urlopen(request, timeout=20) as answer:
                return json.loads(answer.read())
        except HTTPError as error:
            error.close()
            return None
        except (OSError, ValueError, HTTPException):  # it died while it answered
            return None

    # -- work --------------------------------------------------------------------------------------------------------
    def _tend(self, *, request: bool = True) -> tuple[int, bool]:
        """Request what is to be done, abort what is to be aborted; return open tasks, and whether a machine has a goal."""
        seen = self._api("/v1/tasks?status=open")
        agents = self._api("/v1/agents")
        if seen is None or agents is None:
            return 1, False
        tasks = seen["tasks"]
        busy = {one["id"] for one in agents["agents"] if one["action"] not in ("", "Confirm")}
        flying = {one["id"] for one in agents["agents"] if one["landed"] == "airborne"}
        for task in tasks:
            if "resume" in task["held"]:
                self.held.append(task["id"])
                self._api(f"/v1/tasks/{task['id']}/orders", {"order": "continue", "by": "watcher_1"})
            mine = self.accepted.get(task["id"])
            if task["name"] == "Tidy" and task["section"] == "steps" and flying & set(task["agents"]):
                said = self._api(f"/v1/tasks/{task['id']}/abort", {})
                if mine is None or mine.aborted is not True:
                    self.accepted[task["id"]] = Accepted(task["id"], "Tidy", True if said is not None else None)
        if request and len(tasks) < self._most_open and len(agents["agents"]) >= (len(self._only) or 10):
            name, params = self._work[self._requested % len(self._work)]
            said = self._api("/v1/tasks", {"task": name, "params": dict(params)})
            if said is not None:
                self._requested += 1
                self.accepted.setdefault(said["id"], Accepted(said["id"], name))
        return len(tasks), bool(busy)

    # -- deaths ------------------------------------------------------------------------------------------------------
    def life(self, kill: Kill) -> Death:
        """Let an engine live until it is killed so."""
        if kill.point in ("in_reconcile", "in_snapshot", "double"):
            self._while_busy(kill)  # first a death after which there is something to find out
            death = self._coming_back(kill)
        elif kill.point == "random":
            death = self._while_busy(kill)
        else:
            death = self._at_point(kill)
        return death

    def _dead(self, point: str, at: int = 0, *, missed: bool = False) -> Death:
        """Note that the engine is dead, killing it if it lives."""
        assert self._engine is not None
        if self._engine.poll() is None:
            self._engine.kill()
        self._engine.wait()
        self._address = None
        death = Death(point, at, time.time_ns() // 1000, missed)
        self.deaths.append(death)
        return death

    def _run(self) -> None:
        """See that an engine without a failpoint runs and is back."""
        if self._engine is None or self._engine.poll() is not None:
            self._start()
        if self._address is None:
            assert self._wait_up()
        self._wait_back()

    def _is_back(self) -> bool:
        said = self.log()
        if BACK.search(said) or (READY in said and "  resume  " not in said):
            return True
        asked = RESUMES.search(said)  # nothing is reported of tasks that have ended meanwhile
        return asked is not None and all(
            re.search(rf" {re.escape(task)} (SUCCEEDED|FAILED|CANCELED)", said) for task in asked[1].split(", ")
        )

    def _wait_back(self) -> None:
        until = time.monotonic() + self.patience_s
        while not self._is_back():
            if time.monotonic() > until:
                raise Stuck(f"the engine is not back within {self.patience_s:g} s\n{self.log()}")
            time.sleep(0.05)

    def _while_busy(self, kill: Kill) -> Death:
        self._run()
        at = time.monotonic() + (kill.after_s if kill.point == "random" else self._random.uniform(0.2, 3.0))
        until = at + self.patience_s
        while True:
            _, busy = self._tend()
            if busy and time.monotonic() >= at:
                return self._dead("random")
            if time.monotonic() > until:
                raise Stuck(f"no machine flies\n{self.log()}")
            time.sleep(0.1)

    def _coming_back(self, kill: Kill) -> Death:
        """Start, and die before all is known again."""
        if kill.point == "double":
            self._start()
            assert self._engine is not None
            with suppress(subprocess.TimeoutExpired):
                self._engine.wait(kill.after_s)
            return self._dead("double")
        self._start(f"{kill.point}:{kill.at}")
        assert self._engine is not None
        until = time.monotonic() + self.patience_s
        while self._engine.poll() is None:
            if BACK.search(self.log()) or time.monotonic() > until:
                return self._dead(kill.point, kill.at, missed=True)
            time.sleep(0.05)
        return self._died(kill)

    def _at_point(self, kill: Kill) -> Death:
        self._start(f"{kill.point}:{kill.at}")
        assert self._engine is not None
        until = time.monotonic() + self.patience_s
        if self._wait_up():
            while self._engine.poll() is None:
                self._tend()
                if time.monotonic() > until:
                    return self._dead(kill.point, kill.at, missed=True)
                time.sleep(0.1)
        return self._died(kill)

    def _died(self, kill: Kill) -> Death:
        assert self._engine is not None
        if self._engine.returncode != -signal.SIGKILL or f"failpoint {kill.point}:{kill.at}: killed" not in self.log():
            raise Stuck(f"the engine ended with {self._engine.returncode}, not at {kill.point}\n{self.log()}")
        return self._dead(kill.point, kill.at)

    # -- the end -----------------------------------------------------------------------------------------------------
    def end(self) -> None:
        """Start the engine a last time, wait until all tasks have ended, and end it."""
        self._run()
        until = time.monotonic() + 10 * self.patience_s
        while self._tend(request=False)[0]:
            if time.monotonic() > until:
                raise Stuck(f"not all tasks have ended\n{json.dumps(self._api('/v1/tasks?status=open'), indent=1)}")
            time.sleep(0.2)
        assert self._engine is not None
        self._engine.terminate()
        self._engine.wait(self.patience_s)
