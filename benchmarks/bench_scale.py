"""What a wake costs among 100,000 active tasks, beside the same engine with 100 of them.

A third of the tasks waits for a deadline more than ten minutes away, a third for a key of one of 1,000 machines, a third for a
goal of a person (people are shared: many tasks address one). Inputs go straight into the engine, so the figures are those of
`Engine.handle`: everything but wires and the journal. Processor time, in the small and in the large engine in turns, medians:

    timer     a deadline fires, its task goes on to the next wait
    key       a status changes the key that tasks wait for: per task woken, its share of the step
    result    a goal ends, its task goes on to a wait
    progress  news of a goal that goes on
    order     a goal ends, its task orders the next one: gate and goal included
    report    a status that changes nothing that anybody waits for
    person    a status of a person, whose questions are looked at
    ended     a task is aborted and ends
    request   a task is requested, granted its person and started: two steps

Two sums of them: an even mix of the four kinds of wakes, and the wakes as often as they come in this very world, in which every
machine reports each second and each report changes the key. Besides, one status that wakes a third of all tasks at once.

    python benchmarks/bench_scale.py [--tasks 100000] [--agents 1000] [--json FILE]

Prints one line per figure, then everything as one line of JSON.
"""

import argparse
import gc
import json
import resource
import statistics
import time
from collections.abc import Callable
from typing import Any

from agents_sim.world import grid_fleet
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.base.packaged import files
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.changes import NodesEnded
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.engine.kernel.timers import AllocationDue
from formiga_bt.engine.tasks.wake_queue import REST
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.simulation import fleet_site
from formiga_bt.transport.messages import AgentCard, AgentStatus, GoalEvent

PEOPLE = 200
START = 1_000_000 * SECOND
SMALL = 100
WAIT_S = 600.0
"""No wait is shorter, so a task's deadline comes at most so often; its goal is taken to end as often."""
WAKES = ("timer", "key", "result", "progress")
"""What counts as one wake; the others do more than that, or wake nobody."""

DEADLINE = """
formiga: 1
task: WaitsForTime
params: {after: {type: duration}}
steps:
  - sequence:
      - wait: ${after}
      - wait: ${after}
      - wait: ${after}
      - wait: ${after}
    timeout: 24 h
"""
KEY = """
formiga: 1
task: WaitsForKey
params: {who: {type: agent, of: [lwd]}}
steps:
  - wait_until: who.battery < 20 %
    timeout: 24 h
  - wait: 2 h
"""
GOAL = """
formiga: 1
task: WaitsForGoal
params: {who: {type: agent, of: [picker]}}
agents:
  person: {type: picker, id: "${who}"}
steps:
  - do: person.MiniFinder
    with: {base: "${base}"}
    timeout: 24 h
  - wait: 2 h
"""
NEXT_GOAL = """
formiga: 1
task: WaitsForGoals
params: {who: {type: agent, of: [picker]}}
agents:
  person: {type: picker, id: "${who}"}
steps:
  - do: person.MiniFinder
    with: {base: "${base}"}
    timeout: 24 h
  - do: person.MiniFinder
    with: {base: "${base}"}
    timeout: 24 h
"""


class World:
    """One engine with so many tasks, a third of each kind."""

    def __init__(self, tasks: int, machines: int) -> None:
        specs = grid_fleet(machines, 0, PEOPLE, 1)
        catalogue, problems, _ = load_catalogue(files("actions"))
        assert not problems, problems
        site = fleet_site(specs)
        models = {}
        for text in (DEADLINE, KEY, GOAL, NEXT_GOAL):
            loaded = load_task_text(text, "scale.yaml", catalogue=catalogue, site=site)
            assert loaded.task is not None, loaded.diagnostics
            models[loaded.task.name] = loaded.task
        self.engine = Engine(site, catalogue, models)
        self.now = START
        self.tasks = tasks
        self.goals: dict[str, str] = {}
        """Goals that are under way -> their persons."""
        self.n: dict[str, int] = {}
        self.seq = 0
        self.give(inp.Started(1))
        self.machines = [(s.id, s.at) for s in specs if s.type == "lwd"]
        self.people = [s.id for s in specs if s.type == "picker"]
        for spec in specs:
            kind = catalogue.types[spec.type]
            card = AgentCard(id=spec.id, type=kind.name, boot_id="b", actions=kind.actions, mobility=kind.mobility)
            self.give(inp.AgentSeenInput(card))
        for machine in range(machines):
            self.first_report(machine, 90.0)
        for number, person in enumerate(self.people):
            self.status(person, "picker", 90.0, Position(5.0 * number, 5.0, 0.0))

    # -- inputs ------------------------------------------------------------------------------------------------------
    def give(self, given: inp.Input) -> inp.EngineStep:
        step = self.engine.handle(self.now, given)
        for effect in step.effects:
            if isinstance(effect, inp.SendGoal):
                self.goals[effect.goal_id] = effect.agent
        return step

    def timers(self) -> None:
        """Let the deadlines of the present instant fire."""
        while (due := self.engine.next_deadline()) is not None and due[0] <= self.now:
            self.give(inp.TimerDue(due[1]))

    def let(self, us: int) -> None:
        """Let so much time pass, deadlines included."""
        until = self.now + us
        while (due := self.engine.next_deadline()) is not None and due[0] <= until:
            self.now = max(self.now, due[0])
            self.give(inp.TimerDue(due[1]))
        self.now = until

    def status(self, agent: str, kind: str, battery: float, at: Position) -> inp.AgentStatusInput:
        """Return a status and hand it in."""
        given = self.a_status(agent, kind, battery, at)
        self.give(given)
        return given

    def a_status(self, agent: str, kind: str, battery: float, at: Position) -> inp.AgentStatusInput:
        self.seq += 1
        landed = "grounded"
        return inp.AgentStatusInput(
            AgentStatus(
                id=agent,
                type=kind,
                battery=battery,
                position=at,
                boot_id="b",
                seq=self.seq,
                stamp=self.now,
                landed=landed,
            )
        )

    def first_report(self, machine: int, battery: float) -> inp.AgentStatusInput:
        name, at = self.machines[machine]
        return self.status(name, "lwd", battery, Position(at.east_m, at.north_m, 0.0))

    def fill(self) -> None:
        """Submit all tasks and let them come to their waits."""
        for number in range(self.tasks):
            kind, index = number % 3, number // 3
            if kind == 0:
                wish = inp.Submit("WaitsForTime", {"after": 660.0 + index * 3600.0 / self.tasks})
            elif kind == 1:
                wish = inp.Submit("WaitsForKey", {"who": AgentRef(self.machines[index % len(self.machines)][0])})
            else:
                wish = self._for_goal("WaitsForGoals" if index % 2 else "WaitsForGoal", index)
            reply = self.give(wish).reply
            assert isinstance(reply, Accepted), reply
            if number % 1000 == 999:
                self.let(200_000)
        self.let(2 * SECOND)
        active = sum(task.status == "ACTIVE" for task in self.engine.state.tasks.values())
        assert active == self.tasks, f"{active} of {self.tasks} are active"
        assert not self.engine.state.requests

    def _for_goal(self, task: str, index: int) -> inp.Submit:
        return inp.Submit(task, {"who": AgentRef(self.people[index % len(self.people)])})

    # -- what is measured: each returns (inputs, how many tasks each of them wakes) -------------------------------------
    def timer(self) -> tuple[list[inp.Input], float]:
        """Every next deadline of a task."""
        due = self.engine.next_deadline()
        assert due is not None
        self.now = max(self.now, due[0])
        return [inp.TimerDue(due[1])], 1.0

    def key(self) -> tuple[list[inp.Input], float]:
        """The next machine's battery changes; what waits for it stays false."""
        machine = self.seq % min(len(self.machines), max(1, self.tasks // 3))
        name, at = self.machines[machine]
        self.now += 1000
        waits = len(range(machine, self.tasks // 3, len(self.machines)))
        level = 50.0 + self.seq % 400 / 10
        return [self.a_status(name, "lwd", level, Position(at.east_m, at.north_m, 0.0))], float(max(1, waits))

    def report(self) -> tuple[list[inp.Input], float]:
        """The same machine again, nothing changed."""
        name, at = self.machines[-1]
        self.now += 1000
        battery = self.engine.state.agents[name].battery or 0.0
        return [self.a_status(name, "lwd", battery, Position(at.east_m, at.north_m, 0.0))], 1.0

    def progress(self) -> tuple[list[inp.Input], float]:
        """The oldest goal goes on."""
        return [self._event(next(iter(self.goals)), "running")], 1.0

    def result(self) -> tuple[list[inp.Input], float]:
        """The oldest goal that a wait follows ends."""
        return self._ends("WaitsForGoal-")

    def order(self) -> tuple[list[inp.Input], float]:
        """The oldest goal that another one follows ends."""
        return self._ends("WaitsForGoals-")

    def ended(self) -> tuple[list[inp.Input], float]:
        """The oldest task that waits for a key ends."""
        task = next(one for one in self.engine.core.open if one.startswith("WaitsForKey-"))
        return [inp.Abort(task)], 1.0

    def request(self) -> tuple[list[inp.Input], float]:
        """One more task, which must have the person that it names."""
        self.now += 1000
        self.let(60_000)
        return [self._for_goal("WaitsForGoal", self.seq), inp.TimerDue(AllocationDue())], 1.0

    def person(self) -> tuple[list[inp.Input], float]:
        """The next person reports."""
        number = self.seq % len(self.people)
        self.now += 1000
        return [self.a_status(self.people[number], "picker", 90.0, Position(5.0 * number, 5.0, 0.0))], 1.0

    def _ends(self, task: str) -> tuple[list[inp.Input], float]:
        goal = next(one for one in self.goals if one.startswith(task) and one.endswith("/steps/steps[0]"))
        given = self._event(goal, "succeeded", {"in_range": True, "go_to": {"east_m": 1.0, "north_m": 2.0}})
        del self.goals[goal]
        self.n.pop(goal, None)
        return [given], 1.0

    def _event(self, goal: str, state: Any, result: dict[str, Any] | None = None) -> inp.GoalEventInput:
        self.now += 1000
        self.n[goal] = self.n.get(goal, 0) + 1
        return inp.GoalEventInput(
            GoalEvent(goal_id=goal, agent=self.goals[goal], state=state, n=self.n[goal], result=result or {})
        )


def one_us(world: World, make: Callable[[], tuple[list[inp.Input], float]]) -> float:
    """Return the processor time of one wake, microseconds."""
    inputs, wakes = make()
    began = time.thread_time_ns()
    for given in inputs:
        world.give(given)
    return (time.thread_time_ns() - began) / 1000 / wakes


def own_mix(tasks: int, machines: int, us: dict[str, float]) -> dict[str, float]:
    """Return what the wakes cost that come in this world each second."""
    third = tasks / 3
    rates = {"key": third, "timer": third / WAIT_S, "result": third / WAIT_S}
    cost = sum(rate * us[name] for name, rate in rates.items())
    wakes = sum(rates.values())
    return {
        "scenario_wakes_s": round(wakes),
        "scenario_wake_us": round(cost / wakes, 2),
        "scenario_core_percent": round(cost / 1e4, 1),
        "scenario_core_percent_at_1000_wakes_s": round(cost / wakes / 10, 2),
        "tasks_a_report": round(third / machines, 1),
    }


def crowd(tasks: int) -> dict[str, float]:
    """Return how long the steps are when one status wakes so many tasks and lets all of them go on, one of them high."""
    world = World(SMALL, 1)
    world.fill()
    who = {"who": AgentRef(world.machines[0][0])}
    for number in range(tasks):
        world.give(inp.Submit("WaitsForKey", who, priority="high" if number == tasks - 1 else None))
        if number % 1000 == 999:
            world.let(200_000)
    world.let(2 * SECOND)
    name, at = world.machines[0]
    gc.collect()
    gc.freeze()
    given: inp.Input = world.a_status(name, "lwd", 10.0, Position(at.east_m, at.north_m, 0.0))
    times, woken, began = list[float](), list[int](), time.thread_time()
    high_s = 0.0
    while True:
        first = time.thread_time()
        step = world.give(given)
        times.append(time.thread_time() - first)
        ended = [change.task for change in step.changes if isinstance(change, NodesEnded)]
        woken.append(len(ended))
        if any(world.engine.state.tasks[task].request.priority == "high" for task in ended):
            high_s = sum(times)
        due = world.engine.next_deadline()
        if due is None or due[1] != REST:
            break
        given = inp.TimerDue(due[1])
    assert sum(woken) >= tasks, f"{sum(woken)} of {tasks} were woken"
    gc.unfreeze()
    times_ms = [1e3 * one for one in times]
    return {
        "crowd": tasks,
        "crowd_steps": len(times),
        "crowd_s": round(time.thread_time() - began, 2),
        "crowd_median_ms": round(statistics.median(times_ms), 1),
        "crowd_first_ms": round(times_ms[0], 1),
        "crowd_longest_other_ms": round(max(times_ms[1:]), 1),
        "crowd_high_after_ms": round(1e3 * high_s, 1),
    }


def rss_bytes() -> int:
    """Return the memory that this process has now."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=100_000)
    parser.add_argument("--agents", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=400)
    parser.add_argument("--json", default="")
    options = parser.parse_args()
    small = World(SMALL, options.agents)
    small.fill()
    large = World(options.tasks, options.agents)
    gc.collect()
    before, began = rss_bytes(), time.process_time()
    gc.freeze()
    large.fill()
    filled_s = time.process_time() - began
    began = time.process_time()
    gc.collect()
    full_s = time.process_time() - began
    gc.freeze()
    found: dict[str, Any] = {"tasks": options.tasks, "agents": options.agents, "goals": len(large.goals)}
    found["kb_per_task"] = round((rss_bytes() - before) / options.tasks / 1000, 2)
    found["admitted_per_s"] = round(options.tasks / filled_s)
    print(f"{options.tasks:,} active tasks, {options.agents:,} machines, {PEOPLE} people, {len(large.goals):,} goals")
    print(f"memory: {found['kb_per_task']:.1f} kB a task, its request and explanation included")
    print(
        f"request, grant and start: {filled_s / options.tasks * 1e6:.0f} us a task, {found['admitted_per_s']:,} a second"
    )
    found["full_collection_s"] = round(full_s, 2)
    print(f"a full garbage collection over all of them: {full_s:.2f} s; measured without one")
    worst, each = 0.0, list[float]()
    for name in ("key", "progress", "report", "person", "result", "order", "request", "ended", "timer"):
        pairs = []
        for _ in range(options.rounds):
            try:
                pairs.append((one_us(small, getattr(small, name)), one_us(large, getattr(large, name))))
            except StopIteration:  # the small engine has no more of them
                break
        few, many = (statistics.median(side) for side in zip(*pairs, strict=True))
        found[name] = {"us": round(many, 2), f"us_among_{SMALL}": round(few, 2), "ratio": round(many / few, 2)}
        print(f"{name}: {many:.1f} us among {options.tasks:,}, {few:.1f} us among {SMALL}: {many / few:.2f} times")
        if name in WAKES:
            worst = max(worst, many / few)
            each.append(many)
    mixed = statistics.mean(each)
    found |= {
        "wake_us": round(mixed, 2),
        "core_percent_at_1000_wakes_s": round(mixed / 10, 2),
        "worst_ratio": round(worst, 2),
    }
    print(f"1,000 wakes a second, a quarter of each kind: {mixed / 10:.1f} % of a core, {mixed:.1f} us each;", end=" ")
    print(f"at most {worst:.2f} times as much as among {SMALL}")
    found |= own_mix(options.tasks, options.agents, {name: found[name]["us"] for name in WAKES})
    print(
        f"the wakes of this world itself, where {options.agents:,} machines report each second: "
        f"{found['scenario_wake_us']:.1f} us each; {found['scenario_core_percent_at_1000_wakes_s']:.1f} % of a core for "
        f"1,000 a second, "
        f"{found['scenario_core_percent']:.0f} % for all {found['scenario_wakes_s']:,} if each report changes the key"
    )
    del small, large
    gc.collect()
    found |= crowd(options.tasks // 3)
    print(
        f"one status wakes {found['crowd']:,} tasks: {found['crowd_s']:.2f} s in {found['crowd_steps']} steps, "
        f"the first {found['crowd_first_ms']:.1f} ms, the others {found['crowd_median_ms']:.1f} ms, "
        f"at most {found['crowd_longest_other_ms']:.1f} ms; "
        f"the one of high priority went on within {found['crowd_high_after_ms']:.1f} ms"
    )
    print(json.dumps(found))
    if options.json:
        with open(options.json, "w", encoding="utf-8") as out:
            json.dump(found, out, indent=2)


if __name__ == "__main__":
    main()
