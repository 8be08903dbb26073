"""The one seam through which everything that is seen is read: of a running engine, a dry run, or a stored history.

`show.history.folded.FoldedSource` reads what a ledger folded from steps in this process; `formiga_bt.client.Client` asks
a running engine; `replay.source.JournalSource` is a journal at an instant. Nothing that draws notices.
"""

from collections.abc import Sequence
from typing import Protocol

from formiga_bt.show.facts import Because, BlackboardFact, Chart, Now, Stats, TaskPicture, Timeline


class Source(Protocol):
    """What can be asked. An id that is not there: TaskError with code `unknown_task` or `unknown_agent`."""

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant.

        Args:
            first: number of the first task of the page, from 0; the most urgent come first.
            count: length of the page.
            find: only tasks whose id, agents, code or words contain this.
            over: show ended tasks too, newest first after the others.
        """
        ...

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        ...

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands in a few words, and the chain of causes."""
        ...

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all."""
        ...

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map with the ways of the agents of some tasks, or of all agents."""
        ...

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread, of tasks of one name or of all, of the last hours or since the start."""
        ...

    def blackboard(self, prefix: str = "/") -> BlackboardFact:
        """Return the keys of the blackboard that begin with this."""
        ...
