"""The disk under a simulated engine: the real writer over a journal in memory, or over a real SQLite file; both can fail.

What a journal in memory keeps went through the real codec: a state comes back from bytes only.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from formiga_bt.base.clock import Micros
from formiga_bt.engine.drivers.persist import Outcome
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.codec import Codec
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Gap, Journal, KeptStep, StepRow, Unwritable
from formiga_bt.journal.thin import THINNED, Block, TrackPoint, pack, unpack
from formiga_bt.journal.writer import Writer

SLOW_S: Final = 0.8
"""So long a commit takes on a slow disk."""
SNAPSHOT_STEPS: Final = 400
NEVER: Final = 1_000_000_000
When = Literal["lost", "kept"]
"""A step whose commit did not come about, or one that was committed and whose effects never left."""


class Killed(Exception):  # noqa: N818 - it is no error
    """The engine's process is gone."""


class MemoryJournal:
    """A journal of bytes in memory."""

    site = where = "memory"
    is_taught = True

    def __init__(self) -> None:
        self.codec = Codec({}, 0)
        self.rows: list[tuple[int, Micros, Micros, str, bytes]] = []
        self.full = False
        self.on_write: Callable[[], None] = lambda: None
        self._snapshots: list[tuple[int, bytes]] = []
        self._points: list[tuple[str, bytes]] = []
        self._gaps: list[Gap] = []

    def _write(self) -> None:
        if self.full:
            raise Unwritable("the journal cannot be written: disk full\n  help: make room on its disk")
        self.on_write()

    def hurry(self, *, on: bool = True) -> None:
        """Wait for nobody: there is nobody else."""

    def begin(self, state: EngineState, wall: Micros, versions: Any = None, at: Micros | None = None) -> None:
        """Note a start."""
        del wall, versions, at
        self.snapshot(state, state.now)

    def append(self, rows: Sequence[StepRow], blocks: Sequence[Block] = ()) -> None:
        """Keep steps and way points."""
        self.stage(rows, blocks)()

    def stage(self, rows: Sequence[StepRow], blocks: Sequence[Block] = ()) -> Callable[[], None]:
        """Write steps and way points; return what makes them durable."""
        self._write()
        kept = [(row.seq, row.at, row.wall, row.kind, row.blob) for row in rows]
        points = [(block.agent, pack(block.points)) for block in blocks]

        def commit() -> None:
            self.rows += kept
            self._points += points

        return commit

    def snapshot(self, state: EngineState, at: Micros, gap: Gap | None = None) -> None:
        """Keep the whole state."""
        del at
        self._write()
        self._snapshots.append((state.seq, self.codec.encode_state(state)))
        if gap is not None:
            self._gaps.append(gap)

    # -- what `Past` reads ---------------------------------------------------------------------------------------------
    def last(self) -> tuple[int, Micros]:
        """Return number and time of the last step."""
        return (self.rows[-1][0], self.rows[-1][1]) if self.rows else (0, 0)

    def gone(self) -> str:
        """Return what became of its files: nothing ever does."""
        return ""

    def gaps(self) -> list[Gap]:
        """Return what is lost."""
        return self._gaps

    def snapshot_at(self, until: Micros | None = None, *, light: bool = False) -> EngineState | None:
        """Return the newest snapshot."""
        del until, light
        return self.codec.decode_state(self._snapshots[-1][1]) if self._snapshots else None

    def read(self, after: int = 0, to: int | None = None, *, until: Micros | None = None) -> Iterator[KeptStep]:
        """Return steps in order."""
        del to, until
        first = len(self.rows)
        while first and self.rows[first - 1][0] > after:
            first -= 1
        for seq, at, wall, kind, blob in self.rows[first:]:
            yield KeptStep(seq, at, wall, kind, self.codec.decode(blob))

    def points_at(self, agents: Iterable[str], after: int, until: Micros | None = None) -> dict[str, TrackPoint]:
        """Return the newest way point of each agent."""
        del agents, until
        found = {agent: unpack(blob)[-1] for agent, blob in self._points}
        return {agent: point for agent, point in found.items() if point.seq > after}


class Disk:
    """What an engine's steps go to; it may be full or slow, and it outlives engines.

    Args:
        file: of a real journal; None: in memory.
        now: seconds of a clock that never goes back.
        wall: wall time.
        backlog: bytes that may wait while it is full.
        ahead: the engine goes on while its steps are committed.
    """

    def __init__(
        self, file: Path | None, now: Callable[[], float], wall: Callable[[], Micros], backlog: int, ahead: bool
    ) -> None:
        self._file, self._now, self._wall, self._backlog = file, now, wall, backlog
        self._snapshot_steps = (
            NEVER if ahead else SNAPSHOT_STEPS
        )  # one of a live engine has steps that are not kept yet
        self._late_s = 0.0
        self.slow = False
        self.memory = MemoryJournal() if file is None else None
        if self.memory is not None:
            self.memory.on_write = self._take_time
        self.journal: Any = self.memory
        self.writer: Writer | None = None
        self.is_full = False

    def _take_time(self) -> None:
        if self.slow:
            self._late_s += SLOW_S

    def _clock(self) -> float:
        if self.slow and self.memory is None:
            self._late_s += SLOW_S  # asked before and after each commit
        return self._now() + self._late_s

    def take(self, state: Callable[[], EngineState]) -> None:
        """An engine begins to write."""
        self.fill(False)  # no engine starts on a full disk
        if self._file is not None:
            self.journal = Journal(self._file, "ten", durability="normal")
            self.journal.take(state().epoch)
        self.writer = Writer(
            self.journal, state, wall=self._wall, clock=self._clock, snapshot_steps=self._snapshot_steps,
            backlog_bytes=self._backlog,
        )  # fmt: skip
        self.writer.begin()

    def fill(self, full: bool) -> None:
        """No room is left on it, or there is again."""
        self.is_full = full
        if self.memory is not None:
            self.memory.full = full
        elif self.journal is not None and self.writer is not None:
            with self.journal.database.engine.connect() as connection:
                pages = connection.exec_driver_sql("PRAGMA page_count").scalar()
            raw = self.journal._writer()
            raw.exec_driver_sql(f"PRAGMA max_page_count = {pages if full else 1_000_000_000}")
            raw.rollback()

    def keep(self, step: EngineStep) -> Outcome:
        """Keep a step."""
        assert self.writer is not None
        return self.writer.keep((step,))

    @property
    def level(self) -> str:
        """Return how it stands, as the writer has it."""
        return self.writer._level if self.writer is not None else "ok"

    @property
    def waits(self) -> bool:
        """Return whether steps wait for room."""
        return self.writer is not None and bool(self.writer._rows or self.writer._gap)

    def close(self) -> None:
        """The engine that wrote is gone, without a word."""
        if self.memory is None and self.journal is not None:
            self.fill(False)
            self.journal.close()
        self.writer = None

    def found(self) -> tuple[EngineState, list[KeptStep]]:
        """Return the state that is read from it, and the last steps of it."""
        if self.memory is not None:
            tail = [KeptStep(*row[:4], self.memory.codec.decode(row[4])) for row in self.memory.rows[-1:]]
            return Past(self.memory).state(), tail  # type: ignore[arg-type]
        assert self._file is not None
        with Journal(self._file, "ten", read_only=True) as journal:
            last = journal.last()[0]
            return Past(journal).state(), list(journal.read(last - 1))

    def expected(self, state: EngineState) -> EngineState:
        """Return the engine's present state as it is to be found on it."""
        assert self.writer is not None
        return self.writer.view(state) if hasattr(self.writer, "view") else self.writer._thinner.view(state)


def bare(state: EngineState) -> bytes:
    """Return a state as bytes without what is thinned: telemetry, and why tasks that have ended got their agents."""
    none = dict.fromkeys(("position", "stood_at", "battery", "wind")) | dict.fromkeys(
        ("seq", "stamp", "heard_at", "heard_wall"), 0
    )
    assert set(none) == set(THINNED)
    agents = {name: msgspec.structs.replace(agent, **none) for name, agent in state.agents.items()}
    same = msgspec.structs.replace(state, agents=agents, now=0, explanations={}, deadlines={}, wall={})
    timers = sorted(map(repr, (*state.deadlines.items(), *state.wall.items())))
    return msgspec.json.encode((same, timers), order="sorted")
