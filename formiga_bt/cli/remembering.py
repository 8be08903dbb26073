"""An engine of this folder whose journal tells of tasks that the engine has forgotten: it keeps the newest that ended."""

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

from formiga_bt.cli.calling import Client
from formiga_bt.cli.remote import RemoteSource
from formiga_bt.errors import FormigaError, TaskError
from formiga_bt.show.facts import Because, Chart, TaskPicture, Timeline

if TYPE_CHECKING:
    from formiga_bt.replay.machine import TimeMachine
    from formiga_bt.show.source import Source

T = TypeVar("T")


class Remembering(RemoteSource):
    """Asks one engine, then its journal.

    Args:
        client: of the engine.
        open_: opens the journal.
    """

    def __init__(self, client: Client, open_: "Callable[[], TimeMachine]") -> None:
        super().__init__(client)
        self._open = open_

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
        """Return the site's map."""
        return self._asked(
            lambda: super(Remembering, self).chart(tasks), lambda past: past.chart(tasks), ", ".join(tasks)
        )

    def _asked(self, live: Callable[[], T], past: "Callable[[Source], T]", ids: str) -> T:
        try:
            return live()
        except TaskError as unknown:
            if unknown.code != "unknown_task":
                raise
            try:
                from formiga_bt.replay.source import JournalSource

                with self._open() as machine:
                    found = past(JournalSource(machine))
            except FormigaError:
                raise unknown from None
        print(f"the engine has forgotten {ids}; its journal tells", file=sys.stderr)
        return found
