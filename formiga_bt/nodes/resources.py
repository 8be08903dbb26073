"""`with_resource`: steps with units of resources of the site, claimed together when the block is entered.

A block that ends well gives them back at once. One that fails or is stopped leaves its claim to the task: what was stopped must
have ended first, and if the whole task ends with it, its machines must be home, for nobody knows whether they are out.
"""

from collections.abc import Sequence
from typing import ClassVar

from py_trees.common import Status

from formiga_bt.base.clock import micros
from formiga_bt.lang import model
from formiga_bt.lang.model.steps import RESOURCE_WAIT_S
from formiga_bt.nodes.base import FAILURE, RUNNING, Node
from formiga_bt.nodes.composites import Chain, adopt_children
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.memory import Mem, WithResourceMem
from formiga_bt.nodes.run import Run


class WithResourceNode(Chain):
    """`with_resource`: resources of the site for a block."""

    times: ClassVar[bool] = True
    kind: ClassVar[str] = "with_resource"

    def __init__(self, step: model.WithResource, children: Sequence[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        self.waits = True
        adopt_children(self, children)

    def memo(self) -> Mem:
        """Return the memory."""
        return WithResourceMem("waits") if self.waits else WithResourceMem("runs", self.index, self.ran)

    def on_enter(self, run: Run) -> Status:
        """Ask for them."""
        self.waits = True
        self.remember(run, self.memo())
        wait = self.step.wait.run(run.env(self.scope, self.error_here())) if self.step.wait else RESOURCE_WAIT_S
        run.want_resources(self.key, self.step.units)
        run.set_deadline(self.key, run.now + micros(wait))
        self.feedback_message = f"waits for {self.step.said}"
        return RUNNING

    def on_proceed(self, run: Run) -> Status:
        """Begin once they are granted; visit the steps."""
        return self._await(run) if self.waits else self._ended(run, super().on_proceed(run))

    def _await(self, run: Run) -> Status:
        refused = run.take_resources(self.key)
        if refused is None:
            if not run.is_due(self.key):
                return RUNNING
            run.withdraw_resources(self.key)
            return self.fail("resource_timeout", f"{self.step.said} not free in time; see the explanation")
        run.clear_deadline(self.key)
        if refused:
            return self.fail("no_resource", refused, retryable=False)
        self.waits = False
        self.feedback_message = f"holds {self.step.said}"
        return self._ended(run, self.start_chain(run))

    def _ended(self, run: Run, status: Status) -> Status:
        if status is not RUNNING:
            run.free_resources(self.key, (), well=status is not FAILURE)
        return status

    def on_halt(self, run: Run) -> list[End]:
        """Stop the steps, and leave the claim to the task until they have ended."""
        if self.waits:
            run.withdraw_resources(self.key)
            return []
        drained = super().on_halt(run)
        run.free_resources(self.key, tuple(drained), well=False)
        return drained

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, WithResourceMem)
        self.waits = mem.state == "waits"
        if not self.waits:
            self.restore_chain(run, mem.index, ran=mem.ran)
