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

import msgspec
from fastapi import FastAPI, Header, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response, StreamingResponse
from starlette.exceptions import HTTPException

from formiga_bt import __version__
from formiga_bt.base.accounts import AccountBook
from formiga_bt.base.clock import Micros, micros
from formiga_bt.base.roles import Deed
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.lang.request.value_files import ValueFile
from formiga_bt.services.asked_when import AskedWhen
from formiga_bt.services.crew import Crew
from formiga_bt.services.discovered import CatalogueOrders
from formiga_bt.services.feed import Feed, FeedEvent
from formiga_bt.services.http import (
    alarm_routes,
    catalogue_routes,
    crew_routes,
    file_routes,
    fleet_routes,
    library_routes,
    metrics_routes,
    news_routes,
    openapi,
    order_routes,
    past_routes,
    rule_routes,
    seeing_routes,
    zone_routes,
)
from formiga_bt.services.http import bodies as b
from formiga_bt.services.http.audit import Audit
from formiga_bt.services.http.crowd import Crowd
from formiga_bt.services.http.door import Door
from formiga_bt.services.http.routes import REF, FactRoutes
from formiga_bt.services.http.speaking import SPEAKER, require_abort, require_task, speaker, spoken_as
from formiga_bt.services.kept.attachments import AttachmentStore
from formiga_bt.services.kept.journaling import Journaling
from formiga_bt.services.loading import Loading
from formiga_bt.services.members import Members
from formiga_bt.services.news.desk import NewsDesk
from formiga_bt.services.not_served import NotServed
from formiga_bt.services.once import key_of
from formiga_bt.services.orders import ServiceOrders, Waits
from formiga_bt.services.pace import Pace
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.show import facts as f
from formiga_bt.show.source import Source

STATUS: Final = {
    "unknown_task": 404,
    "unknown_agent": 404,
    "unknown_target": 404,
    "unknown_pilot": 404,
    "unknown_event": 404,
    "unknown_fleet": 404,
    "unknown_role": 422,
    "which_role": 422,
    "unknown_action": 404,
    "unknown_type": 422,
    "unknown_home": 422,
    "unknown_rule": 404,
    "unknown_alarm": 404,
    "unknown_place": 404,
    "unknown_channel": 404,
    "not_approver": 403,
    "not_approved": 403,
    "unknown_question": 404,
    "no_history": 404,
    "no_attachment": 404,
    "bad_hash": 422,
    "too_large": 413,
    "not_kept": 503,
    "not_yet": 404,
    "no_role": 403,
    "not_you": 403,
    "not_listed": 403,
    "metrics_off": 403,
    "no_agent": 403,
    "secret_missing": 403,
    "secret_wrong": 403,
    "secret_wait": 429,
    "bad_moment": 422,
    "bad_time": 422,
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
    "too_many_open": 429,
    "closed": 503,
    "stopped": 503,
    "no_reply": 503,
    "client_gone": 503,
}
"""HTTP status of a code; 409 for others: they conflict with how things stand."""

PROBLEM: Final = {
    "description": (f.Problem.__doc__ or "").strip(),
    "content": {"application/problem+json": {"schema": {"$ref": REF.format(name="Problem")}}},
}
HEARTBEAT_S: Final = 2.0
"""A comment is sent to readers of the event stream this often."""


class Host(Protocol):
    """What the API needs besides orders."""

    orders: ServiceOrders
    crew: Crew
    members: Members
    catalogue: CatalogueOrders
    news: NewsDesk
    loading: Loading
    attachments: AttachmentStore
    source: Source
    past: past_routes.PastReader
    refused: tuple[NotServed, ...]
    needs_token: bool
    """Whether its doors ask for the site's token."""
    shows_metrics: bool
    """Whether it shows its figures."""
    driver: RealtimeDriver
    view: EngineView
    journaling: Journaling

    @property
    def feed(self) -> Feed:
        """Return the feed of events."""
        ...

    def health(self) -> f.EngineHealth:
        """Return how the engine is."""
        ...

    def crowds(self) -> dict[str, int]:
        """Return how many connections each door has."""
        ...

    def drain(self) -> str:
        """Admit nothing more; end when all tasks have."""
        ...

    def request_stop(self) -> str:
        """End now; agents go on with what they do."""
        ...


class ProblemResponse(Response):
    """A problem document."""

    media_type = "application/problem+json"

    def render(self, content: f.Problem) -> bytes:
        """Return it as JSON."""
        return msgspec.json.encode(content)


def problem(
    status: int, code: str, text: str, help_: str = "", problems: Sequence[str] = (), near: Sequence[str] = ()
) -> ProblemResponse:
    """Return an error answer."""
    title = HTTPStatus(status).phrase
    found = f.Problem(
        title=title, status=status, code=code, text=text, help=help_, near=tuple(near), problems=tuple(problems)
    )
    return ProblemResponse(found, status, {"Retry-After": "2"} if status in (429, 503) else None)


def application(host: Host) -> FastAPI:
    """Return the routes of an engine; each door is put before them (`guarded`)."""
    app = FastAPI(
        title="formiga_bt",
        version=__version__,
        description="Tasks, agents and questions of one engine. Errors are application/problem+json.",
        openapi_url=None,  # `openapi` serves it
        docs_url=None,  # their pages load scripts from elsewhere
        redoc_url=None,
        responses={"4XX": PROBLEM, "5XX": PROBLEM},
    )
    _errors(app)
    routes = FactRoutes(app)
    _tasks(routes, host.orders)
    _agents(routes, host.orders)
    order_routes.add(routes, host.orders.stops, host.orders.by_hand)
    crew_routes.add(routes, host.crew)
    fleet_routes.add(routes, host.members)
    catalogue_routes.add(routes, host.catalogue)
    seeing_routes.add(routes, host.source)
    past_routes.add(routes, host.past)
    rule_routes.add(routes, host.orders)
    news_routes.add(routes, host.news)
    alarm_routes.add(routes, host.orders.alarms)
    zone_routes.add(routes, host.orders.zones)
    _people(routes, host.orders)
    library_routes.add(routes, host.loading, host.refused)
    file_routes.add(routes, host.attachments)
    _engine(routes, host)
    metrics_routes.add(routes, host, shown=host.shows_metrics)
    app.state.deeds = routes.deeds
    openapi.serve(app, {*routes.kinds, f.Problem}, needs_token=host.needs_token)
    return app


def guarded(
    app: FastAPI,
    *,
    token: str,
    needs_token: bool,
    accounts: AccountBook | None = None,
    audit: Audit | None = None,
    pace: Pace | None = None,
    crowd: Crowd[Any] | None = None,
    is_local: bool = False,
    alive: Callable[[], f.Alive] | None = None,
) -> Callable[..., Any]:
    """Return the ASGI app of one door; see `Door`."""
    return Door(
        app, token=token, needs_token=needs_token, accounts=accounts, audit=audit, pace=pace, refusal=problem,
        crowd=crowd, is_local=is_local, alive=None if alive is None else lambda: _alive_answer(alive()),
    )  # fmt: skip


def _alive_answer(found: f.Alive) -> Response:
    return Response(msgspec.json.encode(found), 200 if found.alive else 503, media_type="application/json")


def _errors(app: FastAPI) -> None:
    @app.exception_handler(Refused)
    async def refused(request: Request, error: Refused) -> ProblemResponse:  # noqa: ARG001
        return problem(STATUS.get(error.code, 409), error.code, error.text, error.help, error.problems, error.near)

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


def _tasks(routes: FactRoutes, orders: ServiceOrders) -> None:
    @routes.post("/v1/tasks", "tasks", Deed.REQUEST, 201)
    def submit(
        body: b.SubmitBody,
        idempotency_key: Annotated[str, Header(max_length=200)] = "",
    ) -> f.TaskRequested:
        """Request a task. With an Idempotency-Key, sending it twice starts one task."""
        who, name = require_task(body.task), speaker(body.by)
        when = AskedWhen(body.not_before, body.deadline, body.if_late, tuple(body.after))
        waits = Waits(_micros(body.wait_s), _micros(body.expires_s), when)
        files = tuple(ValueFile(one.file, one.text, one.param) for one in body.params_from)
        key = key_of(who.name, idempotency_key)
        task_id = orders.submit(
            body.task, body.params, body.priority, name, key, body.bundle, waits, files, who.most_open
        )
        return f.TaskRequested(task_id)

    @routes.get("/v1/tasks", "tasks")
    def tasks(
        status: Annotated[str, Query(max_length=20, description="open, held, or a status; empty: all")] = "",
        limit: Annotated[int, Query(ge=1, le=10_000)] = 100,
    ) -> f.TaskList:
        """List tasks: those under way, then all others, each newest first."""
        return orders.tasks(status, limit)

    @routes.get("/v1/tasks/{task_id}", "tasks")
    def task(task_id: str) -> f.TaskDetail:
        """Return everything about a task."""
        return orders.task(task_id)

    @routes.get("/v1/tasks/{task_id}/why", "tasks")
    def why(task_id: str) -> f.Explanation:
        """Explain why a task waits, is held, chose its agents, or failed."""
        return orders.why(task_id)

    @routes.get("/v1/agents/{agent}/why", "agents")
    def why_agent(agent: str) -> f.Explanation:
        """Explain a machine or person: who has it, which order stands on it, what its goals wait for, its task."""
        return orders.why_agent(agent)

    @routes.post("/v1/tasks/{task_id}/abort", "tasks", Deed.ABORT_OWN)
    def abort(task_id: str, body: b.AbortBody | None = None) -> f.OrderDone:
        """End a task: its cleanup runs, its machines come home."""
        order = body or b.AbortBody()
        return f.OrderDone(orders.abort(task_id, order.how, _ender(task_id, order.by), confirmed=order.confirmed))

    @routes.delete("/v1/tasks/{task_id}", "tasks", Deed.ABORT_OWN)
    def delete(task_id: str, how: Literal["", "now"] = "", by: str = "") -> f.OrderDone:
        """End a task, as POST abort does."""
        return f.OrderDone(orders.abort(task_id, how, _ender(task_id, by)))

    def _ender(task_id: str, said: str) -> str:
        require_abort(lambda: orders.task(task_id).task.by)
        return speaker(said)


def _agents(routes: FactRoutes, orders: ServiceOrders) -> None:
    @routes.get("/v1/agents", "agents")
    def agents() -> f.AgentList:
        """List machines and people."""
        return orders.agents()

    @routes.post("/v1/agents/{agent}/clear", "agents", Deed.CLEAR)
    def clear(agent: str, body: b.ByBody | None = None) -> f.OrderDone:
        """Take a quarantined agent back, or one whose process was started anew, once a person has looked at it."""
        return f.OrderDone(orders.clear(agent, speaker((body or b.ByBody()).by)))

    @routes.post("/v1/agents/{agent}/removed", "agents", Deed.CLEAR)
    def removed(agent: str, body: b.RemovedBody | None = None) -> f.OrderDone:
        """Free the way and the place of a machine that counts as lost, once a person has taken it away."""
        word = body or b.RemovedBody()
        return f.OrderDone(orders.removed(agent, speaker(word.by), word.confirmed))

    @routes.post("/v1/agents/{agent}/events", "people", Deed.EVENT)
    def report_event(agent: str, body: b.EventBody) -> f.OrderDone:
        """Report an event for a person who works at this engine's desk."""
        return f.OrderDone(orders.report_event(spoken_as(agent), body.event, body.fields))


def _people(routes: FactRoutes, orders: ServiceOrders) -> None:
    @routes.get("/v1/inbox", "people", Deed.INBOX)
    def inbox(person: Annotated[str, Query(max_length=200)] = "") -> f.QuestionList:
        """List the open questions, oldest first."""
        return orders.inbox(person if SPEAKER.get().may(Deed.SEE) else spoken_as(person))

    @routes.post("/v1/inbox/{number}/answer", "people", Deed.ANSWER)
    def answer(number: str, body: b.AnswerBody) -> f.OrderDone:
        """Answer a question for a person who works at this engine's desk."""
        return f.OrderDone(orders.answer(number, body.option, spoken_as(body.by), body.fields))


def _engine(routes: FactRoutes, host: Host) -> None:
    @routes.get("/v1/whoami", "engine", Deed.WHO)
    def whoami() -> f.SpeakerFact:
        """Tell who the caller is to this engine, and what they may do."""
        who = SPEAKER.get()
        may = tuple(deed.value for deed in Deed if who.may(deed))
        return f.SpeakerFact(who.name, tuple(map(str, who.roles)), who.agent, who.tasks, may)

    @routes.get("/v1/health", "engine")
    def health() -> f.EngineHealth:
        """Tell how the engine is."""
        return host.health()

    @routes.post("/v1/admin/drain", "engine", Deed.ENGINE)
    def drain() -> f.OrderDone:
        """Admit no more tasks, and end the engine when the last one has ended."""
        return f.OrderDone(host.drain())

    @routes.post("/v1/admin/stop", "engine", Deed.ENGINE)
    def stop() -> f.OrderDone:
        """End the engine now. Agents go on with the goals they have."""
        return f.OrderDone(host.request_stop())

    seeing = routes.guard("GET", "/v1/events", Deed.SEE)

    @routes.app.get("/v1/events", tags=["engine"], response_class=StreamingResponse, dependencies=seeing)
    def events(
        last_event_id: Annotated[str, Header(max_length=100)] = "",
        after: Annotated[str, Query(max_length=100, description="as Last-Event-ID")] = "",
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
    data = {"type": event.type, "at": event.at, "text": event.text}
    if event.task:
        data["task"] = event.task
    if event.agent:
        data["agent"] = event.agent
    text = json.dumps({**data, **event.data}, ensure_ascii=False)
    return f"id: {feed.id_of(event.n)}\nevent: {event.type}\ndata: {text}\n\n"
