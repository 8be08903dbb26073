"""Nodes by themselves, over a run that a test can look into: one step at a time, stops, and py_trees' own driving."""

from collections.abc import Mapping
from typing import Any

import pytest
from py_trees.common import Status

from formiga_bt.engine.kernel.inputs import CancelGoal
from formiga_bt.engine.tasks.treerun import CompiledTrees, TreeHost
from formiga_bt.nodes.base import Node
from formiga_bt.nodes.compile import compile_section
from formiga_bt.nodes.composites import SequenceNode
from formiga_bt.nodes.ends import GoalEnd
from formiga_bt.rehearsal.testing import Bench, effects
from tests.golden import Wording
from tests.unit.engine.yard import CART, Yard, task, yard

TEXT = CART + "steps: [{sequence: [{do: cart.Move, timeout: 1 min}, {wait: 5 s}]}, {do: cart.Home}]"


def root(bench: Bench, task_id: str) -> SequenceNode:
    trees = bench.engine.runs.open[task_id].trees
    assert isinstance(trees, CompiledTrees)
    return trees.roots["steps"]


@pytest.fixture
def running() -> tuple[Yard, str]:
    bench = Yard(TEXT)
    return bench, bench.start()


def statuses(node: Node) -> Mapping[str, Status]:
    return {n.key: n.status for n in node.iterate() if isinstance(n, Node) and n.path}


def test_a_node_that_was_not_woken_is_left_as_it_is(running: tuple[Yard, str]) -> None:
    bench, one = running
    tree = root(bench, one)
    before = statuses(tree)
    run = tree.run
    assert run is not None

    assert tree.proceed(run) is Status.RUNNING

    assert statuses(tree) == before


def test_halt_cancels_the_goal_once_and_may_be_called_twice(running: tuple[Yard, str]) -> None:
    bench, one = running
    tree = root(bench, one)
    run = tree.run
    assert run is not None
    bench.engine.core.begin(bench.now)

    first, second = tree.halt(run), tree.halt(run)

    goal = f"{one}/1/steps/steps[0].sequence[0]"
    assert (first, second) == ([GoalEnd(goal)], [])
    assert [e for e in bench.engine.core.effects if isinstance(e, CancelGoal)] == [CancelGoal(goal, "c1", "Move")]
    assert tree.status is Status.INVALID


def test_a_leafs_end_starts_the_next_in_the_same_pass(running: tuple[Yard, str]) -> None:
    bench, one = running
    bench.cart.succeed({"n": 1})
    bench.run_for(0.1)

    assert bench.engine.statuses(one).keys() == {"steps", "steps/steps[0]", "steps/steps[0].sequence[1]"}


def test_ids_are_the_same_in_every_run_and_no_two_nodes_share_one(running: tuple[Yard, str]) -> None:
    bench, one = running
    other = Yard(TEXT)
    two = other.start()

    mine = [n.id for n in root(bench, one).iterate() if n.status is Status.RUNNING]
    theirs = [n.id for n in root(other, two).iterate() if n.status is Status.RUNNING]

    assert mine == theirs
    assert len(set(mine)) == len(mine)


def test_entering_a_running_node_is_a_bug(running: tuple[Yard, str]) -> None:
    bench, one = running
    tree = root(bench, one)
    assert tree.run is not None

    with pytest.raises(AssertionError, match="entered twice"):
        tree.enter(tree.run, "steps", "")


def test_only_a_node_itself_ends_well_or_badly(running: tuple[Yard, str], wording: Wording) -> None:
    bench, one = running

    with pytest.raises(AssertionError) as refused:
        root(bench, one).stop(Status.SUCCESS)
    wording(refused.value)


def test_py_trees_own_driving_gives_the_same_steps() -> None:
    def ticked(host: TreeHost) -> CompiledTrees:
        return CompiledTrees(host, tick=True)

    journals = []
    for trees in (CompiledTrees, ticked):
        bench = Bench(*yard(), [task(TEXT)], trees=trees)
        cart = bench.agent("c1", "cart", auto={"Move": 1.0, "Home": 1.0})
        bench.run_for(1)
        one = bench.submit("Try")
        assert bench.run_until_ended(one)
        assert cart.done == ["Move", "Home"]
        journals.append(bench.steps)
        bench.check()
        bench.close()

    assert journals[0] == journals[1]


def test_py_trees_displays_can_walk_our_trees(running: tuple[Yard, str]) -> None:
    from py_trees.display import unicode_tree

    bench, one = running
    tree = root(bench, one)

    text = unicode_tree(tree, show_status=True)

    assert "Move" in text
    tip = tree.tip()
    assert tip is not None
    assert tip.name == "cart.Move"


def test_a_section_can_be_compiled_again_from_the_same_steps() -> None:
    steps = task(TEXT).steps

    trees = [compile_section("steps", steps) for _ in range(2)]

    shapes: list[Any] = [[(n.name, getattr(n, "kind", "")) for n in tree.iterate()] for tree in trees]
    assert shapes[0] == shapes[1]
    assert effects(Yard(), CancelGoal) == []
