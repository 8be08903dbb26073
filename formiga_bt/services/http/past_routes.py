"""`/v1/past` routes: the site as it was, from the journal of the engine that answers; the same facts as of now.

Each request folds its moment in a thread of the server, one at a time, with a connection that only reads: the engine's thread
has no part in it.
"""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Final, TypeVar

from fastapi import Query

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError, TaskError, UnusableFile
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.seeing_routes import PAGE, TASKS, Prefix
from formiga_bt.services.refused import Refused
from formiga_bt.services.words import hint_for
from formiga_bt.show.facts import BlackboardFact, Chart, Now, PastTask, Stats, Timeline

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine
    from formiga_bt.show.replay.source import JournalSource

FORMS: Final = "milliseconds of engine time, an ISO time, or words: 10:15, -5 min, PickUp-3 end"
T = TypeVar("T")
At = Annotated[str, Query(max_length=100, description=f"the moment: {FORMS}; empty: the last one")]
Tasks = Annotated[list[str] | None, Query(max_length=TASKS, description="of these tasks only; may be repeated")]


class PastReader:
    """Looks at one journal for the API; opened at the first request.

    Args:
        where: returns path or URL of the journal, or None: the engine keeps none.
        site: name of the site.
    """

    def __init__(self, where: Callable[[], str | None], site: str) -> None:
        self._where, self._site = where, site
        self._lock = threading.Lock()
        self._machine: TimeMachine | None = None

    def look(self, at: str, ask: "Callable[[JournalSource], T]") -> T:
        """Return what is asked of a moment.

        Raises:
            Refused: there is no journal, no such moment, or no such task.
        """
        from formiga_bt.show.replay.source import JournalSource

        with self._lock:
            try:
                machine = self._open()
                return ask(JournalSource(machine, self._moment(machine, at) if at else machine.last))
            except TaskError as error:
                raise Refused(error.code, error.text, error.help or hint_for(error.code), near=error.near) from error
            except UnusableFile as error:
                raise Refused("bad_moment", error.text.partition("\n")[0], f"say {FORMS}") from error
            except JournalError as error:
                raise Refused(
                    "no_history", error.text.partition("\n")[0], "GET /v1/past lists what there is"
                ) from error

    def close(self) -> None:
        """Let the journal go; may be called twice."""
        with self._lock:
            if self._machine is not None:
                self._machine.close()
                self._machine = None

    def _open(self) -> "TimeMachine":
        from formiga_bt.show.replay.machine import TimeMachine

        if self._machine is None:
            where = self._where()
            if where is None:
                raise JournalError("this engine keeps no journal (--no-journal)")
            self._machine = TimeMachine(where, self._site)
        return self._machine

    @staticmethod
    def _moment(machine: "TimeMachine", at: str) -> Micros:
        from formiga_bt.show.replay.when import MomentWords, moment

        if at.isdecimal():
            return min(max(int(at) * 1000, machine.first), machine.last)
        return moment(at, MomentWords(machine.first, machine.last, machine.record))


def add(routes: FactRoutes, past: PastReader) -> None:
    """Add the routes."""

    @routes.get("/v1/past", "past")
    def now(
        at: At = "",
        first: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
        count: Annotated[int, Query(ge=0, le=PAGE)] = 100,
        find: Annotated[str, Query(max_length=200)] = "",
        over: bool = True,
    ) -> Now:
        """Return the whole site as it stood at a moment: tasks, agents, questions, lines."""
        return past.look(at, lambda source: source.now(first=first, count=count, find=find, over=over))

    @routes.get("/v1/past/timeline", "past")
    def timeline(at: At = "", task: Tasks = None) -> Timeline:
        """Return actions and waits until a moment: of some tasks whenever they were, or of all of the day before it."""
        return past.look(at, lambda source: source.timeline(task or ()))

    @routes.get("/v1/past/chart", "past")
    def chart(at: At = "", task: Tasks = None) -> Chart:
        """Return the site's map with the ways until a moment: for some tasks, or of the day before it."""
        return past.look(at, lambda source: source.chart(task or ()))

    @routes.get("/v1/past/stats", "past")
    def stats(
        at: At = "",
        task: Annotated[str, Query(max_length=200)] = "",
        hours: Annotated[float, Query(ge=0.0, le=1e6, description="before the moment; 0: a day")] = 0.0,
    ) -> Stats:
        """Return how long things took in the hours before a moment."""
        return past.look(at, lambda source: source.stats(task=task, hours=hours))

    @routes.get("/v1/past/blackboard", "past")
    def blackboard(at: At = "", prefix: Prefix = "/") -> BlackboardFact:
        """Return the keys of the blackboard as they stood at a moment."""
        return past.look(at, lambda source: source.blackboard(prefix))

    @routes.get("/v1/past/tasks/{task_id}", "past")
    def task(task_id: str, at: At = "") -> PastTask:
        """Return a task as it stood at a moment: tree, values, and why."""
        return past.look(
            at, lambda source: PastTask(picture=source.task(task_id), because=tuple(source.why(task_id)[1]))
        )
