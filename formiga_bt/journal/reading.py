"""Reading a journal: steps, snapshots, way points, starts, files. Also while an engine writes it."""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import msgspec
import sqlalchemy as sa
from sqlalchemy import Connection
from sqlalchemy.exc import SQLAlchemyError

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal import codec, schema
from formiga_bt.journal.database import CHECK_BYTES, Database, Durability, mapped, read_url, told
from formiga_bt.journal.outbox import NewsItem
from formiga_bt.journal.records import BundleRow, Gap, KeptStep, Start
from formiga_bt.journal.thin import TrackPoint, unpack

PAGE: Final = 1000
"""Steps that are read at once."""


class Readable:
    """The journal of one site, to be read.

    Args:
        where: path of an SQLite file, or URL of a database.
        site: name of the site.
        durability: of commits.
        read_only: only look; the journal must be there.
    """

    def __init__(self, where: str | Path, site: str, durability: Durability, *, read_only: bool) -> None:
        self.site = site
        self.database = Database(where, durability=durability, create=not read_only)
        self.where = self.database.where
        self.read_only = read_only
        try:
            self._open()
        except BaseException:
            self.database.close()
            raise

    def _open(self) -> None:
        if self.read_only:
            self.database.check()
        else:
            self.database.prepare()
        with self._reading() as connection:
            self.number = connection.execute(
                sa.select(schema.sites.c.site).where(schema.sites.c.name == self.site)
            ).scalar()  # None: nothing was written for this site yet
            found = connection.execute(sa.select(schema.words.c.id, schema.words.c.version, schema.words.c.data)).all()
        self._dictionaries = {row.id: row.data for row in found}
        self._taught = max(((row.id, row.version) for row in found), default=(0, ""))
        self.codec = codec.Codec(self._dictionaries, self._taught[0])

    def _reading(self) -> "_Reading":
        return _Reading(self.database)

    def damage(self) -> str:
        """Return what is wrong with an SQLite file; an empty text if nothing is, or if it is too large to be looked through."""
        file = self.database.file
        if file is None or self.number is None or file.stat().st_size > CHECK_BYTES:
            return ""
        with self._reading() as connection:
            said = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar()
        return "" if said == "ok" else str(said)

    def bundles(self) -> list[BundleRow]:
        """Return all bundles of the site, with their files."""
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(schema.bundles).where(schema.bundles.c.site == self.number)
                .order_by(schema.bundles.c.epoch, schema.bundles.c.name, schema.bundles.c.bundle)
            ).all()  # fmt: skip
            wanted = sorted({one for row in rows for one in json.loads(row.files).values()})
            texts: dict[str, str] = {}
            for first in range(0, len(wanted), PAGE // 2):
                part = wanted[first : first + PAGE // 2]
                found = connection.execute(
                    sa.select(schema.texts.c.hash, schema.texts.c.text).where(schema.texts.c.hash.in_(part))
                )
                texts.update({row.hash: row.text for row in found})
        return [
            BundleRow(
                row.name, row.bundle, row.file, {path: texts[one] for path, one in json.loads(row.files).items()},
                row.origin, row.epoch,
            )
            for row in rows
        ]  # fmt: skip

    def last(self) -> tuple[int, Micros]:
        """Return `seq` and engine time of the last step that was written; zeros if there is none."""
        with self._reading() as connection:
            row = connection.execute(
                sa.select(schema.sites.c.seq, schema.sites.c.at_us).where(schema.sites.c.site == self.number)
            ).first()
        return (0, 0) if row is None else (row.seq, row.at_us)

    def seq_at(self, at: Micros) -> int:
        """Return `seq` of the last step that is kept not later than a moment; 0 if there is none."""
        step = schema.steps.c
        with self._reading() as connection:
            row = connection.execute(
                sa.select(step.seq).where(step.site == self.number, step.at_us <= at)
                .order_by(step.at_us.desc(), step.seq.desc()).limit(1)
            ).first()  # fmt: skip
        return 0 if row is None else row.seq

    def seq_after(self, at: Micros) -> int | None:
        """Return `seq` of the first step that is kept after a moment; None: there is none."""
        step = schema.steps.c
        with self._reading() as connection:
            return connection.execute(
                sa.select(step.seq).where(step.site == self.number, step.at_us > at)
                .order_by(step.at_us, step.seq).limit(1)
            ).scalar()  # fmt: skip

    def starts(self) -> list[Start]:
        """Return the starts of engines, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(schema.starts).where(schema.starts.c.site == self.number).order_by(schema.starts.c.epoch)
            ).all()
        return [
            Start(row.epoch, row.seq, row.at_us, row.wall_us, json.loads(row.versions), row.ended_us) for row in rows
        ]

    def gaps(self) -> list[Gap]:
        """Return what could not be written, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(schema.gaps).where(schema.gaps.c.site == self.number).order_by(schema.gaps.c.seq)
            ).all()
        return [Gap(row.seq, row.to_seq, row.at_us, row.to_us, row.why) for row in rows]

    def read(
        self, after: int = 0, to: int | None = None, *, until: Micros | None = None, task: str = ""
    ) -> Iterator[KeptStep]:
        """Return kept steps in order.

        Args:
            after: `seq` of the step before the first.
            to: `seq` of the last; None = to the end.
            until: engine time of the last.
            task: only steps that touched this task.

        Raises:
            JournalError: a step is damaged, or was written by a newer version.
        """
        at = schema.steps.c
        query = sa.select(at.seq, at.at_us, at.wall_us, at.kind, at.blob).where(at.site == self.number)
        if task:
            index = schema.step_tasks.c
            query = query.join(
                schema.step_tasks, (index.site == at.site) & (index.seq == at.seq) & (index.task == task)
            )
        if until is not None:  # by its number: else all that comes after it would be looked at
            last = self.seq_at(until)
            to = last if to is None else min(to, last)
        if to is not None:
            query = query.where(at.seq <= to)
        while True:
            with self._reading() as connection:
                rows = connection.execute(query.where(at.seq > after).order_by(at.seq).limit(PAGE)).all()
            for row in rows:
                yield KeptStep(row.seq, row.at_us, row.wall_us, row.kind, self._decode(row.blob, row.seq))
            if len(rows) < PAGE:
                return
            after = rows[-1].seq

    def news(self, after: int, *, urgent: bool, most: int) -> list[NewsItem]:
        """Return the oldest news of steps after one: those that are urgent, or those that are not.

        Args:
            after: `seq` of a step.
            urgent: which.
            most: so many, and the rest of the last step.

        Raises:
            JournalError: the journal cannot be read.
        """
        at = schema.news.c
        query = sa.select(at.seq, at.blob).where(at.site == self.number, at.urgent == urgent).order_by(at.seq, at.n)
        with self._reading() as connection:
            rows = list(connection.execute(query.where(at.seq > after).limit(most)))
            if len(rows) == most:
                last = rows[-1].seq
                rows = [row for row in rows if row.seq < last] + list(connection.execute(query.where(at.seq == last)))
        return [msgspec.json.decode(row.blob, type=NewsItem) for row in rows]

    def _decode(self, blob: bytes, seq: int) -> EngineStep:
        self._know(blob)
        return self.codec.decode(blob, f"step {seq}")

    def _know(self, blob: bytes) -> None:
        """Read the dictionaries anew if the writer has taught another one since."""
        if len(blob) > 1 and blob[1] and blob[1] not in self._dictionaries:
            with self._reading() as connection:
                rows = connection.execute(sa.select(schema.words.c.id, schema.words.c.data)).all()
            self._dictionaries = {row.id: row.data for row in rows}
            self.codec = codec.Codec(self._dictionaries, max(self._dictionaries, default=0))

    def snapshot_at(self, until: Micros | None = None, *, light: bool = False) -> EngineState | None:
        """Return the newest snapshot of a moment, or of all time; None: there is none. `light`: see `Codec.decode_state`."""
        at = schema.snapshots.c
        query = sa.select(at.blob, at.seq).where(at.site == self.number)
        if until is not None:
            query = query.where(at.at_us <= until)
        with self._reading() as connection:
            row = connection.execute(query.order_by(at.epoch.desc(), at.seq.desc()).limit(1)).first()
        if row is None:
            return None
        self._know(row.blob)
        return self.codec.decode_state(row.blob, f"the snapshot after step {row.seq}", light=light)

    def first_snapshot_at(self) -> Micros | None:
        """Return the engine time of the oldest snapshot."""
        at = schema.snapshots.c
        with self._reading() as connection:
            return connection.execute(sa.select(sa.func.min(at.at_us)).where(at.site == self.number)).scalar()

    def snapshots(self) -> list[tuple[int, Micros]]:
        """Return `seq` and engine time of each snapshot, oldest first."""
        at = schema.snapshots.c
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(at.seq, at.at_us).where(at.site == self.number).order_by(at.epoch, at.seq)
            ).all()
        return [(row.seq, row.at_us) for row in rows]

    def way(self, agent: str = "", since: Micros = 0, until: Micros | None = None) -> Iterator[tuple[str, TrackPoint]]:
        """Return the way points of an agent, or of all, agent by agent in order of time."""
        at = schema.telemetry.c
        query = sa.select(at.agent, at.seq, at.blob).where(at.site == self.number, at.to_us >= since)
        if agent:
            query = query.where(at.agent == agent)
        if until is not None:
            query = query.where(at.at_us <= until)
        with self._reading() as connection:
            rows: Iterable[Any] = connection.execute(query.order_by(at.agent, at.seq)).all()
        for row in rows:
            for point in unpack(row.blob):
                if point.at >= since and (until is None or point.at <= until):
                    yield row.agent, point

    def points_at(self, agents: Iterable[str], after: int, until: Micros | None = None) -> dict[str, TrackPoint]:
        """Return the newest way point of each of these agents: of steps after `after`, not later than `until`."""
        at = schema.telemetry.c
        mine = (at.site == self.number) & (at.agent == sa.bindparam("name"))
        if until is not None:
            mine &= at.at_us <= until
            later = self.seq_after(until)
            mine &= at.seq < later if later is not None else sa.true()
        newest = sa.select(at.to_seq, at.blob).where(mine).order_by(at.seq.desc()).limit(1)
        found: dict[str, TrackPoint] = {}
        with self._reading() as connection:
            for name in agents:
                row = connection.execute(newest, {"name": name}).first()
                for point in unpack(row.blob) if row is not None and row.to_seq > after else ():
                    if point.seq > after and (until is None or point.at <= until):
                        found[name] = point
        return found


def sites_of(where: str | Path) -> list[str]:
    """Return the names of the sites whose history a journal holds.

    Raises:
        JournalError: there is no journal, or it cannot be read.
    """
    database = Database(where, create=False)
    try:
        database.check()
        with _Reading(database) as connection:
            return list(connection.execute(sa.select(schema.sites.c.name).order_by(schema.sites.c.name)).scalars())
    finally:
        database.close()


def others_in(where: str | Path, site: str) -> list[str]:
    """Return the sites whose history is in a file in which a site begins one; none, if there is none or it has one already.

    What makes the file no journal is told by whoever opens it to write.
    """
    file = read_url(str(where)).database if read_url(str(where)).get_backend_name() == "sqlite" else None
    if not file or not Path(file).is_file() or not Path(file).stat().st_size:
        return []
    try:
        found = sites_of(where)
    except JournalError:
        return []
    return [] if site in found else found


class _Reading:
    """A connection that reads, with errors told as ours."""

    def __init__(self, database: Database) -> None:
        self._where = database.where
        self._engine = database.engine
        self._connection: Connection | None = None

    def __enter__(self) -> Connection:
        with mapped(self._where):
            self._connection = self._engine.connect()
        return self._connection

    def __exit__(self, kind: Any, error: BaseException | None, trace: TracebackType | None) -> None:
        assert self._connection is not None
        try:
            self._connection.close()
        except SQLAlchemyError as late:
            error = error or late
        if isinstance(error, SQLAlchemyError):
            raise JournalError(told(self._where, error)) from error
