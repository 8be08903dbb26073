"""PickUp missions a second in virtual time: the whole engine, allocator and gate on, 200 scripted agents in this process.

Each goal is answered with accept, one feedback, five statuses and a result; people answer their questions the same way. Agents
without a goal report often enough to count as alive. No physics and no wire: what is measured is the engine and its driver.

    python benchmarks/bench_missions.py [--missions 600] [--profile] [--log FILE]

Prints one line per figure. Exit status 1 if a mission did not succeed. `--log` writes every step as a line of JSON, to compare
two versions of the engine.
"""

import argparse
import cProfile
import gc
import pstats
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import msgspec

from agents_sim.world import AgentSpec, grid_fleet
from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.machines import Mobility
from formiga_bt.base.packaged import files, folder
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.lang.loader import load_catalogue, load_task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.simulation import fleet_site
from formiga_bt.transport import messages as msg

N_DRONES, N_LIGHT, N_PICKERS, N_WATCHERS = 110, 25, 60, 5
START: Micros = 1_000_000 * SECOND
STATUSES = 5
EVERY_US: Micros = 2_900_000
"""Between two statuses of a goal: a machine that is silent for 3 s counts as suspect, and one that jumps is not believed."""
IDLE_US: Micros = 2_900_000
"""A machine without a goal reports so often; a person ten times less."""
LIMIT_US: Micros = 24 * 3600 * SECOND


class Agent:
    """One agent that does whatever it is told within five statuses."""

    def __init__(self, wire: "Wire", spec: AgentSpec) -> None:
        self.wire = wire
        self.id, self.type = spec.id, spec.type
        self.human = spec.type in ("picker", "watcher")
        self.mobility: Mobility = "people" if self.human else "air"
        self.at = Position(spec.at.east_m, spec.at.north_m, 0.0)
        self.landed: Any = "grounded"
        self.goal = ""
        self.way = self.at, self.at
        self.began: Micros = 0
        self.seq = 0
        self.reported: Micros = 0

    def status(self) -> msg.AgentStatus:
        self.seq += 1
        self.reported = now = self.wire.scheduler.now()
        if self.goal and not self.human:
            self._move((now - self.began) / (STATUSES * EVERY_US))
        word = "EXECUTING ACTION" if self.goal else "STANDBY"
        return msg.AgentStatus(
            id=self.id, type=self.type, status=word, battery=90.0, position=self.at, landed=self.landed, boot_id="b",
            seq=self.seq, stamp=now,
        )  # fmt: skip

    def idle(self) -> None:
        """Report if nothing was reported lately."""
        every = IDLE_US * 10 if self.human else IDLE_US
        now = self.wire.scheduler.now()
        if now - self.reported >= every:
            self.wire.idle += 1
            self.wire.tell(msg.StatusArrived(self.status()))
        self.wire.scheduler.call_at(self.reported + every, self.idle)

    def begin(self, order: msg.GoalRequest) -> None:
        self.goal = order.goal_id
        self.wire.goals += 1
        self.way, self.began = self._way(order), self.wire.scheduler.now()
        self._news(order, 1, "accepted")
        self.wire.scheduler.call_at(self.began + EVERY_US, partial(self._go_on, order, 1))

    def _move(self, part: float) -> None:
        a, b = self.way
        self.at = b if part >= 1.0 else Position(
            a.east_m + part * (b.east_m - a.east_m), a.north_m + part * (b.north_m - a.north_m),
            a.up_m + part * (b.up_m - a.up_m),
        )  # fmt: skip
        self.landed = "grounded" if self.at.up_m <= 0.0 else "airborne"

    def _way(self, order: msg.GoalRequest) -> tuple[Position, Position]:
        if order.action == "TakeOff":
            return self.at, Position(self.at.east_m, self.at.north_m, order.fields["altitude"])
        to = order.fields.get("to") or order.fields.get("at")
        return self.at, self.at if to is None else Position(to["east_m"], to["north_m"], to.get("up_m", 0.0))

    def _go_on(self, order: msg.GoalRequest, n: int) -> None:
        self.wire.tell(msg.StatusArrived(self.status()))
        if n == 2:
            self._news(order, 2, "running")
        if n < STATUSES:
            self.wire.scheduler.call_at(self.wire.scheduler.now() + EVERY_US, partial(self._go_on, order, n + 1))
            return
        self.goal = ""
        result: dict[str, Any] = {}
        if self.human:
            result = {"answer": order.fields["options"][0], "by": self.id, "at": self.wire.scheduler.now()}
        self._news(order, 3, "succeeded", result)

    def _news(self, order: msg.GoalRequest, n: int, state: Any, result: dict[str, Any] | None = None) -> None:
        status = self.status() if state == "succeeded" else None
        self.wire.tell(
            msg.GoalReported(
                msg.GoalEvent(
                    goal_id=order.goal_id, agent=self.id, state=state, n=n, result=result or {}, status=status,
                    progress=0.4 if state == "running" else None,
                )
            )
        )  # fmt: skip


class Wire:
    """The transport of all of them: an `AgentTransport` without any wire."""

    name = "scripted"
    guarantees = GUARANTEES

    def __init__(self, scheduler: VirtualScheduler, specs: Sequence[AgentSpec], actions: dict[str, Any]) -> None:
        self.scheduler = scheduler
        self.news: list[msg.TransportEvent] = []
        self.agents = {spec.id: Agent(self, spec) for spec in specs}
        self.goals = self.idle = 0
        for agent in self.agents.values():
            card = msg.AgentCard(
                id=agent.id, type=agent.type, boot_id="b", actions=actions[agent.type], mobility=agent.mobility
            )
            self.tell(msg.AgentSeen(card))
            agent.idle()

    def tell(self, event: msg.TransportEvent) -> None:
        self.news.append(event)

    def open(self, wake: Callable[[], None]) -> None:
        """Nothing to open."""

    def close(self) -> None:
        """Nothing to close."""

    def poll(self) -> Sequence[msg.TransportEvent]:
        news = self.news
        if news:
            self.news = []
        return news

    def send_goal(self, request: msg.GoalRequest) -> None:
        self.agents[request.agent].begin(request)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Only questions that another person answered are withdrawn; who was asked goes on to its own end."""

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        raise AssertionError(f"{agent} was asked about {goal_ids}: it should not have been silent")

    def publish_clock(self, beat: msg.ClockBeat) -> None:
        """Nobody listens."""


class Run:
    """One engine, its agents and requests: one mission after another for each picker."""

    def __init__(self, count: int, log: TextIO | None) -> None:
        catalogue, problems, _ = load_catalogue(files("actions"))
        assert not problems, problems
        specs = grid_fleet(N_LIGHT, N_DRONES, N_PICKERS, N_WATCHERS, field_spacing_m=45.0)
        site = fleet_site(specs)
        loaded = load_task(folder("trees") / "pick_up.yaml", catalogue=catalogue, site=site)
        assert loaded.task is not None, loaded.diagnostics
        self.scheduler = VirtualScheduler(START)
        actions = {name: kind.actions for name, kind in catalogue.types.items()}
        self.wire = Wire(self.scheduler, specs, actions)
        self.engine = Engine(site, catalogue, {loaded.task.name: loaded.task})
        self.driver = VirtualDriver(self.engine, [self.wire], self.scheduler)
        self.driver.start()
        self.left = count
        self.pickers = [spec for spec in specs if spec.type == "picker"]
        self.of: dict[str, AgentSpec] = {}
        self.outcomes: Counter[str] = Counter()
        self.steps = Counter[str]()
        self.engine_s = 0.0
        self.digest = 0
        self.log = log
        self.driver.listeners.append(self._on_step)
        self.driver.drain()

    def _submit(self, picker: AgentSpec) -> None:
        assert isinstance(picker.at, Place)
        self.left -= 1
        reply = self.driver.feed(inp.Submit("PickUp", {"target": picker.at, "user": AgentRef(picker.id)})).reply
        assert isinstance(reply, Accepted), reply
        self.of[reply.task] = picker

    def _on_step(self, step: inp.EngineStep) -> None:
        self.steps[type(step.input).__name__] += 1
        if self.log is not None:
            line = msgspec.json.encode(step)
            self.digest = zlib.crc32(line, self.digest)
            self.log.write(line.decode() + "\n")
        for effect in step.effects:
            if type(effect) is inp.PublishState and effect.status in ("SUCCEEDED", "FAILED", "CANCELED"):
                self.outcomes[effect.status] += 1
                picker = self.of.pop(effect.task)
                if self.left > 0:
                    self.scheduler.call_at(self.scheduler.now() + SECOND, partial(self._submit, picker))

    def fly(self) -> bool:
        """Fly all; return whether everything ended in time."""
        self.driver.run_until(lambda: False, START + 3 * SECOND)
        for number, picker in enumerate(self.pickers[: self.left]):
            self.scheduler.call_at(START + 4 * SECOND + number * 2_300_000, partial(self._submit, picker))
        total = self.left
        return self.driver.run_until(lambda: self.outcomes.total() == total, START + LIMIT_US)


def clocked(run: Run) -> None:
    """Measure the engine's part of the time."""
    handle, clock = run.engine.handle, time.perf_counter

    def timed(now: Micros, given: inp.Input) -> inp.EngineStep:
        began = clock()
        step = handle(now, given)
        run.engine_s += clock() - began
        return step

    run.engine.handle = timed  # type: ignore[method-assign]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=600)
    parser.add_argument("--profile", action="store_true", help="print where the time goes (and be slower)")
    parser.add_argument("--log", default="", help="write every step as JSON")
    options = parser.parse_args()
    with Path(options.log).open("w", encoding="utf-8") if options.log else nullcontext() as log:
        return measure(Run(options.missions, log), options.profile)


def measure(run: Run, profiled: bool) -> int:
    """Fly the missions and print what they cost; 0 = all of them succeeded in time."""
    profile = cProfile.Profile() if profiled else None
    if profile is None:
        clocked(run)
    gc.collect()
    gc.freeze()
    began = time.process_time()
    if profile is not None:
        profile.enable()
    in_time = run.fly()
    if profile is not None:
        profile.disable()
    cpu_s = time.process_time() - began
    done, steps = run.outcomes.total(), run.steps.total()
    print(f"agents: {len(run.engine.state.agents)}, missions: {done}, outcomes: {dict(run.outcomes)}")
    print(f"goals a mission: {run.wire.goals / done:.1f}, inputs a mission: {steps / done:.0f} ", end="")
    print(f"({run.wire.idle / done:.0f} of them reports of agents without a goal)")
    print(f"missions a second of processor time: {done / cpu_s:.1f}; steps a second: {steps / cpu_s:.0f}")
    if profile is None:
        print(f"of {cpu_s / steps * 1e6:.1f} us a step the engine takes {run.engine_s / steps * 1e6:.1f}")
    print(f"inputs: {dict(run.steps.most_common())}")
    if run.log is not None:
        print(f"step log: {run.digest:08x}")
    if profile is not None:
        pstats.Stats(profile).sort_stats("tottime").print_stats(45)
        pstats.Stats(profile).sort_stats("cumulative").print_stats(60)
    return int(not in_time or run.outcomes["SUCCEEDED"] != done)


if __name__ == "__main__":
    sys.exit(main())
