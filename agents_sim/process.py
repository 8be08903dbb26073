"""One simulated agent as the main loop of an OS process, over Zenoh.

One thread owns the body, its rules and its timers; Zenoh's threads only queue what they hear. The loop runs due timers,
answers the engine, publishes the status twice a second of wall time, and keeps the body's state in a file, so that a
drone killed in flight is found where it was. A full disk does not end it: what has no room waits in memory. A picker's
process also listens to where the drones fly, for the tracker.
Called by `__main__`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from agents_sim.bodies import build_body, build_card, hover_drain_percent_s
from agents_sim.faults import FaultyBody, FaultyLink, Order, obey
from agents_sim.goalbook import BookedBody, BookedSide, GoalBook
from agents_sim.ledger import BodyFile, Ledger, MotionNote, Note, NoteTaker, Saved
from agents_sim.lines import Disk
from agents_sim.motion import BodyState
from agents_sim.person import MINI_FINDER
from agents_sim.spec import AgentSpec
from formiga_bt.agent.pacing import PacedScheduler
from formiga_bt.agent.pulse import Pulse, new_boot_id
from formiga_bt.base.certificates import Keys
from formiga_bt.base.clock import SECOND, Micros, monotonic_us, wall_clock_us
from formiga_bt.base.errors import TransportError
from formiga_bt.base.geo import Position
from formiga_bt.transport.zenoh_agent import ZenohAgentLink, ZenohObserver
from formiga_bt.transport.zenoh_keys import MOTION

SAVE_EVERY_US: Final[Micros] = SECOND // 5
"""How far behind the file may be of a drone that moves (wall time)."""


class Radar:
    """What a picker's tracker knows of drones: their newest motion, as they publish it on the site.

    Args:
        observer: its ears; opened by `open`, again and again until there is an engine.
        now: engine time.
    """

    def __init__(self, observer: ZenohObserver, now: Callable[[], Micros]) -> None:
        self._observer = observer
        self._now = now
        self._is_open = False
        self._newest: dict[str, MotionNote] = {}
        self._decoder = msgspec.json.Decoder(Note)

    def listen(self) -> None:
        """Take in what came since the last call."""
        if not self._is_open:
            try:
                self._observer.open(MOTION.of_all)
            except TransportError:
                return  # no engine yet
            self._is_open = True
        for _, raw in self._observer.poll():
            try:
                note = self._decoder.decode(raw)
            except msgspec.DecodeError:
                continue  # not an agent of ours
            if isinstance(note, MotionNote):
                self._newest[note.agent] = note

    def flying(self) -> dict[str, Position]:
        """Return where the drones in the air are, as far as it was heard."""
        self.listen()
        now = self._now()
        return {agent: note.segment.at(now) for agent, note in self._newest.items() if note.kind != "rest"}

    def close(self) -> None:
        """Leave."""
        self._observer.close()


class AgentProcess:
    """One agent: found as its file says, else as its spec says.

    Args:
        spec: what it is.
        site: the site's name.
        connect: the engine's endpoint; the engine may come later.
        state_dir: where its files are; None: the body dies with the process.
        keys: what it proves who it is with, at a secured site.

    Raises:
        ValueError: the spec or the state file is wrong.
    """

    def __init__(
        self, spec: AgentSpec, *, site: str, connect: str, state_dir: Path | None, keys: Keys | None = None
    ) -> None:
        self._file = self._ledger = disk = None
        saved: Saved | None = None
        if state_dir is not None:
            state_dir.mkdir(parents=True, exist_ok=True)
            disk = Disk(spec.id)
            self._file, self._ledger = BodyFile(state_dir, spec.id, disk), Ledger(state_dir, spec.id, disk)
            saved = self._file.load()
        start, speed = wall_clock_us(), 1.0
        if saved is not None:
            start = saved.engine_us + round(max(0, start - saved.wall_us) * saved.speed)
            speed = saved.speed
        self.scheduler = PacedScheduler(monotonic_us, start, speed)
        self._dirty = False
        self._newest: Note | None = None
        self._link = ZenohAgentLink(site, connect=connect, keys=keys)
        # Before the body: already its first motion is noted, and dropped for want of engine time.
        notes = NoteTaker(self._note)
        state = saved.body if saved is not None else None
        if saved is not None and isinstance(state, BodyState):
            state = state.found_at(start, saved.engine_us, hover_drain_percent_s(spec))
        radar = Radar(ZenohObserver(site, connect=connect, keys=keys), self.scheduler.now)
        self.body = build_body(spec, self.scheduler, recorder=notes, state=state, sight=radar.flying)
        self._radar = radar if MINI_FINDER in self.body.actions else None
        self._front, self._faulty = FaultyBody(self.body), FaultyLink(self._link, monotonic_us)
        self._book = GoalBook(state_dir, spec.id, self.scheduler.now, disk) if state_dir is not None else None
        front = self._front if self._book is None else BookedBody(self._front, self._book)
        self.side = BookedSide(
            build_card(spec, self.body, new_boot_id(spec.id)), front, self._faulty, self.scheduler, self._follow_jump
        )
        self.side.book = self._book
        self.body.link = self._link
        self.body.attach(self.side)

    def run(self, is_stopping: Callable[[], bool], orders: Callable[[], list[Order]] = list) -> None:
        """Live until `is_stopping`. `orders` returns the faults to play that were ordered meanwhile.

        Raises:
            TransportError: the site, the id or the endpoint cannot be used.
        """
        try:
            self._link.serve(self.side)
            self.body.resume()
            self._save()
            pulse = Pulse(self.side, self.scheduler, self._report, self._watch_link)
            next_save = monotonic_us()
            while not is_stopping():
                for order in orders():
                    self._obey(order)
                self._faulty.flush()
                wait_s = pulse.turn()
                now = monotonic_us()
                if self._dirty or now >= next_save:
                    self._save()
                    next_save = now + SAVE_EVERY_US
                self._link.pump(min(wait_s, max(0.0, (next_save - monotonic_us()) / SECOND)))
        finally:
            self._save()
            if self._radar is not None:
                self._radar.close()
            self._link.close()
            if self._ledger is not None:
                self._ledger.close()
            if self._book is not None:
                self._book.close()

    def _obey(self, order: Order) -> None:
        if order.kind == "link_loss":
            self._link.cut(vanishes=order.vanishes) if order.on else self._link.mend()
        else:
            obey(order, self.body, self._front, self._faulty)

    def _report(self) -> None:
        if self._radar is not None:
            self._radar.listen()
        self.body.report()
        self._dirty = True  # never found behind where it was last reported
        if self._newest is not None:
            self._link.publish_extra("motion", self._newest)  # for a referee that came late
        self._write_what_waits()

    def _watch_link(self) -> None:
        self.body.watch_link()

    def _note(self, note: Note) -> None:
        self._dirty = True
        if not self.scheduler.has_beat:
            return  # not engine time yet; noted again when it is
        if self._ledger is not None:
            self._ledger.write(note)
        self._newest = note
        self._link.publish_extra("motion", note)

    def _follow_jump(self, by: Micros) -> None:
        self.body.shift(by)
        self._dirty = True

    def _write_what_waits(self) -> None:
        for file in (self._ledger, self._book):
            if file is not None:
                file.try_again()

    def _save(self) -> None:
        self._dirty = False
        state = self.body.state()
        if self._file is not None and state is not None:
            now = self.scheduler.now()
            saved = Saved(body=state, engine_us=now, wall_us=wall_clock_us(), speed=self.scheduler.speed)
            self._file.save(saved)
