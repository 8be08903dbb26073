"""An engine of this folder, and its journal, which tells what the engine does not know.

That are tasks that it has forgotten, as it keeps the newest that ended, and what was before it was started again.
"""

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.client import Client
from formiga_bt.show.facts import Because, Chart, Stats, TaskPicture, Timeline

if TYPE_CHECKING:
    from datetime import tzinfo

    from formiga_bt.show.replay.machine import TimeMachine
    from formiga_bt.show.source import Source

T = TypeVar("T")


class Remembering(Client):
    """Asks one engine, then its journal.

    Args:
        client: of the engine.
        open_: opens the journal.
        zone: the time zone in which moments are told; asked only when one is.
    """

    def __init__(self, client: Client, open_: "Callable[[], TimeMachine]", zone: "Callable[[], tzinfo]") -> None:
        super().__init__(client.address, client.token)
        self._open, self._zone = open_, zone

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        return self._asked(lambda: super(Remembering, self).task(task_id), lambda past: past.task(task_id), task_id)

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands, and the chain of causes."""
        return self._asked(lambda: super(Remembering, self).why(of), lambda past: past.why(of), of)

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all."""
        ids = ", ".join(tasks)
        return self._asked(lambda: super(Remembering, self).timeline(tasks), lambda past: past.timeline(tasks), ids)

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map; of all tasks, with the ways of the last day at least."""
        if not tasks:
            return self._longer(super().chart, lambda past: past.chart())
        return self._asked(
            lambda: super(Remembering, self).chart(tasks), lambda past: past.chart(tasks), ", ".join(tasks)
        )

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread, of the last hours; 0: since the engine's start, of the last day at least."""
        return self._longer(
            lambda: super(Remembering, self).stats(task=task, hours=hours),
            lambda past: past.stats(task=task, hours=hours),
            hours,
        )

    def _longer(self, live: Callable[[], T], past: "Callable[[Source], T]", hours: float = 0.0) -> T:
        """Ask the journal if the engine was started again within the last hours (0: a day), else the engine."""
        try:
            from formiga_bt.show.replay.source import WINDOW_US, JournalSource
            from formiga_bt.show.replay.when import in_words

            with self._open() as machine:
                began = machine.began_again(self.address.epoch)
                wanted = round(hours * 3600 * SECOND) if hours > 0 else WINDOW_US
                if began is not None and began > machine.last - wanted:
                    found = past(JournalSource(machine))
                    when = in_words(began, self._zone())
                    print(f"the engine was started again at {when}; its journal has what was before", file=sys.stderr)
                    return found
        except FormigaError:
            pass
        return live()

    def _asked(self, live: Callable[[], T], past: "Callable[[Source], T]", ids: str) -> T:
        try:
            return live()
        except TaskError as unknown:
            if unknown.code != "unknown_task":
                raise
            try:
                from formiga_bt.show.replay.source import JournalSource

                with self._open() as machine:
                    found = past(JournalSource(machine))
            except FormigaError:
                raise unknown from None
        print(f"the engine has forgotten {ids}; this is from its journal", file=sys.stderr)
        return found
