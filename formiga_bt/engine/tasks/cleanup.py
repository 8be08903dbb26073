"""The `finally` of a stopped sequence: a small tree of its own, which whoever stopped the sequence waits for.

A stopped sequence hands it over (`CleanupNode`, `TaskRun.cleanup`). It becomes a `Cleanup` of the task's record, whose id
stands in drain sets beside goals and moves with them.

| state | until | next |
|---|---|---|
| waiting | the sequence's own goals, and each `finally` inside it, have ended | running |
| running | its steps end; their failure is only a note | ended |
| running | 2 min are over; abort --now, a breach, the end of cleanup_timeout | stopping |
| stopping | its own goals have ended | ended |

It sees the names of its sequence as they were when that was stopped. What it sets or saves reaches the task's own scope; the
scope of a call or of an item of a parallel `for` is gone by then.
"""

from collections.abc import Mapping
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.drains import adopt, forget, is_over
from formiga_bt.engine.kernel.records import Cleanup, TaskRecord
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.engine.tasks.treerun import Ended, TaskTrees
from formiga_bt.lang.model import Call, For, Sequence, Step, WithAgents
from formiga_bt.lang.places import steps_around
from formiga_bt.nodes.ends import Drain, FinallyEnd
from formiga_bt.nodes.run import AROUND, THROUGH, CleanupOrder

TIDY_US: Final = 120 * SECOND
"""The longest time of one `finally` after a stop."""
TASK_SECTIONS: Final = ("steps", "on_failure", "on_abort", "finally")
"""Of a way home that is replaced by another order nothing is tidied up: the order goes first."""


class Cleanups:
    """Every `finally` of one task that was handed over."""

    def __init__(self, core: Core, task_id: str, trees: TaskTrees) -> None:
        self._core = core
        self._task_id = task_id
        self._trees = trees
        self.skip = False
        """What is stopped now is not tidied up (abort --now, a breach)."""

    # -- for the nodes -----------------------------------------------------------------------------------------------
    def take(self, order: CleanupOrder, tree: Any) -> FinallyEnd | None:
        """Take over a `finally`, already running if there is a `tree`; return its end, or None if it is skipped."""
        task = self._task
        section = order.path.partition("/")[0]
        if self.skip or task.ending.abort_now or section not in TASK_SECTIONS:
            return None
        token = f"finally:{task.id}/{task.run}/{order.path}"
        self._core.emit(ch.ScopePut(task.id, order.alias, self._names(order, tree is not None)))
        cleanup = Cleanup(
            id=token, path=order.path, scope=order.alias, after=order.after, error=order.error,
            state="waiting" if tree is None else "running",
        )  # fmt: skip
        self._core.put_part(task.id, "ending", cleanups=(*task.ending.cleanups, cleanup))
        if tree is not None:
            self._trees.take_over(token, tree, self._steps(cleanup), order.alias, order.path, order.error)
            self._core.set_deadline(self._deadline(token), self._core.now + TIDY_US, task.id, pausable=True)
        self._core.touch(task.id)
        return FinallyEnd(token)

    def _names(self, order: CleanupOrder, running: bool) -> dict[str, Any]:
        """Return the names that it sees: what is about to be forgotten is copied, the task's own stay the task's."""
        scopes = self._core.state.scopes[self._task_id]
        inner: list[Mapping[str, Any]] = []
        at, through = order.scope, True
        if running and order.alias in scopes:  # what it saved so far stays its own
            inner.append(scopes[order.alias])
        while at:
            inner.append(scopes[at])
            if AROUND not in scopes[at]:
                return self._flat(inner)
            through = through and THROUGH in scopes[at]
            at = scopes[at][AROUND]
        root = scopes[""]
        loops = {name: root[name] for name in self._loop_names(order.path) if root.get(name) is not None}
        return {**loops, **self._flat(inner), AROUND: "", **({THROUGH: True} if through else {})}

    @staticmethod
    def _flat(inner: list[Mapping[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for values in reversed(inner):
            found.update({name: value for name, value in values.items() if name not in (AROUND, THROUGH)})
        return found

    def _around(self, path: str) -> tuple[Step, ...]:
        return steps_around(self._core.model(self._task), path)

    def _loop_names(self, path: str) -> list[str]:
        """Return the names of the loops and blocks around that are unset when they are stopped."""
        around = self._around(path)
        calls = [index for index, step in enumerate(around) if isinstance(step, Call)]
        loops = [step for step in around[calls[-1] + 1 if calls else 0 :] if isinstance(step, For)]
        blocks = [step for step in around[calls[-1] + 1 if calls else 0 :] if isinstance(step, WithAgents)]
        names = [name for loop in loops for name in (*loop.lists, *([loop.collect] if loop.collect else ()))]
        return [*names, *(name for block in blocks for name in block.roles)]

    def _steps(self, cleanup: Cleanup) -> tuple[Step, ...]:
        step = self._around(cleanup.path)[-1]
        assert isinstance(step, Sequence), f"{cleanup.path} is no sequence"
        return step.finally_

    # -- for drain sets ----------------------------------------------------------------------------------------------
    @property
    def _task(self) -> TaskRecord:
        return self._core.task(self._task_id)

    def _is_over(self, drain: Drain) -> bool:
        return all(is_over(self._core.state, self._task, end) for end in drain)

    # -- life --------------------------------------------------------------------------------------------------------
    def proceed(self) -> None:
        """Start what may start, stop what has had its time, end what has drained. Called before each run of the trees."""
        for token in [cleanup.id for cleanup in self._task.ending.cleanups]:
            cleanup = self._task.cleanup(token)
            if cleanup is None:
                continue
            if cleanup.state == "waiting" and self._is_over(cleanup.after):
                self._put(replace(cleanup, state="running"))
                self._core.set_deadline(self._deadline(token), self._core.now + TIDY_US, self._task_id, pausable=True)
                self._trees.start(token, self._steps(cleanup), cleanup.scope, cleanup.path, cleanup.error)
            elif cleanup.state == "running" and (self._task_id, token) in self._core.due:
                self._note(cleanup, "timeout", "its 2 min are over")
                self._stop(cleanup)
            elif cleanup.state == "stopping" and self._is_over(cleanup.after):
                self._drained(cleanup)

    def on_ended(self, cleanup: Cleanup, ended: Ended) -> None:
        """Its steps have ended."""
        if cleanup.state != "running":
            return
        if ended.failure is not None:
            self._note(cleanup, ended.failure.code, ended.failure.reason)
        if ended.fatal:
            self._stop(cleanup)
        else:
            self._end(cleanup)

    def cut(self) -> None:
        """Stop all of them (abort --now, a breach): what has not begun does not begin."""
        self.skip = True
        for token in [cleanup.id for cleanup in self._task.ending.cleanups]:
            cleanup = self._task.cleanup(token)
            if cleanup is not None and cleanup.state == "waiting":
                self._end(cleanup)
            elif cleanup is not None and cleanup.state == "running":
                self._stop(cleanup)
        self.skip = False

    def restore(self) -> None:
        """Rebuild the trees of those that run."""
        for cleanup in self._task.ending.cleanups:
            if cleanup.state == "running" and cleanup.path in self._core.state.memory.get(self._task_id, {}):
                self._trees.restore(cleanup.id, self._steps(cleanup), cleanup.scope, cleanup.path, cleanup.error)

    def _stop(self, cleanup: Cleanup) -> None:
        drain = tuple(self._trees.halt(cleanup.id))
        self._put(replace(cleanup, state="stopping", after=drain))
        for end in drain:
            adopt(self._core, self._task_id, end, cleanup.id)
        if self._is_over(drain):
            self._drained(replace(cleanup, state="stopping", after=drain))

    def _drained(self, cleanup: Cleanup) -> None:
        for end in cleanup.after:
            forget(self._core, self._task_id, end)
        self._end(cleanup)

    def _end(self, cleanup: Cleanup) -> None:
        core = self._core
        core.clear_deadline(self._deadline(cleanup.id))
        core.emit(ch.ScopePut(self._task_id, cleanup.scope, None))
        self._put(replace(cleanup, state="ended", after=()))
        core.wake(self._task_id, cleanup.owner)

    def _put(self, cleanup: Cleanup) -> None:
        cleanups = tuple(cleanup if one.id == cleanup.id else one for one in self._task.ending.cleanups)
        self._core.put_part(self._task_id, "ending", cleanups=cleanups)

    def _note(self, cleanup: Cleanup, code: str, reason: str) -> None:
        text = f"finally of {cleanup.path}: {code} {reason}".strip()
        self._core.put_part(self._task_id, "outcome", notes=(*self._task.outcome.notes, text))

    def _deadline(self, token: str) -> NodeDue:
        return NodeDue(self._task_id, token)
