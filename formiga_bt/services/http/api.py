"""The HTTP API `/v1`: thin routes over `ServiceOrders`. Errors are problem documents with a code, a text and what helps.

Routes are plain functions: FastAPI runs them in its threads, so one that waits for the engine holds up nobody else. Only the
event stream is asynchronous.
"""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Sequence
from http import HTTPStatus
from typing import Annotated, Any, Final, Literal, Protocol

from fastapi import FastAPI, Header, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.exceptions import HTTPException

from formiga_bt import __version__
from formiga_bt.base.clock import Micros, micros
from formiga_bt.services.crew import Crew
from formiga_bt.services.feed import Feed, FeedEvent
from formiga_bt.services.http import crew_routes, library_routes, openapi, order_routes, past_routes, seeing_routes
from formiga_bt.services.http.crowd import Crowd
from formiga_bt.services.http.door import Door
from formiga_bt.services.http.urgent import in_lane
from formiga_bt.services.loading import Loading
from formiga_bt.services.not_served import NotServed
from formiga_bt.services.orders import ServiceOrders, Waits
from formiga_bt.services.refused import Refused
from formiga_bt.services.replies import models as m
from formiga_bt.show.source import Source

STATUS: Final = {
    "unknown_task": 404,
    "unknown_agent": 404,
    "unknown_target": 404,
    "unknown_pilot": 404,
    "unknown_event": 404,
    "not_approver": 403,
    "not_approved": 403,
    "unknown_question": 404,
    "no_history": 404,
    "not_yet": 404,
    "secret_missing": 403,
    "secret_wrong": 403,
    "secret_wait": 429,
    "bad_moment": 422,
    "bad_status": 422,
    "bad_params": 422,
    "bad_role": 422,
    "bad_option": 422,
    "bad_fields": 422,
    "bad_bundle": 422,
    "bad_task": 422,
    "not_confirmed": 422,
    "who": 422,
    "busy": 429,
    "closed": 503,
    "stopped": 503,
    "no_reply": 503,
    "client_gone": 503,
}
"""HTTP status of a code; 409 for others: they conflict with how things stand."""

HEARTBEAT_S: Final = 2.0
"""A comment is sent to readers of the event stream this often."""


class Host(Protocol):
    """What the API needs besides orders."""

    orders: ServiceOrders
    crew: Crew
    loading: Loading
    source: Source
    past: past_routes.PastReader
    refused: tuple[NotServed, ...]
    needs_token: bool
    """Whether its doors ask for the site's token."""

    @property
    def feed(self) -> Feed:
        """Return the feed of events."""
        ...

    def health(self) -> m.Health:
        """Return how the engine is."""
        ...

    def drain(self) -> str:
        """Admit nothing more; end when all tasks have."""
        ...

    def request_stop(self) -> str:
        """End now; agents go on with what they do."""
        ...


class ProblemResponse(JSONResponse):
    """A problem document."""

    media_type = "application/problem+json"


def problem(status: int, code: str, text: str, hint: str = "", problems: Sequence[str] = ()) -> ProblemResponse:
    """Return an error answer."""
    body = m.Problem(
        title=HTTPStatus(status).phrase, status=status, code=code, text=text, hint=hint, problems=list(problems)
    )
    headers = {"Retry-After": "2"} if status in (429, 503) else None
    return ProblemResponse(body.model_dump(), status, headers)


def application(host: Host) -> FastAPI:
    """Return the routes of an engine; each door is put before them (`guarded`)."""
    app = FastAPI(
        title="formiga_bt",
        version=__version__,
        description="Tasks, agents and questions of one engine. Errors are application/problem+json.",
        openapi_url=None,  # `openapi` serves it
        docs_url=None,  # their pages load scripts from elsewhere
        redoc_url=None,
        responses={
            "4XX": {"description": "Client Error"}
        },  # `openapi` says what is in it; without it FastAPI tells of another 422
    )
    _errors(app)
    _tasks(app, host.orders)
    _agents(app, host.orders)
    order_routes.add(app, host.orders.stops)
    crew_routes.add(app, host.crew)
    seeing_routes.add(app, host.source)
    past_routes.add(app, host.past)
    _people(app, host.orders)
    library_routes.add(app, host.loading, host.refused)
    _engine(app, host)
    openapi.serve(app, needs_token=host.needs_token)
    return app


def guarded(
    app: FastAPI, *, token: str, needs_token: bool, crowd: Crowd[Any] | None = None, is_local: bool = False
) -> Callable[..., Any]:
    """Return the ASGI app of one door; see `Door`."""
    return Door(app, token=token, needs_token=needs_token, refusal=problem, crowd=crowd, is_local=is_local)


def _errors(app: FastAPI) -> None:
    @app.exception_handler(Refused)
    async def refused(request: Request, error: Refused) -> ProblemResponse:  # noqa: ARG001
        return problem(STATUS.get(error.code, 409), error.code, str(error), error.hint, error.problems)

    @app.exception_handler(RequestValidationError)
    async def invalid(request: Request, error: RequestValidationError) -> ProblemResponse:  # noqa: ARG001
        texts = [f"{'.'.join(str(part) for part in e['loc'])}: {e['msg']}" for e in error.errors()]
        if any(e["type"] == "json_invalid" for e in error.errors()):
            return problem(400, "bad_json", f"the body is not JSON: {texts[0]}", "", texts)
        hint = "the shapes of all requests: GET /v1/openapi.json; send bodies as Content-Type: application/json"
        return problem(422, "bad_request", texts[0] if texts else "the request has another shape", hint, texts)

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> ProblemResponse:
        code = {404: "no_such_route", 405: "wrong_method"}.get(error.status_code, "http")
        text = f"{request.method} {request.url.path}: {error.detail}"
        return problem(error.status_code, code, text, "GET /v1/openapi.json lists all routes")

    @app.exception_handler(Exception)
    async def bug(request: Request, error: Exception) -> ProblemResponse:
        return problem(
            500, "bug", f"{request.url.path}: {type(error).__name__}: {error}", "this is a bug of formiga_bt"
        )


def _micros(seconds: float | None) -> Micros | None:
    return None if seconds is None else micros(seconds)


def _tasks(app: FastAPI, orders: ServiceOrders) -> None:
    @app.post("/v1/tasks", status_code=201, tags=["tasks"])
    def submit(
        body: m.SubmitBody,
        idempotency_key: Annotated[str, Header(max_length=200)] = "",
    ) -> m.Submitted:
        """Request a task. With an Idempotency-Key, sending it twice starts one task."""
        name = body.by or "http"
        waits = Waits(_micros(body.wait_s), _micros(body.expires_s))
        task_id = orders.submit(body.task, body.params, body.priority, name, idempotency_key, body.bundle, waits)
        return m.Submitted(id=task_id)

    @app.get("/v1/tasks", tags=["tasks"])
    def tasks(
        status: Annotated[str, Query(max_length=20, description="open, held, or a status; empty: all")] = "",
        limit: Annotated[int, Query(ge=1, le=10_000)] = 100,
    ) -> m.TasksOut:
        """List tasks: those under way, then all others, each newest first."""
        return orders.tasks(status, limit)

    @app.get("/v1/tasks/{task_id}", tags=["tasks"])
    def task(task_id: str) -> m.TaskDetail:
        """Return everything about a task."""
        return orders.task(task_id)

    @app.get("/v1/tasks/{task_id}/why", tags=["tasks"])
    def why(task_id: str) -> m.WhyOut:
        """Explain why a task waits, is held, chose its agents, or failed."""
        return orders.why(task_id)

    @app.get("/v1/agents/{agent}/why", tags=["agents"])
    def why_agent(agent: str) -> m.WhyOut:
        """Explain a machine or person: who has it, which order stands on it, what its goals wait for, its task."""
        return orders.why_agent(agent)

    @app.post("/v1/tasks/{task_id}/abort", tags=["tasks"])
    @in_lane
    def abort(task_id: str, body: m.AbortBody | None = None) -> m.Reply:
        """End a task: its cleanup runs, its machines come home."""
        order = body or m.AbortBody()
        return m.Reply(text=orders.abort(task_id, order.how, order.by or "http", confirmed=order.confirmed))

    @app.delete("/v1/tasks/{task_id}", tags=["tasks"])
    @in_lane
    def delete(task_id: str, how: Literal["", "now"] = "", by: str = "") -> m.Reply:
        """End a task, as POST abort does."""
        return m.Reply(text=orders.abort(task_id, how, by or "http"))


def _agents(app: FastAPI, orders: ServiceOrders) -> None:
    @app.get("/v1/agents", tags=["agents"])
    def agents() -> m.AgentsOut:
        """List machines and people."""
        return orders.agents()

    @app.post("/v1/agents/{agent}/clear", tags=["agents"])
    def clear(agent: str, body: m.ByBody | None = None) -> m.Reply:
        """Take a quarantined agent back, or one whose process was started anew, once a person has looked at it."""
        return m.Reply(text=orders.clear(agent, (body or m.ByBody()).by or "http"))

    @app.post("/v1/agents/{agent}/removed", tags=["agents"])
    def removed(agent: str, body: m.RemovedBody | None = None) -> m.Reply:
        """Free the way and the place of a machine that counts as lost, once a person has taken it away."""
        word = body or m.RemovedBody()
        return m.Reply(text=orders.removed(agent, word.by or "http", word.confirmed))

    @app.post("/v1/agents/{agent}/events", tags=["people"])
    @in_lane
    def report_event(agent: str, body: m.EventBody) -> m.Reply:
        """Tell an event for a person who works at this engine's desk."""
        return m.Reply(text=orders.report_event(agent, body.event, body.fields))


def _people(app: FastAPI, orders: ServiceOrders) -> None:
    @app.get("/v1/inbox", tags=["people"])
    def inbox(person: Annotated[str, Query(max_length=200)] = "") -> m.InboxOut:
        """List the open questions, oldest first."""
        return orders.inbox(person)

    @app.post("/v1/inbox/{number}/answer", tags=["people"])
    @in_lane
    def answer(number: str, body: m.AnswerBody) -> m.Reply:
        """Answer a question for a person who works at this engine's desk."""
        return m.Reply(text=orders.answer(number, body.option, body.by))


def _engine(app: FastAPI, host: Host) -> None:
    @app.get("/v1/health", tags=["engine"])
    def health() -> m.Health:
        """Tell how the engine is."""
        return host.health()

    @app.post("/v1/admin/drain", tags=["engine"])
    def drain() -> m.Reply:
        """Admit no more tasks, and end the engine when the last one has ended."""
        return m.Reply(text=host.drain())

    @app.post("/v1/admin/stop", tags=["engine"])
    def stop() -> m.Reply:
        """End the engine now. Agents go on with the goals they have."""
        return m.Reply(text=host.request_stop())

    @app.get("/v1/events", tags=["engine"], response_class=StreamingResponse)
    def events(
        last_event_id: Annotated[str, Header(max_length=100)] = "",
        after: Annotated[str, Query(max_length=100, description="as Last-FeedEvent-ID")] = "",
        task: Annotated[str, Query(max_length=200, description="of this task only")] = "",
    ) -> StreamingResponse:
        """Stream what happens, as server-sent events (text/event-stream), from now or after an id."""
        source = stream(host.feed, last_event_id or after, task)
        return StreamingResponse(source, media_type="text/event-stream", headers={"Cache-Control": "no-store"})


async def stream(feed: Feed, after: str, task: str = "", heartbeat_s: float = HEARTBEAT_S) -> AsyncIterator[str]:
    """Yield events as text. A reader that missed some gets a `gap` first, and should read the state anew."""
    loop = asyncio.get_running_loop()
    news = asyncio.Event()
    end = feed.listen(lambda: _wake(loop, news))
    try:
        n = feed.newest
        gap = False
        alive_at = loop.time()
        if after:
            known = feed.read_id(after)
            n, gap = (known, False) if known is not None else (0, True)
        yield f": formiga_bt, site events\nid: {feed.id_of(n)}\n\n"
        while True:
            news.clear()
            found, missed = feed.after(n)
            if gap or (missed and n < feed.newest):
                gap = False
                text = "earlier events are gone; read the state anew"
                yield _sse(feed, FeedEvent(n=n, type="gap", at=0, text=text))
            for event in found:
                n = event.n
                if not task or event.task == task:
                    alive_at = loop.time()
                    yield _sse(feed, event)
            if feed.closed:
                return
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(news.wait(), heartbeat_s)
            if loop.time() - alive_at >= heartbeat_s:  # also while only events of other tasks come in
                alive_at = loop.time()
                yield ":\n\n"
    finally:
        end()


def _wake(loop: asyncio.AbstractEventLoop, news: asyncio.Event) -> None:
    with contextlib.suppress(RuntimeError):  # the server has ended meanwhile
        loop.call_soon_threadsafe(news.set)


def _sse(feed: Feed, event: FeedEvent) -> str:
    data = {"type": event.type, "unix_millis": event.at // 1000, "text": event.text}
    if event.task:
        data["task"] = event.task
    if event.agent:
        data["agent"] = event.agent
    text = json.dumps({**data, **event.data}, ensure_ascii=False)
    return f"id: {feed.id_of(event.n)}\nevent: {event.type}\ndata: {text}\n\n"
