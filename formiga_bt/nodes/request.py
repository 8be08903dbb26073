"""`request`: start another task, wait for its end unless told not to, and map that to a status."""

from typing import ClassVar

from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS
from formiga_bt.nodes.ends import ChildEnd, End
from formiga_bt.nodes.leaves import Leaf
from formiga_bt.nodes.memory import Mem, RequestMem
from formiga_bt.nodes.run import ChildRun, Failure, TaskOrder, TaskView


class RequestNode(Leaf):
    """`request`: another task, whose failure is this step's failure. Who stops the step waits for that task's end, too."""

    kind: ClassVar[str] = "request"

    def __init__(self, step: model.Request) -> None:
        super().__init__(step.title, step)
        self.step = step
        self.child = ""

    def act(self, run: ChildRun) -> Status:
        """Read the params and start the task."""
        step, env = self.step, self.env(run)
        params = {}
        for name, expr in step.args.items():
            try:
                params[name] = expr.run(env)
            except model.Unset:  # an optional param of ours that was not given: theirs is not given either
                continue
        order = TaskOrder(self.key, step.task, params, step.priority, step.detached)
        child = run.start_task(order)
        if isinstance(child, Failure):
            return self.fail_as(child)
        self.child = child
        if not step.wait:
            return self._end(run, run.child(child))
        self.remember(run, RequestMem(child))
        return self.on_proceed(run)

    def on_proceed(self, run: ChildRun) -> Status:
        """Look whether it has ended."""
        view = run.child(self.child)
        return self._end(run, view) if view.ended else RUNNING

    def is_quiet(self, run: ChildRun) -> bool:
        """Return whether the task goes on."""
        return bool(self.child) and not run.child(self.child).ended

    def _end(self, run: ChildRun, view: TaskView) -> Status:
        status = view.status if view.ended else "PENDING"
        if self.step.save_as:
            run.set_var(
                self.scope, self.step.save_as, {"status": status, "reason": view.outcome.reason, "task_id": view.id}
            )
        if status in ("SUCCEEDED", "PENDING"):
            return SUCCESS
        self.failure = request_failure(view, self.path)
        return FAILURE

    def on_halt(self, run: ChildRun) -> list[End]:
        """End the task, unless it is detached; whoever stops us waits for that."""
        return [ChildEnd(self.child)] if not self.step.detached and run.end_task(self.child) else []

    def on_restore(self, run: ChildRun, mem: Mem) -> None:  # noqa: ARG002
        """Wait for the same task."""
        assert isinstance(mem, RequestMem)
        self.child = mem.task


def request_failure(view: TaskView, path: str) -> Failure:
    """Return the failure of a step whose task did not succeed."""
    word = view.status.lower()
    return Failure(f"request:{view.outcome.code or word}", f"{view.id}: {view.outcome.reason or word}", path)
