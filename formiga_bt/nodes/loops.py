"""Loops: while, repeat, `for` in order, and break_if. A round is a chain of steps at a path with the round's number.

A round that waits for nothing starts the next one at once, within the task's budget of visits.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

from msgspec.structs import replace
from py_trees.common import Status

from formiga_bt.base.clock import micros
from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import Chain, adopt_children
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.leaves import Leaf
from formiga_bt.nodes.memory import LoopMem, Mem
from formiga_bt.nodes.parallel import OverItems, zip_items
from formiga_bt.nodes.run import Failure, Run


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

    times: ClassVar[bool] = True
    word: ClassVar[str] = "repeat"
    state: LoopMem
    fresh: tuple[str, ...]
    """Names that have no value when a round begins."""

    def place(self, index: int) -> str:
        """Return the path of a step in this round."""
        return f"{self.path}.{self.word}#{self.state.round}.{self.body()[index].seg}"

    def memo(self) -> Mem:
        """Return the memory."""
        self.state = replace(self.state, index=self.index, ran=self.ran)
        return self.state

    def more(self) -> bool:
        """Return whether there is a round with the number that is set."""
        raise NotImplementedError

    def may_start(self, run: Run) -> bool:
        """Look at what is read before a round; return whether it may start."""
        raise NotImplementedError

    def round_ended(self, run: Run, failure: Failure | None) -> Status | None:
        """Look at the end of a round; return how the loop ends with it, or None if it goes on."""
        raise NotImplementedError

    def finish(self, run: Run) -> Status:  # noqa: ARG002
        """End the loop with success. It counts as skipped when all its rounds were."""
        self.breaking = False
        self.skipped = self.state.round > 1 and not self.state.ever_ran
        return SUCCESS

    def rounds(self, run: Run) -> Status:
        """Run rounds from the one whose number is set, until one waits."""
        while self.more() and self.may_start(run):
            self.state = replace(self.state, round_at=run.clock, waiting=False)
            self.breaking = False
            run.spend()
            self.unset(run, self.fresh)
            status = self.start_chain(run)
            if status is RUNNING:
                return RUNNING
            over = self._round_over(run, status)
            if over is not None:
                return over
        return self.finish(run)

    def _round_over(self, run: Run, status: Status) -> Status | None:
        """Count a round; return the loop's status, or None if the next round may start now."""
        failure = self.failure if status is FAILURE else None
        ran = self.state.ever_ran or self.ran or failure is not None
        self.state = replace(self.state, ever_ran=ran)
        over = self.round_ended(run, failure)
        if over is not None:
            return over
        self.failure = None
        self.state = replace(self.state, round=self.state.round + 1)
        if self.breaking or not self.more():
            return self.finish(run)
        return RUNNING if self._must_wait(run) else None

    def _must_wait(self, run: Run) -> bool:
        start = self.state.round_at + self.state.every_us
        if self.state.over_at is not None:
            start = min(start, self.state.over_at)
        if not self.state.every_us or start <= run.clock:
            return False
        self.state = replace(self.state, waiting=True)
        self.remember(run, self.state)
        run.set_deadline(self.key, run.now + start - run.clock)
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
        if status is RUNNING:
            return RUNNING
        over = self._round_over(run, status)
        return over if over is not None else self.rounds(run)

    def on_halt(self, run: Run) -> list[End]:
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
        self.fresh = step.fresh
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
            over_at=run.clock + micros(step.duration.run(env)) if step.duration else None,
            times=int(step.times.run(env)) if step.times else None,
            every_us=micros(step.every.run(env)) if step.every else 0,
            most=int(step.max.run(env)) if step.max else None,
        )
        return self.rounds(run)

    def more(self) -> bool:
        """Return whether count and `max` allow another round."""
        most = [number for number in (self.state.times, self.state.most) if number is not None]
        return not most or self.state.round <= min(most)

    def may_start(self, run: Run) -> bool:
        """Return whether the duration and the `while` condition allow another round."""
        if self.state.over_at is not None and run.clock >= self.state.over_at:
            return False
        return self.step.cond is None or bool(self.step.cond.run(run.env(self.scope, self.error_here())))

    def round_ended(self, run: Run, failure: Failure | None) -> Status | None:
        """A failed round fails the loop; else read `until`."""
        if failure is not None:
            return FAILURE
        until = self.step.until
        if until is not None and not self.breaking:
            self.breaking = bool(until.run(run.env(self.scope, self.error_here())))
        return None


class ForNode(OverItems, Rounds):
    """`for` in order: a round per item; the loop names are set in the scope around it."""

    kind: ClassVar[str] = "for"
    word: ClassVar[str] = "for"

    def __init__(self, step: model.For, children: Sequence[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        self.fresh = step.fresh
        self.state = LoopMem(1, waiting=True)
        adopt_children(self, children)
        self._needs = None if step.need == "all" else int(step.need)

    def on_enter(self, run: Run) -> Status:
        """Read the lists once and start the first round."""
        self.state, self.items = LoopMem(1, waiting=True), ()
        items = zip_items(self, run, self.step)
        if items is None:
            return FAILURE
        self.state = LoopMem(1)
        self.keep_items(run, items)
        self._take(run)  # the list of an earlier run of this loop
        return self.rounds(run)

    def more(self) -> bool:
        """Return whether there is an item left."""
        return self.state.round <= len(self.items)

    def may_start(self, run: Run) -> bool:
        """Set the loop names of the next item."""
        for name, value in self.items[self.state.round - 1].items():
            run.set_var(self.scope, name, value)
        return True

    def round_ended(self, run: Run, failure: Failure | None) -> Status | None:
        """Take what the round saved under the name to collect; with `need` a failed round is only not counted."""
        saved = self._take(run)
        if failure is None:
            counts = self.state.succeeded + self.ran
            self.state = replace(self.state, succeeded=counts, collected=(*self.state.collected, *saved))
            return None
        if self._needs is None:
            self._clear(run)
            return FAILURE
        self.state = replace(self.state, failure=self.state.failure or failure)
        return None

    def _take(self, run: Run) -> tuple[Any, ...]:
        """Unset the name to collect; return the value that it had, if any."""
        name = self.step.collect
        if not name:
            return ()
        env = run.env(self.scope)
        if not env.is_set(name):
            return ()
        value = env.name(name)
        self.unset(run, (name,))
        return (value,)

    def finish(self, run: Run) -> Status:
        """Unset the loop names, hand the collected list over, count what `need` asks for."""
        self._clear(run)
        counts = bool(self.items) and not self.breaking and self.state.ever_ran
        if self._needs is not None and counts and self.state.succeeded < self._needs:
            few = Failure("nothing_applied", f"fewer than {self._needs} succeeded", self.path)
            return self.fail_as(self.state.failure or few)
        if self.step.collect:
            run.set_var(self.scope, self.step.collect, self.state.collected)
        return super().finish(run)

    def _clear(self, run: Run) -> None:
        for name in self.step.lists if self.items else ():
            run.set_var(self.scope, name, None)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the round and unset the loop names."""
        goals = super().on_halt(run)
        if self.items:
            self._take(run)
            self._clear(run)
        return goals

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        self.find_items(run)
        super().on_restore(run, mem)
