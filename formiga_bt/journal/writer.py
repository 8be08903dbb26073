"""The driver's seam: steps become rows and way points, and are durable when `keep` returns, or after `commit`.

When the disk is full (or the server away) steps wait in memory, and the engine is told; each second they are tried again. Those
that no longer fit are a gap: history is lost, but what is open is not, for a snapshot of the state follows it.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final, Literal

import msgspec
from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.durations import Durations
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.inputs import EngineStep, JournalState
from formiga_bt.engine.kernel.records import holder_of
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.restart.resume import copy_of
from formiga_bt.journal.outbox import news_of
from formiga_bt.journal.past import without_ended
from formiga_bt.journal.snapshotter import SNAPSHOT_STEPS, Cadence, Item, Shadow
from formiga_bt.journal.store import Gap, Gone, Journal, Overtaken, StepRow, Unwritable
from formiga_bt.journal.thin import Thinner

LESSON: Final = 256
"""Steps that a journal learns from how to keep the next ones in less room."""
SLOW_S: Final = 0.5
"""A commit that takes longer is slow."""
CALM_S: Final = 10.0
"""Without a slow commit for so long it is no longer slow."""
RETRY_S: Final = 1.0
MOST_RETRY_S: Final = 10.0
RESTS: Final = 4
"""After an attempt that failed, the engine goes on for so many times as long as that took."""
MEND_S: Final = 60.0
"""Between two attempts to write snapshots again after a fault."""
BACKLOG_BYTES: Final = 64 * 1024 * 1024

Level = Literal["ok", "slow", "full", "gone"]


class Writer:
    """A `PersistAhead` over a journal that was taken.

    Args:
        journal: this engine has it.
        state: the engine's present state, read in the driver's thread.
        wall: wall time, microseconds.
        clock: seconds of a clock that never goes back.
        thin: False: every step is kept, for replaying inputs.
        snapshot_steps: a snapshot after so many.
        backlog_bytes: so much waits in memory.
        beside: write snapshots in a thread of its own, so that the engine does not wait for them.
        outbox: keep the news of steps, too, for who delivers them.
    """

    def __init__(
        self,
        journal: Journal,
        state: Callable[[], EngineState],
        *,
        wall: Callable[[], Micros],
        clock: Callable[[], float],
        thin: bool = True,
        snapshot_steps: int = SNAPSHOT_STEPS,
        backlog_bytes: int = BACKLOG_BYTES,
        beside: bool = False,
        outbox: bool = False,
    ) -> None:
        self.journal = journal
        self.kept = 0
        """Steps that were kept."""
        self.written = 0
        """`seq` of the last of them; may be read from any thread."""
        self.commits = 0
        self.commit_times = Durations()
        """How long commits take until they are on disk."""
        self._state, self._wall, self._clock = state, wall, clock
        self._thinner = Thinner(state(), thin=thin)
        self._level: Level = "ok"
        self._rows: list[StepRow] = []
        self._rows_bytes = 0
        self._gap: Gap | None = None
        self._retry_at = 0.0
        self._slow_at = 0.0
        self._lesson: list[EngineStep] = []
        self._backlog_bytes = backlog_bytes
        self._cadence = Cadence(snapshot_steps)
        self._beside = beside
        self._outbox = outbox
        self._shadow: Shadow | None = None
        self._fresh: EngineState | None = None
        """For the shadow, once it is on disk."""
        self._mend_at = 0.0
        self._items: list[Item] = []
        """For the shadow, once they are on disk."""
        self._began = 0.0
        self._commit: Callable[[], None] | None = None
        self._outcome: Outcome | None = None
        self._error: Unwritable | None = None
        self._gone = ""

    def begin(self, versions: dict[str, str] | None = None, at: Micros | None = None) -> None:
        """Note the start of the engine, at this engine time.

        Raises:
            JournalError: the journal cannot be written.
        """
        state = self._state()
        self.journal.begin(without_ended(state), self._wall(), versions, at)
        self.journal.hurry()
        if self._beside:
            self._thinner.on_point = lambda agent, point: self._items.append((agent, point))
            self._shadow = Shadow(self.journal, copy_of(state), self._cadence)

    def keep(self, steps: Sequence[EngineStep]) -> Outcome:
        """Keep steps; see `Persist.keep`."""
        if self.start(steps):
            self.commit()
        return self.finish()

    def start(self, steps: Sequence[EngineStep]) -> bool:
        """Write steps; see `PersistAhead.start`."""
        wall = self._wall()
        for step in steps:
            if self._thinner.keeps(step):
                self._take(step, wall)
        blocks = self._thinner.blocks(self._state().now)
        if self._is_stuck:
            blocks = []  # where machines were meanwhile is not kept
            self._items.clear()
        if not (self._rows or blocks or self._gap):
            self._outcome = self._unchanged()
            return False
        self._began = self._clock()
        if self._is_stuck and self._began < self._retry_at:
            self._bound()
            self._outcome = Outcome(False)
            return False
        try:
            if self._gap is not None:
                self._bound(all_=True)
                self._put_snapshot(self._gap)
            self._commit = self.journal.stage(self._rows, blocks)
        except Unwritable as error:
            self._outcome = self._failed(error)
            return False
        self._fresh = copy_of(self._thinner.view(self._state())) if self._shadow_needs_state() else None
        self._outcome = None
        return True

    def commit(self) -> None:
        """Make durable what `start` wrote; see `PersistAhead.commit`."""
        assert self._commit is not None
        try:
            begun = self._clock()
            self._commit()
            self.commit_times.add(self._clock() - begun)
            self._gone = self.journal.gone()
        except Unwritable as error:
            self._error = error

    def finish(self) -> Outcome:
        """Return what became of it; see `PersistAhead.finish`."""
        if self._outcome is not None:
            return self._outcome
        error, self._error, self._commit = self._error, None, None
        if error is not None:
            return self._failed(error)
        self.commits += 1
        kept = len(self._rows)
        self.kept += kept
        self.written = self._rows[-1].seq if self._rows else self.written
        self._rows, self._rows_bytes, self._gap = [], 0, None
        if self._gone:  # it went into files without a name
            return self._lost(self._gone)
        news = self._level_after(self._began, self._clock())
        self._cleanup(kept)
        return Outcome(True, news)

    def end(self) -> None:
        """Note a clean end; what cannot be written any more is left."""
        if self._shadow is not None:
            self._shadow.stop()
        self.journal.hurry(on=False)
        try:
            if self._gap is None:
                self.journal.append(self._rows, self._thinner.blocks(0, all_=True))
            else:
                self._bound(all_=True)
            self._put_snapshot(self._gap)
            self.journal.end(self._wall())
        except (Unwritable, Overtaken):
            return

    def view(self, state: EngineState) -> EngineState:
        """Return the engine's present state as the fold of what is kept has it."""
        return without_ended(self._thinner.view(state))

    @property
    def _is_stuck(self) -> bool:
        """Return whether nothing can be written."""
        return self._level in ("full", "gone")

    def _unchanged(self) -> Outcome:
        """Return how the journal stands where there is nothing to write."""
        if gone := self.journal.gone():
            return self._lost(gone)
        return Outcome(True, self._turn("ok", "")) if self._level == "gone" else DURABLE

    def _lost(self, gone: str) -> Outcome:
        news = self._turn("gone", gone)
        if news is not None:
            self.journal.rescue()
        return Outcome(False, news)

    # -- one step ----------------------------------------------------------------------------------------------------
    def _take(self, step: EngineStep, wall: Micros) -> None:
        if not self.journal.is_taught:
            self._lesson.append(step)
        blob = self.journal.codec.encode(step)
        self._rows.append(
            StepRow(
                step.seq,
                step.at,
                wall,
                kind_of(step.input),
                tasks_of(step),
                blob,
                news_of(step) if self._outbox else (),
            )
        )
        self._rows_bytes += len(blob)
        if self._beside:
            self._items.append(step)

    # -- after a commit ------------------------------------------------------------------------------------------------
    def _cleanup(self, kept: int) -> None:
        """Write a snapshot, or teach the codec, when it is time; whatever fails here is tried again later."""
        try:
            if len(self._lesson) >= LESSON:
                lesson, self._lesson = self._lesson, []
                self.journal.teach(lesson)
            if self._shadow is not None:
                now = self._state().now
                fresh, self._fresh = self._fresh, None
                if fresh is not None and self._shadow.is_broken:
                    self._mend_at = self._clock() + MEND_S
                    self._shadow = Shadow(self.journal, fresh, self._cadence)
                elif fresh is not None:
                    self._shadow.reset(fresh, now)
                elif self._items:
                    self._shadow.take(self._items, now)
                self._items = []
            elif self._cadence.count(kept, self._state().now, self._state()):
                self.journal.append((), self._thinner.blocks(0, all_=True))
                self._put_snapshot(None)
        except Unwritable:
            return

    def _shadow_needs_state(self) -> bool:
        """Return whether what is followed begins anew with the state that is written now."""
        if self._shadow is None:
            return False
        return self._is_stuck or (self._shadow.is_broken and self._clock() >= self._mend_at)

    def _level_after(self, began: float, ended: float) -> JournalState | None:
        took = ended - began
        if took > SLOW_S:
            self._slow_at = ended
            text = f"a commit to {self.journal.where} took {took:.1f} s"
            return self._turn("slow", text)
        if self._is_stuck or (self._level == "slow" and ended - self._slow_at >= CALM_S):
            return self._turn("ok", "")
        return None

    def _turn(self, level: Level, text: str) -> JournalState | None:
        if level == self._level:
            return None
        self._level = level
        return JournalState(level, text)

    def _failed(self, error: Unwritable) -> Outcome:
        now = self._clock()
        self._retry_at = now + min(MOST_RETRY_S, max(RETRY_S, RESTS * (now - self._began)))
        self._bound()
        if isinstance(error, Gone):
            return self._lost(str(error))
        return Outcome(False, self._turn("full", str(error).replace("\n  help: ", "; ")))

    def _put_snapshot(self, gap: Gap | None) -> None:
        state = self._state()
        self.journal.snapshot(self.view(state), state.now, gap)
        if self._shadow is None:
            self._cadence.begin(state.now)

    def _bound(self, *, all_: bool = False) -> None:
        """Give up what waits, if it is too much (or all of it): a gap."""
        if not self._rows or not (all_ or self._rows_bytes > self._backlog_bytes):
            return
        first, last, gap = self._rows[0], self._rows[-1], self._gap
        why = "the journal could not be written for too long"
        if gap is None:
            self._gap = Gap(first.seq, last.seq, first.at, last.at, why)
        else:
            self._gap = Gap(gap.seq, last.seq, gap.at, last.at, why)
        self._rows, self._rows_bytes = [], 0


def kind_of(given: inp.Input) -> str:
    """Return the name of an input's kind, as it is kept."""
    return str(type(given).__struct_config__.tag)


def tasks_of(step: EngineStep) -> tuple[str, ...]:
    """Return the tasks that a step touched, in order."""
    found: dict[str, None] = {}
    for parts in ((step.input,), step.changes, step.effects):
        for part in parts:
            for finger in _FINGERS[type(part)]:
                task = finger(part)
                if task is not None:
                    found[holder_of(task)] = None
    found.pop("", None)
    return tuple(found)


Finger = Callable[[Any], str | None]
"""Tells the task that one field of a part of a step is about."""


def _named(part: Any) -> str | None:
    inside = part.task
    return inside if isinstance(inside, str) else getattr(inside, "id", None)


def _inside(name: str) -> Finger:
    def tell(part: Any) -> str | None:
        return getattr(getattr(part, name), "task", None)

    return tell


def _fingers(kind: type[Struct]) -> tuple[Finger, ...]:
    types = {one.name: one.type for one in msgspec.structs.fields(kind)}
    found: list[Finger] = []
    if "task" in types and kind not in (inp.Submit, inp.Serve, inp.Approve):  # there it is the name of a task
        found.append(_named)
    return (*found, *(_inside(name) for name in ("goal", "question", "order") if types.get(name, str) is not str))


class _ByKind(dict[type, tuple[Finger, ...]]):
    """Kind of a part -> where it names tasks; found when first asked for."""

    def __missing__(self, kind: type[Struct]) -> tuple[Finger, ...]:
        self[kind] = _fingers(kind)
        return self[kind]


_FINGERS: Final = _ByKind()
