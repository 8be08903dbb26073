"""The pace of a task: how often its own clocks may wake it, so that one task cannot starve all others.

A task has a budget of `WAKES_A_SECOND` an engine second, and may save up as much as one second's. What counts is a step in
which it sets a deadline that is near for the number of deadlines it has: each of 200 loops of `wait: 1 ms`, never a `wait: 5 s`
of a task with ten of them. Beyond the budget its next deadline is rounded up to when there is budget again. One number
(`Wakes.spent`, journaled) says all: the instant up to which the budget is spent.

Not for cleanup sections, a `finally`, ways home, stops and the engine's own tasks, nor for live conditions.
"""

from typing import TYPE_CHECKING, Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.records import TaskRecord, Wakes
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import WAKES_A_SECOND

if TYPE_CHECKING:
    from formiga_bt.engine.kernel.core import Core

EACH_US: Final[Micros] = SECOND // WAKES_A_SECOND
SAVED_US: Final[Micros] = SECOND
"""Budget of so long may be saved up."""
SHOWN_US: Final[Micros] = 5 * SECOND
"""A task is shown as throttled for so long after a deadline of it was rounded up."""


class Pace:
    """The pace of one task."""

    def __init__(self, core: "Core", task_id: str) -> None:
        self._core, self._task_id = core, task_id
        self._counted = -1
        """The step in which a wake was counted last: once a step."""

    def round_up(self, path: str, at: Micros) -> Micros:
        """Return when a node of the task is woken that wants to be at `at`; count that."""
        core, task_id = self._core, self._task_id
        now = core.now
        if at - now >= 2 * EACH_US * (core.index.deadline_count(task_id) + 1) or not self._is_bound(path):
            return at
        old = core.state.wakes.get(task_id) or Wakes()
        spent = old.spent
        if self._counted != core.state.seq:
            self._counted = core.state.seq
            spent = max(spent, now) + EACH_US
        first = spent - SAVED_US
        if at >= first:
            if spent != old.spent:
                core.emit(ch.WakesPut(task_id, Wakes(spent, old.since, old.rounded, old.path)))
            return at
        since = old.since if old.rounded is not None and now - old.rounded <= SHOWN_US else now
        core.emit(ch.WakesPut(task_id, Wakes(spent, since, now, path)))
        return first

    def _is_bound(self, path: str) -> bool:
        task = self._core.task(self._task_id)
        return path.startswith("steps") and ":finally" not in path and not task.system.agent and not task.system.stop


def throttled(state: EngineState, task: TaskRecord, now: Micros) -> Wakes | None:
    """Return how a task is throttled at an engine time, or None."""
    wakes = state.wakes.get(task.id)
    if wakes is None or wakes.rounded is None or task.section != "steps":
        return None
    return wakes if now - wakes.rounded <= SHOWN_US else None
