"""What a run on the virtual clock may use up, so that `formiga dryrun` and `formiga test` end: steps, and computer time.

Counted are steps by the clocks of tasks (a `wait`, a round of a loop): in virtual time they cost nothing to wait for, so a
loop that waits a moment again and again can go on for hours.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final

from formiga_bt.engine.kernel.inputs import EngineStep, TimerDue
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.lang.model import For, Loop, Task
from formiga_bt.lang.places import steps_around

MOST_WAKES: Final = 200_000
"""Steps by the clocks of tasks. A wait each second for six hours, in nine loops at once, is as much."""
MOST_S: Final = 300.0
"""Seconds of this computer."""


class RunSpending:
    """What one run uses up.

    Args:
        most_wakes: so many steps by the clocks of tasks are enough.
        most_s: so many seconds of this computer are.
        clock: seconds.
    """

    def __init__(
        self, most_wakes: int = MOST_WAKES, most_s: float = MOST_S, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.most_wakes, self.most_s = most_wakes, most_s
        self._clock = clock
        self._began = clock()
        self._wakes = 0
        self._of: Counter[tuple[str, str]] = Counter()
        """(task's id, node key) -> wakes."""

    def feed(self, step: EngineStep) -> None:
        """Take a step of the engine."""
        if isinstance(step.input, TimerDue) and isinstance(step.input.timer, NodeDue):
            self._wakes += 1
            self._of[step.input.timer.task, step.input.timer.node] += 1

    @property
    def is_over(self) -> bool:
        """Return whether to give up."""
        return self._wakes > self.most_wakes or self._clock() - self._began > self.most_s

    def reason(self, models: Mapping[str, Task]) -> str:
        """Return why the run was given up, and which loop used most; empty if it was not.

        Args:
            models: the checked tasks by name.
        """
        if not self.is_over:
            return ""
        if self._wakes > self.most_wakes:
            what = f"given up after {self._wakes:,} steps by the clocks of tasks (--most-steps)"
        else:
            what = f"given up after {self.most_s:g} s of this computer (--most-seconds)"
        loops: Counter[str] = Counter()
        for (task, key), wakes in self._of.items():
            loops[_loop(models, task, key)] += wakes
        if not loops:
            return what
        (loop, wakes), *_ = loops.most_common(1)
        return f"{what}; {wakes:,} of them by {loop}" if self._wakes > self.most_wakes else f"{what}; most by {loop}"


def _loop(models: Mapping[str, Task], task_id: str, key: str) -> str:
    """Return the innermost loop around a node, and where it stands."""
    model = models.get(task_id.rpartition("-")[0])
    around = steps_around(model, key) if model is not None else ()
    step = next((one for one in reversed(around) if isinstance(one, Loop | For)), around[-1] if around else None)
    if step is None:
        return f"{key} of {task_id}"
    return f"{step.title} at {step.mark.file}:{step.mark.line} ({key.partition('#')[0]} of {task_id})"
