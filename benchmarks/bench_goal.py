"""From one goal to the next over real Zenoh: the agent is another process that succeeds at once.

Each round is: goal sent, accepted, result, next goal ordered and sent. Beside it, in the same run, the wire alone: one Zenoh
query to the same process and back (an agent is asked for a goal that it does not know).

    python benchmarks/bench_goal.py [--goals N]
"""

import argparse
import statistics
import subprocess
import sys
import threading
import time
from itertools import pairwise
from queue import SimpleQueue

from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import EngineStep, SendGoal, Submit
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.transport.messages import QueryReplied
from formiga_bt.transport.zenoh import ZenohTransport

AGENT = """
import sys, time
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import AgentCard
from formiga_bt.transport.zenoh_agent import ZenohAgentLink

class Body:
    todo = []
    def start(self, request):
        self.todo.append((request.goal_id, request.action))
        return ""
    def cancel(self, goal_id):
        return True

body = Body()
link = ZenohAgentLink(sys.argv[1], connect=sys.argv[2])
card = AgentCard(id="hwd_1", type="hwd", boot_id="b", actions=("TakeOff", "GoTo", "LandIn"))
side = AgentSide(card, body, link, now=lambda: time.monotonic_ns() // 1000)
side.set_status(position=Position(15.0, 40.0, 0.0), battery=90.0, landed="grounded")
link.serve(side)
beat = time.monotonic()
while True:
    link.pump(0.2)
    while body.todo:
        goal_id, action = body.todo.pop(0)
        if action != "GoTo":
            up_m = 15.0 if action == "TakeOff" else 0.0
            side.set_status(position=Position(15.0, 40.0, up_m), landed="airborne" if up_m else "grounded")
            side.publish_status()
        side.finish(goal_id, "succeeded")
    if time.monotonic() - beat > 1.0:
        beat = time.monotonic()
        side.publish_status()
"""


def task(goals: int) -> str:
    """Return a task of so many goals that need no clearance and move nothing."""
    step = "  - do: drone.GoTo\n    with: {to: '${at_height(ground(drone.position), 1 m)}'}\n"
    first, last = "  - do: drone.TakeOff\n", "  - do: drone.LandIn\n    with: {at: '${drone.home}'}\n"
    return f"formiga: 1\ntask: Many\nagents:\n  drone: {{type: hwd}}\nsteps:\n{first}{step * goals}{last}"


def main() -> None:
    """Run and print medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goals", type=int, default=300)
    goals = parser.parse_args().goals
    catalogue, _, _ = load_catalogue(files("actions"))
    site, _, _ = load_site(folder("trees") / "demo-site.yaml")
    assert site is not None
    loaded = load_task_text(task(goals), "many.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None, loaded.diagnostics
    transport = ZenohTransport(site.name, listen="tcp/127.0.0.1:0")
    steps: SimpleQueue[EngineStep] = SimpleQueue()
    times: list[float] = []

    def listen(step: EngineStep) -> None:
        if any(isinstance(effect, SendGoal) for effect in step.effects):
            times.append(time.perf_counter())
        steps.put(step)

    driver = RealtimeDriver(Engine(site, catalogue, {"Many": loaded.task}), [transport], listeners=[listen])
    driver.start()
    agent = subprocess.Popen([sys.executable, "-c", AGENT, site.name, transport.endpoint])
    try:
        while "hwd_1" not in driver.engine.state.agents or driver.engine.state.agents["hwd_1"].position is None:
            time.sleep(0.05)
        reply = driver.ask(Submit("Many"))
        assert isinstance(reply, Accepted)
        task_id = reply.task
        while driver.engine.state.tasks[task_id].section != "done":
            time.sleep(0.05)
        outcome = driver.engine.state.tasks[task_id]
    finally:
        driver.stop()
        agent.kill()
        agent.wait()
    assert outcome.status == "SUCCEEDED", outcome
    gaps = [(b - a) * 1e3 for a, b in pairwise(times)]
    wire = wire_ms(site.name, 200)
    median = statistics.median(gaps)
    print(
        f"goal to next goal over Zenoh: {median:.2f} ms median, {sorted(gaps)[int(len(gaps) * 0.99)]:.2f} ms p99 of {len(gaps)}"
    )
    print(
        f"one query over the same wire: {wire:.2f} ms median; ratio {median / wire:.1f} (a goal is a query and a put)"
    )


def wire_ms(site: str, rounds: int) -> float:
    """Return the median of one query to an agent's process and back, milliseconds."""
    transport = ZenohTransport(site, listen="tcp/127.0.0.1:0")
    woken = threading.Event()
    transport.open(woken.set)
    agent = subprocess.Popen([sys.executable, "-c", AGENT, site, transport.endpoint])
    times = []
    try:
        while not any(type(event).__name__ == "AgentSeen" for event in transport.poll()):
            time.sleep(0.01)
        for _ in range(rounds):
            start = time.perf_counter()
            transport.query_goals("hwd_1", ("unknown",))
            while not any(isinstance(event, QueryReplied) for event in transport.poll()):
                woken.wait(1.0)  # not a spin: it would starve the wire's thread
                woken.clear()
            times.append((time.perf_counter() - start) * 1e3)
    finally:
        agent.kill()
        agent.wait()
        transport.close()
    return statistics.median(times)


if __name__ == "__main__":
    main()
