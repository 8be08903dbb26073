"""The engine's nodes against the naive interpreter, and against py_trees' own driving: the same mission, equal steps.

A part of them in each run of the tests, all in CI. More examples: FORMIGA_EXAMPLES=5000 pytest tests/property
"""

from collections import Counter
from itertools import zip_longest
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, NotifyPeople
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreesFactory
from formiga_bt.nodes.memory import WithMem
from tests.oracle.naive import NaiveTrees
from tests.property.strategies import Mission, block_mission, missions
from tests.property.world import World
from tests.shares import in_ci, some


def fly(mission: Mission, trees: TreesFactory = CompiledTrees) -> World:
    world = World(mission.tasks(), mission.deeds, mission.events, trees=trees)
    world.run()
    return world


def visible(step: EngineStep) -> tuple[Any, ...]:
    """Return what two interpreters must agree on."""
    changes = tuple(c for c in step.changes if not isinstance(c, ch.NodeMem | ch.DeadlineSet))
    return step.seq, step.at, step.input, changes, step.effects, step.reply


def assert_equal(ours: World, theirs: World, mission: Mission) -> None:
    for mine, other, mine_now, other_now in zip(ours.steps, theirs.steps, ours.statuses, theirs.statuses, strict=False):
        if visible(mine) != visible(other) or mine_now != other_now:
            nodes, oracle = [[*visible(step)[3:], now] for step, now in ((mine, mine_now), (other, other_now))]
            both = [line for a, b in zip(nodes, oracle, strict=True) for line in first_difference(a, b)]
            story = (*mission.texts, mission.deeds, mission.events, f"step {mine.seq} at {mine.at}: {mine.input}")
            pytest.fail("\n".join(map(str, (*story, *both))))
    assert len(ours.steps) == len(theirs.steps)


def first_difference(nodes: Any, oracle: Any) -> list[str]:
    """Return one line of each, where two values (or two tuples of them) differ first."""
    if nodes == oracle:
        return []
    if isinstance(nodes, tuple):
        nodes, oracle = next((a, b) for a, b in zip_longest(nodes, oracle) if a != b)
    return [f"nodes:  {nodes}", f"oracle: {oracle}"]


@pytest.mark.parametrize("first", [0, 50, *in_ci(range(100, 400, 50))])
def test_the_nodes_do_what_the_naive_interpreter_does(first: int) -> None:
    for mission in missions(50, first):
        assert_equal(fly(mission), fly(mission, NaiveTrees), mission)


@pytest.mark.parametrize("first", [0, *in_ci(range(40, 80, 40))])
def test_two_tasks_at_once_run_as_in_the_naive_interpreter(first: int) -> None:
    for mission in missions(40, first, tasks=2):
        assert_equal(fly(mission), fly(mission, NaiveTrees), mission)


def urgent(mission: Mission) -> Mission:
    """Return a mission of two tasks whose second one is of high priority and comes while the first one runs."""
    calm, text = mission.texts
    events = tuple(replace(e, at=e.at + 4) if (e.what, e.whom) == ("submit", "Random1") else e for e in mission.events)
    return replace(
        mission, texts=(calm, text.replace('"formiga": 1,', '"formiga": 1, "priority": "high",', 1)), events=events
    )


def test_a_task_that_is_preempted_runs_as_in_the_naive_interpreter() -> None:
    preempted = 0
    for mission in map(urgent, missions(60, 500, tasks=2)):
        ours = fly(mission)
        assert_equal(ours, fly(mission, NaiveTrees), mission)
        preempted += any(
            task.restart.past or task.outcome.code == "preempted" for task in ours.engine.state.tasks.values()
        )

    assert preempted >= 5, f"only {preempted} missions have a preemption"


def test_blocks_that_lose_a_machine_or_hand_over_run_as_in_the_naive_interpreter() -> None:
    seen: Counter[str] = Counter()
    for mission in map(block_mission, range(some(80, 200))):
        ours = fly(mission)
        assert_equal(ours, fly(mission, NaiveTrees), mission)
        changes = [change for step in ours.steps for change in step.changes]
        mems = [one.mem for one in changes if isinstance(one, ch.NodeMem) and isinstance(one.mem, WithMem)]
        seen["hands over"] += any(mem.anew for mem in mems)
        told = [one.text for step in ours.steps for one in step.effects if isinstance(one, NotifyPeople)]
        seen["lost"] += "fail_block" in mission.texts[0] and "agent_lost" in told

    assert min(seen["hands over"], seen["lost"]) >= 5, seen


@pytest.mark.parametrize("first", [400, *in_ci([450])])
def test_driven_by_py_trees_own_tick_the_steps_are_equal(first: int) -> None:
    for mission in missions(50, first):
        ours, ticked = fly(mission), fly(mission, lambda host: CompiledTrees(host, tick=True))
        assert ours.statuses == ticked.statuses
        assert ours.steps == ticked.steps
