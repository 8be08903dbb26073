"""From a goal's result to the next goal, among 10,000 active tasks: in process, and over Zenoh beside a bare ping-pong.

In process: one `Engine.handle` that takes the result and returns the next goal, in an engine of so many missions and in one of
100, in turns. Over Zenoh: an agent in another process tells a result and waits for its next goal, while the engine has so many
other tasks active; its messages are two, one there and one back, and so are those of the ping-pong, in the same processes and
the same run, by the clock: on a machine that has more to do, the p99 is mostly the scheduler's.

    python benchmarks/bench_reaction.py [--tasks 10000] [--goals 800] [--wire-goals 300] [--out FILE]
"""

import argparse
import gc
import json
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.peers.ours import OurFleet, world
from benchmarks.peers.trees import ACTIONS_IN_TURN, mission, task_text
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Submit
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.loader import load_task_text
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_session import close_session, free_endpoint, on_network_thread, open_session

RESULTS = Path(__file__).parent / "results"
SMALL = 100
BYTES = 400
"""A goal and a result are about so long on the wire."""
PORTION = 5000
PATIENCE_S = 120.0
IDLE = """
formiga: 1
task: Idle
steps:
  - wait: 12 h
    timeout: 24 h
"""
AGENT = """
import json, sys, threading, time
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import AgentCard
from formiga_bt.transport.zenoh_agent import ZenohAgentLink
from formiga_bt.transport.zenoh_session import close_session, on_network_thread, open_session

site, engine, echo, rounds, size, goals = *sys.argv[1:4], *map(int, sys.argv[4:])

def ping(count):
    session = open_session("peer", "bare", connect=[echo])
    came, gaps = threading.Event(), []
    kept = session.declare_subscriber("pong", on_network_thread(lambda sample: came.set()))
    while not came.wait(0.2):
        session.put("ping", b"x" * size)
    time.sleep(0.5)
    for _ in range(count):
        came.clear()
        start = time.perf_counter()
        session.put("ping", b"x" * size)
        came.wait(5.0)
        gaps.append(time.perf_counter() - start)
    close_session(session)
    del kept
    return gaps

class Body:
    todo, told, gaps = [], 0.0, []
    def start(self, request):
        if self.told:
            self.gaps.append(time.perf_counter() - self.told)
        self.todo.append(request.goal_id)
        return ""
    def cancel(self, goal_id):
        return True

before = ping(rounds)
body = Body()
link = ZenohAgentLink(site, connect=engine)
card = AgentCard(id="worker_0", type="worker", boot_id="b", actions=("Work",), mobility="people")
side = AgentSide(card, body, link, now=lambda: time.monotonic_ns() // 1000)
side.set_status(position=Position(0.0, 0.0, 0.0))
link.serve(side)
beat = time.monotonic()
while len(body.gaps) < goals - 1:
    link.pump(0.2)
    while body.todo:
        goal = body.todo.pop(0)
        body.told = time.perf_counter()
        side.finish(goal, "succeeded")
    if time.monotonic() - beat > 1.0:
        beat = time.monotonic()
        side.publish_status()
print(json.dumps({"reaction": body.gaps, "bare": before + ping(rounds)}), flush=True)
"""


def centile(values: list[float], share: float) -> float:
    """Return a centile of what was measured."""
    return sorted(values)[min(len(values) - 1, int(len(values) * share))]


def figures(values_s: list[float]) -> dict[str, float]:
    """Return p50 and p99 in microseconds."""
    return {"p50_us": round(statistics.median(values_s) * 1e6, 1), "p99_us": round(centile(values_s, 0.99) * 1e6, 1)}


class Missions:
    """An engine of so many missions, whose results are asked for one by one."""

    def __init__(self, tasks: int) -> None:
        self.fleet = OurFleet(task_text("mission", mission()), tasks)
        self.turns = [(task, action) for action in ACTIONS_IN_TURN[:-1] for task in range(min(tasks, SMALL))]
        self.turns.reverse()

    def react(self) -> tuple[float, float]:
        """Return seconds from a result to the next goal, by the clock and of the processor."""
        tree, action = self.turns.pop()
        fleet = self.fleet
        given = fleet.event(fleet.goals[fleet.ids[tree]].pop(action), "succeeded")
        began, cpu = time.perf_counter(), time.thread_time()
        step = fleet.engine.handle(fleet.now, given)
        took = time.perf_counter() - began, time.thread_time() - cpu
        (goal,) = [effect for effect in step.effects if type(effect).__name__ == "SendGoal"]
        fleet.goals[fleet.ids[tree]][goal.fields["leaf"]] = goal.goal_id
        return took


def in_process(tasks: int, goals: int) -> dict[str, Any]:
    """Measure in this process: many tasks and few, in turns."""
    small, large = Missions(min(tasks, SMALL)), Missions(tasks)
    gc.collect()
    gc.freeze()
    pairs = [(large.react(), small.react()) for _ in range(min(goals, len(small.turns)))]
    gc.unfreeze()
    found: dict[str, Any] = {"tasks": tasks, "goals": len(pairs)}
    for kind, name in enumerate(("wall", "cpu")):
        found[name] = {"many": figures([a[kind] for a, _ in pairs]), "few": figures([b[kind] for _, b in pairs])}
    return found


def many_goals(count: int) -> str:
    """Return a task of so many goals, one after another."""
    step = "  - do: worker.Work\n    with: {leaf: x}\n"
    return f"formiga: 1\ntask: Many\nagents:\n  worker: {{type: worker, id: worker_0}}\nsteps:\n{step * count}"


def over_zenoh(tasks: int, goals: int) -> dict[str, Any]:
    """Measure over loopback, with so many other tasks active."""
    site, catalogue = world()
    models = {}
    for text in (IDLE, many_goals(goals)):
        loaded = load_task_text(text, "reaction.yaml", catalogue=catalogue, site=site)
        assert loaded.task is not None, loaded.diagnostics
        models[loaded.task.name] = loaded.task
    engine = Engine(site, catalogue, models)
    transport = ZenohTransport(site.name, listen="tcp/127.0.0.1:0")
    driver = RealtimeDriver(engine, [transport])
    endpoint = free_endpoint("tcp/127.0.0.1:0")
    echo = open_session("router", "bare", listen=[endpoint])
    publisher = echo.declare_publisher("pong")
    kept = echo.declare_subscriber("ping", on_network_thread(lambda sample: publisher.put(sample.payload)))
    driver.start()
    agent = None
    try:
        for first in range(0, tasks, PORTION):
            for answer in [driver.post(Submit("Idle")) for _ in range(min(PORTION, tasks - first))]:
                assert isinstance(answer.result(PATIENCE_S), Accepted)
            _wait(lambda first=first: _active(engine) >= min(first + PORTION, tasks))
        arguments = [site.name, transport.endpoint, endpoint, str(goals // 2), str(BYTES), str(goals)]
        agent = subprocess.Popen([sys.executable, "-c", AGENT, *arguments], stdout=subprocess.PIPE, text=True)
        _wait(lambda: "worker_0" in engine.state.agents)
        driver.ask(Submit("Many"))
        told, _ = agent.communicate(timeout=PATIENCE_S)
        got = json.loads(told)
    finally:
        if agent is not None:
            agent.kill()
            agent.wait()
        driver.stop()
        del kept
        close_session(echo)
    return {"tasks": tasks, "reaction": figures(got["reaction"]), "bare": figures(got["bare"])}


def _active(engine: Engine) -> int:
    # Read from another thread: a count that is too small for a moment is looked at again.
    return sum(task.status == "ACTIVE" for task in list(engine.state.tasks.values()))


def _wait(done: Any) -> None:
    end = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < end, "it does not come on"
        time.sleep(0.1)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=10_000)
    parser.add_argument("--goals", type=int, default=800)
    parser.add_argument("--wire-goals", type=int, default=300, help="0: not over Zenoh")
    parser.add_argument("--out", type=Path, default=RESULTS / "reaction.json")
    options = parser.parse_args()
    found: dict[str, Any] = {"in_process": in_process(options.tasks, options.goals)}
    for kind, said in (("wall", "by the clock"), ("cpu", "of the processor")):
        many, few = found["in_process"][kind]["many"], found["in_process"][kind]["few"]
        print(
            f"result to next goal in process, {said}: {options.tasks:,} tasks: p50 {many['p50_us']:.0f} us, "
            f"p99 {many['p99_us']:.0f} us; {SMALL}: {few['p50_us']:.0f} and {few['p99_us']:.0f} us; "
            f"x{many['p50_us'] / few['p50_us']:.2f} and x{many['p99_us'] / few['p99_us']:.2f}"
        )
    if options.wire_goals:
        found["zenoh"] = wire = over_zenoh(options.tasks, options.wire_goals)
        here, bare = wire["reaction"], wire["bare"]
        print(
            f"over Zenoh, {options.tasks:,} tasks: p50 {here['p50_us'] / 1e3:.2f} ms, p99 {here['p99_us'] / 1e3:.2f} ms; "
            f"bare ping-pong {bare['p50_us'] / 1e3:.2f} and {bare['p99_us'] / 1e3:.2f} ms; "
            f"x{here['p50_us'] / bare['p50_us']:.1f} and x{here['p99_us'] / bare['p99_us']:.1f}"
        )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(f"written: {options.out}")


if __name__ == "__main__":
    main()
