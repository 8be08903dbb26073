"""A sequence with `finally`: after its end, good or bad, the steps of `finally` run in place; their failure changes nothing."""

from typing import ClassVar

from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import SequenceNode, adopt_children
from formiga_bt.nodes.memory import Mem, TidyMem
from formiga_bt.nodes.run import Failure, Run


class TidyNode(Node):
    """Runs a sequence, then its `finally`, then ends as the sequence did."""

    kind: ClassVar[str] = "finally"

    def __init__(self, step: model.Sequence, main: Node, tidy: SequenceNode) -> None:
        super().__init__(step.title, step)
        self.main = main
        self.tidy = tidy
        self.closing = False
        self.decided: Failure | None = None
        adopt_children(self, [main, tidy])

    @property
    def key(self) -> str:
        """Return the path with the word."""
        return f"{self.path}:finally"

    def error_for_children(self) -> Failure | None:
        """Return the failure of the sequence, for the steps of `finally`."""
        return self.decided if self.closing else None

    def on_enter(self, run: Run) -> Status:
        """Start the sequence."""
        self.closing, self.decided = False, None
        self.remember(run, TidyMem())
        self.main.enter(run, self.path, self.scope)
        return self._after_main(run)

    def on_proceed(self, run: Run) -> Status:
        """Go on with what runs."""
        if self.closing:
            return RUNNING if self.tidy.proceed(run) is RUNNING else self._end()
        self.main.proceed(run)
        return self._after_main(run)

    def _after_main(self, run: Run) -> Status:
        if self.main.status is RUNNING:
            return RUNNING
        self.closing, self.decided = True, self.main.failure if self.main.status is FAILURE else None
        self.skipped, self.breaking = self.main.skipped, self.main.breaking
        self.remember(run, TidyMem(True, self.decided, self.skipped, self.breaking))
        if self.tidy.enter(run, self.path, self.scope) is RUNNING:
            return RUNNING
        return self._end()

    def _end(self) -> Status:
        return SUCCESS if self.decided is None else self.fail_as(self.decided)

    def on_halt(self, run: Run) -> list[str]:
        """Stop what runs."""
        return self.tidy.halt(run) if self.closing else self.main.halt(run)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on with what ran."""
        assert isinstance(mem, TidyMem)
        self.closing, self.decided = mem.closing, mem.failure
        self.skipped, self.breaking = mem.skipped, mem.breaking
        (self.tidy if mem.closing else self.main).restore(run, self.path, self.scope)
