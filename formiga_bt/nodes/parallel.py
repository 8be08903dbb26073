"""`parallel`, `race` and the parallel `for`: children at once, counted, decided once at the end of a visit.

Ended children are never visited again. Success is looked at before failure: reaching `need` stops the rest and, when their
goals have drained, succeeds. After a failure that puts `need` out of reach, `finish` waits for the others to end by themselves,
`cancel` stops them. Of a `for` with `need` all items run. Of a race the child that ends first decides, well or badly; of those
that end in one visit the one that is written first. Skipped children do not count; all skipped = skipped.
"""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from py_trees import common, composites
from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.nodes import draining
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import SequenceNode, adopt_children
from formiga_bt.nodes.ends import Drain, End
from formiga_bt.nodes.memory import GatherMem, ItemsMem, Mem
from formiga_bt.nodes.run import Failure, Run, StepRun

WAITS, RUNS, DONE, FAILED, SKIPPED = ".RSFK"


class Gathering(Node, composites.Parallel):
    """Common part: starts children, counts their ends."""

    policy = common.ParallelPolicy.SuccessOnAll(synchronise=False)
    current_child = None
    all_run = False
    """Reaching a `need` of N does not stop the others."""

    def __init__(self, step: model.Parallel | model.For) -> None:
        Node.__init__(self, step.title, step)
        self.need: int | str = step.need
        self.cancels = step.on_child_failure == "cancel" or step.need == "first"
        self.at_once: int | None = None
        self.states: list[str] = []
        self.first: Failure | None = None
        self.halting = False
        self.drain: Drain = ()
        self.collected: list[Any] = []

    def place(self, index: int) -> str:
        """Return the instance path of a child."""
        raise NotImplementedError

    def scope_of(self, index: int) -> str:  # noqa: ARG002
        """Return the scope of a child."""
        return self.scope

    def opened(self, run: Run, index: int) -> None:
        """A child is about to start."""

    def ended(self, run: Run, index: int) -> None:
        """A child has ended or was stopped."""

    def begin(self, run: Run) -> Status:
        """Start the children."""
        self.states = [WAITS] * len(self.children)
        self.first, self.halting, self.drain = None, False, ()
        self._remember(run)
        return self._fill_and_decide(run)

    def on_proceed(self, run: Run) -> Status:
        """Visit the woken children in order, then decide once, if one of them has ended."""
        if self.halting:
            return self._drained(run)
        ended = False
        for index, child in enumerate(self.children):
            if child.dirty and self.states[index] == RUNS and child.proceed(run) is not RUNNING:
                self._count(run, index)
                ended = True
        return self._fill_and_decide(run) if ended else RUNNING

    def _child(self, index: int) -> Node:
        child = self.children[index]
        assert isinstance(child, Node)
        return child

    def _fill_and_decide(self, run: Run) -> Status:
        for index, state in enumerate(self.states):
            if state != WAITS:
                continue
            if not self.may_start():
                break
            self.opened(run, index)
            self.states[index] = RUNS
            if self._child(index).enter(run, self.place(index), self.scope_of(index)) is not RUNNING:
                self._count(run, index)
        return self._decide(run)

    def may_start(self) -> bool:
        """Return whether a child that waits may start now."""
        if self.at_once is None:
            return True
        return self.states.count(RUNS) < self.at_once and not (self.cancels and self.out_of_reach())

    def _count(self, run: Run, index: int) -> None:
        child = self._child(index)
        if child.status is FAILURE:
            self.states[index] = FAILED
            self.first = self.first or child.failure
        else:
            self.states[index] = SKIPPED if child.skipped else DONE
        self.ended(run, index)

    def reached(self) -> bool:
        """Return whether it succeeds now."""
        done, left = self.states.count(DONE), self.states.count(RUNS) + self.states.count(WAITS)
        if self.need == "all":
            return left == 0 and FAILED not in self.states
        if self.all_run and left:
            return False
        return done >= (1 if self.need in ("any", "first") else int(self.need))

    def out_of_reach(self) -> bool:
        """Return whether it can no longer succeed."""
        done, left = self.states.count(DONE), self.states.count(RUNS) + self.states.count(WAITS)
        if self.need == "all":
            return FAILED in self.states
        return done + left < (1 if self.need in ("any", "first") else int(self.need))

    def _decide(self, run: Run) -> Status:
        left = self.states.count(RUNS) + self.states.count(WAITS)
        if self.reached():
            return self._stop_rest(run, None)
        if self.out_of_reach() and (self.cancels or left == 0):
            return self._stop_rest(run, self.first or self.lacking())
        self._remember(run)
        return RUNNING

    def lacking(self) -> Failure | None:
        """Return why it fails though no child did; None if all were skipped, and so is it."""
        if all(state == SKIPPED for state in self.states):
            return None
        return Failure("nothing_applied", f"fewer than {self.need} succeeded", self.path)

    def _stop_rest(self, run: Run, failure: Failure | None) -> Status:
        goals: list[End] = []
        for index, state in enumerate(self.states):
            if state == RUNS:
                goals += self._child(index).halt(run)
                self.ended(run, index)
        self.first, self.halting = failure, True
        self.drain = draining.adopt(run, self.key, goals)
        self._remember(run)
        return self._drained(run)

    def _drained(self, run: Run) -> Status:
        if not draining.is_empty(run, self.drain):
            self.feedback_message = "halting"
            return RUNNING
        failure = draining.unconfirmed(run, self.drain, self.path) if self.first is not None else None
        draining.drop(run, self.drain)
        self.drain = ()
        if self.first is not None:
            return self.fail_as(failure or self.first)
        self.skipped = bool(self.states) and all(state == SKIPPED for state in self.states)
        self.succeeded(run)
        return SUCCESS

    def succeeded(self, run: Run) -> None:
        """Everything has ended, with success."""

    def on_halt(self, run: Run) -> list[End]:
        """Stop all children; goals already draining move on."""
        goals = draining.move_on(run, self.drain)
        self.drain = ()
        for index, state in enumerate(self.states):
            if state == RUNS and not self.halting:
                goals += self._child(index).halt(run)
                self.ended(run, index)
        return goals

    def _remember(self, run: Run) -> None:
        states, collected = "".join(self.states), tuple(self.collected)
        self.remember(run, GatherMem(states, self.first, self.halting, self.drain, collected))

    def load(self, mem: GatherMem) -> None:
        """Take over what was remembered."""
        self.states, self.first, self.halting, self.drain = list(mem.states), mem.failure, mem.halting, mem.drain
        self.collected = list(mem.collected)

    def restore_children(self, run: Run) -> None:
        """Rebuild the children that run."""
        for index, state in enumerate(self.states):
            if state == RUNS and not self.halting:
                self._child(index).restore(run, self.place(index), self.scope_of(index))


class ParallelNode(Gathering):
    """`parallel` and `race`."""

    kind: ClassVar[str] = "parallel"

    def __init__(self, step: model.Parallel, children: Sequence[Node]) -> None:
        super().__init__(step)
        adopt_children(self, children)

    def place(self, index: int) -> str:
        """Return the instance path of a child."""
        return f"{self.path}.{self._child(index).seg}"

    def on_enter(self, run: Run) -> Status:
        """Start all children."""
        return self.begin(run)

    def may_start(self) -> bool:
        """Return whether the next child may start: of a race none does once one has ended."""
        return self.need != "first" or not self._winner()

    def reached(self) -> bool:
        """Return whether it succeeds now."""
        return super().reached() if self.need != "first" else self._winner() == DONE

    def out_of_reach(self) -> bool:
        """Return whether it can no longer succeed."""
        return super().out_of_reach() if self.need != "first" or not self._winner() else self._winner() == FAILED

    def _winner(self) -> str:
        """Return how the child ended that decides a race, or "": it is decided in the visit in which the first one ends."""
        return next((state for state in self.states if state in (DONE, FAILED)), "")

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, GatherMem)
        self.load(mem)
        self.restore_children(run)


class OverItems(Node):
    """Common part of both forms of `for`: the items, in a memory of their own."""

    items: tuple[dict[str, Any], ...] = ()

    def keep_items(self, run: Run, items: tuple[dict[str, Any], ...]) -> None:
        """Go over these from now on."""
        self.items = items
        run.remember(f"{self.path}:items", ItemsMem(items))

    def find_items(self, run: Run) -> None:
        """Take over what was remembered."""
        mem = run.memory(f"{self.path}:items")
        assert isinstance(mem, ItemsMem)
        self.items = mem.items

    def _leave(self, run: StepRun) -> None:
        super()._leave(run)
        run.remember(f"{self.path}:items", None)


class ForParallelNode(OverItems, Gathering):
    """`for` with `mode: parallel`: a body per item, each with a scope of its own."""

    kind: ClassVar[str] = "for"
    all_run = True

    def __init__(self, step: model.For, body: Callable[[], list[Node]]) -> None:
        Gathering.__init__(self, step)
        self.step = step
        self.at_once = step.max_parallel
        self._body = body

    def place(self, index: int) -> str:
        """Return the instance path of an item."""
        return f"{self.path}.for#{index + 1}"

    def scope_of(self, index: int) -> str:
        """Return the item's own scope."""
        return self.place(index)

    def on_enter(self, run: Run) -> Status:
        """Read the lists once and start the items."""
        items = zip_items(self, run, self.step)
        if items is None:
            return FAILURE
        self.keep_items(run, items)
        self.collected = [None] * len(items) if self.step.gives else []
        if self.step.gives and run.env(self.scope).is_set(self.step.gives):
            run.set_var(self.scope, self.step.gives, None)  # of an earlier run of this loop
        self._grow()
        return self.begin(run)

    def _grow(self) -> None:
        adopt_children(self, [SequenceNode("item", None, self._body(), joint=".") for _ in self.items])

    def opened(self, run: Run, index: int) -> None:
        """Open the item's scope with its loop names."""
        run.open_scope(self.scope_of(index), {**self.items[index], "..": self.scope})

    def may_start(self) -> bool:
        """Return whether an item that waits may start now: none does once `first` has its value."""
        return super().may_start() and not (self.step.first and self._found())

    def reached(self) -> bool:
        """Return whether it succeeds now: with `first` as soon as an item has saved that name, or if there is no item."""
        if not self.step.first:
            return super().reached()
        return bool(self._found()) or not self.states

    def out_of_reach(self) -> bool:
        """Return whether it can no longer succeed: with `first` when no item is left."""
        if not self.step.first:
            return super().out_of_reach()
        return RUNS not in self.states and WAITS not in self.states

    def lacking(self) -> Failure | None:
        """Return why it fails though no item did."""
        if not self.step.first:
            return super().lacking()
        return Failure("nothing_applied", f"no item saved '{self.step.first}'", self.path)

    def _found(self) -> tuple[Any, ...]:
        """Return what the items have saved under the name to gather, in the order of the loop."""
        return tuple(value for value in self.collected if value is not None)

    def ended(self, run: Run, index: int) -> None:
        """Take what the item saved under the name to gather; forget its scope."""
        name = self.step.gives
        if name and self.states[index] == DONE:
            env = run.env(self.scope_of(index))
            self.collected[index] = env.name(name) if env.is_set(name) else None
        run.close_scope(self.scope_of(index))

    def succeeded(self, run: Run) -> None:
        """Hand over what was gathered; of items that ended in one visit the first in the order of the loop wins."""
        found = self._found()
        if self.step.collect:
            run.set_var(self.scope, self.step.collect, found)
        elif self.step.first and found:
            run.set_var(self.scope, self.step.first, found[0])

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, GatherMem)
        self.load(mem)
        self.find_items(run)
        self._grow()
        self.restore_children(run)


def zip_items(node: Node, run: Run, step: model.For) -> tuple[dict[str, Any], ...] | None:
    """Return the loop names of each round, or None after failing the node with `zip_length`."""
    env = run.env(node.scope, node.error_here())
    lists = {name: tuple(expr.run(env)) for name, expr in step.lists.items()}
    lengths = {name: len(values) for name, values in lists.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"'{name}' has {length}" for name, length in lengths.items())
        node.fail("zip_length", f"{told} items")
        return None
    return tuple(dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True))
