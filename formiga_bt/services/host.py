"""Everything of one running engine: its site's folder, driver, wires, desk, view and API. `formiga up` is a shell around it.

Start and end are in one order: what others rely on comes first and goes last. Ending leaves agents flying: their goals go on,
as they would if the process were killed.
"""

import logging
import os
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec.structs import replace

from formiga_bt import __version__
from formiga_bt.base.accounts import AccountBook
from formiga_bt.base.clock import passed_us
from formiga_bt.base.endpoints import is_loopback
from formiga_bt.base.errors import FormigaError, SiteError, TaskError
from formiga_bt.base.site_folder import APPROVALS, DISCOVERED, FLEET, SiteFolder
from formiga_bt.engine.drivers.failpoints import Failpoint
from formiga_bt.engine.drivers.realtime import Listener, RealtimeDriver, stop_words
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.goals.epochs import TAKE_BACK, next_epoch
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, HouseState, Resumed, Started, Trouble
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.restart.resume import copy_of
from formiga_bt.lang.growing import growing
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.services import beginning, crew, discovered, members
from formiga_bt.services.answering import Answering
from formiga_bt.services.calling import Caller
from formiga_bt.services.clocked import Clocked
from formiga_bt.services.collector import uncollected
from formiga_bt.services.duplicate_people import OneEach
from formiga_bt.services.feed import Feed
from formiga_bt.services.http import api, server
from formiga_bt.services.http.audit import Audit
from formiga_bt.services.http.connection import Connection
from formiga_bt.services.http.crowd import Crowd, descriptors, http_places, local_places
from formiga_bt.services.http.local import close_local, open_local
from formiga_bt.services.http.past_routes import PastReader
from formiga_bt.services.http.proving import Proofs
from formiga_bt.services.journal_watch import JournalWatch
from formiga_bt.services.kept.attachments import AttachmentStore
from formiga_bt.services.kept.bundles import BundleStore
from formiga_bt.services.kept.flightlog import FlightLog
from formiga_bt.services.kept.journaling import JournalAt, Journaling
from formiga_bt.services.kept.recalling import Recall
from formiga_bt.services.kept.resuming import Comeback, Pulse
from formiga_bt.services.listening import make_wires
from formiga_bt.services.loading import Loading, served_again
from formiga_bt.services.news.desk import NewsDesk
from formiga_bt.services.not_served import NotServed
from formiga_bt.services.order_taker import PersonalOrders
from formiga_bt.services.orders import ServiceOrders
from formiga_bt.services.pace import Pace
from formiga_bt.services.paper import PaperServices
from formiga_bt.services.standing import lockdown_fact, wall_us
from formiga_bt.services.standing_alarms import StandingAlarms, clock_check, machine_clock_check
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import Alive, EngineHealth, EngineLoad, StandingFact
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.offset import offset_words
from formiga_bt.show.source import Source
from formiga_bt.transport.base import AgentTransport, CarriesFiles, Listening, Secured
from formiga_bt.transport.desk import DeskTransport

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine

log = logging.getLogger("formiga.host")
STANDS_S: Final = 15.0
"""An engine whose thread has not begun a turn for so long does not work."""
DEAD: Final = frozenset({"failed", "stands_still"})
"""Causes for which an engine is to be started anew; one that ends is left to end."""


class EngineHost:
    """One engine as a service; a context manager.

    Args:
        site, catalogue, tasks: what the engine is made of.
        beside: the folder of the site file; the runtime folder lies in it.
        speed: engine seconds per wall second. In mode real it is 1 (`formiga up` takes no other), and engine time follows the
            wall clock; a test may rehearse a real site at another speed, on a clock of its own.
        http: `host:port` of the API; port 0 takes a free one.
        desk: people who answer at this engine: id -> agent type.
        listen: where agents connect; default: what the site says. Beyond this machine only by TLS.
        keys: the site's folder of keys; default: what the site says. With it a router of its own listens (`formiga router`).
        refused: task files that are not served.
        needs_token: ask for the token on the loopback too. In mode real it is asked for everywhere.
        wires: other transports instead of those that the site names.
        listeners: called in the driver's thread after each step; they must only enqueue.
        journal: which journal is kept; None = none.
        texts: the files that the tasks were read from, by task; under `SITE_FILES` those of the site: path -> text.
        failpoint: where this engine kills itself, to test what follows a crash.
        start_anew: begin a new history; what there is of another one is set aside, nothing is deleted.
        metrics: show the engine's figures beyond this machine, too.

    Raises:
        JournalError: the journal cannot be used.
        SiteError: another engine has the site, a port is taken, the runtime folder cannot be used, or the agents' wire would be
            open to others.
        TransportError: the agents' wire cannot be opened.
    """

    def __init__(
        self,
        site: Site,
        catalogue: Catalogue,
        tasks: Mapping[str, Task],
        *,
        beside: Path,
        speed: float = 1.0,
        http: str = server.DEFAULT_HTTP,
        desk: Mapping[str, str] | None = None,
        listen: str = "",
        keys: Path | None = None,
        refused: Sequence[NotServed] = (),
        needs_token: bool = False,
        wires: Sequence[AgentTransport] | None = None,
        listeners: Sequence[Listener] = (),
        journal: JournalAt | None = None,
        texts: Mapping[str, Mapping[str, str]] | None = None,
        failpoint: Failpoint | None = None,
        start_anew: bool = False,
        metrics: bool = False,
    ) -> None:
        self.site = site
        self.refused = tuple(refused)
        self.error: BaseException | None = None
        self._catalogue = growing(catalogue)
        self._tasks = Bundles(tasks)
        self._speed = speed
        self._http = http
        self._listeners = tuple(listeners)
        is_beyond = not is_loopback(server.read_address(http)[0])
        self.needs_token = needs_token or is_beyond or site.mode == "real"
        """Whether each request must bring the site's token; what stops something is taken at the local door without."""
        self.shows_metrics = metrics or not is_beyond
        self._desk_types = dict(desk or {})
        self._desk = DeskTransport(now=passed_us, boot_id=f"desk-{time.time_ns()}")
        self._wires: list[AgentTransport] = make_wires(site, listen, keys) if wires is None else list(wires)
        self._beside = beside
        self._trees = beside / "trees"
        self._folder = SiteFolder(beside, site.name)
        self._store = BundleStore(self._folder.path)
        self.attachments = AttachmentStore(self._folder.path)
        """The bytes of attachments that agents name."""
        for wire in self._wires:
            if isinstance(wire, CarriesFiles):
                wire.keep_files(self.attachments)
        self.proofs = Proofs(self._folder.path, site)
        self.journaling = Journaling(
            self._folder, site.name, journal, self._keep, start_anew=start_anew, outbox=bool(site.news)
        )
        self._texts = dict(texts or {})
        self._failpoint = failpoint
        self._servers: list[server.HttpServer] = []
        self._doors: dict[str, Crowd[Connection]] = {}
        self.local_door = ""
        """Path of the Unix socket, or why there is none."""
        self._stop = threading.Event()
        self._opened: list[Any] = []
        self._back: Comeback | None = None
        self._follow: dict[str, int] = {}
        """Agent -> the epoch that it follows, as it last said."""
        self._engine_id = ""
        self.draining = False
        self.restored: list[str] = []
        """What people should know of tasks that were loaded before this start, in sentences."""
        self.with_simulated = False
        """Whether simulated agents were started with this engine, and end with it."""

    def __enter__(self) -> "EngineHost":
        try:
            with uncollected():
                self._start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- start and end ---------------------------------------------------------------------------------------------
    def _start(self) -> None:
        self._folder.take()
        self._opened.append(self._folder.release)
        sock = server.listen(self._http)
        self._opened.append(sock.close)
        local, self.local_door = open_local(self._folder.path)
        if local is not None:
            self._opened.append(lambda: close_local(local, self.local_door))
        else:
            log.warning("no local door: %s", self.local_door)
        token = self._folder.token()
        self._opened.append(self.journaling.close)
        self.journaling.open()
        now_us, counters = self._folder.marks()
        self.epoch = self._last_epoch = self.journaling.take()
        self._engine_id = self._folder.engine_id()
        discovered.restore(self._folder.path, self._catalogue, self.site)
        self._restore_tasks()
        served = dict(self._tasks)
        listed = members.with_added(self.site, self._folder.path)
        self._back = self.journaling.find_comeback(self._tasks, listed, self._catalogue, now_us, counters)
        back = self._back
        self.view = EngineView(self.epoch, state=copy_of(back.state) if back is not None else None)
        flights = FlightLog(self._folder.path, self.site)
        state = self.journaling.first_state(now_us, counters) if back is None else back.state
        start_at = beginning.begin_at(self.site, state.now, back)
        self._folder.reserve(state.counters, state.now)
        engine = Engine(
            self.site, self._catalogue, self._tasks, state=state, resumes=back is not None,
            without=back.without if back is not None else (), look=back.blame.look if back is not None else None,
        )  # fmt: skip
        fails = self._failpoint
        history = self.journaling.journal
        self.news = NewsDesk(
            self.site, self._beside, engine_id=self._engine_id, began=state.seq, marks=state.news,
            read=None if history is None else lambda seq, urgent, most: history.news(seq, urgent=urgent, most=most),
            note=lambda given: self.driver.post(given), keep=lambda given: self.driver.ask(given),
            now=lambda: self.driver.now(),
        )  # fmt: skip
        once = [OneEach(wire, self._desk_types) for wire in self._wires]
        wires: list[AgentTransport] = [self._desk, *once]
        self.driver = RealtimeDriver(
            engine,
            wires if fails is None else [fails.wire(wire) for wire in wires],
            speed=self._speed,
            epoch=self.epoch,
            engine_id=self._engine_id,
            listeners=[
                self.view.feed_step, flights.feed_step, self.news.feed_step,
                *([back.blame.take] if back is not None else []), *self._listeners,
            ],
            persist=self.journaling if fails is None else fails.persist(self.journaling, lambda: engine.state),
            first=self._first(back, engine) if back is not None else None,
            start_at=start_at,
            follows_wall=beginning.follows_wall(self.site) and self._speed == 1.0,
        )  # fmt: skip
        if fails is not None and self.journaling.journal is not None:
            self.journaling.journal.in_snapshot = lambda: fails.passing("in_snapshot")
        self.journaling.begin(lambda: engine.state, self.driver.now)
        self.journaling.keep_read(served, self._texts)
        self._answering = Answering(self._desk, lambda: self.driver.kept_seq)
        self.driver.listeners.append(self._answering.feed_step)
        self.driver.listeners.append(self._note_held)
        self.orders = ServiceOrders(
            self.driver, self.view, self._desk, self.site, self._tasks, self._catalogue, answering=self._answering,
            refused=self.refused, trees=self._trees,
        )  # fmt: skip
        self.loading = Loading(self.orders.ask, self.view, self.site, self._catalogue, self._tasks, self._store)
        self.loading.closed_for = lambda: self.orders.closed_for
        self.loading.keep = self.journaling.keep_loaded
        self.recall = Recall(self.view, self._time_machine)
        self._opened.append(self.recall.close)
        self.view.recall = self.recall
        self.source: Source = FoldedSource(
            self.view.ledger, self.site, self._tasks, self._catalogue,
            desk=lambda: tuple(self.orders.desk_people), engine=lambda: self.status, clock=self.driver.now,
            wall=wall_us, speed=self.driver.speed, lock=self.view.lock, recall=self.recall,
            ahead=lambda: self.driver.clock.ahead_us,
        )  # fmt: skip
        self.past = PastReader(lambda: self.journaling.word, self.site.name)
        self._opened.append(self.past.close)
        orders = PersonalOrders(self.driver, self.view, self.proofs)
        self.crew = crew.Crew(orders, self.view, self.site, self._tasks, self._catalogue)
        self.members = members.Members(self._folder.path, orders, self.view, self.site)
        self.catalogue = discovered.CatalogueOrders(orders, self.view, self.site, self._catalogue)
        for person, kind in self._desk_types.items():
            self._desk.add_person(person, kind)
            self.orders.desk_people.add(person)
        self._accounts, self._audit = AccountBook(self._folder.path), Audit(self._folder.path)
        self._pace = Pace()
        self._opened.append(self._audit.close)
        self.calls = Caller(PaperServices(self.orders, self.view, self.site), self._accounts, self._audit, self._pace)
        self.calls.serve(self.site, self._wires)
        self.view.start()
        self._opened.append(self.view.stop)
        flights.start()
        self._opened.append(flights.stop)
        self.house = StandingAlarms(
            self._tell_house,
            [
                clock_check(self.driver.clock),
                machine_clock_check(self.driver.clock),
                self._set_aside,
                self.proofs.troubles,
                self.news.troubles,
                *(wire.troubles for wire in once),
                self._wire_troubles,
            ],
        )
        self._opened.append(self.house.stop)
        self._opened.append(self._stop_server)
        self._opened.append(self._stop_driver)  # first: requests that wait for it are answered, then the server ends
        self._opened.append(self.news.stop)  # before the driver, which takes how far the channels have come
        self.driver.start()
        self.news.start()
        self.pulse = Pulse(
            self._folder.path,
            self.driver.now,
            lambda: self.driver.speed,
            lambda: engine.state,
            lambda: self.journaling.written,
        )
        if self.journaling.journal is not None:
            self.pulse.start()
        watch = JournalWatch(lambda: self.journaling.is_changed, self.driver.look_again)
        self._opened.append(watch.stop)
        watch.start()
        for version in back.newer if back is not None else ():
            self._tasks.serve(served[version.task])
            self.driver.ask(version)
        for version in self.loading.first():
            self.driver.ask(version)
        crew.restore(self._folder.path, self.driver)
        members.restore(self._folder.path, self.driver)
        self._folder.keep_private()  # the journal's files are there now
        self._serve(sock, local, token)
        self.house.start()
        self.address = self._folder.publish(
            epoch=self.epoch, url=self._servers[-1].url, endpoint=self.endpoint,
            socket=self.local_door if local is not None else "",
        )  # fmt: skip

    def _serve(self, sock: socket.socket, local: socket.socket | None, token: str) -> None:
        """Serve both doors: HTTP, and the local one, if there is one."""
        app, limit = api.application(self), descriptors()
        for one, places in ((local, local_places(limit)), (sock, http_places(limit))):
            if one is not None:
                crowd: Crowd[Connection] = Crowd(places)
                self._doors["local" if one is local else "http"] = crowd
                door = api.guarded(
                    app, token=token, needs_token=self.needs_token, accounts=self._accounts, audit=self._audit, pace=self._pace,
                    crowd=crowd, is_local=one is local, alive=self.alive,
                )  # fmt: skip
                clocked = Clocked(door, lambda: self.driver.clock.ahead_us)
                self._servers.append(server.HttpServer(clocked, one, crowd))
                self._servers[-1].start()

    def _first(self, back: Comeback, engine: Engine) -> Resumed:
        revoked = crew.taken_back(self._folder.path, back.state.approvals)
        return replace(back.first(self.epoch, engine.unbuilt), taken_back=revoked)

    def _restore_tasks(self) -> None:
        """Serve what was loaded into the engine before, besides the task files of this start."""
        store = self._store
        listed = members.with_added(self.site, self._folder.path)
        found, self.restored = served_again(store, self._tasks, listed, self._catalogue)
        loaded = store.served()
        for name, task in found.items():
            self._tasks.serve(task)
            self.journaling.keep_again(task, loaded[name])

    def _time_machine(self) -> "TimeMachine":
        from formiga_bt.show.replay.machine import TimeMachine  # loads SQLAlchemy

        assert self.journaling.word is not None, "what is from an earlier start is from a journal"
        return TimeMachine(self.journaling.word, self.site.name)

    def _keep(self, step: EngineStep) -> None:
        for line in crew.lines_of(step):
            self._folder.add_line(APPROVALS, line)
        for line in members.lines_of(step):
            self._folder.add_line(FLEET, line)
        for line in discovered.lines_of(step):
            self._folder.add_line(DISCOVERED, line)
        for change in step.changes:
            if isinstance(change, ch.CounterSet):
                self._folder.counted(change.name, change.value, step.at)
            elif isinstance(change, ch.AgentPut):
                self._note_follower(change.agent)

    def _note_held(self, step: EngineStep) -> None:
        """Once it is in the journal that all of a restored site is HELD, later starts are as any other."""
        if isinstance(step.input, Resumed | Started) and self._folder.was_restored and self.driver.kept_seq >= step.seq:
            try:
                self._folder.forget_restored()
            except SiteError as error:  # then the next start holds everything once more
                log.warning("%s", error)

    def _note_follower(self, agent: AgentRecord) -> None:
        """Note which epoch an agent follows, if it is one of this engine's."""
        ours = agent.engine_id in ("", self._engine_id)
        if ours and agent.epoch != self._follow.get(agent.id, self.epoch):
            self._follow[agent.id] = agent.epoch
            self._prepare_next_start()

    def _prepare_next_start(self) -> None:
        """Let the next start have an epoch that the agents accept: some follow an engine of a higher one."""
        last = next_epoch(self.epoch, self._follow.values()) - 1
        if last == self._last_epoch:
            return
        self._last_epoch = last
        try:
            self._folder.raise_epoch(last)
        except SiteError as error:
            log.warning("the next start may have too low an epoch: %s", error)

    def _stop_driver(self) -> None:
        self.driver.stop()
        self._answering.close()
        self.error = self.driver.error
        if hasattr(self, "pulse"):
            self.pulse.stop()
        core = self.driver.engine.core
        is_bug = self.error is not None and not isinstance(self.error, FormigaError)
        if is_bug and self._back is not None and core.state.resume is not None and core.at_work:
            self._back.blame.count(core.at_work)
        try:
            self._folder.settle(self.driver.now())
        except SiteError as error:  # what was set aside is passed over then
            log.warning("the runtime folder was left as it was: %s", error)
        self.journaling.end()

    def _stop_server(self) -> None:
        self.view.feed.close()  # readers of the event stream would keep the server waiting
        for served in self._servers:  # all at once, for each takes some tenths of a second
            served.ask_to_stop()
        for served in self._servers:
            served.stop()

    def close(self) -> None:
        """End; may be called twice. Agents go on with the goals they have."""
        if hasattr(self, "orders"):
            self.orders.closed_for = "stopping"
        self._stop.set()
        while self._opened:
            self._opened.pop()()

    @property
    def resumed(self) -> list[str]:
        """Return what people should know of what was resumed, in sentences."""
        return self._back.told(self.site) if self._back is not None else []

    @property
    def clock_text(self) -> str:
        """Return how the clock of all times that are shown stands to the wall clock, in words; empty: they are the same."""
        speed, off = self.driver.speed, offset_words(self.driver.clock.ahead_us)
        parts = [] if speed == 1.0 else [f"engine time runs {speed:g} times as fast as the wall clock"]
        if off:
            end = "" if self.site.mode == "real" else "; to end that: formiga up --start-anew"
            parts.append(f"engine time is {off}{end}")
        return "; ".join(parts)

    @property
    def desk(self) -> DeskTransport:
        """Return the people who answer at this engine."""
        return self._desk

    # -- while it runs ---------------------------------------------------------------------------------------------
    def _tell_house(self, troubles: tuple[Trouble, ...]) -> None:
        """Hand the engine what is wrong with its own house; it has alarms of it."""
        self.driver.post(HouseState(troubles))

    @property
    def set_aside(self) -> list[str]:
        """Return which files of the runtime folder could not be used, and what follows, in sentences."""
        return [one.text for one in self._set_aside()]

    def _set_aside(self) -> list[Trouble]:
        found = {**self._folder.unusable, **self._store.unusable}
        return [Trouble("set_aside", name, text) for name, text in sorted(found.items())]

    def _wire_troubles(self) -> list[Trouble]:
        return [Trouble(*one) for wire in self._wires if isinstance(wire, Secured) for one in wire.troubles()]

    def _house_facts(self) -> tuple[StandingFact, ...]:
        """Return what is wrong with the engine's own house, as pictures show it."""
        found = self.house.standing if hasattr(self, "house") else ()
        return tuple(
            StandingFact(code=one.trouble.code, subject=one.trouble.subject, text=one.trouble.text, since=one.since)
            for one in found
        )

    @property
    def feed(self) -> Feed:
        """Return the feed of events."""
        return self.view.feed

    @property
    def endpoint(self) -> str:
        """Return where agents connect."""
        return next((wire.endpoint for wire in self._wires if isinstance(wire, Listening)), "")

    @property
    def runtime_folder(self) -> Path:
        """Return the site's runtime folder."""
        return self._folder.path

    @property
    def served(self) -> list[str]:
        """Return the names of the tasks that can be requested."""
        return sorted(self._tasks)

    def open_tasks(self) -> list[str]:
        """Return the tasks that have not ended."""
        with self.view.reading() as state:
            return [task.id for task in state.tasks.values() if task.section != "done"]

    def is_over(self) -> bool:
        """Return whether to end: asked to, drained, or the engine met a bug."""
        if self.driver.error is not None:
            return True
        return self._stop.is_set() or (self.draining and not self.open_tasks())

    def wait(self, seconds: float) -> None:
        """Sleep, but no longer than until a stop is asked for."""
        self._stop.wait(seconds)

    def check(self) -> None:
        """Tell of a bug that ended the engine.

        Raises:
            FormigaError: there was one.
        """
        error = self.driver.error or self.error
        if error is not None:
            raise FormigaError(stop_words(error)) from error

    def abort_all(self, by: str) -> int:
        """Abort every task that is not ending yet; return how many were told to end."""
        self.orders.closed_for = "stopping"
        told = 0
        for task_id in self.open_tasks():
            try:
                self.driver.ask(Abort(task_id, by=by))
                told += 1
            except TaskError:
                continue  # it is ending already, which is what was wanted
        self.draining = True
        return told

    # -- what the API orders -----------------------------------------------------------------------------------------
    def drain(self) -> str:
        """Admit nothing more; end when all tasks have."""
        self.draining = True
        self.orders.closed_for = self.orders.closed_for or "draining"
        left = len(self.open_tasks())
        if not left:
            return "the engine ends"
        return f"no more tasks are admitted; the engine ends with the last of {count(left, 'open task')}{self.kept}"

    def request_stop(self) -> str:
        """End now; agents go on with what they do, simulated ones of this engine end."""
        self.orders.closed_for = "stopping"
        left = len(self.open_tasks())
        self._stop.set()
        return "the engine ends" + (
            f"; {count(left, 'task')} {'is' if left == 1 else 'are'} left, {self.fate}" if left else ""
        )

    @property
    def kept(self) -> str:
        """Return that lockdown keeps tasks from ending, if it stands; empty otherwise."""
        with self.view.reading() as state:
            stands = state.lockdown is not None
        return "; lockdown keeps them from ending: formiga lockdown release" if stands else ""

    @property
    def fate(self) -> str:
        """Return what becomes of the agents of tasks that are left."""
        if self.with_simulated:
            return "the simulated agents end too"
        return "their agents go on with the goals they have"

    @property
    def status(self) -> str:
        """Return how the engine stands: ok, overloaded, draining, deposed, stopping or failed."""
        if self.driver.error is not None:
            return "failed"
        if self._stop.is_set():
            return "stopping"
        # Without the view's lock: the doors' own threads ask, which must not wait for who reads a large page.
        deposed = self.view.state.counters.get("deposed", 0) > 0
        if deposed or self.draining:
            return "deposed" if deposed else "draining"
        return "overloaded" if self.driver.is_behind else "ok"

    def alive(self) -> Alive:
        """Return whether the engine works, for whoever starts it anew if it does not."""
        causes = self._causes()
        return Alive(alive=not DEAD & {*causes}, status=self.status, causes=causes)

    def _causes(self) -> tuple[str, ...]:
        found = [self.status] if self.status != "ok" else []
        if self.driver.error is None and self.driver.statistics().stands_s > STANDS_S:
            found.append("stands_still")
        if self.journaling.stands != "ok":
            found.append(f"journal_{self.journaling.stands}")
        if self.view.state.lockdown is not None:
            found.append("lockdown")
        return tuple(dict.fromkeys([*found, *(one.code for one in self._house_facts())]))

    def crowds(self) -> dict[str, int]:
        """Return how many connections each door has."""
        return dict(zip(self._doors, map(len, self._doors.values()), strict=True))

    def health(self) -> EngineHealth:
        """Return how the engine is."""
        failed = self.driver.error is not None
        status, load = self.status, self.driver.statistics()
        with self.view.reading() as state:
            tasks: dict[str, int] = {}
            for task in state.tasks.values():
                tasks[task.status] = tasks.get(task.status, 0) + 1
            agents: dict[str, int] = {}
            for agent in state.agents.values():
                word = "people" if agent.human else agent.pool
                agents[word] = agents.get(word, 0) + 1
            return EngineHealth(
                status=status,
                site=self.site.name,
                mode=self.site.mode,
                version=__version__,
                epoch=self.epoch,
                pid=os.getpid(),
                speed=self.driver.speed,
                endpoint=self.endpoint,
                at=self.driver.now(),
                ahead_us=self.driver.clock.ahead_us,
                steps=state.seq,
                tasks=tasks,
                agents=agents,
                lockdown=lockdown_fact(state, self.driver.now()),
                questions=sum(q.reply is None for q in state.questions.values()),
                alarms=tuple(self.view.alarms)[-10:],
                house=self._house_facts(),
                load=EngineLoad(
                    waiting=load.inbox.waiting,
                    most_waiting=load.inbox.most,
                    replaced=load.inbox.replaced,
                    behind_s=load.behind_s,
                ),
                journal=self.journaling.stands,
                causes=self._causes(),
                text=repr(self.driver.error) if failed else TAKE_BACK if status == "deposed" else "",
            )


def count(number: int, noun: str) -> str:
    """Return how many there are, in words."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
