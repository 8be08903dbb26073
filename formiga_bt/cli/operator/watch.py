"""`formiga watch`: a dashboard of all tasks and agents in the terminal."""

import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import SiteOption, TokenFileOption, UrlOption
from formiga_bt.cli.order_words import in_words
from formiga_bt.cli.ordering import ByOption
from formiga_bt.cli.past import AtOption, JournalOption, is_past, source_of
from formiga_bt.cli.printing import following, user
from formiga_bt.client import ApiError, Client, NoEngine, connect
from formiga_bt.show.watch.orders import WatchOrder, WatchReply

if TYPE_CHECKING:
    from formiga_bt.show.facts import Because, BlackboardFact, Chart, Now, OrderReply, Stats, TaskPicture, Timeline
    from formiga_bt.show.source import Source


def command(
    task: Annotated[str, typer.Argument(help="Begin with this task, for example PickUp-12.", metavar="TASK-ID")] = "",
    read_only: Annotated[bool, typer.Option("--read-only", help="Only look: no key gives an order.")] = False,
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Draw with ASCII characters only.")] = False,
    by: ByOption = "",
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
    journal: JournalOption = "",
    at: AtOption = "",
) -> None:
    """Watch a site in the terminal: what needs you on top, tasks, agents, one task's live tree; answer and stop by key.

    ? shows every key, q leaves; the engine goes on. Without colours: NO_COLOR=1. Example: formiga watch PickUp-3
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty() and sys.stderr.isatty()):
        raise UnusableFile("watch needs a terminal; for scripts there is formiga tasks --json")
    from formiga_bt.show.watch.app import Dashboard

    place = EngineOptions(site, url, token_file)
    source = _source(place, journal, at)  # no engine, no history: said at once, in words
    colour = not os.environ.pop("NO_COLOR", "") and os.environ.get("TERM") != "dumb"
    for name in ("COLUMNS", "LINES"):  # of a parent, they would count for more than the terminal's own size
        os.environ.pop(name, None)
    app = Dashboard(
        source,
        None if read_only or is_past(source) else RemoteOrders(place, by or user()),
        clock=time.monotonic,
        task=task,
        ascii_only=ascii_only or not can_draw(),
        colour=colour,
    )
    app.run(mouse=False)


def _source(place: "EngineOptions", journal: str, at: str) -> "Source":
    if not (journal or at):
        engine = HttpSource(place)
        with suppress(NoEngine):
            engine.now(count=1)
            return engine
    source = source_of(*place, journal=journal, at=at)
    source.now(count=1)
    return source


def can_draw() -> bool:
    """Return whether stdout takes the characters of the screen."""
    try:
        "●▶│├…".encode(sys.stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


class EngineOptions(NamedTuple):
    """Where the engine is looked for, as the options say it."""

    site: Path | None
    url: str
    token_file: Path | None


class HttpSource:
    """The engine as a `Source`. When it went away it is looked for anew: it may be back at another address."""

    def __init__(self, place: EngineOptions) -> None:
        self._place = place
        self._found: Source | None = None

    def _source(self) -> "Source":
        if self._found is None:
            from formiga_bt.cli.options import connect_source

            self._found = connect_source(*self._place)
        return self._found

    def _ask(self, what: str, *words: Any, **more: Any) -> Any:
        try:
            return getattr(self._source(), what)(*words, **more)
        except NoEngine:
            self._found = None
            raise

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> "Now":
        """Return the site at its instant."""
        found: Now = self._ask("now", first=first, count=count, find=find, over=over)
        return found

    def task(self, task_id: str) -> "TaskPicture":
        """Return one task with its tree."""
        found: TaskPicture = self._ask("task", task_id)
        return found

    def why(self, of: str) -> "tuple[str, list[Because]]":
        """Return how a task or an agent stands, and the chain of causes."""
        found: tuple[str, list[Because]] = self._ask("why", of)
        return found

    def timeline(self, tasks: Sequence[str] = ()) -> "Timeline":
        """Return the actions of some tasks, or of all."""
        found: Timeline = self._ask("timeline", tasks)
        return found

    def chart(self, tasks: Sequence[str] = ()) -> "Chart":
        """Return the site's map."""
        found: Chart = self._ask("chart", tasks)
        return found

    def stats(self, *, task: str = "", hours: float = 0.0) -> "Stats":
        """Return durations with their spread."""
        found: Stats = self._ask("stats", task=task, hours=hours)
        return found

    def blackboard(self, prefix: str = "/") -> "BlackboardFact":
        """Return the keys of the blackboard that begin with this."""
        found: BlackboardFact = self._ask("blackboard", prefix)
        return found


class RemoteOrders:
    """Carries orders over HTTP, as the verbs do: the same routes, the same words."""

    def __init__(self, place: EngineOptions, by: str) -> None:
        self._place, self._by = place, by

    def send(self, order: WatchOrder) -> WatchReply:
        """Send an order, and return what the engine says.

        Raises:
            NoEngine: it does not answer.
        """
        try:
            reply = carry(connect(*self._place), order, self._by)
        except ApiError as error:
            return WatchReply(f"REFUSED: {error}", good=False)
        if isinstance(reply, str):
            return WatchReply(reply)
        missed = any(one.may_be_airborne for one in reply.skipped)
        said = in_words(reply)
        then = following(reply.next, said)
        return WatchReply(said + (f"\nnext: {then}" if then else ""), good=not missed)


def carry(client: Client, order: WatchOrder, by: str) -> "OrderReply | str":
    """Give an order to the engine, and return what it says."""
    match order.verb:
        case "answer":
            return client.answer(order.target, order.how, by=order.by)
        case "abort":
            return client.abort(order.target, by=by)
        case "handback":
            return client.hand_back(order.target, order.how, by=by)
        case "ack":
            return client.acknowledge(order.target, by=by)
        case "clear":
            return client.clear(order.target, by=by)
        case "lockdown" | "release":
            return client.lock_down("return" if order.verb == "lockdown" else "release", by=by)
    match order.kind:
        case "agent":
            return client.order_agent(order.target, order.verb, by=by, confirmed=order.confirmed)
        case "task":
            return client.order_task(order.target, order.verb, by=by)
        case _:
            return client.order_all(order.verb, by=by)
