"""What a step costs: only the way to what was woken is visited, and never more than the budget."""

import json
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel.inputs import TimerDue
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.engine.tasks.taskrun import TaskRun
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreesFactory
from formiga_bt.lang.model import Loop, Task
from tests.oracle.naive import NaiveTrees
from tests.property.strategies import load
from tests.property.world import Event, World

BRANCHES = 200


def task_of(steps: list[dict[str, Any]]) -> Task:
    head = {"formiga": 1, "task": "Wide", "vars": {"n": "${0}"}, "agents": {"one": {"type": "cart"}}}
    task = load(json.dumps({**head, "steps": steps}))
    assert task is not None
    return task


@pytest.mark.parametrize("where", ["parallel", "for"])
def test_a_wake_visits_only_the_way_from_the_root_to_the_leaf(where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    deep = [{"guard": "one.battery > 1 %", "steps": [{"wait": "3 s", "timeout": "9 min"}], "when": "n == 0"}]
    if where == "parallel":
        branches = [{"sequence": [{"wait": f"{5 + i} s"}, *deep]} for i in range(BRANCHES)]
        task = task_of([{"parallel": branches}])
    else:
        waits = {"repeat": "${mod(i, 3) + 1}", "steps": [{"wait": "1 s"}]}
        lists = {"i": f"${{range({BRANCHES})}}"}
        task = task_of([{"for": lists, "mode": "parallel", "steps": [{"wait": "5 s"}, waits, *deep]}])
    visits = 0
    spend = TaskRun.spend

    def counted(run: TaskRun) -> None:
        nonlocal visits
        visits += 1
        spend(run)

    monkeypatch.setattr(TaskRun, "spend", counted)
    counts: list[tuple[bool, int]] = []

    def watch(_: World, step: Any) -> None:
        nonlocal visits
        counts.append((isinstance(step.input, TimerDue) and isinstance(step.input.timer, NodeDue), visits))
        visits = 0

    world = World([task], {}, [Event(1.0, "submit", "Wide")], watch=watch)
    world.run(300.0)
    assert world.engine.state.tasks["Wide-1"].status == "SUCCEEDED"
    timers = [number for timer, number in counts if timer]
    assert len(timers) >= 2 * BRANCHES
    # root, parallel, branch, when, guard, timeout, wait: seven on the deepest way, and what the end of a wait starts.
    assert max(timers) <= 10, max(timers)


@pytest.mark.parametrize("trees", [CompiledTrees, NaiveTrees])
@pytest.mark.parametrize("kind", [{"repeat": "forever", "timeout": "1 min"}, {"while": "n >= 0", "timeout": "1 min"}])
def test_a_loop_that_waits_for_nothing_runs_away_and_fails_only_its_task(
    trees: TreesFactory, kind: dict[str, Any]
) -> None:
    task = task_of([{**kind, "every": "1 s", "steps": [{"set": {"n": "${n + 1}"}}]}])
    (loop,) = task.steps
    assert isinstance(loop, Loop)
    task = replace(task, steps=(replace(loop, every=None),))  # the checker refuses such a file
    world = World([task], {}, [Event(1.0, "submit", "Wide")], trees=trees)
    world.run(30.0)
    record = world.engine.state.tasks["Wide-1"]
    assert (record.status, record.outcome.code) == ("FAILED", "runaway")
    assert not world.engine.state.memory.get("Wide-1")
