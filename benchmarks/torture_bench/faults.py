"""What breaks in a round, and when: drawn before it begins, so that a seed brings the same again.

A fault is a word and its numbers. What needs more than an ordinary user (network namespaces, mounts) is drawn
only where it may be used; the ground for it is laid before the engine starts.
"""

import shutil
import subprocess
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from .deaf import Crowd
from .engine import pythons
from .judge import Finding
from .privileged import Disk, Net
from .site import HOMES, MACHINES, PEOPLE, PLACES, PORTS
from .wall import Wall

if TYPE_CHECKING:
    from .play import Torture

KINDS: Final = {
    "kill": 6, "kill_soon": 2, "stop": 3, "stop_long": 1, "freeze": 3, "reboot": 2, "move": 3, "full": 2, "crowd": 2, "deaf": 2,
    "second": 2, "pilot": 1, "lift": 2, "descriptors": 1, "clock": 2,
}  # fmt: skip
"""Word -> how often it is drawn."""
MORE: Final = {"mount": {"read_only": 2, "tiny": 1}, "netns": {"cut": 3}}


class Fault(Struct, frozen=True):
    """Something that breaks `at_s` seconds after the round began, and lasts."""

    at_s: float
    kind: str
    lasts_s: float = 0.0
    who: str = ""
    number: float = 0.0
    place: str = ""


def faults_of(random: Random, duration_s: float, privileges: frozenset[str], *, gentle: bool = False) -> list[Fault]:
    """Draw the faults of a round."""
    kinds = dict(KINDS)
    for privilege in sorted(privileges):
        kinds |= MORE.get(privilege, {})
    if gentle:
        kinds.pop("stop_long")
    found, at = [], random.uniform(1.0, 4.0)
    while at < duration_s:
        kind = random.choices(list(kinds), list(kinds.values()))[0]
        who = random.choice((*MACHINES, *MACHINES, *PEOPLE) if kind == "freeze" else MACHINES)
        long_s = 60.0 if kind == "stop_long" else 4.0 if gentle else 15.0
        found.append(
            Fault(
                round(at, 2), kind, round(random.uniform(1.0, long_s), 2), who, round(random.random(), 3),
                random.choice((*PORTS, *PLACES)),
            )
        )  # fmt: skip
        at += random.uniform(1.0, 4.0 if gentle else 9.0)
    return found


class Weather:
    """Plays the faults of a round.

    Args:
        faults: which.
        random: of details that do not matter.
    """

    def __init__(self, faults: Sequence[Fault], random: Random) -> None:
        self.faults, self._random = list(faults), random
        self.done: Counter[str] = Counter()
        self.findings: list[Finding] = []
        self._later: list[tuple[float, str, Fault]] = []
        self._crowds: list[Crowd] = []
        self._full_since: float | None = None
        self._clock: Wall | None = None
        self._disk: Disk | None = None
        self._net: Net | None = None

    @contextmanager
    def ground(self, folder: Path) -> Iterator[dict[str, Any]]:
        """Lay the ground for faults that need one before the engine starts; yield options of `Torture`."""
        kinds = {fault.kind for fault in self.faults}
        options: dict[str, Any] = {"engine": {"environment": {}, "prefix": []}}
        shutil.rmtree(folder, ignore_errors=True)
        if "clock" in kinds:
            self._clock = Wall(folder.with_name(folder.name + ".clock"))
            options["engine"]["environment"].update(self._clock.environment())
        if kinds & {"read_only", "tiny"}:
            self._disk = Disk(folder)
        if "cut" in kinds:
            self._net = Net()
            options["endpoint"], options["agents"] = self._net.endpoint, self._net.prefix
        try:
            yield options
        finally:
            for one in (self._disk, self._net):
                if one is not None:
                    one.close()

    # -- the time of the round ---------------------------------------------------------------------------------------
    def play(self, torture: "Torture", duration_s: float) -> None:
        """Let everything break in its time."""
        began = time.monotonic()
        waiting = list(self.faults)
        while (now := time.monotonic() - began) < duration_s:
            for at, what, fault in [one for one in self._later if one[0] <= now]:
                self._later.remove((at, what, fault))
                self._end(torture, what, fault)
            if waiting and waiting[0].at_s <= now:
                fault = waiting.pop(0)
                self.done[fault.kind] += 1
                self._begin(torture, fault, now)
            time.sleep(0.05)

    def clear(self, torture: "Torture") -> None:
        """End what lasts."""
        for _, what, fault in self._later:
            self._end(torture, what, fault)
        self._later.clear()
        for crowd in self._crowds:
            crowd.close()

    def _later_on(self, now: float, what: str, fault: Fault) -> None:
        self._later.append((now + fault.lasts_s, what, fault))

    def _begin(self, torture: "Torture", fault: Fault, now: float) -> None:
        engine, crew = torture.engine, torture.crew
        match fault.kind:
            case "kill" | "kill_soon":
                engine.go_on()
                engine.kill()
                if fault.number < 0.35:  # the fleet changes while nobody looks
                    self._move(torture, fault)
                    self.done["move"] += 1
                if fault.kind == "kill_soon":
                    self._start(torture)
                else:
                    self._later_on(now, "start", fault)
            case "stop" | "stop_long":
                engine.stop()
                self._later_on(now, "go_on", fault)
            case "freeze":
                crew.freeze(fault.who)
                self._later_on(now, "thaw", fault)
            case "reboot":
                crew.reboot(fault.who)
            case "lift":
                crew.lift(fault.who)
            case "move":
                self._move(torture, fault)
            case "full":
                self._fill(torture, fault, now)
            case "crowd" | "deaf":
                if engine.url:
                    crowd = Crowd(engine.url, 30 + int(fault.number * 200), deaf=fault.kind == "deaf")
                    crowd.open()
                    self._crowds.append(crowd)
                    self._later_on(now, "crowd_leaves", fault)
            case "second":
                self._second(torture)
            case "pilot":
                crew.fleet.take_over(fault.who)
                crew.silent.append((fault.who, time.time() - 2.0, time.time() + fault.lasts_s + 3.0))
                self._later_on(now, "hand_back", fault)
            case "descriptors":
                self._descriptors(torture, 16 + int(fault.number * 40))
                self._later_on(now, "descriptors_free", fault)
            case "clock" if self._clock is not None:
                self._clock.jump(self._random.choice((-86400, -3600, -30, -2, 2, 30, 3600, 86400)))
            case "read_only" if self._disk is not None:
                engine.go_on()
                engine.kill()
                self._disk.read_only(True)
                self._full(torture)
                self._start(torture)
                self._later_on(now, "writable", fault)
            case "tiny" if self._disk is not None:
                self._disk.fill()
                self._full(torture)
                self._later_on(now, "room", fault)
            case "cut" if self._net is not None:
                self._net.cut(True)
                crew.silent += [
                    (who, time.time() - 1.0, time.time() + fault.lasts_s + 12.0) for who in (*MACHINES, *PEOPLE)
                ]
                self._later_on(now, "join", fault)
            case _:
                self.done[f"{fault.kind} (not here)"] += 1

    def _end(self, torture: "Torture", what: str, fault: Fault) -> None:
        engine, crew = torture.engine, torture.crew
        match what:
            case "start":
                self._start(torture)
            case "go_on":
                engine.go_on()
            case "thaw":
                crew.thaw(fault.who)
            case "crowd_leaves":
                if self._crowds:
                    self._crowds.pop(0).close()
            case "hand_back":
                if crew.body(fault.who).get("control") == "pilot":
                    crew.fleet.hand_back(fault.who)
            case "roomy":
                engine.fill_disk(None)
                self._has_room(torture)
            case "descriptors_free":
                self._descriptors(torture, None)
            case "writable" if self._disk is not None:
                torture.engine.kill()
                self._disk.read_only(False)
                self._has_room(torture)
                self._start(torture)
            case "room" if self._disk is not None:
                self._disk.free()
                self._has_room(torture)
            case "join" if self._net is not None:
                self._net.cut(False)
            case _:
                raise AssertionError(what)

    # -- single faults -----------------------------------------------------------------------------------------------
    def _start(self, torture: "Torture") -> None:
        if torture.engine.runs:
            return
        torture.engine.harmed = "its disk takes nothing" if self._full_since is not None else ""
        if torture.engine.start().ok:
            torture.check_known()

    def _move(self, torture: "Torture", fault: Fault) -> None:
        """Carry a machine away, or home, while its process is dead; mostly on the ground."""
        east, north = (PORTS | PLACES)[fault.place]
        taken = [torture.crew.body(one).get("segment", {}).get("p1", {}) for one in MACHINES if one != fault.who]
        if any((east, north) == PORTS[port] for who, port in HOMES.items() if who != fault.who):
            east += 7.0  # whose port it is may come home by itself, and knows nothing of this one
        if any(abs(at.get("east_m", 1e9) - east) < 6 and abs(at.get("north_m", 1e9) - north) < 6 for at in taken):
            east += 7.0
        torture.crew.reboot(fault.who, (east, north, 0.0 if fault.number < 0.85 else 40.0))

    def _full(self, torture: "Torture") -> None:
        if self._full_since is None:
            self._full_since = time.time()
            torture.unkept.append((self._full_since, 1e18))

    def _has_room(self, torture: "Torture") -> None:
        if self._full_since is not None:
            torture.unkept[-1] = (self._full_since, time.time())
            self._full_since = None

    def _fill(self, torture: "Torture", fault: Fault, now: float) -> None:
        sizes = [file.stat().st_size for file in (torture.folder / ".formiga").glob("*/*") if file.is_file()]
        torture.engine.fill_disk(int(fault.number * max(sizes, default=0)) + 4096)
        self._full(torture)
        self._later_on(now, "roomy", fault)

    def _descriptors(self, torture: "Torture", number: int | None) -> None:
        import resource

        if torture.engine.runs:
            _, hard = resource.prlimit(torture.engine.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(torture.engine.pid, resource.RLIMIT_NOFILE, (number or min(hard, 1024), hard))

    def _second(self, torture: "Torture") -> None:
        """A second engine on the same site is refused, with a word."""
        if not torture.engine.runs or torture.engine.stands_still:
            return
        try:
            ran = subprocess.run(
                torture.engine.words(), cwd=torture.folder, env=pythons(), stdin=subprocess.DEVNULL,
                capture_output=True, text=True, timeout=180.0, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            self.findings.append(Finding("second", "a second engine on the site did not end within 180 s"))
            return
        said = ran.stdout + ran.stderr
        if ran.returncode == 0 or "help:" not in said or "Traceback" in said:
            self.findings.append(
                Finding("second", f"a second engine on the site: status {ran.returncode}, {said[-800:]}")
            )
