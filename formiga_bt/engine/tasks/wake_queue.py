"""One input may wake thousands of tasks. Some are looked at in its own step, the others in steps of their own after it.

Only what a live condition woke may wait: its key changed, or its instant came. Tasks of high priority never wait, nor does
what must be done in the step itself (goals that ended, sections, releases, orders). The rest goes on with the deadline
`TurnDue`, at the same instant, so many tasks a step; whatever comes in meanwhile has its turn between those steps. Called by
the engine.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Final

from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.timers import TurnDue
from formiga_bt.engine.tasks.runs import Runs

AT_ONCE: Final = 256
"""So many tasks that may wait are looked at in one step: some milliseconds."""

REST: Final = TurnDue()
"""The deadline that goes on with the others."""


class WakeQueue:
    """Who is looked at in this step, and who waits."""

    def __init__(self, core: Core, runs: Runs) -> None:
        self._core = core
        self._runs = runs
        self._waiting: deque[str] = deque()
        self._among: set[str] = set()
        """The same, to look up."""
        self._seq = -1
        self._room = AT_ONCE

    def of(self, touched: Mapping[str, bool]) -> Sequence[str]:
        """Return who is looked at now, in the order of admission; `touched`: tasks, and whether each must be."""
        if self._seq != self._core.state.seq:
            self._seq, self._room = self._core.state.seq, AT_ONCE
        names = list(touched)
        if len(names) > 1:
            names.sort(key=self._order_of)
        if len(names) <= self._room:
            self._room -= len(names)
            return names
        chosen = []
        for name in names:
            if self._must(name, touched):
                chosen.append(name)
            elif self._room > 0:
                self._room -= 1
                chosen.append(name)
            elif name not in self._among:
                self._waiting.append(name)
                self._among.add(name)
        self._come_back()
        return chosen

    def go_on(self) -> None:
        """Handle the deadline: the next ones. After a restart nobody knows who they were, and all who wait are looked at."""
        core, waiting = self._core, self._waiting
        if not waiting:
            for run in self._runs.open.values():
                run.wake_watchers()
            return
        for _ in range(min(AT_ONCE, len(waiting))):
            name = waiting.popleft()
            self._among.discard(name)
            core.touched.setdefault(name, False)
        self._come_back()

    def _come_back(self) -> None:
        core = self._core
        if self._waiting and REST not in core.state.deadlines:
            core.set_deadline(REST, core.now)

    def _must(self, name: str, touched: Mapping[str, bool]) -> bool:
        task = self._core.state.tasks.get(name)
        return touched[name] or (task is not None and task.request.priority == "high")

    def _order_of(self, name: str) -> int:
        task = self._core.state.tasks.get(name)
        return task.order if task is not None else 0
