"""Modifiers as decorators, outermost first: when, ignore_failure, timeout, retry, attempt timeout.

Only `retry` changes the instance path of what is below it (`@2` = second attempt). The keys of the others add their
word to the step's path, so that each has its own memory and deadline.
"""

from typing import ClassVar

from msgspec.structs import replace
from py_trees import decorators
from py_trees.common import Status

from formiga_bt.base.clock import Micros, micros
from formiga_bt.lang import model
from formiga_bt.nodes import draining
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.ends import Drain, End
from formiga_bt.nodes.leaves import DoNode
from formiga_bt.nodes.memory import Mem, PassMem, RetryMem, TimeoutMem
from formiga_bt.nodes.run import Failure, Run, StepRun


class Modifier(Node, decorators.Decorator):
    """Common part: one child, at the same path unless the kind says otherwise.

    The child tells how the step ended; a modifier does so only when it decides that itself.
    """

    tells = False

    def __init__(self, step: model.Step, child: Node) -> None:
        Node.__init__(self, self.kind, step)
        child.parent = self
        self.children = [child]
        self.child = child
        self.suffix = f":{self.kind}"

    @property
    def decorated(self) -> Node:  # type: ignore[override]
        """Return the child, under py_trees' name."""
        return self.child

    def on_proceed(self, run: Run) -> Status:
        """Pass the visit on."""
        self.child.proceed(run)
        return self.child_ended(run)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the child."""
        return self.child.halt(run)

    def on_restore(self, run: Run, mem: Mem) -> None:  # noqa: ARG002
        """Rebuild the child."""
        self.child.restore(run, self.path, self.scope)

    def child_ended(self, run: Run) -> Status:
        """Return this node's status for the child's."""
        raise NotImplementedError

    def report_end(self, run: StepRun) -> None:
        """Tell of a failure that is not the child's: what it reads at its start is not known."""
        if self.failure is not None and self.failure is not self.child.failure:
            run.ended(self.path, "F", self.failure.code)

    def same(self) -> Status:
        """Take the child's status, skip and failure over."""
        self.skipped, self.failure, self.breaking = self.child.skipped, self.child.failure, self.child.breaking
        return self.child.status


class WhenNode(Modifier):
    """`when`: read once at entry; false = skipped."""

    kind: ClassVar[str] = "when"

    def on_enter(self, run: Run) -> Status:
        """Read the condition; start the child or be skipped."""
        assert self.step_model is not None
        assert self.step_model.when is not None
        if not self.step_model.when.run(run.env(self.scope, self.error_here())):
            self.skipped = True
            run.ended(self.path, "K")
            return SUCCESS
        self.remember(run, PassMem())
        self.child.enter(run, self.path, self.scope)
        return self.child_ended(run)

    def child_ended(self, run: Run) -> Status:  # noqa: ARG002
        """Pass through."""
        return self.same()


class IgnoreFailureNode(Modifier):
    """`ignore_failure: true`: a failure counts as success. What ends the task (an abort, a breach) never comes here."""

    kind: ClassVar[str] = "ignore_failure"

    def on_enter(self, run: Run) -> Status:
        """Start the child."""
        self.remember(run, PassMem())
        self.child.enter(run, self.path, self.scope)
        return self.child_ended(run)

    def child_ended(self, run: Run) -> Status:  # noqa: ARG002
        """Turn failure into success."""
        if self.child.status is FAILURE:
            self.feedback_message = self.child.failure.code if self.child.failure else ""
            return SUCCESS
        return self.same()


class TimeoutNode(Modifier):
    """`timeout` (and a retry's `attempt_timeout`): stop the child at the deadline, await its goals' ends, then fail.

    Around a `do`, a goal that succeeds while it is being canceled counts: the work was done.
    """

    times: ClassVar[bool] = True

    def __init__(self, step: model.Step, child: Node, duration: model.Expr, word: str = "timeout") -> None:
        self.word = word
        super().__init__(step, child)
        self.name = word
        self.suffix = f":{word}"
        self.duration = duration
        self.drain: Drain = ()
        self.halting = False

    kind: ClassVar[str] = "timeout"

    def on_enter(self, run: Run) -> Status:
        """Set the deadline and start the child."""
        self.drain, self.halting = (), False
        duration = self.duration
        after: Micros = micros(
            duration.const if duration.is_const else duration.run(run.env(self.scope, self.error_here()))
        )
        self.remember(run, TimeoutMem())
        run.set_deadline(self.key, run.now + after)
        self.child.enter(run, self.path, self.scope)
        return self.child_ended(run)

    def on_proceed(self, run: Run) -> Status:
        """Drain, or visit the child, or - at the deadline - stop it. A child that ends at this instant counts."""
        if self.halting:
            return self._drained(run)
        if self.child.proceed(run) is not RUNNING:
            return self.child_ended(run)
        if not run.is_due(self.key):
            return RUNNING
        self.drain, self.halting = draining.adopt(run, self.key, self.child.halt(run)), True
        run.clear_deadline(self.key)
        self.remember(run, TimeoutMem(halting=True, drain=self.drain))
        self.feedback_message = "halting"
        return self._drained(run)

    def _drained(self, run: Run) -> Status:
        if not draining.is_empty(run, self.drain):
            return RUNNING
        done = self._done_after_all(run)
        unconfirmed = draining.unconfirmed(run, self.drain, self.path)
        again = all(view.repeatable for view in draining.goals(run, self.drain))
        draining.drop(run, self.drain)
        if done is not None:
            return done
        if unconfirmed is not None:
            return self.fail_as(unconfirmed)
        said = f"not done within its {self.word.replace('_', ' ')}"
        return self.fail("timeout", said, retryable=again, by_another=not again)

    def _done_after_all(self, run: Run) -> Status | None:
        leaf: Node = self.child
        while isinstance(leaf, Modifier):
            leaf = leaf.child
        if not isinstance(leaf, DoNode):
            return None
        for view in draining.goals(run, self.drain):
            if view.state == "succeeded":
                place = view.id.split("/", 2)[2].partition("+")[0]
                leaf.run, leaf.path, leaf.key, leaf.scope = (
                    run,
                    place,
                    place,
                    self.scope,
                )  # if we were restored, it was not
                status = leaf.conclude(run, view)
                self.failure = leaf.failure
                return status
        return None

    def child_ended(self, run: Run) -> Status:  # noqa: ARG002
        """Pass through."""
        return self.same()

    def report_end(self, run: StepRun) -> None:
        """Tell how a step ended that was stopped at the deadline."""
        if not self.halting:
            super().report_end(run)
        elif self.failure is not None:
            run.ended(self.path, "F", self.failure.code)
        else:
            run.ended(self.path, "S")

    def on_halt(self, run: Run) -> list[End]:
        """Stop the child; goals already draining move to the one that stops us."""
        moved = draining.move_on(run, self.drain)
        self.drain = ()
        return [*self.child.halt(run), *moved]

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on running the child, or waiting for goals to end."""
        assert isinstance(mem, TimeoutMem)
        self.halting, self.drain = mem.halting, mem.drain
        if not mem.halting:
            super().on_restore(run, mem)


class RetryNode(Modifier):
    """`retry`: try again after a failure that may be retried, up to `attempts` times in all."""

    times: ClassVar[bool] = True
    kind: ClassVar[str] = "retry"

    def on_enter(self, run: Run) -> Status:
        """Read attempts, delay and backoff once; start the first attempt."""
        assert self.step_model is not None
        retry = self.step_model.retry
        assert retry is not None
        env = run.env(self.scope, self.error_here())
        self.mem = RetryMem(
            attempts=int(retry.attempts.run(env)),
            delay_us=micros(retry.delay.run(env)) if retry.delay else 0,
            backoff=float(retry.backoff.run(env)) if retry.backoff else 1.0,
        )
        return self._attempt(run, 1)

    def _attempt(self, run: Run, number: int) -> Status:
        while True:
            self.mem = replace(self.mem, attempt=number, waiting=False, had=())
            self.remember(run, self.mem)
            if number > 1 and self.step_model is not None and self.step_model.retry is not None:
                self.unset(run, self.step_model.retry.fresh)
            self.child.enter(run, f"{self.path}@{number}", self.scope)
            status = self.child_ended(run)
            if status is not RUNNING or self.child.status is RUNNING or self.mem.waiting:
                return status
            number += 1

    def child_ended(self, run: Run) -> Status:
        """Pass success through; after a failure wait for the next attempt, or give up."""
        child = self.child
        if child.status is not FAILURE:
            return self.same()
        assert child.failure is not None
        if self.mem.attempt >= self.mem.attempts or not self._may_again(child.failure):
            return self.same()
        self._exclude(child.failure)
        delay = round(self.mem.delay_us * self.mem.backoff ** (self.mem.attempt - 1))
        if delay > 0:
            self.mem = replace(self.mem, waiting=True)
            self.remember(run, self.mem)
            run.set_deadline(self.key, run.now + delay)
        return RUNNING

    @property
    def takes_another(self) -> bool:
        """Return whether the next attempt is made with other agents."""
        assert self.step_model is not None
        return self.step_model.retry is not None and self.step_model.retry.agent == "another"

    def note_agents(self, run: Run, agents: tuple[str, ...]) -> None:
        """Keep in mind who was granted to a block of this attempt."""
        self.mem = replace(self.mem, had=tuple(dict.fromkeys((*self.mem.had, *agents))))
        self.remember(run, self.mem)

    def clear_agents(self, run: Run, agents: tuple[str, ...]) -> None:
        """Forget who did its turn and was replaced: a later failure that names nobody is not theirs."""
        self.mem = replace(self.mem, had=tuple(one for one in self.mem.had if one not in agents))
        self.remember(run, self.mem)

    def _may_again(self, failure: Failure) -> bool:
        """Return whether a failure may be tried again; by another agent also what this one may not repeat, and its loss."""
        assert self.step_model is not None
        assert self.step_model.retry is not None
        if not self.step_model.retry.covers(failure.code):
            return False
        replaced = failure.agent in self.mem.had or (not failure.agent and bool(self.mem.had))
        return failure.retryable or (self.takes_another and failure.by_another and replaced)

    def _exclude(self, failure: Failure) -> None:
        """Leave out who failed; if the failure names none of the block's agents, all that it had."""
        if self.takes_another:
            culprits = (failure.agent,) if failure.agent in self.mem.had else self.mem.had
            self.mem = replace(self.mem, failed=tuple(dict.fromkeys((*self.mem.failed, *culprits))))

    def on_proceed(self, run: Run) -> Status:
        """Start the next attempt when the delay is over, else visit the running one."""
        if self.mem.waiting:
            if not run.is_due(self.key):
                return RUNNING
            run.clear_deadline(self.key)
            return self._attempt(run, self.mem.attempt + 1)
        if self.child.proceed(run) is RUNNING:
            return RUNNING
        status = self.child_ended(run)
        if status is RUNNING and not self.mem.waiting:
            return self._attempt(run, self.mem.attempt + 1)
        return status

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on waiting, or with the attempt under way."""
        assert isinstance(mem, RetryMem)
        self.mem = mem
        if not mem.waiting:
            self.child.restore(run, f"{self.path}@{mem.attempt}", self.scope)
