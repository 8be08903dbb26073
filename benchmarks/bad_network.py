"""Missions over a bad network: engines in one network namespace, their agents in another, all over TLS with keys.

    python benchmarks/bad_network.py --rounds 3 --beside 10      as root: it makes network namespaces

Between the two a relay in user space (TUN) holds each packet for a while, drops some, and now and then drops all. Missions
run in real time; an operator gives back what came home by itself, and lets go on what waits for a word. Judged by what the
agents noted of themselves: no goal is begun twice, no machines meet. Each task has ended, SUCCEEDED or FAILED with its reason,
and in the end all stand and are free again. Exit code 1 if something is otherwise.
"""

import argparse
import ctypes
import fcntl
import heapq
import json
import os
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, Final

import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from agents_sim.goalbook import read_books
from agents_sim.ledger import judge as tell_referee
from agents_sim.referee import Referee

ROOT: Final = Path(__file__).resolve().parents[1]
NEAR, FAR = "10.77.0.1", "10.77.0.2"
CLONE_NEWNET: Final = 0x40000000
TUNSETIFF: Final = 0x400454CA
IFF_TUN, IFF_NO_PI = 0x0001, 0x1000
MTU: Final = 1400
QUEUE: Final = 4000
"""Packets under way; more are dropped, as by a radio."""


@dataclass(frozen=True)
class Mission:
    """A task, the site that it is for, and who takes part."""

    task: str
    site: Path
    agents: tuple[str, ...]
    params: Mapping[str, str]
    trees: Path | None = None
    within_s: float = 900.0


DEMO: Final = ROOT / "trees" / "demo-site.yaml"
MISSIONS: Final = (
    Mission("PickUp", DEMO, ("hwd_1", "picker_1", "watcher_1"), {"target": "north_field", "user": "picker_1"}),
    Mission(
        "WatchDogRequest", DEMO, ("hwd_1", "picker_1", "watcher_1"),
        {"alarmtype": "lost", "target": "south_field", "username": "picker_1"},
    ),
    Mission(
        "ToteRun", ROOT / "trees" / "warehouse" / "site.yaml", ("rover_1", "lift_1", "loader"),
        {"shelf": "shelf_a", "front": "before_lift", "cabin": "cabin", "table": "packing"},
        ROOT / "trees" / "warehouse" / "trees",
    ),
)  # fmt: skip


FIRST_S: Final = (10.0, 120.0)
"""From the request to the first cut."""
NEXT_S: Final = (60.0, 400.0)
"""From the end of a cut to the next."""


class Relay:
    """Carries packets between two devices, late and with losses.

    Args:
        ends: file descriptors of the two.
        delay_s: of a packet, one way.
        loss: share of packets that are dropped.
        seed: of the losses.
    """

    def __init__(self, ends: tuple[int, int], delay_s: float, loss: float, seed: int) -> None:
        self._ends = ends
        self._delay_s = delay_s
        self._loss = loss
        self._dice = Random(seed)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.is_cut = False
        self.counts: Counter[str] = Counter()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self._over.set()
        self._thread.join(5.0)

    def _run(self) -> None:
        waiting: list[tuple[float, int, int, bytes]] = []
        number = 0
        while not self._over.is_set():
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, _, out, packet = heapq.heappop(waiting)
                os.write(out, packet)
            left = max(0.0, waiting[0][0] - now) if waiting else 0.2
            for end in select.select(self._ends, [], [], min(left, 0.2))[0]:
                packet = os.read(end, 65535)
                self.counts["all"] += 1
                if self.is_cut or len(waiting) > QUEUE or self._dice.random() < self._loss:
                    self.counts["dropped"] += 1
                    continue
                number += 1
                other = self._ends[end == self._ends[0]]
                heapq.heappush(waiting, (time.monotonic() + self._delay_s, number, other, packet))


def sh(*words: str) -> None:
    """Run a command of the system."""
    subprocess.run(words, check=True, capture_output=True)


def tun_in(space: str, address: str) -> int:
    """Make a device in a network namespace; return its descriptor."""
    libc = ctypes.CDLL(None, use_errno=True)
    with open("/proc/self/ns/net", encoding="ascii") as mine, open(f"/run/netns/{space}", encoding="ascii") as there:
        if libc.setns(there.fileno(), CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), "setns")
        try:
            end = os.open("/dev/net/tun", os.O_RDWR)
            fcntl.ioctl(end, TUNSETIFF, struct.pack("16sH22x", b"far0", IFF_TUN | IFF_NO_PI))
        finally:
            libc.setns(mine.fileno(), CLONE_NEWNET)
    for words in (("addr", "add", f"{address}/24", "dev", "far0"), ("link", "set", "far0", "mtu", str(MTU), "up"),
                  ("link", "set", "lo", "up")):  # fmt: skip
        sh("ip", "-n", space, *words)
    return end


@contextmanager
def network(delay_s: float, loss: float, seed: int) -> Iterator[tuple[str, str, Relay]]:
    """Make two namespaces with a relay between them; yield their names and the relay."""
    spaces = (f"fbt-near-{os.getpid()}", f"fbt-far-{os.getpid()}")
    with ExitStack() as stack:
        for space in spaces:
            sh("ip", "netns", "add", space)
            stack.callback(sh, "ip", "netns", "del", space)
        ends = (tun_in(spaces[0], NEAR), tun_in(spaces[1], FAR))
        relay = Relay(ends, delay_s, loss, seed)
        relay.start()
        stack.callback(relay.stop)
        yield (*spaces, relay)


@dataclass
class Run:
    """A site of its own with its router, engine and agents, and one mission."""

    mission: Mission
    number: int
    folder: Path
    spaces: tuple[str, str]
    task_id: str = ""
    wrong: list[str] = field(default_factory=list)
    orders: list[str] = field(default_factory=list)
    """What the operator did."""
    ended: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    _processes: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def formiga(self, *words: str, far: bool = False) -> list[str]:
        """Return a command line in one of the namespaces."""
        return ["ip", "netns", "exec", self.spaces[far], sys.executable, "-m", "formiga_bt", *words]

    def say(self, *words: str) -> str:
        """Run a command; return what it said."""
        done = subprocess.run(
            self.formiga(*words), cwd=self.folder, env=self._env(), capture_output=True, text=True, timeout=180,
            check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def _env(self) -> dict[str, str]:
        return {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}

    def _start(self, name: str, *words: str, far: bool = False) -> None:
        with (self.folder / f"{name}.log").open("wb") as log:
            self._processes.append(
                subprocess.Popen(
                    self.formiga(*words, far=far),
                    cwd=self.folder,
                    env=self._env(),
                    stdout=log,
                    stderr=log,
                    stdin=subprocess.DEVNULL,
                    start_new_session=True,
                )
            )

    def set_up(self) -> None:
        """Make the site with its keys, and start its processes."""
        site = yaml.safe_load(self.mission.site.read_text(encoding="utf-8"))
        name = f"far{self.number}"
        endpoint = f"tls/{NEAR}:{7500 + self.number}"
        site["name"] = name
        site["agents"] = {one: about for one, about in site["agents"].items() if one in self.mission.agents}
        site["transports"] = {"zenoh": {"listen": endpoint, "keys": f".formiga/{name}/keys"}}
        (self.folder / "site.yaml").write_text(yaml.safe_dump(site, sort_keys=False), encoding="utf-8")
        if self.mission.trees is not None:
            shutil.copytree(self.mission.trees, self.folder / "trees")
        self.say("access", "ca", "--host", NEAR)
        self.say("access", "agent", *self.mission.agents)
        self._start("router", "router")
        time.sleep(2.0)
        self._start("engine", "up", "--http", "127.0.0.1:0")
        self._start("sim", "sim", far=True)

    def wait_for_agents(self, until: float) -> None:
        """Wait until all are heard of."""
        while time.monotonic() < until:
            try:
                rows = json.loads(self.say("agents", "--json"))
            except (RuntimeError, ValueError):
                rows = {}
            found = rows["agents"] if isinstance(rows, dict) and "agents" in rows else rows
            here = [one for one in found if isinstance(one, dict) and one.get("at") is not None]
            if len(here) >= len(self.mission.agents):
                return
            time.sleep(2.0)
        raise RuntimeError(f"not all agents are there: {self.say('agents')}")

    def request(self) -> None:
        """Request the task."""
        params = [word for name, value in self.mission.params.items() for word in ("--param", f"{name}={value}")]
        self.task_id = json.loads(self.say("run", self.mission.task, *params, "--json"))["id"]

    def tend(self) -> None:
        """Do what an operator would: give back machines that came home by themselves, let go on what waits for a word."""
        for one in json.loads(self.say("agents", "--json"))["agents"]:
            if one["taken"] and one["control"] == "engine" and one["liveness"] == "ALIVE":
                self._try("handback", one["id"], "--continue" if one["task"] else "--return")
            if one["order"] and one["landed"] == "grounded":
                self._try("continue", one["id"])
        for one in json.loads(self.say("tasks", "--json"))["tasks"]:
            if any(not why.startswith("clearance") for why in one["held"]):
                self._try("continue", one["id"])

    def _try(self, *words: str) -> None:
        """Give an order; one that is refused is noted, and given again later if it still matters."""
        try:
            self.say(*words)
            self.orders.append(" ".join(words))
        except RuntimeError as error:
            self.orders.append(f"refused: {error}")

    def watch(self, began: float) -> bool:
        """Look whether the task has ended and all machines stand; return it."""
        self.tend()
        found = json.loads(self.say("tasks", "--json"))
        rows = found["tasks"] if isinstance(found, dict) else found
        under_way = [one for one in rows if one["status"] in ("PENDING", "ASSIGNED", "ACTIVE", "ENDING")]
        agents = json.loads(self.say("agents", "--json"))["agents"]
        machines = [one for one in agents if one["mobility"] != "people"]
        if under_way or any(one["landed"] == "airborne" or one["pool"] != "STANDBY" for one in machines):
            return False  # also until each machine is known to stand, and is free again
        self.ended = next(one for one in rows if one["id"] == self.task_id)
        self.seconds = time.monotonic() - began
        return True

    def judge(self) -> None:
        """Look at what the agents noted, and at what became of the task."""
        if not self.ended:
            self.wrong.append(f"it did not end in time\n{self._said('why', self.task_id)}\n{self._said('agents')}")
        books = self.folder / ".formiga" / f"far{self.number}" / "sim"
        begun = Counter((one.agent, one.goal) for one in read_books(books) if one.state == "begun")
        self.wrong += [f"{goal} was begun {n} times" for (_, goal), n in begun.items() if n > 1]
        referee = Referee()
        self.wrong += [f"crash: {one}" for one in referee.verdict(tell_referee(books, referee)).crashes]
        if self.ended and self.ended["status"] not in ("SUCCEEDED", "FAILED"):
            self.wrong.append(f"{self.task_id} ended {self.ended['status']}")

    def _said(self, *words: str) -> str:
        try:
            return self.say(*words)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            return str(error)

    def close(self) -> None:
        """End all processes of this run."""
        for one in reversed(self._processes):
            if one.poll() is None:
                one.terminate()
        for one in self._processes:
            try:
                one.wait(30.0)
            except subprocess.TimeoutExpired:
                os.killpg(one.pid, 9)
                one.wait()


def cut_sometimes(relay: Relay, dice: Random, options: argparse.Namespace, over: threading.Event) -> None:
    """Cut the relay some times, at moments by chance."""
    for number in range(options.cuts):
        if over.wait(dice.uniform(*(FIRST_S if number == 0 else NEXT_S))):
            return
        print(f"  cut for {options.cut_s:g} s", flush=True)
        relay.is_cut = True
        over.wait(options.cut_s)
        relay.is_cut = False


def in_turns(runs: Sequence[Run], act: Callable[[Run], None]) -> list[Run]:
    """Do something with each run; return those with which it worked."""
    good = []
    for run in runs:
        try:
            act(run)
            good.append(run)
        except (RuntimeError, subprocess.TimeoutExpired, KeyError, ValueError) as error:
            run.wrong.append(str(error))
    return good


def play(missions: Sequence[Mission], folder: Path, options: argparse.Namespace, seed: int) -> list[Run]:
    """Run missions side by side; return what came of them."""
    runs: list[Run] = []
    with network(options.delay_ms / 1000, options.loss, seed) as (near, far, relay):
        for number, mission in enumerate(missions):
            own = folder / f"{seed}-{number}-{mission.task}"
            own.mkdir(parents=True)
            runs.append(Run(mission, number, own, (near, far)))
        over = threading.Event()
        cuts = threading.Thread(target=cut_sometimes, args=(relay, Random(seed), options, over), daemon=True)
        try:
            ready = in_turns(runs, Run.set_up)
            ready = in_turns(ready, lambda run: run.wait_for_agents(time.monotonic() + 300.0))
            began = time.monotonic()
            left = in_turns(ready, Run.request)
            cuts.start()
            while left and time.monotonic() - began < max(one.mission.within_s for one in left):
                time.sleep(3.0)
                left = [run for run in left if not run.watch(began)]
            for run in ready:
                run.judge()
        finally:
            over.set()
            relay.is_cut = False
            for run in runs:
                run.close()
        print(f"packets: {dict(relay.counts)}", flush=True)
    return runs


def main() -> int:
    """Play the rounds; print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--beside", type=int, default=3, help="missions side by side, of all kinds in turn")
    parser.add_argument("--only", default="", help="this task only")
    parser.add_argument("--delay-ms", type=float, default=250.0, help="one way")
    parser.add_argument("--loss", type=float, default=0.1)
    parser.add_argument("--cut-s", type=float, default=60.0)
    parser.add_argument("--cuts", type=int, default=1, help="of each round, at moments by chance")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if os.geteuid() != 0:
        print("it makes network namespaces: run it as root", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # namespaces and processes are tidied away
    kinds = [one for one in MISSIONS if options.only in ("", one.task)]
    folder = Path(tempfile.mkdtemp(prefix="bad-network-"))
    bad = 0
    rows: list[tuple[str, Run]] = []
    for number in range(options.rounds):
        seed = options.seed + number
        picked = [kinds[(number * options.beside + one) % len(kinds)] for one in range(options.beside)]
        for run in play(picked, folder, options, seed):
            how = run.ended.get("status", "-")
            print(
                f"round {seed} {run.mission.task:<16} {how:<10} {run.ended.get('code') or '':<24} {run.seconds:5.0f} s "
                f"{'good' if not run.wrong else 'NOT GOOD'}  {'; '.join(run.orders)}", flush=True,
            )  # fmt: skip
            for what in run.wrong:
                print(f"    {what}", flush=True)
            bad += bool(run.wrong)
            rows.append((run.mission.task, run))
    for task in dict.fromkeys(name for name, _ in rows):
        of = [run for name, run in rows if name == task]
        ends = Counter(f"{run.ended.get('status', 'no end')} {run.ended.get('code') or ''}".strip() for run in of)
        print(
            f"| {task} | {len(of)} | {', '.join(f'{n} {end}' for end, n in ends.items())} | {sum(not r.wrong for r in of)} |"
        )
    if bad:
        print(f"kept: {folder}")
    else:
        shutil.rmtree(folder)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
