"""`/v1` routes of what is seen: the facts of `show.facts`, from which the verbs draw their pictures.

A page is made while the view is held still, which is short, and written as JSON afterwards, so that the engine's steps do not
pile up behind a slow reader.
"""

from collections.abc import Callable, Sequence
from typing import Annotated, Any, Final

import msgspec
from fastapi import FastAPI, Query, Response

from formiga_bt.base.errors import TaskError
from formiga_bt.services.refused import Refused
from formiga_bt.services.words import hint_for
from formiga_bt.show.facts import Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.source import Source

PAGE: Final = 1000
"""Tasks of one page, at most."""
TASKS: Final = 1000
"""Tasks that may be named in one request."""
KINDS: Final = (Now, TaskPicture, Timeline, Chart, Stats)
REF: Final = "#/components/schemas/{name}"

Tasks = Annotated[list[str] | None, Query(max_length=TASKS, description="of these tasks only; may be repeated")]


def add(app: FastAPI, source: Source) -> None:
    """Add the routes to an app."""
    described(app, KINDS)

    @app.get("/v1/now", tags=["seeing"], response_class=Response, responses=answers(Now))
    def now(
        first: Annotated[int, Query(ge=0, le=10_000_000, description="number of the first task of the page")] = 0,
        count: Annotated[int, Query(ge=0, le=PAGE)] = 100,
        find: Annotated[str, Query(max_length=200, description="only tasks that contain this")] = "",
        over: Annotated[bool, Query(description="also tasks that have ended")] = False,
    ) -> Response:
        """Return the whole site at one instant, of its tasks a page; the most urgent come first."""
        return _json(lambda: source.now(first=first, count=count, find=find, over=over))

    @app.get("/v1/tasks/{task_id}/picture", tags=["seeing"], response_class=Response, responses=answers(TaskPicture))
    def picture(task_id: str) -> Response:
        """Return a task with its tree, and how each of its steps stands."""
        return _json(lambda: source.task(task_id))

    @app.get("/v1/timeline", tags=["seeing"], response_class=Response, responses=answers(Timeline))
    def timeline(task: Tasks = None) -> Response:
        """Return the actions and waits of some tasks, or of all that are kept: what a Gantt chart shows."""
        return _json(lambda: source.timeline(task or ()))

    @app.get("/v1/chart", tags=["seeing"], response_class=Response, responses=answers(Chart))
    def chart(task: Tasks = None) -> Response:
        """Return the site's map, with the ways of the agents of some tasks, or of all."""
        return _json(lambda: source.chart(task or ()))

    @app.get("/v1/stats", tags=["seeing"], response_class=Response, responses=answers(Stats))
    def stats(
        task: Annotated[str, Query(max_length=200, description="of tasks of this name")] = "",
        hours: Annotated[float, Query(ge=0.0, le=1e6, description="of the last hours; 0: since the start")] = 0.0,
    ) -> Response:
        """Return how long actions, gaps, waits, tasks and answers take, with their spread."""
        return _json(lambda: source.stats(task=task, hours=hours))


def _json(ask: Callable[[], object]) -> Response:
    try:
        found = ask()
    except TaskError as error:
        raise Refused(error.code, str(error), hint_for(error.code)) from error
    return Response(msgspec.json.encode(found), media_type="application/json")


def answers(kind: type) -> dict[int | str, dict[str, Any]]:
    """Return the documentation of a route that answers facts of one kind."""
    schema = {"$ref": REF.format(name=kind.__name__)}
    return {200: {"description": (kind.__doc__ or "").strip(), "content": {"application/json": {"schema": schema}}}}


def described(app: FastAPI, kinds: Sequence[type]) -> None:
    """Put the shapes of facts into the app's OpenAPI document."""
    plain = app.openapi

    def openapi() -> dict[str, Any]:
        document = plain()
        _, shapes = msgspec.json.schema_components(kinds, ref_template=REF)
        document.setdefault("components", {}).setdefault("schemas", {}).update(shapes)
        return document

    app.openapi = openapi  # type: ignore[method-assign]
