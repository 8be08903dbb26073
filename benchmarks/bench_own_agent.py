"""What an agent of one's own costs: its lines, the time to its first goal, and each goal beside plain Zenoh.

Both agents are processes that a bare engine's end of the wire sends goals to, one after the other. The plain one answers
with what it has written beforehand and keeps none of the rules of `docs/wire.md`: the ratio is their price, and asyncio's.

    python benchmarks/bench_own_agent.py [--goals N] [--rounds N]
    python benchmarks/bench_own_agent.py --keys       # the same agent with keys, beside itself without: TLS and a router

With --keys a request is measured, too: from `add_task` over Zenoh to the first goal at the agent, all of them processes.
"""

import argparse
import contextlib
import json
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from formiga_bt.base.authority import issue, make_authority
from formiga_bt.base.certificates import About, Keys, read_keys
from formiga_bt.base.clock import SECOND
from formiga_bt.base.site_folder import read_address
from formiga_bt.client import Client
from formiga_bt.transport.messages import (
    TERMINAL,
    AgentSeen,
    ClockBeat,
    GoalReported,
    GoalRequest,
    SendFailed,
    TransportEvent,
)
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_session import free_endpoint, open_session

OWN = """
import sys
from formiga_bt.agent import Agent, Place, action, run

class Mule(Agent, type="mule", mobility="ground"):
    @action
    async def Drive(self, to: Place) -> None:
        pass

run(Mule, id="mule_1", site=sys.argv[1], connect=sys.argv[2], keys="".join(sys.argv[3:]), arguments=[])
"""

PLAIN = """
import json, sys, time, zenoh
site, endpoint = sys.argv[1:]
session = zenoh.open(zenoh.Config.from_json5(json.dumps({
    "mode": "peer", "namespace": site, "connect": {"endpoints": [endpoint], "timeout_ms": -1, "exit_on_failure": False},
    "listen": {"endpoints": []}, "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}}})))
me = "mule/mule_1/"
status = {"id": "mule_1", "type": "mule", "boot_id": "b", "seq": 0, "stamp": 0}
card = {"id": "mule_1", "type": "mule", "boot_id": "b", "wire": 2, "mobility": "ground", "actions": ["Drive"]}

def on_goal(query):
    goal = json.loads(query.payload.to_bytes())["goal_id"]
    event = {"goal_id": goal, "agent": "mule_1", "state": "accepted", "n": 1}
    query.reply(str(query.key_expr), json.dumps(event))
    status["seq"] += 1
    session.put(me + "action/Drive/event", json.dumps({**event, "state": "succeeded", "n": 2, "status": status}),
                congestion_control=zenoh.CongestionControl.BLOCK, express=True)

direct = lambda call: zenoh.handlers.Callback(call, None, indirect=False)
kept = [session.declare_queryable(me + "card", direct(lambda query: query.reply(me + "card", json.dumps(card)))),
        session.declare_queryable(me + "action/*/goal", direct(on_goal))]
token = session.liveliness().declare_token(me + "alive")
while True:
    time.sleep(1)
"""


ROUTER = """
import sys, time
from pathlib import Path
from formiga_bt.transport.zenoh_router import Refusals, Router, hear_refusals

router = Router(sys.argv[1], Path(sys.argv[2]), sys.argv[3], simulation=False, tell=lambda text: None)
hear_refusals(Refusals(lambda number: "", lambda text: None))  # as formiga router does: each message is a line of its log
router.open()
while True:
    time.sleep(1)
"""


class Wire:
    """An engine's end of the wire, and one agent's process."""

    def __init__(self, program: str, keys: Path | None = None) -> None:
        self.woken = threading.Event()
        listen = free_endpoint("tls/127.0.0.1:0" if keys is not None else "tcp/127.0.0.1:0")
        self.router = None
        own: list[str] = []
        if keys is not None:
            self.router = subprocess.Popen(
                [sys.executable, "-c", ROUTER, "bench", str(keys), listen], stdout=subprocess.DEVNULL
            )
            own = [str(keys / "mule_1")]
        self.transport = ZenohTransport("bench", listen=listen, keys=keys)
        self.transport.open(self.woken.set)
        self.agent = subprocess.Popen([sys.executable, "-c", program, "bench", listen, *own], stderr=subprocess.DEVNULL)
        self.found: list[TransportEvent] = []
        self.beats = 0
        self.wait(lambda event: isinstance(event, AgentSeen))

    def wait(self, fits: object) -> None:
        """Wait for an event."""
        assert callable(fits)
        end = time.monotonic() + 30
        while not any(fits(event) for event in self.found):
            assert time.monotonic() < end, "no answer"
            self.woken.wait(1.0)
            self.woken.clear()
            self.found = list(self.transport.poll())

    def goal_ms(self, number: int) -> float:
        """Send a goal; return how long its end took."""
        if number % 50 == 0:
            self.beats += 1
            self.transport.publish_clock(
                ClockBeat(wall_us=0, engine_us=self.beats * SECOND, speed=1.0, epoch=1, beat=self.beats)
            )
        goal, fields = f"bench/{number}", {"to": {"east_m": 1.0, "north_m": 2.0}}
        self.found = []
        start = time.perf_counter()
        self.transport.send_goal(
            GoalRequest(goal_id=goal, agent="mule_1", action="Drive", fields=fields, epoch=1, beat=self.beats)
        )

        def ended(event: TransportEvent) -> bool:
            assert not isinstance(event, SendFailed), event
            return isinstance(event, GoalReported) and event.event.goal_id == goal and event.event.state in TERMINAL

        self.wait(ended)
        return (time.perf_counter() - start) * 1e3

    def close(self) -> None:
        """End both, and the router."""
        self.agent.kill()
        self.agent.wait()
        self.transport.close()
        if self.router is not None:
            self.router.kill()
            self.router.wait()


def goals_ms(goals: int, rounds: int, other: Callable[[], Wire]) -> tuple[float, float]:
    """Return the medians of a goal with an agent of one's own and with another one, in turns."""
    wires = [Wire(OWN), other()]
    times: list[list[float]] = [[], []]
    try:
        number = 0
        for each in range(rounds + 1):
            for wire, into in zip(wires, times, strict=True):
                for _ in range(goals // rounds):
                    number += 1
                    into.append(wire.goal_ms(number))
            if each == 0:
                times = [[], []]  # both are warm now
    finally:
        for wire in wires:
            wire.close()
    return statistics.median(times[0]), statistics.median(times[1])


def first_goal_s() -> tuple[float, int]:
    """Return the time from `formiga new agent` to the end of its first goal, with all commands, and the lines of the agent."""
    with tempfile.TemporaryDirectory(prefix="formiga-bench-") as name:
        folder = Path(name)
        start = time.perf_counter()
        call(folder, "-m", "formiga_bt", "new", "agent", "mule.py").wait()
        passed = time.perf_counter() - start
        endpoint = free_endpoint("tcp/127.0.0.1:0")  # not what is measured: no port of another engine
        for file, old, new in (
            ("site.yaml", "tcp/127.0.0.1:7447", endpoint),
            ("mule.py", 'site="', f'connect="{endpoint}", site="'),
        ):
            (folder / file).write_text((folder / file).read_text().replace(old, new))
        start = time.perf_counter()
        up = ["-m", "formiga_bt", "up", "--http", "127.0.0.1:0", "--speed", "20"]
        engine, agent = call(folder, *up), call(folder, "mule.py")
        try:
            while not list(folder.glob(".formiga/*/engine.json")):
                assert engine.poll() is None, "the engine did not start"
                time.sleep(0.01)
            run = call(folder, "-m", "formiga_bt", "run", "TryMule", "--follow")
            assert run.wait(60) == 0, "the first goal failed"
            passed += time.perf_counter() - start
        finally:
            for one in (agent, engine):
                one.terminate()
            for one in (agent, engine):
                with contextlib.suppress(subprocess.TimeoutExpired):
                    one.wait(15)
                one.kill()
                one.wait()
        return passed, lines_of((folder / "mule.py").read_text())


def call(folder: Path, *words: str) -> "subprocess.Popen[bytes]":
    """Start a Python program in a folder."""
    quiet = subprocess.DEVNULL
    return subprocess.Popen([sys.executable, *words], cwd=folder, stdin=quiet, stdout=quiet, stderr=quiet)


def lines_of(text: str) -> int:
    """Return the lines of a program without blank ones and without its docstring."""
    return len([line for line in re.sub(r'^""".*?"""', "", text, flags=re.DOTALL).splitlines() if line.strip()])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goals", type=int, default=600)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--keys", action="store_true", help="measure what keys cost")
    options = parser.parse_args()
    if options.keys:
        with_keys(options.goals, options.rounds)
        return
    passed, lines = first_goal_s()
    print(f"lines: the page's agent {page_lines()}, what `formiga new agent` writes {lines}")
    print(
        f"from `formiga new agent` to the end of the first goal: {passed:.1f} s; 11 s of engine time at speed 20 are in it"
    )
    own, plain = goals_ms(options.goals, options.rounds, lambda: Wire(PLAIN))
    print(f"a goal and its end: {own:.2f} ms; with plain Zenoh {plain:.2f} ms; ratio {own / plain:.2f}")


def with_keys(goals: int, rounds: int) -> None:
    """Measure and print what TLS and a router cost."""
    with tempfile.TemporaryDirectory(prefix="formiga-bench-") as name:
        keys = Path(name) / "keys"
        make_authority(keys, "bench", (), time.time())
        issue(keys, "mule_1", About(), time.time())
        plain, secured = goals_ms(goals, rounds, lambda: Wire(OWN, keys))
    print(f"a goal and its end: {plain:.2f} ms; with TLS and a router {secured:.2f} ms; ratio {secured / plain:.2f}")
    asked = {has_keys: requested_ms(rounds * 10, has_keys=has_keys) for has_keys in (False, True)}
    for has_keys, times in asked.items():
        words = "with TLS and a router" if has_keys else "without keys"
        p90 = sorted(times)[len(times) * 9 // 10]
        print(
            f"from add_task to its first goal at the agent, {words}: {statistics.median(times):.1f} ms, p90 {p90:.1f} ms"
        )


def requested_ms(requests: int, *, has_keys: bool) -> list[float]:
    """Return how long it took from `POST /v1/tasks` to the first goal, which the agent notes on the clock of the machine."""
    with tempfile.TemporaryDirectory(prefix="formiga-bench-") as name:
        folder = Path(name)
        call(folder, "-m", "formiga_bt", "new", "agent", "mule.py").wait()
        site, endpoint = folder / "site.yaml", free_endpoint("tls/127.0.0.1:0" if has_keys else "tcp/127.0.0.1:0")
        (of,) = re.findall(r"^name: (\w+)", site.read_text(), re.MULTILINE)
        keys = f".formiga/{of}/keys"
        options = f'listen: "{endpoint}"' + (f", keys: {keys}" if has_keys else "")
        site.write_text(site.read_text().replace("listen: tcp/127.0.0.1:7447", options))
        noted = folder / "noted.txt"
        (folder / "mule.py").write_text(NOTING.replace("@site", of))
        (folder / "actions" / "mule.yaml").unlink()
        with (folder / "actions" / "mule.yaml").open("wb") as out:
            subprocess.run([sys.executable, "mule.py", "--catalogue"], cwd=folder, stdout=out, check=True)
        (folder / "trees" / "try_mule.yaml").write_text(ONE_GOAL)
        running = []
        if has_keys:
            call(folder, "-m", "formiga_bt", "access", "ca").wait()
            call(folder, "-m", "formiga_bt", "access", "agent", "mule_1").wait()
            call(folder, "-m", "formiga_bt", "access", "program", "shop").wait()
            call(folder, "-m", "formiga_bt", "access", "add", "shop", "--role", "requester").wait()
            running.append(call(folder, "-m", "formiga_bt", "router"))
        running.append(call(folder, "-m", "formiga_bt", "up", "--http", "127.0.0.1:0"))
        running.append(
            call(folder, "mule.py", *(["--keys", f"{keys}/mule_1"] if has_keys else []), "--connect", endpoint)
        )
        try:
            return _requested(
                folder, of, noted, requests, read_keys(folder / keys / "shop", time.time()) if has_keys else None
            )
        finally:
            for one in reversed(running):
                one.terminate()
            for one in running:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    one.wait(15)
                one.kill()
                one.wait()


def _requested(folder: Path, site: str, noted: Path, requests: int, keys: Keys | None) -> list[float]:
    until = time.monotonic() + 40
    while (there := read_address(folder / ".formiga" / site)) is None or not any(
        one.pool == "STANDBY" for one in Client(there).agents().agents if one.id == "mule_1"
    ):
        assert time.monotonic() < until, "the agent is not there"
        time.sleep(0.1)
    client, found = Client(there), []
    app = open_session("client", site, connect=[there.endpoint], keys=keys)
    service = "formiga/add_task" if keys is None else "svc/shop/formiga/add_task"
    for number in range(requests + 5):
        seen, start = noted.read_text().count("\n") if noted.exists() else 0, time.monotonic_ns()
        (reply,) = app.get(service, payload=json.dumps({"keyword": "TryMule"}), timeout=10.0)
        assert reply.ok is not None, reply.err.payload.to_string()
        task = json.loads(reply.ok.payload.to_string())["task_id"]
        while not noted.exists() or noted.read_text().count("\n") == seen:
            assert time.monotonic() < until + requests, "no goal came"
            time.sleep(0.002)
        if number >= 5:  # both are warm now
            found.append((int(noted.read_text().split()[-1]) - start) / 1e6)
        while client.detail(task).task.status not in ("SUCCEEDED", "FAILED"):
            time.sleep(0.01)
    app.close()
    return found


NOTING = """
import time
from pathlib import Path
from formiga_bt.agent import Agent, action, run

class Mule(Agent, type="mule", mobility="none"):
    @action(repeatable=True)
    async def Note(self) -> None:
        \"\"\"Note when it begins.\"\"\"
        with Path("noted.txt").open("a") as out:
            out.write(f"{time.monotonic_ns()}\\n")

if __name__ == "__main__":
    run(Mule, id="mule_1", site="@site")
"""
ONE_GOAL = """
formiga: 1
task: TryMule
agents:
  mule: {type: mule}
steps:
  - do: mule.Note
    timeout: 10 min
"""


def page_lines() -> int:
    """Return the lines of the agent in docs/agent.md."""
    page = (Path(__file__).parents[1] / "docs" / "agent.md").read_text(encoding="utf-8")
    return lines_of(next(one for one in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "class Mule" in one))


if __name__ == "__main__":
    main()
