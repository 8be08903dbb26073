"""Tasks that tasks request: how one is started by a step, and ends with its parent.

A child is a task like any other (admission, approval, agents, orders), with a parent in its record. Who stops the step that
waits for it aborts it, and its end joins the drain; one that nobody waits for is aborted when its parent's steps end.
A detached one outlives its parent.
"""

from typing import Final, Literal

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.drains import adopt
from formiga_bt.engine.kernel.inputs import Abort, Submit
from formiga_bt.engine.kernel.news import Unwanted
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.tasks.intake import Intake
from formiga_bt.nodes.ends import ChildEnd, Drain
from formiga_bt.nodes.run import Failure, TaskOrder

MOST_DEEP: Final = 3
"""A task that a person requested may request one that requests one that requests one, and no more."""
MOST_CHILDREN: Final = 20
"""Open at once."""


class Children:
    """The tasks that other tasks requested; keeps nothing itself."""

    def __init__(self, core: Core, intake: Intake) -> None:
        self._core = core
        self._intake = intake

    def start(self, parent_id: str, order: TaskOrder) -> str | Failure:
        """Start a task for a step; return its id, or why it cannot be."""
        core = self._core
        parent = core.task(parent_id)
        bundle = core.library.bundle_for(order.task, parent)
        wish = Submit(
            order.task, order.params, order.priority or None, parent.request.by, bundle, cause=parent.request.cause
        )
        if parent.family.depth >= MOST_DEEP:
            why = f"{parent_id} was requested by a task itself, {MOST_DEEP} deep"
            return _refused(order, "too_deep", why, again=False)
        if len(self.open(parent_id)) >= MOST_CHILDREN:
            return _refused(order, "too_many", f"{MOST_CHILDREN} tasks of {parent_id} are open")
        try:
            child = self._intake.submit(wish, parent, order)
        except TaskError as error:
            return _refused(order, error.code, str(error))
        core.put_part(parent_id, "family", children=(*core.task(parent_id).family.children, child))
        return child

    def open(self, parent_id: str) -> tuple[str, ...]:
        """Return the tasks of a task that have not ended."""
        tasks = self._core.state.tasks
        return tuple(child for child in self._core.task(parent_id).family.children if tasks[child].section != "done")

    def end(self, child_id: str) -> bool:
        """End a task because its parent does, as quickly as that; return whether its end must be waited for."""
        child = self._core.task(child_id)
        if child.section == "done":
            return False
        how: Literal["", "now"] = "now" if self._core.task(child.family.parent).ending.abort_now else ""
        self._core.report(Unwanted(Abort(child_id, how, child.family.parent, "operator")))
        return self._core.task(child_id).section != "done"

    def hurry(self, parent_id: str) -> None:
        """A person is in a hurry with the end of a task: so with what ends with it."""
        for child in self._attached(parent_id):
            self.end(child)

    def end_all(self, parent_id: str) -> Drain:
        """End what a task leaves open behind its steps; return what must be waited for."""
        waited = tuple(ChildEnd(child) for child in self._attached(parent_id) if self.end(child))
        for end in waited:
            adopt(self._core, parent_id, end, "!task")
        return waited

    def _attached(self, parent_id: str) -> list[str]:
        return [child for child in self.open(parent_id) if self._core.task(child).attached]

    def ended(self, child: TaskRecord) -> None:
        """A child has ended: wake who waits for it."""
        if child.family.parent:
            self._core.wake(child.family.parent, child.family.node)


def _refused(order: TaskOrder, code: str, reason: str, *, again: bool = True) -> Failure:
    return Failure(f"request:{code}", reason, order.owner, retryable=again)
