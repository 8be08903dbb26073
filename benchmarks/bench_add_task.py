"""From an app's `formiga/add_task` to the first goal at its agent, over real Zenoh: app, engine and agent are processes.

On the way: the call, its order, the look of the allocator (at most 50 ms after the last one), the journal's commits, the gate,
the goal. Beside it the call alone: to its reply, and of `get_mex_list`, which only reads. One task at a time.

    python benchmarks/bench_add_task.py [--tasks N] [--no-journal]
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from formiga_bt.base.packaged import files, folder
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.services.host import EngineHost
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_session import close_session, open_session

AGENT = """
import sys, time
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.messages import AgentCard
from formiga_bt.transport.zenoh_agent import ZenohAgentLink

class Body:
    todo = []
    def start(self, request):
        print(time.monotonic_ns(), request.goal_id, flush=True)
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
        up_m = 15.0 if action == "TakeOff" else 0.0
        side.set_status(position=Position(15.0, 40.0, up_m), landed="airborne" if up_m else "grounded")
        side.publish_status()
        side.finish(goal_id, "succeeded")
    if time.monotonic() - beat > 1.0:
        beat = time.monotonic()
        side.publish_status()
"""
TASK = """\
formiga: 1
task: Hop
agents: {drone: {type: hwd}}
steps:
  - do: drone.TakeOff
  - do: drone.LandIn
    with: {at: '${drone.home}'}
"""


def call(session: Any, service: str, **request: Any) -> tuple[Any, float, int]:
    """Return the reply to a call, how long it took in milliseconds, and when it was sent in nanoseconds."""
    sent = time.monotonic_ns()
    for reply in session.get(service, payload=json.dumps(request), timeout=12.0):
        assert reply.ok is not None, reply.err.payload.to_string()
        return json.loads(reply.ok.payload.to_bytes()), (time.monotonic_ns() - sent) / 1e6, sent
    raise AssertionError(f"no answer of {service}")


def main() -> None:
    """Run and print medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=100)
    parser.add_argument("--no-journal", action="store_true")
    options = parser.parse_args()
    catalogue, _, _ = load_catalogue(files("actions"))
    site, _, _ = load_site(folder("trees") / "demo-site.yaml")
    assert site is not None
    loaded = load_task_text(TASK, "hop.yaml", catalogue=catalogue, site=site)
    assert loaded.task is not None, loaded.diagnostics
    wire = ZenohTransport(site.name, listen="tcp/127.0.0.1:0")
    journal = None if options.no_journal else JournalAt()
    with (
        tempfile.TemporaryDirectory() as beside,
        EngineHost(
            site,
            catalogue,
            {"Hop": loaded.task},
            beside=Path(beside),
            http="127.0.0.1:0",
            wires=[wire],
            journal=journal,
        ) as host,
    ):
        command = [sys.executable, "-c", AGENT, site.name, wire.endpoint]
        agent = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        session = open_session("client", site.name, connect=[wire.endpoint])
        try:
            measure(host, session, agent, options.tasks)
        finally:
            close_session(session)
            agent.kill()
            agent.communicate()


def measure(host: EngineHost, session: Any, agent: "subprocess.Popen[str]", tasks: int) -> None:
    """Request tasks one by one, each after the end of the one before."""
    assert agent.stdout is not None
    to_goal, to_reply, to_list = [], [], []
    for number in range(tasks + 5):
        while not any(one["available"] for one in call(session, "fleet_manager_front/get_mex_list")[0]["mex"]):
            time.sleep(0.02)
        time.sleep(0.1)  # the look of the allocator before is over
        to_list.append(call(session, "fleet_manager_front/get_mex_list")[1])
        reply, took_ms, sent = call(session, "formiga/add_task", keyword="Hop", key=f"k{number}")
        at, goal = agent.stdout.readline().split()
        assert goal.startswith(f"{reply['task_id']}/1/steps/steps[0]"), goal
        to_goal.append((int(at) - sent) / 1e6)
        to_reply.append(took_ms)
        agent.stdout.readline()
        while host.orders.task(reply["task_id"]).task.status != "SUCCEEDED":
            time.sleep(0.01)
    for what, found in (
        ("add_task to the first goal at its agent", to_goal), ("add_task to its reply", to_reply),
        ("get_mex_list to its reply", to_list),
    ):  # fmt: skip
        kept = sorted(found[5:])  # the first ones load libraries
        print(
            f"{what}: {statistics.median(kept):.1f} ms median, {kept[int(len(kept) * 0.95)]:.1f} ms p95 of {len(kept)}"
        )


if __name__ == "__main__":
    main()
