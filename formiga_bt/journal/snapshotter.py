"""Snapshots beside the engine: a thread folds what was written into a state of its own, and keeps that now and then.

The engine's state changes with each step, so whoever encodes it holds the engine up; of many tasks for half a second. The
shadow stands still while it is encoded, in slices, and the engine goes on between them. It also brings the write-ahead log into
the file, which a commit would else do for all others.
"""

import logging
import threading
import time
from collections.abc import Sequence
from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.past import follow, without_ended
from formiga_bt.journal.store import Journal
from formiga_bt.journal.thin import TrackPoint

SNAPSHOT_STEPS: Final = 2000
SNAPSHOT_US: Final[Micros] = 3600 * SECOND
"""A snapshot comes after so many kept steps, and not before as many as there are open tasks, which it costs; or so long."""
CHECKPOINT_COMMITS: Final = 200
TURN_S: Final = 0.0002
"""So long the thread works before it rests."""
REST: Final = 4.0
"""It rests so many times as long. (Who only offers the interpreter to others takes it back before they wake up, and the
engine's thread lets go of it at each call of the database.)"""
AGAIN_S: Final = 5.0
"""A snapshot that could not be written is tried again after so long."""
END_S: Final = 10.0
log = logging.getLogger("formiga.journal")

Item = EngineStep | tuple[str, TrackPoint]
"""A step that is on disk, or a way point of an agent."""


class Cadence:
    """Tells when a snapshot is due.

    Args:
        steps: after so many kept steps.
    """

    def __init__(self, steps: int = SNAPSHOT_STEPS) -> None:
        self._steps = steps
        self._since = 0
        self._at: Micros | None = None

    def count(self, steps: int, now: Micros, state: EngineState) -> bool:
        """Note so many kept steps, which led to this state; return whether a snapshot is due."""
        self._since += steps
        if self._at is None:
            self._at = now
        open_tasks = len(state.memory) + len(state.requests)
        return self._since >= max(self._steps, open_tasks) or (now - self._at >= SNAPSHOT_US and self._since > 0)

    def begin(self, now: Micros) -> None:
        """Note that there is one."""
        self._since, self._at = 0, now


class Shadow:
    """Follows what is written, in a thread of its own.

    Args:
        journal: that was taken.
        state: as the fold of what was written has it; from now on the thread's own.
        cadence: tells when a snapshot is due.
    """

    def __init__(self, journal: Journal, state: EngineState, cadence: Cadence) -> None:
        self.is_broken = False
        """It ended by a fault of its own: begin another one, with the present state."""
        self._journal, self._state, self._cadence = journal, state, cadence
        self._given: list[tuple[EngineState | None, Sequence[Item], Micros]] = []
        self._news = threading.Condition()
        self._ends = False
        self._commits = 0
        self._again = 0.0
        self._turn = 0.0
        self._thread = threading.Thread(target=self._run, name="formiga-snapshots", daemon=True)
        self._thread.start()

    def take(self, items: Sequence[Item], now: Micros) -> None:
        """Follow what was written; engine time is now."""
        self._give(None, items, now)

    def reset(self, state: EngineState, now: Micros) -> None:
        """Go on from another state, of which a snapshot was just written."""
        self._give(state, (), now)

    def stop(self) -> None:
        """End, after what is done now."""
        with self._news:
            self._ends = True
            self._news.notify()
        self._thread.join(END_S)

    def _give(self, state: EngineState | None, items: Sequence[Item], now: Micros) -> None:
        with self._news:
            self._given.append((state, items, now))
            self._news.notify()

    # -- the thread --------------------------------------------------------------------------------------------------
    def _run(self) -> None:
        while True:
            with self._news:
                while not self._given and not self._ends:
                    self._news.wait()
                if self._ends:
                    return
                given, self._given = self._given, []
            try:
                self._follow(given)
            except SiteError:
                return  # another engine has the site: whoever commits next is told
            except Exception:
                log.exception("a snapshot could not be made; another one is begun soon, steps are kept meanwhile")
                self.is_broken = True
                return

    def _follow(self, given: Sequence[tuple[EngineState | None, Sequence[Item], Micros]]) -> None:
        due, now = False, 0
        self._turn = time.monotonic()
        for state, items, now in given:
            if state is not None:
                self._state = state
                self._cadence.begin(now)
                continue
            steps = 0
            for item in items:
                if isinstance(item, EngineStep):
                    follow(self._state, item)
                    steps += 1
                else:
                    name, point = item
                    agent = self._state.agents.get(name)
                    if agent is not None:
                        self._state.agents[name] = point.on(agent)
                self._pause()
            due = self._cadence.count(steps, now, self._state)
            self._commits += 1
        if due and time.monotonic() >= self._again:
            self._write(now)
        if self._commits >= CHECKPOINT_COMMITS:
            self._commits = 0
            self._journal.checkpoint()

    def _write(self, now: Micros) -> None:
        try:
            self._journal.snapshot_beside(without_ended(self._state), now, self._pause)
        except JournalError as error:
            self._again = time.monotonic() + AGAIN_S
            log.warning("no snapshot was written: %s", error)
            return
        self._cadence.begin(now)

    def _pause(self) -> None:
        worked = time.monotonic() - self._turn
        if worked >= TURN_S:
            time.sleep(worked * REST)
            self._turn = time.monotonic()
