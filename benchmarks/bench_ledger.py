"""What folding a busy fleet's steps into a ledger costs, beside the engine that made them, and how fast its pages are.

    python benchmarks/bench_ledger.py [--tasks 200] [--active 1000 10000]

The steps are those of `bench_virtual_fleet`. The pages are of sites with so many tasks that fly, wait at the gate, ask a person
or wait for agents, each with a timeout, on a tenth as many machines.
"""

import argparse
import gc
import statistics
import time

from benchmarks.bench_virtual_fleet import Run
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, Started
from formiga_bt.engine.kernel.records import (
    AgentRecord,
    Deadline,
    GoalRecord,
    Question,
    TaskRecord,
    TaskRequest,
    TaskTimes,
)
from formiga_bt.engine.kernel.timers import TaskDue
from formiga_bt.lang.model import Site
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import Ledger

PAGE = 60
ROUNDS = 15


def fold(tasks: int) -> None:
    """Measure the fold of a fleet's steps."""
    run = Run(tasks, judged=False)
    steps: list[EngineStep] = []
    run.world.driver.listeners = [steps.append]
    began = time.perf_counter()
    run.fly()
    engine_s = time.perf_counter() - began
    ledger = Ledger()
    gc.collect()
    gc.freeze()
    began = time.perf_counter()
    for step in steps:
        ledger.feed(step)
    fold_s = time.perf_counter() - began
    points = sum(len(piece.fixes) for way in ledger.ways.values() for piece in way.pieces)
    print(f"{len(steps)} steps of {tasks} missions, engine with its fleet {engine_s / len(steps) * 1e6:.0f} us a step")
    print(
        f"ledger {fold_s / len(steps) * 1e6:.1f} us a step, {fold_s / engine_s * 100:.1f} % of that; {points} points of ways"
    )


def crowd(tasks: int) -> FoldedSource:
    """Return a site with so many open tasks."""
    changes: list[ch.Change] = []
    for n in range(tasks):
        task, agent, kind = f"Survey-{n}", f"lwd_{n}", n % 4
        active = "PENDING" if kind == 3 else "ACTIVE"
        record = TaskRecord(
            id=task,
            name="Survey",
            order=n,
            request=TaskRequest(bundle=""),
            status=active,
            times=TaskTimes(submitted_at=n),
        )  # type: ignore[arg-type]
        changes.append(ch.TaskPut(record))
        changes.append(ch.DeadlineSet(TaskDue(task, "timeout"), Deadline((n * 7919 % tasks) * SECOND, n, task)))
        if n % 10 == 0:
            here = Position(float(n), 0.0, 60.0)
            changes.append(ch.AgentPut(AgentRecord(id=agent, type="lwd", task=task, position=here, landed="airborne")))
        if kind in (0, 1):
            state = "running" if kind == 0 else "gated"
            goal = GoalRecord(id=f"{task}/1/steps/steps[0]", agent=agent, action="GoTo", task=task, state=state)  # type: ignore[arg-type]
            changes.append(ch.GoalPut(goal))
        if kind == 2 and n % 20 == 2:
            question = Question(
                id=f"{task}/1/steps/steps[1]", number=f"Q{n}", task=task, priority="medium", kind="ask", text="Ready?",
                options=("yes", "no"), tiers=(("eve",),), expires_at=n * SECOND,
            )  # fmt: skip
            changes.append(ch.QuestionPut(question))
    ledger = Ledger()
    ledger.feed(EngineStep(1, SECOND, Started(1), tuple(changes), ()))
    return FoldedSource(ledger, Site("crowded", 60.0, 24.0), {})


def page(tasks: int) -> None:
    """Measure a page of a crowded site."""
    source = crowd(tasks)

    def took_ms(find: str = "") -> float:
        began = time.perf_counter()
        source.now(count=PAGE, find=find)
        return (time.perf_counter() - began) * 1e3

    plain = statistics.median(took_ms() for _ in range(ROUNDS))
    found = statistics.median(took_ms("gate") for _ in range(ROUNDS))
    print(f"{tasks} open tasks: a page of {PAGE} in {plain:.1f} ms, searched in {found:.1f} ms")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=200)
    parser.add_argument("--active", type=int, nargs="*", default=[1000, 10_000])
    options = parser.parse_args()
    for tasks in options.active:
        page(tasks)
    if options.tasks:
        fold(options.tasks)


if __name__ == "__main__":
    main()
