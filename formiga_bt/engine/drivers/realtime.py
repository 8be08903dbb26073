"""The realtime driver: one thread that feeds the engine, over real transports and a real clock.

Engine time starts at max(wall clock, what was journaled last) and never goes back. Then it follows the monotonic clock times
the speed, or (mode real) approaches the wall clock (`clock.EngineClock`). Liveness, cancels and heartbeats are wall time and do
not scale with the speed.

Steps that come within a few milliseconds are one batch: they are persisted together, then their effects leave in order, and
only then listeners and callers are told. A batch never waits for a step that is not there yet. While the disk is waited for, a
busy engine goes on with the next batch (`persist.Ahead`).

All that is judged in a turn of the loop is judged by the time at its beginning. Between two turns the driver looks whether it
stood still itself: the process was stopped, the machine slept, a step or a commit took long. Then `Outage` goes before
all else, and what was to leave before it and did not, leaves no more.
"""

import heapq
import logging
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import SECOND, EngineClock, Micros, passed_us, wall_clock_us
from formiga_bt.base.durations import DurationCounts, Durations
from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.engine.drivers.inbox import MOST_REQUESTS, Inbox, InboxLoad
from formiga_bt.engine.drivers.persist import DURABLE, Ahead, Outcome, Persist, PersistAhead
from formiga_bt.engine.drivers.waiting import CALLER, Waiter, never_expires, refusal_of_old, since_boot
from formiga_bt.engine.drivers.wiring import Switchboard
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.journal_levels import LEVELS
from formiga_bt.engine.kernel.replies import Accepted, Done, Refusal, Reply, granted
from formiga_bt.engine.kernel.timers import LiveDue, WallTimer
from formiga_bt.engine.restart.journal_backpressure import LACKS, begins_something
from formiga_bt.engine.tasks.wake_queue import REST
from formiga_bt.lang.model import Catalogue
from formiga_bt.transport.base import AgentTransport
from formiga_bt.transport.messages import ClockBeat

TOP_SPEED = 20.0
"""60 s of a clearance must be at least 3 s of wall time for the people asked."""
STOP_S = 10.0
"""A thread that does not end within this is left behind."""
BATCH_US = 10_000
"""Steps of so long are persisted together."""
TIMERS_A_TURN = 64
"""So many deadlines that are due are given before the inbox has its turn."""
BEHIND_US: Final[Micros] = 2 * SECOND
"""An engine whose deadlines are given so late (engine time) for `BEHIND_FOR_US` is overloaded, which is an alarm."""
BEHIND_FOR_US: Final[Micros] = SECOND
"""Wall time: what one long step leaves behind is made up sooner."""
BEHIND_WALL_US: Final[Micros] = SECOND // 2
"""At a high speed engine time passes quickly: to be overloaded is to be late by so much wall time, too."""
KEEPS_UP: Final = 4
"""One whose deadlines are late by less than a fourth of that has caught up."""

STANDSTILL_US: Final[Micros] = 3 * SECOND
"""The engine stood still for so long: at most. It is as long as the shortest silence after which a machine is not trusted, and
half that after which it is lost: a shorter standstill makes nobody silent."""
LEAST_STANDSTILL_US: Final[Micros] = SECOND // 2
"""So long a busy computer may let its processes wait."""

Listener = Callable[[inp.EngineStep], None]
Batch = list[tuple[inp.EngineStep, "Future[Reply | None] | None", Micros]]
"""Steps, each with whoever waits for its reply, and when it was made."""
log = logging.getLogger("formiga.driver")


def standstill_us(catalogue: Catalogue) -> Micros:
    """Return how long an engine must have stood still for its agents to be asked; wall time."""
    machines = [kind for kind in catalogue.types.values() if not kind.human]
    silences = [silence for kind in machines for silence in (kind.suspect_after_us, kind.lost_after_us // 2)]
    return max(LEAST_STANDSTILL_US, min(STANDSTILL_US, *silences))


def _check_speed(speed: float) -> None:
    if not 0.0 < speed <= TOP_SPEED:
        raise ValueError(f"speed must be above 0 and at most {TOP_SPEED:g} (people are asked), got {speed:g}")


class EngineStopped(FormigaError):  # noqa: N818 - it names the state
    """The driver was stopped, or the engine met a bug and stopped; the text says which."""


class DriverLoad(Struct, frozen=True):
    """How far a driver keeps up."""

    inbox: InboxLoad
    behind_s: float
    """How late the earliest deadline is, engine time; 0 = it keeps up. Meanwhile inputs bear the time of that deadline."""
    stands_s: float
    """How long its thread has not begun a turn that it was to begin, wall time."""
    steps: DurationCounts
    """How long steps of the engine took."""
    beats: DurationCounts
    """How late the clock's beats left."""


def stop_words(error: BaseException) -> str:
    """Return why an engine stopped: what it cannot go on with, or that it met a bug."""
    return (
        f"the engine stopped: {error}" if isinstance(error, FormigaError) else f"the engine stopped by a bug: {error!r}"
    )


class RealtimeDriver:
    """Runs an engine in its own thread.

    Args:
        engine: the engine; nobody else may touch it while the driver runs.
        transports: the wires.
        speed: engine seconds per wall second, above 0 and at most 20.
        epoch: of this start of the engine on its site.
        engine_id: which engine this is, the same after a restart; agents keep to it.
        listeners: called in the driver's thread after each step is persisted; they must only enqueue.
        persist: keeps steps before their effects leave.
        first: the engine's first input; by default `Started`.
        start_at: engine time does not begin before it.
        follows_wall: engine time approaches the wall clock (mode real); the speed is 1 then.
    """

    def __init__(
        self,
        engine: Engine,
        transports: Sequence[AgentTransport],
        *,
        speed: float = 1.0,
        epoch: int = 1,
        engine_id: str = "",
        listeners: Sequence[Listener] = (),
        persist: Persist | None = None,
        first: inp.Input | None = None,
        start_at: Micros = 0,
        follows_wall: bool = False,
    ) -> None:
        _check_speed(speed)
        assert speed == 1.0 or not follows_wall, "a clock that follows the wall clock has no speed"
        self.engine = engine
        self.switchboard = Switchboard(transports, engine_id)
        engine.core.engine_id = self._engine_id = engine_id
        self.listeners = list(listeners)
        self.error: BaseException | None = None
        self._persist = persist
        self._ahead: Ahead[Batch] | None = Ahead(persist) if isinstance(persist, PersistAhead) else None
        self._batch: Batch = []
        self._batch_from: Micros = 0
        self.kept_seq = self._released_seq = engine.state.seq
        """The last step that is on disk; may be read from any thread."""
        self._unanswered: list[tuple[Future[Reply | None], Reply | None]] = []
        """Callers whose steps wait in memory for the disk, with their replies."""
        self._try_again_at: Micros | None = None
        """While steps wait in memory: the disk is tried again then, also if nothing happens."""
        self._stands: Literal["ok", "slow", "full", "gone"] = "ok"
        """How the journal stands, as it was told last."""
        self._epoch = epoch
        self._first = first
        self._inbox = Inbox(self._is_high)
        self._behind: Micros = 0
        self._behind_since: Micros | None = None
        self._worst: Micros = 0
        """How late a deadline was at most since the engine came late; 0: it keeps up."""
        self._wall: list[tuple[Micros, int, WallTimer]] = []
        self._wall_live: dict[WallTimer, int] = {}
        self._wall_seq = 0
        self._beat = 0
        self._next_beat: Micros = 0
        self._beat_at: Micros | None = None
        self._step_times, self._beats_late = Durations(), Durations()
        self._standstill = standstill_us(engine.core.catalogue)
        self._stopping = threading.Event()
        self._door = threading.Lock()
        self._refusing = False
        self._thread: threading.Thread | None = None
        self.clock = EngineClock(max(wall_clock_us(), engine.state.now, start_at), speed, follows_wall=follows_wall)
        self._turn, self._turn_at = self._wall_now(), self.clock.now()
        """Wall time and engine time at the beginning of this turn of the loop."""
        self._until: Micros = self._turn
        """When the next turn was to begin at the latest."""

    # -- time ------------------------------------------------------------------------------------------------------
    @staticmethod
    def _wall_now() -> Micros:
        return passed_us()

    def now(self) -> Micros:
        """Return the engine time; may be called from any thread."""
        return self.clock.now()

    @property
    def speed(self) -> float:
        """Return engine seconds per wall second."""
        return 1.0 if self.clock.follows_wall else self.clock.rate

    def statistics(self) -> DriverLoad:
        """Return how far the engine keeps up; may be called from any thread."""
        stands = max(0, self._wall_now() - max(self._turn, self._until))
        steps, beats = self._step_times.statistics(), self._beats_late.statistics()
        return DriverLoad(self._inbox.statistics(), self._behind / SECOND, stands / SECOND, steps, beats)

    def _is_high(self, task: str) -> bool:
        record = self.engine.state.tasks.get(task)
        return record is not None and record.request.priority == "high"

    def set_speed(self, speed: float) -> None:
        """Change the speed from now on; engine time goes on without a jump. May be called from any thread.

        Raises:
            ValueError: not above 0, or more than 20.
        """
        _check_speed(speed)
        assert not self.clock.follows_wall, "a clock that follows the wall clock has no speed"
        self.clock.set_rate(speed)
        self._next_beat = 0
        self._inbox.wake()

    # -- from any thread -------------------------------------------------------------------------------------------
    def start(self) -> None:
        """Open the transports and start the thread.

        Raises:
            TransportError: a wire cannot be opened.
        """
        self.switchboard.open(self._inbox.wake)
        self.switchboard.publish_site(self.engine.core.site_message, self._epoch)
        self._inbox.put(self._first or inp.Started(self._epoch))
        self._thread = threading.Thread(target=self._run, name="formiga-engine", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread and close the transports; may be called twice. Agents go on with what they do."""
        self._stopping.set()
        self._inbox.wake()
        if self._thread is None:
            self._refuse_waiting()
        elif self._thread is not threading.current_thread():
            self._thread.join(STOP_S)
        self.switchboard.close()

    def post(self, given: inp.Input) -> "Future[Reply | None]":
        """Hand in a person's order; the future holds the engine's reply. One canceled in time is not carried out.

        Its age counts from when its caller's request came in (`waiting.CALLER`), or from now.
        """
        caller = CALLER.get()
        future = Waiter(since_boot() if caller is None else caller.since)
        with self._door:
            if not self._refusing:
                if isinstance(given, inp.Submit) and self._inbox.is_full:
                    future.set_result(Refusal("busy", f"{MOST_REQUESTS:,} requests wait already; try again later"))
                else:
                    self._inbox.put(given, future)
                return future
        future.set_exception(EngineStopped(self._why()))
        return future

    def ask(self, given: inp.Input, timeout_s: float = 10.0) -> Accepted | Done:
        """Hand in a person's order and wait for the reply.

        A stop is carried out whatever becomes of its caller; any other order is withdrawn if its caller (`waiting.CALLER`)
        goes, or gives up, before the engine comes to it.

        Raises:
            TaskError: the engine refused it, or (`no_reply`) did not come to it in time, or (`client_gone`) nobody waits.
            EngineStopped: the engine does not run.
        """
        future = self.post(given)
        caller = CALLER.get()
        stays = never_expires(given)
        if caller is not None and not stays:
            caller.when_gone(future.cancel)
        try:
            return _read(future, timeout_s)
        except TimeoutError:
            if stays:
                text = f"the engine has not come to it within {timeout_s:g} s; it is carried out as soon as it does"
                raise TaskError("no_reply", text) from None
        except CancelledError:
            raise TaskError("client_gone", "who gave the order has gone; it was not carried out") from None
        if future.cancel():
            raise TaskError("no_reply", f"the engine did not take the order within {timeout_s:g} s")
        try:
            return _read(future, timeout_s)
        except TimeoutError:
            text = f"the engine took the order, but did not end with it within {timeout_s:g} s"
            raise TaskError("no_reply", text) from None

    # -- the thread ------------------------------------------------------------------------------------------------
    def _run(self) -> None:
        try:
            self._turn = self._until = self._wall_now()
            while not self._stopping.is_set():
                self._look_at_clock()
                self._publish_clock()
                self._collect()
                if self._one():
                    self._hand_over()
                elif not self._flush():
                    self._idle()
            self._flush()
        except BaseException as error:
            self.error = error
            log.exception("the engine stopped")
            self._stopping.set()
            self._flush_after_error()
        finally:
            self._refuse_waiting()
            if self._ahead is not None:
                self._ahead.close()

    def _flush_after_error(self) -> None:
        """Steps before the one that failed are as good as any."""
        batch = self._batch
        try:
            self._flush()
        except Exception:
            log.exception("the last steps were not kept")
        for _, waiter, _ in batch:
            if waiter is not None and not waiter.done():
                waiter.set_exception(EngineStopped(self._why()))

    def _refuse_waiting(self) -> None:
        with self._door:
            self._refusing = True
        for waiter, _ in self._unanswered:
            waiter.set_exception(EngineStopped(self._why()))
        self._unanswered.clear()
        while (item := self._inbox.take()) is not None:
            if isinstance(item[1], Future) and item[1].set_running_or_notify_cancel():
                item[1].set_exception(EngineStopped(self._why()))

    def _why(self) -> str:
        return stop_words(self.error) if self.error is not None else "the engine is stopped"

    def _look_at_clock(self) -> None:
        """Begin a turn; tell the engine first if it stood still since the last one was to end."""
        wall = self._wall_now()
        stood, last = wall - max(self._turn, self._until), self._turn_at
        self._turn, self._turn_at, self._until = wall, self.now(), wall
        if stood <= self._standstill or self.engine.core.stands_by:
            return
        log.warning("the engine stood still for %.1f s", stood / SECOND)
        now = wall_clock_us()
        self._handle(
            max(self._turn_at, self.engine.state.now),
            inp.Outage(at=last, since=now - stood, wall=now, heard=wall, speed=self.speed),
        )

    def _idle(self) -> None:
        """Wait until there is something to do; a turn that took as long as a standstill ends at once."""
        idle_s, wall = self._idle_s(), self._wall_now()
        if wall - self._turn <= self._standstill:
            self._until = wall + round(idle_s * SECOND)
            self._inbox.wait(idle_s)

    def _collect(self) -> None:
        events = self.switchboard.poll()
        clock = self.now()
        for event in events:
            self._inbox.put(self.switchboard.read(event, self._turn, clock))

    def _one(self) -> bool:
        """Handle what is due, then one input; return False when there was nothing to do."""
        now = self._turn_at
        worked = self._timers(now, including=False) | self._wall_timers()
        self._note_load(now)
        item = self._inbox.take()
        if item is None:
            return self._timers(now, including=True) or worked
        given, waiter = item
        if not isinstance(waiter, Future):
            self._handle(self._stamp(now), given)
        elif waiter.set_running_or_notify_cancel():
            too_old = refusal_of_old(given, since_boot() - waiter.since) if isinstance(waiter, Waiter) else None
            if too_old is not None:
                waiter.set_result(too_old)
                return True
            try:
                self._handle(self._stamp(now), given, waiter)
            except BaseException as error:
                waiter.set_exception(EngineStopped(stop_words(error)))
                raise
        return True

    def _timers(self, now: Micros, *, including: bool) -> bool:
        worked = False
        for _ in range(TIMERS_A_TURN):
            due = self.engine.next_deadline()
            if due is None or due[0] > now or (due[0] == now and not including):
                break
            self._handle(max(due[0], self.engine.state.now), inp.TimerDue(due[1]))
            worked = True
            if due[1] == REST:  # thousands are woken: the inbox has its turn after each part of them
                break
        return worked

    def _stamp(self, now: Micros) -> Micros:
        """Return the instant of an input: now; under overload that of the earliest deadline not yet given.

        So a flood of deadlines keeps no goal's end and no person's order waiting: an input at the very deadline goes first.
        """
        due = self.engine.next_deadline()
        return max(now if due is None else min(now, due[0]), self.engine.state.now)

    def _note_load(self, now: Micros) -> None:
        due = self.engine.next_deadline()
        self._behind = max(0, now - due[0]) if due is not None else 0
        most = max(BEHIND_US, round(BEHIND_WALL_US * self.clock.rate))
        if self._worst:
            self._worst = max(self._worst, self._behind)
            if self._behind <= most // KEEPS_UP:
                self._report_load(0)
        elif self._behind <= most:
            self._behind_since = None
        elif self._behind_since is None:
            self._behind_since = self._turn
        elif self._turn - self._behind_since >= BEHIND_FOR_US:
            self._worst = self._behind
            self._report_load(self._behind)

    def _report_load(self, late: Micros) -> None:
        log.warning(
            "overloaded: deadlines are given %.1f s late" if late else "the engine keeps up again; it was %.1f s late",
            (late or self._worst) / SECOND,
        )
        self._handle(self._stamp(self._turn_at), inp.Behind(late, self._worst))
        if not late:
            self._worst, self._behind_since = 0, None

    @property
    def is_behind(self) -> bool:
        """Return whether the engine comes late; may be called from any thread."""
        return self._worst > 0

    def _wall_timers(self) -> bool:
        worked = False
        for _ in range(TIMERS_A_TURN):
            if not self._wall or self._wall[0][0] > self._turn:
                break
            _, seq, timer = heapq.heappop(self._wall)
            if self._wall_live.get(timer) == seq:
                heard = 0
                if isinstance(timer, LiveDue):
                    heard = max(self._inbox.heard(timer.agent), self.switchboard.heard(timer.agent))
                later = self.engine.put_off(timer, self._turn, heard)
                self._set_wall(timer, later)
                if later is not None:
                    continue
                self._timers(self._turn_at, including=False)
                self._handle(self._stamp(self._turn_at), inp.WallDue(timer, self._turn))
                worked = True
        return worked

    def _handle(self, now: Micros, given: inp.Input, waiter: "Future[Reply | None] | None" = None) -> None:
        # A deadline that came up between stamping and handling goes first.
        while not isinstance(given, inp.TimerDue | inp.Outage):
            due = self.engine.next_deadline()
            if due is None or due[0] >= now:
                break
            self._handle(max(due[0], self.engine.state.now), inp.TimerDue(due[1]))
        begun = time.perf_counter()
        step = self.engine.handle(now, given)
        self._step_times.add(time.perf_counter() - begun)
        if not self._batch:
            self._batch_from = self._wall_now()
        self._batch.append((step, waiter, self._turn))
        for change in step.changes:
            if isinstance(change, ch.WallTimerSet):
                self._set_wall(change.timer, change.after_us)

    def _hand_over(self) -> None:
        """Let a batch that is old enough be persisted while the engine goes on."""
        ahead = self._ahead
        if ahead is not None and ahead.is_done:
            self._release_ahead(ahead)
        if not self._batch or self._wall_now() - self._batch_from < BATCH_US:
            return
        if ahead is None:
            self._flush()
            return
        if ahead.is_under_way:
            self._release_ahead(ahead)
        batch, self._batch = self._batch, []
        try:
            ahead.begin(batch, [step for step, *_ in batch])
        except BaseException as error:
            _refuse(batch, error)
            raise

    def _release_ahead(self, ahead: Ahead[Batch]) -> None:
        """Wait for the batch that is under way, and release it."""
        batch, kept = ahead.end()
        if isinstance(kept, BaseException):
            _refuse(batch, kept)
            raise kept
        self._release(batch, kept)

    def _flush(self) -> bool:
        """Persist the batch and release it; return whether that led to another step."""
        if self._ahead is not None and self._ahead.is_under_way:
            self._release_ahead(self._ahead)
        batch, self._batch = self._batch, []
        if not batch and (self._try_again_at is None or self._wall_now() < self._try_again_at):
            return False
        try:
            kept = DURABLE if self._persist is None else self._persist.keep([step for step, *_ in batch])
        except BaseException as error:
            _refuse(batch, error)
            raise
        self._release(batch, kept)
        return bool(self._batch)

    def look_again(self) -> None:
        """Have the journal tell soon how it stands, also if nothing happens; may be called from any thread."""
        self._try_again_at = 0
        self._inbox.wake()

    def _release(self, batch: Batch, kept: Outcome) -> None:
        """Let the effects of a batch leave, and answer who waits."""
        self._try_again_at = None if kept.durable else self._wall_now() + SECOND
        if batch:
            self._released_seq = batch[-1][0].seq
        if kept.news is not None:
            self._stands = kept.news.state
        if kept.durable:
            self.kept_seq = self._released_seq
            for late, reply in self._unanswered:
                late.set_result(reply)
            self._unanswered.clear()
        wall = self._wall_now()
        for step, waiter, made in batch:
            too_old = wall - made > self._standstill
            if too_old:
                self._publish_clock()  # agents take what leaves now by this beat
            for effect in step.effects:
                failed = self._too_late(effect) if too_old else None
                failed = failed or self.switchboard.carry_out(effect, self._beat)
                if failed is not None:
                    self._inbox.put(failed)
            for listener in self.listeners:
                listener(step)
            if waiter is not None:
                self._answer(step, waiter, durable=kept.durable)
        if kept.news is not None:
            self._handle(max(self._turn_at, self.engine.state.now), kept.news)

    def _too_late(self, effect: inp.Effect) -> inp.EffectFailed | None:
        """Return that a goal was not sent: the engine stood still since it was to leave, and must look at it again."""
        if not isinstance(effect, inp.SendGoal) or effect.safety:
            return None
        agent = self.engine.state.agents.get(effect.agent)
        if agent is None or agent.human:
            return None
        return inp.EffectFailed(effect.agent, "goal", effect.goal_id, "unreachable", "the engine stood still")

    def _answer(self, step: inp.EngineStep, waiter: "Future[Reply | None]", *, durable: bool) -> None:
        """Answer a caller; one whose step is not durable is told so, or waits until it is, and a request is taken back."""
        reply = step.reply
        if durable or isinstance(reply, Refusal):
            waiter.set_result(reply)
        elif isinstance(reply, Accepted):
            code, why, remedy = LACKS[max(LEVELS["full"], LEVELS[self._stands])]
            self._inbox.put(inp.Abort(reply.task, "", "engine", code))
            waiter.set_result(Refusal(code, f"{reply.task} is taken back: {why}; {remedy}"))
        elif begins_something(step.input):
            self._unanswered.append((waiter, reply))
        else:
            waiter.set_result(Done(kept=False))

    def _set_wall(self, timer: WallTimer, after_us: Micros | None) -> None:
        self._wall_live.pop(timer, None)
        if after_us is not None:
            self._wall_seq += 1
            self._wall_live[timer] = self._wall_seq
            heapq.heappush(self._wall, (self._wall_now() + after_us, self._wall_seq, timer))

    def _publish_clock(self) -> None:
        wall = self._wall_now()
        if wall < self._next_beat:
            return
        if self._next_beat:
            self._beats_late.add((wall - self._next_beat) / SECOND)
        passed = 0 if self._beat_at is None else (wall - self._beat_at) // SECOND
        self._next_beat, self._beat_at = wall + SECOND, wall
        self._beat += max(1, passed)  # the life of a goal is counted in beats, also over a standstill
        self.clock.steer()
        beat = ClockBeat(
            wall_us=wall_clock_us(),
            engine_us=self.now(),
            speed=self.clock.rate,
            epoch=self._epoch,
            beat=self._beat,
            engine_id=self._engine_id,
        )
        for transport in self.switchboard.transports:
            transport.publish_clock(beat)

    def _idle_s(self) -> float:
        wall = self._wall_now()
        waits = [self._next_beat - wall]
        if self._wall:
            waits.append(self._wall[0][0] - wall)
        due = self.engine.next_deadline()
        if due is not None:
            waits.append(round((due[0] - self.now()) / self.clock.rate) + 1)
        return max(0.0, min(waits) / SECOND)


def _read(future: "Future[Reply | None]", within_s: float) -> Accepted | Done:
    """Return the reply.

    Raises:
        CancelledError: the order was withdrawn.
        TaskError: the engine refused the order.
        TimeoutError: there is none yet.
    """
    return granted(future.result(within_s))


def _refuse(batch: Batch, error: BaseException) -> None:
    """Tell whoever waits that the engine stopped."""
    for _, waiter, _ in batch:
        if waiter is not None and not waiter.done():
            waiter.set_exception(EngineStopped(stop_words(error)))
