"""`formiga sim` without `--virtual`: the scenario's agents join a running engine, whose API takes the tasks."""

import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import typer

from formiga_bt.base.endpoints import is_tls
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.site_folder import find_engines
from formiga_bt.cli.integrator.absent import check_absent
from formiga_bt.cli.options import print_table
from formiga_bt.cli.printing import show_next
from formiga_bt.client import Client, NoEngine, UnknownId, connect

if TYPE_CHECKING:
    from agents_sim.referee import Verdict
    from formiga_bt.lang.scenario import Scenario, ScenarioOrder, ScenarioTask

OVER: Final = frozenset({"SUCCEEDED", "FAILED", "CANCELED"})
ASK_EVERY_S: Final = 0.5
EXIT_NO, EXIT_INTERRUPTED = 1, 130
REQUESTER: Final = "scenario"
ALL_TASKS: Final = 10_000
"""As many as one answer may list: a new one must be among them however many are under way."""
T = TypeVar("T")


class PlayedTask(NamedTuple):
    """A task of the scenario, as it was when it was last looked at."""

    status: str
    outcome: str
    agents: str = ""
    done: int = 0
    """Actions that came to their end."""
    lasted_s: float = 0.0


class Api:
    """The API of the scenario's engine: that may die, and another one comes, perhaps at another address.

    Args:
        find: returns a client of the engine that runs now; raises NoEngine.
        tell: takes a line for people.
        where: the endpoint at which its agents look for it.
    """

    def __init__(self, find: Callable[[], Client], tell: Callable[[str], None], where: str = "") -> None:
        self._find, self._tell, self._where = find, tell, where
        self.client = find()
        self._is_gone = False

    def call(self, what: Callable[[Client], T]) -> T | None:
        """Return what a call returns, or None: no engine is there now. What it was told may have reached it all the same.

        Raises:
            ApiError: the engine said no.
        """
        try:
            if self._is_gone:
                self.client = self._find()
            found = what(self.client)
        except NoEngine:
            if not self._is_gone:
                self._tell(f"no engine answers: the agents live on, and look for the next one at {self._where}")
            self._is_gone = True
            return None
        if self._is_gone:
            self._is_gone = False
            self._tell("an engine answers again")
        return found


class LiveRequests:
    """What a scenario asks of its engine, each in its turn; what no engine took waits for the next one.

    Args:
        api: of the engine; None: it is not known here.
        tell: takes a line for people.
    """

    def __init__(self, api: Api | None, tell: Callable[[str], None]) -> None:
        self._api, self._tell = api, tell
        self._waiting: deque[ScenarioTask | ScenarioOrder] = deque()
        self._before: set[str] | None = None
        self.tasks: dict[str, PlayedTask | None] = {}
        """What was requested, as it was when it was last looked at; None: not yet."""

    def ask(self, entry: "ScenarioTask | ScenarioOrder") -> None:
        """Take what is due."""
        self._waiting.append(entry)
        self.go_on()

    def go_on(self) -> None:
        """Ask for what waits, as far as there is an engine."""
        while self._waiting and self._play(self._waiting[0]):
            self._waiting.popleft()
            self._before = None

    @property
    def are_over(self) -> bool:
        """Return whether all that was asked for has ended."""
        return not self._waiting and all(task is not None and task.status in OVER for task in self.tasks.values())

    def look(self) -> None:
        """Look how the tasks are, telling changes of their status."""
        for task_id, before in self.tasks.items():
            if self._api is not None and (before is None or before.status not in OVER):
                task = self._api.call(partial(_looked_up, task_id=task_id))
                if task is None:
                    return
                self.tasks[task_id] = task
                if before is None or before.status != task.status:
                    self._tell(f"{task_id} {task.outcome}")

    def _play(self, entry: "ScenarioTask | ScenarioOrder") -> bool:
        from formiga_bt.lang.scenario import ScenarioOrder
        from formiga_bt.rehearsal.simulation import describe

        if isinstance(entry, ScenarioOrder):
            said = give(None, entry) if self._api is None else self._api.call(lambda client: give(client, entry))
            if said is not None:
                self._tell(f"order: {describe(entry)}{said}")
            return said is not None
        if self._api is None:
            self._tell(f"{entry.task} is due: no API of this engine is known here, request it yourself")
            return True
        made = self._request(self._api, entry)
        if made:
            self.tasks[made] = None
            self._tell(f"{made} requested")
        return bool(made)

    def _request(self, api: Api, entry: "ScenarioTask") -> str | None:
        """Request a task, once: an engine that died before it answered may have taken it."""
        there = api.call(lambda client: client.tasks(limit=ALL_TASKS).tasks)
        if there is None:
            return None
        mine = [task.id for task in there if task.name == entry.task and task.by == REQUESTER]
        if self._before is None:
            self._before = set(mine)
        taken = [task_id for task_id in mine if task_id not in self._before]
        if taken:
            return taken[0]
        wait_s, expires_s = (None if lasts is None else lasts / 1e6 for lasts in (entry.wait, entry.expires))
        return api.call(
            lambda client: client.request(
                entry.task, entry.texts, priority=entry.priority, by=REQUESTER, wait_s=wait_s, expires_s=expires_s
            )
        )


def run(play: "Scenario", endpoint: str | None) -> int:
    """Play a scenario beside a running engine; return the exit code."""
    client = _client(endpoint)
    if client is not None and client.address.site != play.site.name:
        raise FormigaError(
            f"the engine here runs the site '{client.address.site}', the scenario is of '{play.site.name}'",
            help="start an engine of that site, or play it here with --virtual",
        )
    if client is not None:
        check_absent(client, [agent.id for agent in play.agents], can_leave_out=False)
    where = endpoint or (client.address.endpoint if client is not None else "")
    from formiga_bt.rehearsal.simulation import describe
    from formiga_bt.rehearsal.stage import Stage

    if is_tls(where):
        raise FormigaError(
            f"a scenario's agents have no keys, which the engine at {where} asks for", help="play it with --virtual"
        )
    api = Api(lambda: _found(play.site.name, where), typer.echo, where) if client is not None else None
    requests = LiveRequests(api, typer.echo)
    typer.echo(f"starting {len(play.agents)} agents, each a process of its own, beside the engine at {where}")
    try:
        with Stage(play, where, requests.ask) as stage:
            stage.wait_ready(lambda agent: typer.echo(f"agent {agent} is there"))
            typer.echo(f"all are there; the engine's clock runs at {stage.speed:g}x")
            next_look = 0.0
            while client is None or not stage.all_played or not requests.are_over:
                for fault in stage.step():
                    typer.echo(f"fault: {describe(fault)}")
                if time.monotonic() >= next_look:
                    next_look = time.monotonic() + ASK_EVERY_S
                    requests.go_on()
                    requests.look()
            verdict = stage.verdict()
    except KeyboardInterrupt:
        typer.echo("Interrupted: the agents are gone; the engine goes on")
        return EXIT_INTERRUPTED
    return _close(requests.tasks, verdict)


def give(client: Client | None, order: "ScenarioOrder") -> str:
    """Give an order to the engine; return what to add to it for people: why it was refused, or nothing.

    Raises:
        NoEngine: no engine answers.
    """
    if client is None:
        return " is due: no API of this engine is known here, give it yourself"
    try:
        _carry(client, order, _newest(client, order.target) if order.of == "task" else order.target)
    except NoEngine:
        raise
    except FormigaError as error:
        return f": refused, {' '.join(str(error).split())}"
    return ""


def _carry(client: Client, order: "ScenarioOrder", target: str) -> None:
    by = order.by
    match order.order:
        case "lockdown":
            client.lock_down(order.how, by=by)
        case "abort":
            client.abort(target, order.how, by=by, confirmed=order.how == "abandon")
        case "handback":
            client.hand_back(target, order.how, by=by)
        case "clear":
            client.clear(target, by=by)
        case "removed":
            client.removed(target, confirmed=target, by=by)
        case word if order.of == "agent":
            client.order_agent(target, word, by=by, confirmed=target if word == "cut" else "")
        case word if order.of == "task":
            client.order_task(target, word, by=by)
        case word:
            client.order_all(word, by=by)


def _newest(client: Client, name: str) -> str:
    from formiga_bt.show.listed import natural

    found = client.tasks("open", ALL_TASKS).tasks
    if not (mine := [task.id for task in found if task.name == name]):
        raise FormigaError(f"no task '{name}' is open")
    return max(mine, key=natural)


def _client(endpoint: str | None) -> Client | None:
    if endpoint is None:
        return connect()
    found = [address for address in find_engines(Path.cwd()) if address.endpoint == endpoint]
    return Client(found[0]) if found else None


def _found(site: str, endpoint: str) -> Client:
    """Return a client of the engine of a site that runs here now.

    Raises:
        NoEngine: there is none, or it listens elsewhere than the agents look for it.
    """
    for address in find_engines(Path.cwd()):
        if (address.site, address.endpoint) == (site, endpoint):
            return Client(address)
    raise NoEngine(f"no engine of the site '{site}' listens at {endpoint}")


def _looked_up(client: Client, task_id: str) -> PlayedTask:
    """Return the task as it is now."""
    try:
        found = client.detail(task_id)
    except UnknownId as error:
        return PlayedTask("FAILED", f"FAILED: {error.code} the engine that is there now knows nothing of it")
    task, done = found.task, sum(action.ended_well for action in found.actions)
    outcome = f"{task.status}: {task.code} {task.reason}".strip() if task.code else task.status
    lasted_s = ((task.ended_at or found.at) - task.submitted_at) / 1e6
    return PlayedTask(task.status, outcome, ", ".join(found.granted), done, lasted_s)


def _close(tasks: "Mapping[str, PlayedTask | None]", verdict: "Verdict") -> int:
    rows: list[tuple[str, ...]] = [("task", "agents", "actions", "duration", "outcome")]
    ended = {task_id: task for task_id, task in tasks.items() if task is not None}
    rows += [
        (task_id, task.agents, str(task.done), f"{task.lasted_s:.0f} s", task.outcome)
        for task_id, task in ended.items()
    ]
    print_table(rows)
    near = verdict.closest_pass
    found = f"crashes: {len(verdict.crashes)}, starts near people without clearance: {len(verdict.unsafe_starts)}"
    found += f", low flights: {len(verdict.low_flights)}"
    typer.echo(found + ("" if near is None else f", closest pass: {near.distance_m:.0f} m ({near.a}, {near.b})"))
    show_next("formiga tasks", *(f"formiga why {task_id}" for task_id, one in ended.items() if one.status == "FAILED"))
    good = verdict.is_clean and all(task.status == "SUCCEEDED" for task in ended.values())
    return 0 if good else EXIT_NO
