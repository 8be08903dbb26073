"""How long history is kept, and what it takes: retention, compaction, figures.

The newest snapshot and every step after it stay whatever their age: what an engine needs to go on is never removed.
Called by whoever runs an engine, in a thread of its own (`Housekeeper`), and by hand. May run while an engine writes: it takes
little at a time.
"""

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import FormigaError, JournalError
from formiga_bt.journal import schema
from formiga_bt.journal.database import mapped, read_url, writing
from formiga_bt.journal.files import all_of, size_of
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal

DAY_US: Final[Micros] = 86_400 * SECOND
EVERY_S: Final = 3600.0
SLICE: Final = 1000
"""Steps that are removed at once: whoever writes waits for no more."""
log = logging.getLogger("formiga.journal")


class Retention(Struct, frozen=True, kw_only=True):
    """How long is kept; None = for ever."""

    history_days: float | None = 30.0
    """Steps and snapshots."""
    telemetry_days: float | None = 7.0
    """Way points. Beyond, an agent's place is known where a step tells it."""


class Removed(Struct, frozen=True):
    """What a compaction removed."""

    steps: int = 0
    snapshots: int = 0
    points: int = 0


def compact(journal: Journal, now: Micros, retention: Retention | None = None) -> Removed:
    """Remove what is older than is kept, and give its room back to the disk.

    Args:
        journal: need not be taken; an engine may write it meanwhile.
        now: engine time that ages are reckoned from.
        retention: by default 30 days of history and 7 of telemetry.

    Raises:
        JournalError: it cannot be read or written.
    """
    rule = retention or Retention()
    removed = Removed()
    if journal.number is None:
        return removed
    if rule.history_days is not None:
        removed = _forget_history(journal, now - round(rule.history_days * DAY_US))
    if rule.telemetry_days is not None:
        removed = Removed(
            removed.steps, removed.snapshots,
            removed.points + _forget_points(journal, now - round(rule.telemetry_days * DAY_US)),
        )  # fmt: skip
    if journal.database.is_sqlite:
        _give_room_back(journal)
    return removed


def _forget_history(journal: Journal, before: Micros) -> Removed:
    """Remove the steps before a moment; the state of that moment becomes the first snapshot."""
    at = schema.snapshots.c
    mine = at.site == journal.number
    with mapped(journal.where), journal.database.engine.connect() as connection:
        base = connection.execute(
            sa.select(at.epoch, at.seq, at.at_us).where(mine, at.at_us <= before)
            .order_by(at.epoch.desc(), at.seq.desc()).limit(1)
        ).first()  # fmt: skip
        oldest = connection.execute(
            sa.select(sa.func.min(schema.steps.c.at_us)).where(schema.steps.c.site == journal.number)
        ).scalar()
    if base is None or oldest is None or oldest > before:
        return Removed()
    state = Past(journal).state(before)
    # Its own snapshot, so that the time between is not kept for its sake. One of the same step may be there: an earlier one
    # lacks way points that are removed next, and before a later one there would be nothing.
    with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
        row = {"site": journal.number, "epoch": base.epoch, "seq": state.seq, "at_us": before}
        connection.execute(sa.delete(schema.snapshots).where(mine, at.epoch == base.epoch, at.seq == state.seq))
        connection.execute(sa.insert(schema.snapshots), {**row, "blob": journal.codec.encode_state(state)})
    steps = _forget_steps(journal, state.seq)
    with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
        older = mine & ((at.epoch < base.epoch) | ((at.epoch == base.epoch) & (at.seq < state.seq)))
        snapshots = connection.execute(sa.delete(schema.snapshots).where(older)).rowcount
        gone = schema.gaps.c
        connection.execute(sa.delete(schema.gaps).where(gone.site == journal.number, gone.to_seq <= state.seq))
        way = schema.telemetry.c
        points = way.site == journal.number
        points &= way.to_seq <= state.seq
        count = connection.execute(sa.select(sa.func.sum(way.points)).where(points)).scalar() or 0
        connection.execute(sa.delete(schema.telemetry).where(points))
    return Removed(steps, snapshots, int(count))


def _forget_steps(journal: Journal, last: int) -> int:
    removed = 0
    table, index = schema.steps.c, schema.step_tasks.c
    while True:
        with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
            seqs = list(
                connection.execute(
                    sa.select(table.seq).where(table.site == journal.number, table.seq <= last)
                    .order_by(table.seq).limit(SLICE)
                ).scalars()
            )  # fmt: skip
            if not seqs:
                return removed
            connection.execute(sa.delete(schema.steps).where(table.site == journal.number, table.seq <= seqs[-1]))
            told = schema.news.c
            connection.execute(sa.delete(schema.news).where(told.site == journal.number, told.seq <= seqs[-1]))
            connection.execute(sa.delete(schema.step_tasks).where(index.site == journal.number, index.seq <= seqs[-1]))
            removed += len(seqs)


def _forget_points(journal: Journal, before: Micros) -> int:
    """Remove way points of before a moment, but not those after its snapshot: that moment, and later ones, need them."""
    way, at = schema.telemetry.c, schema.snapshots.c
    with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
        newest = connection.execute(
            sa.select(at.seq).where(at.site == journal.number, at.at_us <= before)
            .order_by(at.epoch.desc(), at.seq.desc()).limit(1)
        ).scalar()  # fmt: skip
        if newest is None:
            return 0
        old = (way.site == journal.number) & (way.to_us < before) & (way.to_seq <= newest)
        count = connection.execute(sa.select(sa.func.sum(way.points)).where(old)).scalar() or 0
        connection.execute(sa.delete(schema.telemetry).where(old))
    return int(count)


def _give_room_back(journal: Journal) -> None:
    free, before = 1, -1
    while free and free != before:
        with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
            raw: Any = connection.connection.dbapi_connection
            before = raw.execute("PRAGMA freelist_count").fetchone()[0]
            raw.execute("PRAGMA incremental_vacuum(500)").fetchall()
            free = raw.execute("PRAGMA freelist_count").fetchone()[0]


class Housekeeper:
    """Compacts a journal at the start, and each hour, in a thread of its own.

    Args:
        journal: of an engine that runs.
        now: engine time.
        retention: how long is kept.
    """

    def __init__(self, journal: Journal, now: Callable[[], Micros], retention: Retention | None = None) -> None:
        self._journal, self._now, self._retention = journal, now, retention
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="formiga-journal", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End it, after what it does now."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(5.0)

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                compact(self._journal, self._now(), self._retention)
            except FormigaError as error:
                log.warning("old history is still kept: %s", error)
            self._stop.wait(EVERY_S)


# -- figures -----------------------------------------------------------------------------------------------------------
class JournalStats(Struct, frozen=True):
    """What a journal holds of a site."""

    site: str
    where: str
    steps: int
    kinds: dict[str, int]
    """Steps by the kind of their input."""
    points: int
    snapshots: int
    starts: int
    bundles: int
    gaps: int
    first: Micros | None
    """Engine time of the earliest moment that can be looked at."""
    last: Micros | None
    bytes_steps: int
    bytes_points: int
    bytes_snapshots: int
    bytes_file: int | None
    """Of the SQLite file; other sites may be in it."""


def stats(journal: Journal) -> JournalStats:
    """Return what a journal holds.

    Raises:
        JournalError: it cannot be read.
    """
    number = journal.number
    with mapped(journal.where), journal.database.engine.connect() as connection:

        def one(table: sa.Table, *what: Any) -> Any:
            return connection.execute(sa.select(*what).select_from(table).where(table.c.site == number)).one()

        count = sa.func.count()
        length = sa.func.coalesce(sa.func.sum(sa.func.length(schema.steps.c.blob)), 0)
        steps, bytes_steps, last = one(schema.steps, count, length, sa.func.max(schema.steps.c.at_us))
        kinds = connection.execute(
            sa.select(schema.steps.c.kind, count).where(schema.steps.c.site == number)
            .group_by(schema.steps.c.kind).order_by(count.desc(), schema.steps.c.kind)
        ).all()  # fmt: skip
        way, shots = schema.telemetry, schema.snapshots
        points, bytes_points = one(
            way,
            sa.func.coalesce(sa.func.sum(way.c.points), 0),
            sa.func.coalesce(sa.func.sum(sa.func.length(way.c.blob)), 0),
        )
        snapshots, bytes_snapshots, first = one(
            shots, count, sa.func.coalesce(sa.func.sum(sa.func.length(shots.c.blob)), 0), sa.func.min(shots.c.at_us)
        )
        others = [one(table, count)[0] for table in (schema.starts, schema.bundles, schema.gaps)]
    return JournalStats(
        site=journal.site, where=journal.where, steps=steps, kinds={row[0]: row[1] for row in kinds},
        points=int(points), snapshots=snapshots, starts=others[0], bundles=others[1], gaps=others[2],
        first=first, last=last, bytes_steps=int(bytes_steps), bytes_points=int(bytes_points),
        bytes_snapshots=int(bytes_snapshots), bytes_file=file_bytes(journal.where),
    )  # fmt: skip


def file_bytes(where: str) -> int | None:
    """Return how much of the disk an SQLite journal takes, with what waits in its write-ahead log; None: it is no file.

    Raises:
        JournalError: it cannot be read.
    """
    url = read_url(where)
    if url.get_backend_name() != "sqlite" or not url.database:
        return None
    file = Path(url.database)
    try:
        return sum(size_of(one) or 0 for one in all_of(file)[:2])
    except OSError as error:
        raise JournalError(f"cannot read {file}: {error.strerror or error}") from error
