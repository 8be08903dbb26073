"""The virtual driver: discrete events, no waiting. Dry runs, tests and fault injection run the production engine on it.

Order at one instant: what the world does, then wall timers, then engine deadlines (an input at the very deadline goes before
the timer). Wall time is the virtual time.
"""

import heapq
from collections.abc import Callable, Sequence
from functools import partial

from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler
from formiga_bt.engine.drivers.persist import Persist
from formiga_bt.engine.drivers.wiring import Switchboard
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.timers import LiveDue, WallTimer
from formiga_bt.transport.base import AgentTransport
from formiga_bt.transport.messages import ClockBeat

Listener = Callable[[inp.EngineStep], None]


class VirtualDriver:
    """Runs an engine and in-process transports on a `VirtualScheduler`."""

    def __init__(
        self,
        engine: Engine,
        transports: Sequence[AgentTransport],
        scheduler: VirtualScheduler,
        *,
        listeners: Sequence[Listener] = (),
        persist: Persist | None = None,
    ) -> None:
        self.engine = engine
        self.scheduler = scheduler
        self.switchboard = Switchboard(transports)
        self.listeners = list(listeners)
        self._persist = persist
        self._wall: list[tuple[Micros, int]] = []
        """When which setting of a wall timer is due; one that was cleared or set anew is in `_wall_timers` no more."""
        self._wall_timers: dict[int, WallTimer] = {}
        self._wall_live: dict[WallTimer, int] = {}
        self._wall_seq = 0
        self._beat = 0
        self._next_beat_at: Micros = 0
        self._waits: list[inp.Input] | None = None
        """While the engine's process stands still: what it is fed when it goes on."""
        self.switchboard.open(lambda: None)
        self.switchboard.publish_site(engine.core.site_message, engine.state.epoch)
        self._publish_clock()

    def start(self, epoch: int = 1) -> None:
        """Give the engine its epoch."""
        self.feed(inp.Started(epoch))
        self.switchboard.publish_site(self.engine.core.site_message, epoch)
        self._publish_clock()

    def _publish_clock(self) -> None:
        now = self.scheduler.now()
        self._beat = now // SECOND
        self._next_beat_at = (self._beat + 1) * SECOND
        beat = ClockBeat(wall_us=now, engine_us=now, speed=1.0, epoch=self.engine.state.epoch, beat=self._beat)
        for transport in self.switchboard.transports:
            transport.publish_clock(beat)

    # -- feeding -------------------------------------------------------------------------------------------------
    def feed(self, given: inp.Input) -> inp.EngineStep:
        """Handle an input now; deadlines that lie before are given first."""
        now = self.scheduler.now()
        while (due := self.engine.next_deadline()) is not None and due[0] < now:
            self._handle(max(due[0], self.engine.state.now), inp.TimerDue(due[1]))
        return self._handle(now, given)

    def _feed(self, given: inp.Input) -> None:
        if self._waits is None:
            self.feed(given)
        else:
            self._waits.append(given)

    def _handle(self, now: Micros, given: inp.Input) -> inp.EngineStep:
        step = self.engine.handle(now, given)
        if self._persist is not None:
            kept = self._persist.keep((step,))
            if kept.news is not None:
                self.scheduler.call_at(self.scheduler.now() + 1, partial(self._feed, kept.news))
        for change in step.changes:
            if type(change) is ch.WallTimerSet:
                self._set_wall(change.timer, change.after_us)
        for listener in self.listeners:
            listener(step)
        if step.effects:
            failed = [self.switchboard.carry_out(effect, self._beat) for effect in step.effects]
            for failure in failed:
                if failure is not None:
                    self.scheduler.call_at(self.scheduler.now() + 1, partial(self._feed, failure))
        return step

    def _set_wall(self, timer: WallTimer, after_us: Micros | None) -> None:
        before = self._wall_live.pop(timer, None)
        if before is not None:
            self._wall_timers.pop(before, None)
        if after_us is not None:
            self._wall_seq = seq = self._wall_seq + 1
            self._wall_live[timer] = seq
            self._wall_timers[seq] = timer
            heapq.heappush(self._wall, (self.scheduler.now() + after_us, seq))

    def _next_wall(self) -> Micros | None:
        wall = self._wall
        while wall and wall[0][1] not in self._wall_timers:
            heapq.heappop(wall)
        return wall[0][0] if wall else None

    def stand_still(self, us: Micros, wall: Callable[[], Micros] | None = None) -> inp.EngineStep:
        """Let the world go on for so long while the engine's process does nothing; return the step with which it goes on.

        Args:
            us: how long.
            wall: the time of day; by default the virtual time.
        """
        wall = wall or self.scheduler.now
        at, since = self.scheduler.now(), wall()
        waits: list[inp.Input] = []
        self._waits = waits
        while (world := self.scheduler.next_time()) is not None and world <= at + us:
            self.scheduler.run_next()
        self.scheduler.advance_to(at + us)
        self._publish_clock()
        now = self.scheduler.now()
        given = inp.Outage(at=max(at, self.engine.state.now), since=since, wall=wall(), heard=now)
        self._waits = None
        step = self._handle(max(now, self.engine.state.now), given)
        for waiting in waits:
            self.feed(waiting)
        self.drain()
        return step

    # -- running -------------------------------------------------------------------------------------------------
    def drain(self) -> None:
        """Feed what the transports have."""
        events = self.switchboard.poll()
        if events:
            now = self.scheduler.now()
            for event in events:
                self.feed(self.switchboard.read(event, now, now))

    def next_time(self) -> Micros | None:
        """Return when the next thing happens, or None if nothing is left to happen."""
        due = self.engine.next_deadline()
        times = [t for t in (self.scheduler.next_time(), self._next_wall(), due[0] if due else None) if t is not None]
        return min(times, default=None)

    def run_one(self, limit: Micros | None = None) -> bool:
        """Let the next thing happen; return False when there is none, or none until `limit`."""
        scheduler = self.scheduler
        world, wall, due = scheduler.next_time(), self._next_wall(), self.engine.next_deadline()
        at = world
        if wall is not None and (at is None or wall < at):
            at = wall
        if due is not None and (at is None or due[0] < at):
            at = due[0]
        if at is None or (limit is not None and at > limit):
            return False
        if scheduler.now() >= self._next_beat_at:
            self._publish_clock()
            return True
        if at == world:
            scheduler.run_next()
        elif at == wall:
            scheduler.advance_to(wall)
            timer = self._wall_timers.pop(heapq.heappop(self._wall)[1])
            heard = self.switchboard.heard(timer.agent) if isinstance(timer, LiveDue) else 0
            later = self.engine.put_off(timer, wall, heard)
            self._set_wall(timer, later)
            if later is None:
                self.feed(inp.WallDue(timer, wall))
        else:
            assert due is not None
            scheduler.advance_to(max(due[0], scheduler.now()))
            self._handle(scheduler.now(), inp.TimerDue(due[1]))
        self.drain()
        return True

    def run_until(self, done: Callable[[], bool], limit: Micros) -> bool:
        """Run until `done()` or until virtual time `limit`; return whether it is done."""
        while not done():
            if not self.run_one(limit):
                return done()
        return True

    def close(self) -> None:
        """Close the transports."""
        self.switchboard.close()
