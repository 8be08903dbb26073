"""`/v1/past` routes: the site as it was, from the journal of the engine that answers; the same facts as of now.

Each request folds its moment in a thread of the server, one at a time, with a connection that only reads: the engine's thread
has no part in it.
"""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import msgspec
from fastapi import FastAPI, Query, Response
from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError, TaskError, UnusableFile
from formiga_bt.services.http.seeing_routes import PAGE, TASKS, answers, described
from formiga_bt.services.refused import Refused
from formiga_bt.services.words import hint_for
from formiga_bt.show.facts import Because, Chart, Now, Stats, TaskPicture, Timeline

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine
    from formiga_bt.show.replay.source import JournalSource

FORMS: Final = "milliseconds of engine time, an ISO time, or words: 10:15, -5 min, PickUp-3 end"
T = TypeVar("T")
At = Annotated[str, Query(max_length=100, description=f"the moment: {FORMS}; empty: the last one")]
Tasks = Annotated[list[str] | None, Query(max_length=TASKS, description="of these tasks only; may be repeated")]


class PastTask(Struct, frozen=True, kw_only=True):
    """A task as it stood at a moment: its tree with statuses, the values on its blackboard, and why it stood so."""

    picture: TaskPicture
    because: tuple[Because, ...]
    """What it waited for or why it ended, and why the allocator chose its agents."""


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
                text, _, hint = str(error).partition("\n  help: ")
                raise Refused(error.code, text, hint or hint_for(error.code)) from error
            except UnusableFile as error:
                raise Refused("bad_moment", str(error).partition("\n")[0], f"say {FORMS}") from error
            except JournalError as error:
                raise Refused(
                    "no_history", str(error).partition("\n")[0], "GET /v1/past tells what there is"
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


def add(app: FastAPI, past: PastReader) -> None:
    """Add the routes to an app."""
    described(app, (PastTask,))

    @app.get("/v1/past", tags=["past"], response_class=Response, responses=answers(Now))
    def now(
        at: At = "",
        first: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
        count: Annotated[int, Query(ge=0, le=PAGE)] = 100,
        find: Annotated[str, Query(max_length=200)] = "",
        over: bool = True,
    ) -> Response:
        """Return the whole site as it stood at a moment: tasks, agents, questions, lines."""
        return _json(past.look(at, lambda source: source.now(first=first, count=count, find=find, over=over)))

    @app.get("/v1/past/timeline", tags=["past"], response_class=Response, responses=answers(Timeline))
    def timeline(at: At = "", task: Tasks = None) -> Response:
        """Return actions and waits until a moment: of some tasks whenever they were, or of all of the day before it."""
        return _json(past.look(at, lambda source: source.timeline(task or ())))

    @app.get("/v1/past/chart", tags=["past"], response_class=Response, responses=answers(Chart))
    def chart(at: At = "", task: Tasks = None) -> Response:
        """Return the site's map with the ways until a moment: for some tasks, or of the day before it."""
        return _json(past.look(at, lambda source: source.chart(task or ())))

    @app.get("/v1/past/stats", tags=["past"], response_class=Response, responses=answers(Stats))
    def stats(
        at: At = "",
        task: Annotated[str, Query(max_length=200)] = "",
        hours: Annotated[float, Query(ge=0.0, le=1e6, description="before the moment; 0: a day")] = 0.0,
    ) -> Response:
        """Return how long things took in the hours before a moment."""
        return _json(past.look(at, lambda source: source.stats(task=task, hours=hours)))

    @app.get("/v1/past/tasks/{task_id}", tags=["past"], response_class=Response, responses=answers(PastTask))
    def task(task_id: str, at: At = "") -> Response:
        """Return a task as it stood at a moment: tree, values, and why."""
        return _json(
            past.look(at, lambda source: PastTask(picture=source.task(task_id), because=tuple(source.why(task_id)[1])))
        )


def _json(value: Any) -> Response:
    return Response(msgspec.json.encode(value), media_type="application/json")
