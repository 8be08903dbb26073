"""A sequence with `finally`: after its end, good or bad, the steps of `finally` run in place; their failure changes nothing.

A sequence that is stopped hands its `finally` over instead (`Run.cleanup`): it runs on its own once what the sequence had
under way has ended, and whoever stopped the sequence waits for it. One that runs in place already goes on as it is.
"""

from collections.abc import Callable, Sequence
from typing import ClassVar

from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, LeafError, Node
from formiga_bt.nodes.composites import SequenceNode, adopt_children
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.memory import CleanupMem, Mem
from formiga_bt.nodes.run import AROUND, THROUGH, CleanupOrder, Failure, Run, Runaway


class FinallyNode(SequenceNode):
    """The steps of a `finally`, below their sequence or on their own."""

    gives_error = True

    def __init__(self, children: Sequence[Node], error: Failure | None = None) -> None:
        super().__init__("finally", None, children, joint=".")
        self.error = error

    def error_for_children(self) -> Failure | None:
        """Return what `error` is once it is on its own; below its sequence that tells it."""
        return self.error


class CleanupNode(Node):
    """Runs a sequence, then its `finally`, then ends as the sequence did."""

    kind: ClassVar[str] = "finally"
    gives_error = True

    def __init__(self, step: model.Sequence, main: Node, cleanup: Callable[[], FinallyNode]) -> None:
        super().__init__(step.title, step)
        self.main = main
        self.suffix = ":finally"
        main.tells = False  # the step has not ended before its `finally`
        self._new_cleanup = cleanup
        self.cleanup = cleanup()
        self.closing = False
        self.broken = False
        """`finally` raised: it cannot go on, also not on its own."""
        self.decided: Failure | None = None
        adopt_children(self, [main, self.cleanup])

    def error_for_children(self) -> Failure | None:
        """Return the failure of the sequence, for the steps of `finally`."""
        return self.decided if self.closing else None

    def on_enter(self, run: Run) -> Status:
        """Start the sequence."""
        self.closing, self.broken, self.decided = False, False, None
        self.remember(run, CleanupMem())
        self.main.enter(run, self.path, self.scope)
        return self._after_main(run)

    def on_proceed(self, run: Run) -> Status:
        """Go on with what runs."""
        if self.closing:
            return self._tidied(run, lambda: self.cleanup.proceed(run))
        self.main.proceed(run)
        return self._after_main(run)

    def _after_main(self, run: Run) -> Status:
        if self.main.status is RUNNING:
            return RUNNING
        self.closing, self.decided = True, self.main.failure if self.main.status is FAILURE else None
        self.skipped, self.breaking = self.main.skipped, self.main.breaking
        self.remember(run, CleanupMem(True, self.decided, self.skipped, self.breaking))
        run.open_scope(self.key, {AROUND: self.scope, THROUGH: True})
        return self._tidied(run, lambda: self.cleanup.enter(run, self.path, self.key))

    def _tidied(self, run: Run, act: Callable[[], Status]) -> Status:
        try:
            status = act()
        except (LeafError, Runaway):
            self.broken = True
            raise
        if status is RUNNING:
            return RUNNING
        run.close_scope(self.key)
        return SUCCESS if self.decided is None else self.fail_as(self.decided)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the sequence and hand `finally` over, also one that runs."""
        goals = [] if self.closing else self.main.halt(run)
        error = self.decided if self.closing and self.decided is not None else self.error_here()
        order = CleanupOrder(self.path, self.scope, self.key, tuple(goals), error)
        end = None if self.broken else run.cleanup(order, self.cleanup if self.closing else None)
        if self.closing and end is not None:
            self.cleanup = self._new_cleanup()
            adopt_children(self, [self.main, self.cleanup])
        elif self.closing:
            goals = self.cleanup.halt(run)
            run.close_scope(self.key)
        return goals if end is None else [*goals, end]

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on with what ran."""
        assert isinstance(mem, CleanupMem)
        self.closing, self.decided = mem.closing, mem.failure
        self.skipped, self.breaking = mem.skipped, mem.breaking
        if mem.closing:
            self.cleanup.restore(run, self.path, self.key)
        else:
            self.main.restore(run, self.path, self.scope)
