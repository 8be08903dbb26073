"""One site under torture: its engine, agents, client and readers together, and a round of all of it.

A round is drawn from its seed: what the client asks, who reads, and what breaks when. At its end everything is healed, and what
was acknowledged must have ended, with every machine on the ground; then `judge` looks at it from outside.
"""

import random as randoms
import shutil
import socket
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from random import Random
from typing import Any, Final

from msgspec import Struct

from . import site as sites
from .client import Client
from .crew import Crew
from .engine import Engine, Start
from .faults import Weather, faults_of
from .judge import Evidence, Finding, judge, lost
from .readers import Readers

ENDS_S: Final = 240.0
"""After a round tasks must have ended within this (wall time); those that were not aborted have half of it."""
STALL_S: Final = 45.0


def free_port() -> int:
    """Return a port that nobody listens on, below those that are given to who asks for any."""
    while True:
        port = randoms.SystemRandom().randrange(15_000, 32_000)
        with socket.socket() as one:
            try:
                one.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


class Lag:
    """How late a thread of this process is woken at most: a machine under load must not count as a late engine."""

    def __init__(self) -> None:
        self.most_s = 0.0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="lag", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._closing.is_set():
            began = time.monotonic()
            self._closing.wait(0.05)
            self.most_s = max(self.most_s, time.monotonic() - began - 0.05)

    def close(self) -> None:
        self._closing.set()
        self._thread.join()


class Torture:
    """A context manager: one site with its agents; the engine is started by `start`.

    Args:
        folder: becomes the site's; what is there is removed.
        seed: of its client.
        speed: engine seconds per wall second.
        hold_after, hasty, spin: see `site.make`.
        only: agents; none named = all.
        most_open: tasks of the client.
        engine: options of `Engine`.
        endpoint: where the engine listens to agents; a free port if none is named.
        agents: words before each agent's command.
    """

    def __init__(
        self,
        folder: Path,
        *,
        seed: int = 0,
        speed: float = 10.0,
        hold_after: str = "30 s",
        hasty: bool = False,
        spin: bool = False,
        only: Sequence[str] = (),
        most_open: int = 3,
        engine: dict[str, Any] | None = None,
        endpoint: str = "",
        agents: Sequence[str] = (),
    ) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        self.folder, self.speed = folder, speed
        sites.make(folder, hold_after=hold_after, hasty=hasty, spin=spin)
        where = endpoint or f"tcp/127.0.0.1:{free_port()}"
        self.engine = Engine(folder, where, speed=speed, **(engine or {}))
        self.crew = Crew(folder, where, only=only, prefix=agents)
        self.client = Client(self.engine, folder, seed=seed, most_open=most_open)
        self.findings: list[Finding] = []
        self.unkept: list[tuple[float, float]] = []
        self.lag = Lag()
        self._stack = ExitStack()

    def __enter__(self) -> "Torture":
        try:
            self._stack.callback(self.client.close)
            self._stack.callback(self.lag.close)
            self._stack.enter_context(self.crew)
            self._stack.callback(self._end_engine)
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _end_engine(self) -> None:
        self.engine.go_on()
        self.engine.kill()

    # -- steps that rounds and scenarios are made of -----------------------------------------------------------------
    def find(self, what: str, text: str) -> None:
        """Note something that must not be."""
        self.findings.append(Finding(what, text))

    def start(self, agents_within_s: float = 30.0) -> Start:
        """Start the engine; tasks that were acknowledged must be known, and the agents must come."""
        start = self.engine.start()
        if start.ok:
            self.check_known()
            self.wait(self._all_there, agents_within_s)
        return start

    def _all_there(self) -> bool:
        said = self.client.ask("/v1/agents")
        return said.ok and len([one for one in said.body["agents"] if one["liveness"] != "lost"]) >= len(
            self.crew.fleet._specs
        )

    def check_known(self) -> None:
        """Note which acknowledged tasks are not known."""
        acks = list(self.client.acks)
        known = self.client.known()
        if known is not None:
            self.findings += lost(acks, known, self.unkept)

    def wait(self, is_met: Any, within_s: float = 30.0) -> bool:
        """Wait for a condition; return whether it came true."""
        end = time.monotonic() + within_s
        while not is_met():
            if time.monotonic() > end:
                return False
            time.sleep(0.1)
        return True

    def settle(self, within_s: float = ENDS_S) -> None:
        """Heal all, let what is open end, and see every machine on the ground."""
        self.engine.go_on()
        self.engine.fill_disk(None)
        self.crew.heal()
        if not self.engine.runs:
            self.start()
        began, open_ = time.monotonic(), None
        while time.monotonic() - began < within_s:
            if not self.engine.runs and not self.start().ok:
                break
            open_ = self.client.heal(abort=time.monotonic() - began > within_s / 2)
            if open_ == [] and not self.crew.airborne():
                break
            time.sleep(0.5)
        if open_ is None:
            self.find("mute", "the engine does not answer after everything was healed")
        for task in open_ or ():
            self.find(
                "stuck",
                f"{task['id']} {task['status']} {task['held']} did not end within {within_s:g} s: {self._why(task['id'])}",
            )
        for agent in self.crew.airborne():
            self.find("airborne", f"{agent} is still in the air: {self._why_agent(agent)}")
        self.check_known()

    def _why(self, task: str) -> str:
        said = self.client.ask(f"/v1/tasks/{task}/why")
        return "; ".join(one["text"] for one in said.body["because"][:4]) if said.ok else "no answer"

    def _why_agent(self, agent: str) -> str:
        said = self.client.ask(f"/v1/agents/{agent}/why")
        return "; ".join(one["text"] for one in said.body["because"][:4]) if said.ok else "no answer"

    def ends(self) -> dict[str, tuple[str, str]]:
        """Return status and code of each task, as the engine says."""
        said = self.client.ask("/v1/tasks?limit=10000")
        return {one["id"]: (one["status"], one["code"]) for one in said.body["tasks"]} if said.ok else {}

    def judged(self) -> list[Finding]:
        """Return all that was wrong; call it when the engine has ended."""
        evidence = Evidence(
            folder=self.folder, acks=list(self.client.acks), starts=self.engine.starts, ended=self.engine.ended,
            away=self.engine.free(), silent=self.crew.silent, reboots=self.crew.reboots,
            lag_s=self.lag.most_s, speed=self.speed, unkept=self.unkept,
        )  # fmt: skip
        found = [*self.findings, *judge(evidence)]
        found += [Finding("bug", text) for text in self.client.bugs]
        return list(dict.fromkeys(found))


class Round(Struct, frozen=True):
    """What came of a round on one site."""

    seed: int
    site: int
    seconds: float
    tasks: int
    acknowledged: int
    deaths: int
    faults: dict[str, int]
    read: dict[str, int]
    findings: list[Finding]
    lag_s: float
    ends: dict[str, int]
    folder: str = ""


def play(
    folder: Path, seed: int, number: int, duration_s: float, privileges: frozenset[str], gentle: bool = False
) -> Round:
    """Play a round on one site.

    Args:
        folder: becomes the site's; is left there.
        seed: of the round.
        number: of the site in the round.
        duration_s: so long (wall time) things break; then they are healed and have time to end.
        privileges: what may be used besides: `netns`, `mount`.
        gentle: short faults only: a round that is over soon.
    """
    random = Random(f"{seed}/{number}")
    began = time.monotonic()
    weather = Weather(faults_of(random, duration_s, privileges, gentle=gentle), random)
    with weather.ground(folder) as ground:
        torture = Torture(
            folder, seed=random.randrange(1 << 30), speed=random.choice((5.0, 10.0, 15.0)),
            hold_after=random.choice(("30 s", "10 min")), **ground,
        )  # fmt: skip
        with torture:
            torture.start()
            stop = threading.Event()
            worker = threading.Thread(target=_work, args=(torture.client, stop, random.randrange(1 << 30)), daemon=True)
            readers = Readers(torture.client, folder, seed=random.randrange(1 << 30))
            with readers:
                worker.start()
                weather.play(torture, duration_s)
                stop.set()
                worker.join()
            weather.clear(torture)
            torture.settle()
            ends: dict[str, int] = {}
            for status, code in torture.ends().values():
                ends[f"{status} {code}".strip()] = ends.get(f"{status} {code}".strip(), 0) + 1
            torture.engine.end()
            findings = [*torture.judged(), *(Finding("bug", text) for text in readers.bugs), *weather.findings]
    return Round(
        seed, number, round(time.monotonic() - began, 1), len(torture.client.tasks()), len(torture.client.acks),
        len(torture.engine.deaths), dict(weather.done), dict(readers.done), findings, round(torture.lag.most_s, 2), ends,
        str(folder),
    )  # fmt: skip


def _work(client: Client, stop: threading.Event, seed: int) -> None:
    random = Random(seed)
    while not stop.wait(random.uniform(0.1, 0.6)):
        client.work()
