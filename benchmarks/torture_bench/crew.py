"""The simulated agents of a site, each a process of its own that outlives every engine; and what befalls them."""

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any, Final

from msgspec.structs import replace

from agents_sim.launch import FleetProcesses
from agents_sim.world import AgentSpec
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal.rehearsal import fleet_of

from .engine import pythons
from .site import MACHINES, PEOPLE, SCRIPTS

LASTING: Final = {"cruise_drain_pct_s": 0.004, "hover_drain_pct_s": 0.004, "charge_percent_s": 0.5}
"""Batteries that last: what is tried here is no lack of charge."""
WILD: Final = Path(__file__).with_name("wild_agent.py")
PEOPLE_AT: Final = {"picker_1": "camp", "watcher_1": "camp"}


class _Wild(FleetProcesses):
    """Machines that can also go up by nobody's order (`wild_agent`), and agents behind other words, such as `nsenter`."""

    prefix: Sequence[str] = ()

    def _spawn(self, words: list[str], name: str) -> "subprocess.Popen[bytes]":
        assert words[:2] == ["-m", "agents_sim"], words
        with self._open_log(name) as log:
            return subprocess.Popen(
                [*self.prefix, sys.executable, str(WILD), *words[2:]], env=pythons(),
                stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT, start_new_session=True, bufsize=0,
            )  # fmt: skip


class Reboot:
    """A machine that was started anew: when, and how it stood before."""

    def __init__(self, agent: str, wall: float, kind: str, moved: bool) -> None:
        self.agent, self.wall, self.kind, self.moved = agent, wall, kind, moved


class Crew:
    """A context manager: the agents of a site run inside.

    Args:
        folder: the site's; the agents' files go to `sim/`.
        endpoint: where they look for an engine.
        only: agents; none named = all.
        prefix: words before each agent's command.
    """

    def __init__(self, folder: Path, endpoint: str, *, only: Sequence[str] = (), prefix: Sequence[str] = ()) -> None:
        world = read_world([folder / "actions.yaml"], folder / "site.yaml")
        assert world.site is not None
        specs = [
            _spec(one, world.site)
            for one in fleet_of(world.site, world.catalogue, scripts=SCRIPTS)
            if not only or one.id in only
        ]
        self.sim = folder / "sim"
        self.machines = tuple(one.id for one in specs if one.id in MACHINES)
        self.fleet = _Wild(specs, site=world.site.name, connect=endpoint, state_dir=self.sim)
        self.fleet.prefix = prefix
        self.reboots: list[Reboot] = []
        self.silent: list[tuple[str, float, float]] = []
        """Who could not act from when to when: dead, frozen, cut off."""
        self._frozen: dict[str, float] = {}

    def __enter__(self) -> "Crew":
        self.fleet.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.fleet.close()

    # -- what befalls them -------------------------------------------------------------------------------------------
    def freeze(self, agent: str) -> None:
        """Stop its process (SIGSTOP)."""
        if agent not in self._frozen and self.fleet.is_running(agent):
            self.fleet.freeze(agent)
            self._frozen[agent] = time.time()

    def thaw(self, agent: str) -> None:
        """Let it go on."""
        if agent in self._frozen:
            self.fleet.thaw(agent)
            self.silent.append((agent, self._frozen.pop(agent), time.time()))

    def reboot(self, agent: str, to: tuple[float, float, float] | None = None) -> None:
        """Start a machine's process anew; meanwhile it may be put elsewhere (east, north, up in metres)."""
        began = time.time()
        self.thaw(agent)
        self.fleet.kill(agent)
        body = self.body(agent)
        if to is not None and body:
            self._put(agent, to)
        kind = ("hover" if to[2] > 0 else "rest") if to is not None else str(body.get("kind", "rest"))
        self.fleet.start(agent)
        self.reboots.append(Reboot(agent, time.time(), kind, to is not None))
        self.silent.append((agent, began, time.time() + 4.0))

    def _put(self, agent: str, to: tuple[float, float, float]) -> None:
        file = self.sim / f"{agent}.body.json"
        saved = json.loads(file.read_text(encoding="utf-8"))
        at = {"east_m": float(to[0]), "north_m": float(to[1]), "up_m": float(to[2])}
        saved["body"]["segment"]["p0"] = saved["body"]["segment"]["p1"] = at
        saved["body"]["kind"] = "hover" if to[2] > 0 else "rest"
        file.write_text(json.dumps(saved), encoding="utf-8")

    def lift(self, agent: str) -> None:
        """Let a machine on the ground go up by nobody's order."""
        if self.kind(agent) == "rest":
            self.fleet.hand_back(agent)

    def heal(self) -> None:
        """Let all go on, and start those whose process has ended."""
        for agent in list(self._frozen):
            self.thaw(agent)
        for agent in self.fleet.ended():
            self.fleet.start(agent)

    # -- how they stand ----------------------------------------------------------------------------------------------
    def body(self, agent: str) -> dict[str, Any]:
        """Return a body as its own file says; empty if there is none."""
        try:
            return dict(json.loads((self.sim / f"{agent}.body.json").read_text(encoding="utf-8"))["body"])
        except (OSError, ValueError, KeyError):
            return {}

    def kind(self, agent: str) -> str:
        """Return what a body does: rest, hover, climb, cruise, descend, fall."""
        return str(self.body(agent).get("kind", "rest"))

    def airborne(self) -> list[str]:
        """Return the machines that do not rest."""
        return [agent for agent in self.machines if self.kind(agent) != "rest"]

    def one(self, random: Random) -> str:
        """Return a machine."""
        return random.choice(self.machines)


def _spec(one: AgentSpec, site: Any) -> AgentSpec:
    if one.id in PEOPLE:
        return replace(one, at=site.places[PEOPLE_AT[one.id]])
    return replace(one, limits=LASTING)
