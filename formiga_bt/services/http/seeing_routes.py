"""`/v1` routes of what is seen: the facts of `show.facts`, from which the verbs draw their pictures.

A page is made while the view is held still, which is short, and written as JSON afterwards (`routes`), so that the engine's
steps do not pile up behind a slow reader.
"""

from collections.abc import Callable
from typing import Annotated, Final, TypeVar

from fastapi import Query

from formiga_bt.base.errors import TaskError
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.refused import Refused
from formiga_bt.services.words import hint_for
from formiga_bt.show.facts import BlackboardFact, Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.source import Source

PAGE: Final = 1000
"""Tasks of one page, at most."""
TASKS: Final = 1000
"""Tasks that may be named in one request."""
T = TypeVar("T")

Tasks = Annotated[list[str] | None, Query(max_length=TASKS, description="of these tasks only; may be repeated")]

Prefix = Annotated[str, Query(max_length=200, description="only keys that begin with this, such as /fleet/")]


def add(routes: FactRoutes, source: Source) -> None:
    """Add the routes."""

    @routes.get("/v1/now", "seeing")
    def now(
        first: Annotated[int, Query(ge=0, le=10_000_000, description="number of the first task of the page")] = 0,
        count: Annotated[int, Query(ge=0, le=PAGE)] = 100,
        find: Annotated[str, Query(max_length=200, description="only tasks that contain this")] = "",
        over: Annotated[bool, Query(description="also tasks that have ended")] = False,
    ) -> Now:
        """Return the whole site at one instant, of its tasks a page; the most urgent come first."""
        return _asked(lambda: source.now(first=first, count=count, find=find, over=over))

    @routes.get("/v1/tasks/{task_id}/picture", "seeing")
    def picture(task_id: str) -> TaskPicture:
        """Return a task with its tree, and how each of its steps stands."""
        return _asked(lambda: source.task(task_id))

    @routes.get("/v1/timeline", "seeing")
    def timeline(task: Tasks = None) -> Timeline:
        """Return the actions and waits of some tasks, or of all that are kept: what a Gantt chart shows."""
        return _asked(lambda: source.timeline(task or ()))

    @routes.get("/v1/chart", "seeing")
    def chart(task: Tasks = None) -> Chart:
        """Return the site's map, with the ways of the agents of some tasks, or of all."""
        return _asked(lambda: source.chart(task or ()))

    @routes.get("/v1/stats", "seeing")
    def stats(
        task: Annotated[str, Query(max_length=200, description="of tasks of this name")] = "",
        hours: Annotated[float, Query(ge=0.0, le=1e6, description="of the last hours; 0: since the start")] = 0.0,
    ) -> Stats:
        """Return how long actions, gaps, waits, tasks and answers take, with their spread."""
        return _asked(lambda: source.stats(task=task, hours=hours))

    @routes.get("/v1/blackboard", "seeing")
    def blackboard(prefix: Prefix = "/") -> BlackboardFact:
        """Return the keys of the blackboard with their values: what agents report, requests for agents, grants."""
        return _asked(lambda: source.blackboard(prefix))


def _asked(ask: Callable[[], T]) -> T:
    try:
        return ask()
    except TaskError as error:
        raise Refused(error.code, error.text, error.help or hint_for(error.code), near=error.near) from error
