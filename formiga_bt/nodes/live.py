"""Nodes with live conditions: wait_until, guard, reactive sequence and fallback. Nothing is polled: a watch wakes them.

A watch makes its owner due at its own place in the tree, so a guard is looked at before what it guards. A condition that
reads a state not yet known fails the step at entry (`unknown_state`); later it leaves everything as it is.
"""

from collections.abc import Sequence as Seq
from contextlib import suppress
from typing import ClassVar

from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.lang.model import UnknownState
from formiga_bt.nodes import draining
from formiga_bt.nodes.base import RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import Chain, adopt_children, skipped_before
from formiga_bt.nodes.ends import Drain, End
from formiga_bt.nodes.leaves import InstantNode, Leaf, check_failure
from formiga_bt.nodes.memory import LiveMem, Mem, PassMem, WaitForMem
from formiga_bt.nodes.run import Failure, Run, StepRun


class WaitUntilNode(Leaf):
    """`wait_until`."""

    kind: ClassVar[str] = "wait_until"
    watches = True

    def __init__(self, step: model.WaitUntil) -> None:
        super().__init__(step.title, step)
        self.step = step

    def act(self, run: StepRun) -> Status:
        """Succeed at once if true, else watch."""
        if self.step.cond.run(self.env(run)):
            return SUCCESS
        self.remember(run, PassMem())
        run.watch(self.key, (self.step.cond,), self.scope)
        return RUNNING

    def on_proceed(self, run: StepRun) -> Status:
        """Look again."""
        with suppress(UnknownState):
            if self.step.cond.run(self.env(run)):
                return SUCCESS
        run.watch(self.key, (self.step.cond,), self.scope)
        return RUNNING

    def is_quiet(self, run: StepRun) -> bool:
        """Return whether it is still false; what it reads may be another thing now."""
        try:
            if self.step.cond.run(self.env(run)):
                return False
        except UnknownState:
            pass
        except Exception:  # noqa: BLE001 - the visit raises it again, at its place in the tree
            return False
        run.watch(self.key, (self.step.cond,), self.scope)
        return True

    def on_restore(self, run: StepRun, mem: Mem) -> None:  # noqa: ARG002
        """Watch again."""
        run.watch(self.key, (self.step.cond,), self.scope)


class WaitForNode(Leaf):
    """`wait_for`: the next event of an agent. Events that come together are taken one by one."""

    kind: ClassVar[str] = "wait_for"
    watches = True

    def __init__(self, step: model.WaitFor) -> None:
        super().__init__(step.title, step)
        self.step = step
        self.mem = WaitForMem("", 0)

    def act(self, run: StepRun) -> Status:
        """Take an event that came already, if those count, else wait."""
        assert self.step.who.agent is not None
        agent = self.step.who.agent.run(self.env(run)).id
        after = run.events_seen(agent, self.step.event) if self.step.since_task else run.newest_event()
        self.mem = WaitForMem(agent, after)
        if self._take(run):
            return SUCCESS
        self.remember(run, self.mem)
        run.watch_event(self.key, agent, self.step.event)
        return RUNNING

    def _take(self, run: StepRun) -> bool:
        after = self.mem.after
        if self.step.since_task:  # another branch may have taken one meanwhile
            after = run.events_seen(self.mem.agent, self.step.event)
        found = run.take_event(self.mem.agent, self.step.event, after)
        if found is not None and self.step.save_as:
            run.set_var(self.scope, self.step.save_as, dict(found))
        return found is not None

    def on_proceed(self, run: StepRun) -> Status:
        """Look again."""
        return SUCCESS if self._take(run) else RUNNING

    def on_restore(self, run: StepRun, mem: Mem) -> None:
        """Wait again."""
        assert isinstance(mem, WaitForMem)
        self.mem = mem
        run.watch_event(self.key, mem.agent, self.step.event)


class Watcher(Chain):
    """A chain that looks at live conditions before its running child, and may stop it."""

    watches = True
    halting = False
    drain: Drain = ()
    decided: Failure | None = None

    def live(self) -> tuple[model.Expr, ...]:
        """Return the conditions that are live at the present place."""
        raise NotImplementedError

    def verdict(self, run: Run) -> tuple[bool, Failure | None]:
        """Return whether to stop the running child, and the failure to return then (None: success)."""
        raise NotImplementedError

    def memo(self) -> Mem:
        """Return the memory."""
        return LiveMem(self.index, self.ran, self.halting, self.drain, self.decided)

    def on_enter(self, run: Run) -> Status:
        """Start the chain."""
        self.halting, self.drain, self.decided = False, (), None
        return self.start_chain(run)

    def arrive(self, run: Run) -> None:
        """Watch before the child starts: what it writes at once counts too."""
        run.watch(self.key, self.live(), self.scope)

    def on_proceed(self, run: Run) -> Status:
        """Look at the conditions, then at the child; while goals drain, wait for them."""
        if self.halting:
            return self._drained(run)
        stop, failure = self.verdict(run)
        if stop:
            return self._stop(run, failure)
        run.watch(self.key, self.live(), self.scope)
        return super().on_proceed(run)

    def is_quiet(self, run: Run) -> bool:
        """Return whether the conditions let the child go on."""
        if self.halting:
            return False
        try:
            stop, _ = self.verdict(run)
        except Exception:  # noqa: BLE001 - the visit raises it again, at its place in the tree
            return False
        if not stop:
            run.watch(self.key, self.live(), self.scope)
        return not stop

    def _stop(self, run: Run, failure: Failure | None) -> Status:
        self.drain = draining.adopt(run, self.key, super().on_halt(run))
        self.halting, self.decided = True, failure
        run.unwatch(self.key)
        run.clear_deadline(self.key)
        self.remember(run, self.memo())
        self.feedback_message = "halting"
        return self._drained(run)

    def _drained(self, run: Run) -> Status:
        if not draining.is_empty(run, self.drain):
            return RUNNING
        unconfirmed = draining.unconfirmed(run, self.drain, self.path)
        draining.drop(run, self.drain)
        self.drain = ()
        return SUCCESS if self.decided is None else self.fail_as(unconfirmed or self.decided)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the child; goals already draining move on."""
        moved = draining.move_on(run, self.drain)
        self.drain = ()
        return [*moved, *([] if self.halting else super().on_halt(run))]

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, LiveMem)
        self.halting, self.drain, self.decided = mem.halting, mem.drain, mem.failure
        self.index, self.ran = mem.index, mem.ran
        if not mem.halting:
            self.restore_chain(run, mem.index, ran=mem.ran)
            run.watch(self.key, self.live(), self.scope)


class GuardNode(Watcher):
    """`guard`: stop the steps and fail as soon as the condition is false."""

    kind: ClassVar[str] = "guard"

    def __init__(self, step: model.Guard, children: Seq[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        adopt_children(self, children)

    def live(self) -> tuple[model.Expr, ...]:
        """Return the guard's condition."""
        return (self.step.cond,)

    def on_enter(self, run: Run) -> Status:
        """Fail at once if false, else start the steps."""
        if not self.step.cond.run(run.env(self.scope, self.error_here())):
            return self.fail_as(self._failure())
        return super().on_enter(run)

    def verdict(self, run: Run) -> tuple[bool, Failure | None]:
        """Stop when the condition is known to be false."""
        try:
            holds = self.step.cond.run(run.env(self.scope, self.error_here()))
        except UnknownState:
            return False, None
        return (not holds), self._failure()

    def _failure(self) -> Failure:
        return Failure("guard", f"{self.step.cond.source} is false", self.path)


class ReactiveNode(Watcher):
    """`sequence` and `fallback` with `reactive: true`: the children before the running one, pure checks, stay live.

    In a sequence a check that turns false stops what runs and fails; in a fallback one that turns true stops it and succeeds.
    """

    gives_error = True

    def __init__(self, step: model.Sequence | model.Fallback, children: Seq[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.is_fallback = isinstance(step, model.Fallback)
        self.last: Failure | None = None
        adopt_children(self, children)

    @property
    def kind(self) -> str:  # type: ignore[override]
        """Return `sequence` or `fallback`."""
        return "fallback" if self.is_fallback else "sequence"

    def _checks(self) -> list[tuple[int, model.Check]]:
        found = []
        for index, child in enumerate(self.body()[: self.index]):
            step = child.step_model
            if isinstance(child, InstantNode) and isinstance(step, model.Check):
                found.append((index, step))
        return found

    def live(self) -> tuple[model.Expr, ...]:
        """Return the conditions of the checks passed."""
        return tuple(check.cond for _, check in self._checks())

    def on_enter(self, run: Run) -> Status:
        """Start the first child."""
        self.last = None
        return super().on_enter(run)

    def verdict(self, run: Run) -> tuple[bool, Failure | None]:
        """Re-check in order."""
        error = self.error_here()
        for index, check in self._checks():
            env = run.env(self.scope, error)
            try:
                holds = bool(check.cond.run(env))
                false = None if holds else check_failure(check, env, self.place(index))
            except UnknownState:
                continue
            if holds == self.is_fallback:
                return True, false
            error = false or error  # what the next child of a fallback sees
        return False, None

    def error_for_children(self) -> Failure | None:
        """Return the failure of the child before the running one of a fallback."""
        return self.last or (skipped_before(self.path) if self.is_fallback and self.index else None)

    def _child_ended(self, child: Node) -> Status | None:
        if not self.is_fallback:
            return super()._child_ended(child)
        if child.status is Status.FAILURE:
            self.last = child.failure
            return None
        self.breaking = child.breaking
        return None if child.skipped else SUCCESS

    def conclude(self, run: Run) -> Status:
        """End after the last child."""
        if not self.is_fallback:
            return super().conclude(run)
        if self.last is not None:
            return self.fail_as(self.last)
        return self.fail("nothing_applied", "every child of the fallback was skipped")

    def memo(self) -> Mem:
        """Return the memory; a fallback's last failure takes the place of a decision not yet made."""
        return LiveMem(self.index, self.ran, self.halting, self.drain, self.decided if self.halting else self.last)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, LiveMem)
        self.last = None if mem.halting else mem.failure
        super().on_restore(run, mem)
