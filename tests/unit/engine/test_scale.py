"""One step costs what it changes: as many calls among 900 active tasks as among 45. And tasks that have ended leave nothing."""

import gc
import importlib.util
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.tasks.taskrun import TaskRun
from formiga_bt.nodes.base import Node

pytestmark = pytest.mark.usefixtures("set_aside_again")
BENCH = Path(__file__).resolve().parents[3] / "benchmarks" / "bench_scale.py"
KINDS = ("key", "progress", "report", "person", "result", "order", "request", "ended", "timer")


@pytest.fixture(scope="module")
def bench() -> Any:
    """Return the benchmark as a module."""
    spec = importlib.util.spec_from_file_location("bench_scale", BENCH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def calls(world: Any, given: inp.Input) -> int:
    """Return how many functions are called to handle an input, C functions included."""
    found: Counter[str] = Counter()
    sys.setprofile(lambda frame, event, arg: found.update([event]))
    try:
        world.give(given)
    finally:
        sys.setprofile(None)
    return found["call"] + found["c_call"]


def test_a_step_calls_no_more_functions_among_more_tasks(bench: Any) -> None:
    few, many = bench.World(45, 15), bench.World(900, 15)
    few.fill()
    many.fill()
    for kind in KINDS:
        for _ in range(3):
            (wished, wakes), (wanted, more_wakes) = getattr(few, kind)(), getattr(many, kind)()
            small = sum(calls(few, given) for given in wished)
            large = sum(calls(many, given) for given in wanted)
            if wakes == more_wakes == 1:
                assert large <= small * 1.1 + 5, f"{kind}: {small} calls among 45, {large} among 900"
            else:
                assert large / more_wakes <= small / wakes, f"{kind}: each of {more_wakes} tasks that one status wakes"


def requested(world: Any) -> str:
    reply = world.give(inp.Submit("WaitsForTime", {"after": 700.0})).reply
    assert isinstance(reply, Accepted)
    return reply.task


def test_tasks_that_have_ended_leave_nothing_but_their_records(bench: Any) -> None:
    world = bench.World(9, 3)
    world.fill()

    def fly(count: int) -> Counter[str]:
        gc.collect()
        gc.disable()
        for _ in range(count):
            task = requested(world)
            world.let(SECOND)
            assert world.give(inp.Abort(task)).reply == Done()
            world.let(SECOND)
        world.give(inp.Abort(requested(world)))
        gc.enable()
        found = Counter(type(one).__name__ for one in gc.get_objects() if isinstance(one, Node | TaskRun))
        state, core = world.engine.state, world.engine.core
        tables = {"memory": state.memory, "scopes": state.scopes, "deadlines": state.deadlines, "goals": state.goals}
        tables |= {
            "requests": state.requests,
            "runs": world.engine.runs.open,
            "named": core.named,
            "woken": core.woken,
        }
        tables |= {"readers": core.board._readers, "wall": state.wall, "questions": state.questions}
        return found + Counter({name: len(table) for name, table in tables.items()})

    first = fly(10)
    assert fly(60) == first
