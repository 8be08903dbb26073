"""Loops: while, repeat, `for` in order, and break_if. A round is a chain of steps at a path with the round's number.

A round that waits for nothing starts the next one at once, within the task's budget of visits.
"""

from collections.abc import Sequence
from typing import ClassVar

from msgspec.structs import replace
from py_trees.common import Status

from formiga_bt.clock import micros
from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import Chain, adopt_children
from formiga_bt.nodes.leaves import Leaf
from formiga_bt.nodes.memory import LoopMem, Mem
from formiga_bt.nodes.parallel import zip_items
from formiga_bt.nodes.run import Run


class BreakIfNode(Leaf):
    """`break_if`: end everything up to the nearest loop with success."""

    kind: ClassVar[str] = "break_if"

    def __init__(self, step: model.BreakIf) -> None:
        super().__init__(step.title, step)
        self.step = step

    def act(self, run: Run) -> Status:
        """Read the condition."""
        self.breaking = bool(self.step.cond.run(self.env(run)))
        return SUCCESS


class Rounds(Chain):
    """Common part of loops."""

    word: ClassVar[str] = "repeat"
    state: LoopMem

    def place(self, index: int) -> str:
        """Return the path of a step in this round."""
        return f"{self.path}.{self.word}#{self.state.round}.{self.body()[index].seg}"

    def memo(self) -> Mem:
        """Return the memory."""
        self.state = replace(self.state, index=self.index, ran=self.ran)
        return self.state

    def may_start(self, run: Run) -> bool:
        """Return whether the next round, whose number is set, may start."""
        raise NotImplementedError

    def round_ended(self, run: Run) -> bool:
        """Look at the end of a round; return whether the loop ends with it."""
        raise NotImplementedError

    def finish(self, run: Run) -> Status:  # noqa: ARG002
        """End the loop with success."""
        self.breaking = False
        return SUCCESS

    def rounds(self, run: Run) -> Status:
        """Run rounds from the one whose number is set, until one waits."""
        while True:
            if not self.may_start(run):
                return self.finish(run)
            self.state = replace(self.state, round_at=run.now, waiting=False)
            self.breaking = False
            run.spend()
            status = self.start_chain(run)
            if status is not SUCCESS:
                return status
            if self.breaking or self.round_ended(run):
                return self.finish(run)
            self.state = replace(self.state, round=self.state.round + 1)
            if self._must_wait(run):
                return RUNNING

    def _must_wait(self, run: Run) -> bool:
        start = self.state.round_at + self.state.every_us
        if self.state.over_at is not None:
            start = min(start, self.state.over_at)
        if not self.state.every_us or start <= run.now:
            return False
        self.state = replace(self.state, waiting=True)
        self.remember(run, self.state)
        run.set_deadline(self.key, start)
        return True

    def conclude(self, run: Run) -> Status:  # noqa: ARG002
        """End of a round."""
        return SUCCESS

    def on_proceed(self, run: Run) -> Status:
        """Go on with the round, or start the next when its time has come."""
        if self.state.waiting:
            if not run.is_due(self.key):
                return RUNNING
            run.clear_deadline(self.key)
            return self.rounds(run)
        status = super().on_proceed(run)
        if status is not SUCCESS:
            return status
        if self.breaking or self.round_ended(run):
            return self.finish(run)
        self.state = replace(self.state, round=self.state.round + 1)
        return RUNNING if self._must_wait(run) else self.rounds(run)

    def on_halt(self, run: Run) -> list[str]:
        """Stop the round."""
        return [] if self.state.waiting else super().on_halt(run)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, LoopMem)
        self.state = mem
        self.index, self.ran = mem.index, mem.ran
        if not mem.waiting:
            self.restore_chain(run, mem.index, ran=mem.ran)


class LoopNode(Rounds):
    """`while` and `repeat`."""

    def __init__(self, step: model.Loop, children: Sequence[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        self.state = LoopMem(1, waiting=True)
        adopt_children(self, children)

    @property
    def kind(self) -> str:  # type: ignore[override]
        """Return `while` or `repeat`."""
        return "while" if self.step.cond is not None else "repeat"

    @property
    def word(self) -> str:  # type: ignore[override]
        """Return the word in instance paths."""
        return self.kind

    def on_enter(self, run: Run) -> Status:
        """Read the numbers once and start the first round."""
        step, env = self.step, run.env(self.scope, self.error_here())
        self.state = LoopMem(
            1,
            over_at=run.now + micros(step.duration.run(env)) if step.duration else None,
            times=int(step.times.run(env)) if step.times else None,
            every_us=micros(step.every.run(env)) if step.every else 0,
            most=int(step.max.run(env)) if step.max else None,
        )
        return self.rounds(run)

    def may_start(self, run: Run) -> bool:
        """Return whether count, duration, `max` and the `while` condition allow another round."""
        state = self.state
        if state.times is not None and state.round > state.times:
            return False
        if state.most is not None and state.round > state.most:
            return False
        if state.over_at is not None and run.now >= state.over_at:
            return False
        return self.step.cond is None or bool(self.step.cond.run(run.env(self.scope, self.error_here())))

    def round_ended(self, run: Run) -> bool:
        """Read `until`."""
        until = self.step.until
        return until is not None and bool(until.run(run.env(self.scope, self.error_here())))


class ForNode(Rounds):
    """`for` in order: a round per item; the loop names are set in the scope around it."""

    kind: ClassVar[str] = "for"
    word: ClassVar[str] = "for"

    def __init__(self, step: model.For, children: Sequence[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        self.state = LoopMem(1, waiting=True)
        adopt_children(self, children)
        self._needs = None if step.need == "all" else int(step.need)
        self._failed_round = False

    def on_enter(self, run: Run) -> Status:
        """Read the lists once and start the first round."""
        items = zip_items(self, run, self.step)
        if items is None:
            return FAILURE
        self.state, self._failed_round = LoopMem(1, items=items), False
        return self._cleared(run, self.rounds(run))

    def may_start(self, run: Run) -> bool:
        """Set the loop names of the next item, if there is one."""
        if self.state.round > len(self.state.items):
            return False
        for name, value in self.state.items[self.state.round - 1].items():
            run.set_var(self.scope, name, value)
        return True

    def round_ended(self, run: Run) -> bool:
        """Take what the round saved under the name to collect; with `need` count the success."""
        self._take(run)
        self.state = replace(self.state, times=(self.state.times or 0) + (not self._failed_round))
        self._failed_round = False
        return False

    def _take(self, run: Run) -> None:
        name = self.step.collect
        if name:
            env = run.env(self.scope)
            if env.is_set(name):
                self.state = replace(self.state, collected=(*self.state.collected, env.name(name)))
                run.set_var(self.scope, name, None)

    def _child_ended(self, child: Node) -> Status | None:
        if child.status is FAILURE and self._needs is not None:
            self._failed_round = True  # with `need: N` a failed round is only not counted
            return SUCCESS
        return super()._child_ended(child)

    def on_proceed(self, run: Run) -> Status:
        """Go on; unset the loop names after a failure."""
        return self._cleared(run, super().on_proceed(run))

    def _cleared(self, run: Run, status: Status) -> Status:
        if status is FAILURE:
            self._clear(run)
        return status

    def finish(self, run: Run) -> Status:
        """Unset the loop names, hand the collected list over, count what `need` asks for."""
        self._clear(run)
        if self.step.collect:
            run.set_var(self.scope, self.step.collect, self.state.collected)
        if self._needs is not None and (self.state.times or 0) < self._needs and not self.breaking:
            return self.fail("nothing_applied", f"fewer than {self._needs} rounds succeeded")
        return super().finish(run)

    def _clear(self, run: Run) -> None:
        for name in self.step.lists:
            run.set_var(self.scope, name, None)

    def on_halt(self, run: Run) -> list[str]:
        """Stop the round and unset the loop names."""
        goals = super().on_halt(run)
        self._clear(run)
        return goals
