"""The flight log: one record for each flight, from leaving the ground to standing on it again.

    FlightLog (a listener of the driver; a thread of its own)  ->  flights.jsonl (ended), flying.json (under way)

Each record is on disk before the next step is looked at. Flights under way outlive the engine: after a restart they go on with
the machine's next status, or are closed if it stands on the ground by then. `formiga log export` reads the files.
"""

import csv
import io
import json
import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import SiteError
from formiga_bt.base.geo import Frame, Position
from formiga_bt.base.site_folder import FLIGHTS, FLYING, append_line, read_lines, write_durably
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, StandingOrder, TaskRecord
from formiga_bt.lang.model import Site

BREACH: Final = "envelope."
log = logging.getLogger("formiga.flights")


class Flight(Struct, frozen=True, kw_only=True):
    """One flight. Places are metres from the base station, and degrees.

    Take-off and landing are of the wall clock, ISO, UTC. The duration is of engine time, as the machine lived it: at another
    speed of the clock they differ.
    """

    agent: str
    type: str
    mode: str
    """Of the site: simulation or real."""
    pilot: str = ""
    task: str = ""
    """Id of the task that it started for; empty: it was found in the air."""
    task_name: str = ""
    requester: str = ""
    take_off_utc: str
    take_off_east_m: float | None = None
    take_off_north_m: float | None = None
    take_off_lat_deg: float | None = None
    take_off_lng_deg: float | None = None
    landing_utc: str = ""
    """Empty: it is still in the air."""
    landing_east_m: float | None = None
    landing_north_m: float | None = None
    landing_lat_deg: float | None = None
    landing_lng_deg: float | None = None
    duration_s: float | None = None
    battery_used_percent: float | None = None
    landed_by: str = ""
    """task, recover, order, failsafe, pilot, or unknown."""
    landed_why: str = ""
    """The step's action, the order and who gave it, or what is not known."""
    breaches: tuple[str, ...] = ()
    orders: tuple[str, ...] = ()


COLUMNS: Final = Flight.__struct_fields__


class Open(Struct, frozen=True, kw_only=True):
    """A flight under way, and what is needed to close it."""

    flight: Flight
    at: Micros
    battery: float | None = None
    control: str = "engine"


class LastGround(Struct, frozen=True):
    """How a machine last stood on the ground."""

    left_at: Micros | None
    """When it was first not seen there any more; None: it stands."""
    left_utc: str
    position: Position | None
    battery: float | None


class Flights:
    """The flights that the steps of an engine tell of. No file, no thread: `FlightLog` has those.

    Args:
        site: says the mode, and where the base station is.
        flying: flights that were under way when the former engine ended.
        utc: what a clock on the wall shows at an instant of engine time that is just now, ISO; by itself the engine time.
    """

    def __init__(
        self, site: Site, flying: Mapping[str, Open] | None = None, utc: Callable[[Micros], str] | None = None
    ) -> None:
        self._utc = utc or iso
        self.flying: dict[str, Open] = dict(flying or {})
        self._site = site
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)
        self._ground: dict[str, LastGround] = {}
        self._agents: dict[str, AgentRecord] = {}
        self._tasks: dict[str, TaskRecord] = {}
        self._orders: dict[str, StandingOrder] = {}
        self._goals: dict[str, GoalRecord] = {}

    def take(self, step: EngineStep) -> list[Flight]:
        """Follow a step; return the flights that ended in it."""
        ended = []
        for change in step.changes:
            match change:
                case ch.TaskPut(task):
                    self._task(task)
                case ch.GoalPut(goal):
                    self._goals[goal.id] = goal
                case ch.GoalDrop(goal_id):
                    self._goals.pop(goal_id, None)
                case ch.OrderPut(agent_id, order):
                    self._order(agent_id, order)
                case ch.AgentPut(agent) if not agent.human:
                    found = self._agent(step.at, agent)
                    ended += [found] if found is not None else []
        for effect in step.effects:
            if isinstance(effect, Alarm) and effect.code.startswith(BREACH):
                self._breach(effect.agent, effect.code.removeprefix(BREACH))
        return ended

    def _task(self, task: TaskRecord) -> None:
        if task.section == "done":
            self._tasks.pop(task.id, None)
        else:
            self._tasks[task.id] = task

    def _order(self, agent: str, order: StandingOrder | None) -> None:
        if order is None:
            self._orders.pop(agent, None)
            return
        before = self._orders.get(agent)
        self._orders[agent] = order
        if agent in self.flying and (before is None or before.stop != order.stop):
            self._note(agent, orders=_words(order))

    def _breach(self, agent: str, name: str) -> None:
        if agent in self.flying and name:
            self._note(agent, breaches=name)

    def _note(self, agent: str, **words: str) -> None:
        """Add words to lists of a flight; none twice in a row."""
        now = self.flying[agent]
        lists = {name: getattr(now.flight, name) for name in words}
        new = {name: (*lists[name], word) for name, word in words.items() if lists[name][-1:] != (word,)}
        if new:
            self.flying[agent] = replace(now, flight=replace(now.flight, **new))

    def _agent(self, at: Micros, agent: AgentRecord) -> Flight | None:
        before = self._agents.get(agent.id)
        self._agents[agent.id] = agent
        if agent.breach and (before is None or before.breach != agent.breach):
            self._breach(agent.id, agent.breach.lstrip("!").removeprefix(BREACH))
        if agent.landed == "grounded":
            ended = self._landed(at, agent)
            self._ground[agent.id] = LastGround(None, "", agent.position, agent.battery)
            return ended
        ground = self._ground.get(agent.id)
        if ground is not None and ground.left_at is None:
            self._ground[agent.id] = replace(ground, left_at=at, left_utc=self._utc(at))
        if agent.landed == "airborne" and agent.id not in self.flying:
            self._took_off(at, agent)
        now = self.flying.get(agent.id)
        if now is not None:
            self.flying[agent.id] = self._goes_on(now, agent)
        return None

    def _took_off(self, at: Micros, agent: AgentRecord) -> None:
        ground = self._ground.get(agent.id)
        start = ground or LastGround(at, self._utc(at), agent.position, agent.battery)
        began = start.left_at if start.left_at is not None else at
        flight = Flight(
            agent=agent.id,
            type=agent.type,
            mode=self._site.mode,
            take_off_utc=start.left_utc or self._utc(at),
            **self._place("take_off", start.position),
        )
        self.flying[agent.id] = Open(flight=flight, at=began, battery=start.battery)
        order = self._orders.get(agent.id)
        if order is not None:
            self._note(agent.id, orders=_words(order))

    def _goes_on(self, now: Open, agent: AgentRecord) -> Open:
        task = self._tasks.get(agent.task)
        if task is not None and not now.flight.task:
            told = {"task": task.id, "task_name": task.name, "requester": task.request.by, "pilot": task.agents.pilot}
            now = replace(now, flight=replace(now.flight, **told))
        control = "pilot" if agent.control == "engine" and agent.taken else agent.control
        return now if control == now.control else replace(now, control=control)

    def _landed(self, at: Micros, agent: AgentRecord) -> Flight | None:
        now = self.flying.pop(agent.id, None)
        if now is None:
            return None
        by, why = self._why(now, agent)
        used = None if now.battery is None or agent.battery is None else round(max(0.0, now.battery - agent.battery), 1)
        return replace(
            now.flight,
            landing_utc=self._utc(at),
            **self._place("landing", agent.position),
            duration_s=round(max(0, at - now.at) / 1e6, 1),
            battery_used_percent=used,
            landed_by=by,
            landed_why=why,
        )

    def _why(self, now: Open, agent: AgentRecord) -> tuple[str, str]:
        """Return who or what brought a machine down, and how."""
        if now.control in ("pilot", "failsafe"):
            return now.control, ""
        goal = self._goals.get(agent.goal)
        order = self._orders.get(agent.id)
        if order is not None and (goal is None or goal.task == order.task or goal.id == order.goal):
            return "order", _words(order)
        if goal is None:
            return "unknown", "" if agent.liveness == "ALIVE" else "it was not heard of"
        task = self._tasks.get(goal.task)
        if task is not None and task.system.stop:
            return "order", task.system.stop
        if goal.section.startswith("recover"):
            return "recover", f"{goal.action}, {goal.task}"
        return ("task" if goal.task else "order"), goal.action

    def _place(self, what: str, position: Position | None) -> dict[str, Any]:
        if position is None:
            return {}
        lat, lng = self._frame.lat_lng(position)
        return {
            f"{what}_east_m": position.east_m,
            f"{what}_north_m": position.north_m,
            f"{what}_lat_deg": round(lat, 7),
            f"{what}_lng_deg": round(lng, 7),
        }


def _words(order: StandingOrder) -> str:
    why = f" ({order.why})" if order.why else ""
    return f"{order.stop} by {order.by or order.scope}{why}"


class FlightLog:
    """Keeps the flights of an engine in its site's runtime folder.

    Args:
        folder: the runtime folder.
        site: the site.
        utc: what the clock on the wall shows now, as ISO text; it is given the engine time.

    Raises:
        SiteError: the files of the former start cannot be read.
    """

    def __init__(self, folder: Path, site: Site, utc: Callable[[Micros], str] | None = None) -> None:
        self._folder = folder
        self._flights = Flights(site, flying(folder), utc or on_the_wall)
        self._kept = dict(self._flights.flying)
        self._ended: list[Flight] = []
        """Not on disk yet."""
        self._is_reported = False
        self._queue: SimpleQueue[EngineStep | None] = SimpleQueue()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start to follow."""
        self._thread = threading.Thread(target=self._run, name="formiga-flights", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Follow what is queued, then end."""
        self._queue.put(None)
        if self._thread is not None:
            self._thread.join(5.0)

    def feed_step(self, step: EngineStep) -> None:
        """Take a step; returns at once."""
        self._queue.put(step)

    def _run(self) -> None:
        while (step := self._queue.get()) is not None:
            try:
                self._keep(self._flights.take(step))
            except SiteError as error:  # a full disk, say: told once, tried again with each step
                if not self._is_reported:
                    log.error("the flight log waits to be written: %s", error)
                self._is_reported = True
            except Exception:  # a bug here may not end the log of all later flights
                log.exception("the flight log missed step %s", step.seq)

    def _keep(self, ended: Iterable[Flight]) -> None:
        self._ended += ended
        while self._ended:
            append_line(self._folder / FLIGHTS, msgspec.to_builtins(self._ended[0]))
            self._ended.pop(0)
        if self._flights.flying != self._kept:
            now = dict(self._flights.flying)
            write_durably(self._folder / FLYING, msgspec.json.encode(now).decode() + "\n")
            self._kept = now
        self._is_reported = False


def flying(folder: Path) -> dict[str, Open]:
    """Return the flights under way, as the file tells.

    Raises:
        SiteError: the file cannot be read.
    """
    file = folder / FLYING
    try:
        return msgspec.json.decode(file.read_bytes(), type=dict[str, Open]) if file.exists() else {}
    except (OSError, msgspec.MsgspecError) as error:
        raise SiteError(f"cannot read {file}: {error}", help="if it is damaged beyond repair, delete it") from error


def flights(folder: Path, since: str = "") -> list[Flight]:
    """Return the flights of a site, the ended ones first, then those under way; each by its take-off.

    Args:
        folder: the runtime folder.
        since: only those that took off at this ISO instant or later; without a zone it is UTC.

    Raises:
        SiteError: the files cannot be read.
        ValueError: `since` is no ISO instant.
    """
    found = [msgspec.convert(line, Flight) for line in read_lines(folder / FLIGHTS)]
    found += [now.flight for now in flying(folder).values()]
    first = instant(since) if since else None
    return [f for f in found if first is None or instant(f.take_off_utc) >= first]


def instant(text: str) -> datetime:
    """Return the instant of an ISO text; without a zone it is UTC.

    Raises:
        ValueError: it is none.
    """
    at = datetime.fromisoformat(text)
    return at if at.tzinfo is not None else at.replace(tzinfo=UTC)


def as_csv(found: Iterable[Flight]) -> str:
    """Return flights as CSV; units stand in the heads, lists are joined by `; `."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for flight in found:
        writer.writerow([_cell(getattr(flight, name)) for name in COLUMNS])
    return out.getvalue()


def as_json(found: Iterable[Flight]) -> str:
    """Return flights as a JSON list."""
    return json.dumps([msgspec.to_builtins(f) for f in found], indent=2, ensure_ascii=False) + "\n"


def _cell(value: Any) -> Any:
    if isinstance(value, tuple):
        value = "; ".join(value)
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@"):
        return f"'{value}"  # a spreadsheet must not take a name for a formula
    return "" if value is None else value


def on_the_wall(_: Micros) -> str:
    """Return what the clock on the wall shows now, whatever the engine time is."""
    return iso(time.time_ns() // 1000)


def iso(at: Micros) -> str:
    """Return an instant, microseconds since 1970, as ISO text, UTC, to a millisecond."""
    return datetime.fromtimestamp(at / 1e6, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
