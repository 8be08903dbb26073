"""The `finally` of a stopped sequence: a small tree of its own, which whoever stopped the sequence waits for.

A stopped sequence hands it over (`TidyNode`, `TaskRun.tidy`). It becomes a `Tidy` of the task's record, whose id stands in
drain sets beside goals and moves with them.

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
from formiga_bt.engine.kernel.records import TaskRecord, Tidy
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.engine.tasks.treerun import Ended, TaskTrees
from formiga_bt.lang.model import Call, For, Sequence, Step, WithAgents
from formiga_bt.lang.places import steps_around
from formiga_bt.nodes.ends import Drain, FinallyEnd
from formiga_bt.nodes.run import AROUND, THROUGH, TidyOrder

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
    def take(self, order: TidyOrder, tree: Any) -> FinallyEnd | None:
        """Take over a `finally`, already running if there is a `tree`; return its end, or None if it is skipped."""
        task = self._task
        section = order.path.partition("/")[0]
        if self.skip or task.abort_now or section not in TASK_SECTIONS:
            return None
        token = f"finally:{task.id}/{task.run}/{order.path}"
        self._core.emit(ch.ScopePut(task.id, order.alias, self._names(order, tree is not None)))
        tidy = Tidy(
            id=token, path=order.path, scope=order.alias, after=order.after, error=order.error,
            state="waiting" if tree is None else "running",
        )  # fmt: skip
        self._core.put_task(task.id, tidying=(*task.tidying, tidy))
        if tree is not None:
            self._trees.take_over(token, tree, self._steps(tidy), order.alias, order.path, order.error)
            self._core.set_deadline(self._deadline(token), self._core.now + TIDY_US, task.id, pausable=True)
        self._core.touch(task.id)
        return FinallyEnd(token)

    def _names(self, order: TidyOrder, running: bool) -> dict[str, Any]:
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

    def _steps(self, tidy: Tidy) -> tuple[Step, ...]:
        step = self._around(tidy.path)[-1]
        assert isinstance(step, Sequence), f"{tidy.path} is no sequence"
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
        for token in [tidy.id for tidy in self._task.tidying]:
            tidy = self._task.tidy(token)
            if tidy is None:
                continue
            if tidy.state == "waiting" and self._is_over(tidy.after):
                self._put(replace(tidy, state="running"))
                self._core.set_deadline(self._deadline(token), self._core.now + TIDY_US, self._task_id, pausable=True)
                self._trees.start(token, self._steps(tidy), tidy.scope, tidy.path, tidy.error)
            elif tidy.state == "running" and (self._task_id, token) in self._core.due:
                self._note(tidy, "timeout", "its 2 min are over")
                self._stop(tidy)
            elif tidy.state == "stopping" and self._is_over(tidy.after):
                self._drained(tidy)

    def on_ended(self, tidy: Tidy, ended: Ended) -> None:
        """Its steps have ended."""
        if tidy.state != "running":
            return
        if ended.failure is not None:
            self._note(tidy, ended.failure.code, ended.failure.reason)
        if ended.fatal:
            self._stop(tidy)
        else:
            self._end(tidy)

    def cut(self) -> None:
        """Stop all of them (abort --now, a breach): what has not begun does not begin."""
        self.skip = True
        for token in [tidy.id for tidy in self._task.tidying]:
            tidy = self._task.tidy(token)
            if tidy is not None and tidy.state == "waiting":
                self._end(tidy)
            elif tidy is not None and tidy.state == "running":
                self._stop(tidy)
        self.skip = False

    def restore(self) -> None:
        """Rebuild the trees of those that run."""
        for tidy in self._task.tidying:
            if tidy.state == "running" and tidy.path in self._core.state.memory.get(self._task_id, {}):
                self._trees.restore(tidy.id, self._steps(tidy), tidy.scope, tidy.path, tidy.error)

    def _stop(self, tidy: Tidy) -> None:
        drain = tuple(self._trees.halt(tidy.id))
        self._put(replace(tidy, state="stopping", after=drain))
        for end in drain:
            adopt(self._core, self._task_id, end, tidy.id)
        if self._is_over(drain):
            self._drained(replace(tidy, state="stopping", after=drain))

    def _drained(self, tidy: Tidy) -> None:
        for end in tidy.after:
            forget(self._core, self._task_id, end)
        self._end(tidy)

    def _end(self, tidy: Tidy) -> None:
        core = self._core
        core.clear_deadline(self._deadline(tidy.id))
        core.emit(ch.ScopePut(self._task_id, tidy.scope, None))
        self._put(replace(tidy, state="ended", after=()))
        core.wake(self._task_id, tidy.owner)

    def _put(self, tidy: Tidy) -> None:
        tidying = tuple(tidy if one.id == tidy.id else one for one in self._task.tidying)
        self._core.put_task(self._task_id, tidying=tidying)

    def _note(self, tidy: Tidy, code: str, reason: str) -> None:
        text = f"finally of {tidy.path}: {code} {reason}".strip()
        self._core.put_task(self._task_id, notes=(*self._task.notes, text))

    def _deadline(self, token: str) -> NodeDue:
        return NodeDue(self._task_id, token)
