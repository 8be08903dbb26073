"""What was before this start of the engine, read from its journal when a task is looked at: steps, actions, waits, ways.

A start goes on from the state of the one before it, which has no history: of tasks from then the view knows how they stand, not
how they came there. The story of such a task is read once, in the thread of whoever asks, and the view goes on with it.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from formiga_bt.base.errors import JournalError
from formiga_bt.engine.kernel.journal_levels import JOURNAL, LEVELS
from formiga_bt.services.view import EngineView

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine

MANY: Final = 100
"""So many tasks are recalled at once, if all are looked at: the newest."""
log = logging.getLogger("formiga.recalling")


class Recall:
    """Makes a view know the beginnings of tasks of earlier starts. Call it without the view's lock.

    Args:
        view: that began with the state of an earlier start, or with none.
        open_: opens the journal, with a connection that only reads.
    """

    def __init__(self, view: EngineView, open_: "Callable[[], TimeMachine]") -> None:
        self._view, self._open = view, open_
        self._left = set(view.state.tasks)
        """Tasks of earlier starts that nobody has looked at."""
        self._recent: list[str] | None = None
        self._lock = threading.Lock()
        self._machine: TimeMachine | None = None

    def __call__(self, ids: Sequence[str] = ()) -> None:
        """Recall these tasks, or the newest of all; others are passed over. If the journal cannot be read, nothing changes."""
        if not self._left or (ids and self._left.isdisjoint(ids)):
            return
        with self._lock:
            for one in [one for one in ids or self._newest() if one in self._left]:
                try:
                    self._take(one)
                except JournalError as error:
                    log.warning("what %s did before this start cannot be read: %s", one, error)
                    return

    def close(self) -> None:
        """Let the journal go."""
        with self._lock:
            self._left.clear()
            if self._machine is not None:
                self._machine.close()
                self._machine = None

    def _newest(self) -> list[str]:
        if self._recent is None:
            with self._view.reading() as state:
                known = [state.tasks[one] for one in self._left if one in state.tasks]
            known.sort(key=lambda task: task.order, reverse=True)
            self._recent = [task.id for task in known[:MANY]]
        return self._recent

    def _take(self, task_id: str) -> None:
        if self._machine is None:
            self._machine = self._open()
        with self._view.reading() as state:
            seq = state.seq
        story = self._machine.story(task_id, self._machine.last, ways=True, to=seq)
        if story is not None:
            with self._view.reading() as state:  # each step that is folded is on disk, unless nothing can be written
                if state.counters.get(JOURNAL, 0) >= LEVELS["full"]:
                    return
                self._machine.go_on(story, task_id, state.seq)
                if task_id in state.tasks:
                    self._view.ledger.adopt(story, task_id)
        self._left.discard(task_id)
