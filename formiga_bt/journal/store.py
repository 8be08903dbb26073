"""A journal: the steps of one site, in order, in a database.

One engine at a time writes (`Journal.take`), anybody may read, also while it writes. A commit writes all steps that it is given
or none, and only while this engine has the site: one whose epoch was overtaken writes nothing any more.
"""

import hashlib
import json
import os
import platform
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal

import sqlalchemy as sa
from msgspec import Struct
from sqlalchemy import Connection
from sqlalchemy.exc import SQLAlchemyError

from formiga_bt import __version__
from formiga_bt.clock import Micros
from formiga_bt.engine.inputs import Step
from formiga_bt.engine.state import EngineState
from formiga_bt.errors import JournalError, SiteError
from formiga_bt.journal import codec, schema
from formiga_bt.journal.database import Database, Durability, Prepared, mapped, told, writing
from formiga_bt.journal.thin import Block, Point, pack, unpack

NODE_STATE_VERSION: Final = 1
"""Of what nodes remember; a start with another one cannot go on with running trees."""
PAGE: Final = 1000
"""Steps that are read at once."""
CHECK_BYTES: Final = 256 * 1024 * 1024
"""A smaller SQLite file is looked through after an end that was not clean."""
DICTIONARIES: Final = 255


class Row(Struct, frozen=True):
    """A step ready to be written."""

    seq: int
    at: Micros
    wall: Micros
    kind: str
    tasks: tuple[str, ...]
    blob: bytes


class Kept(Struct, frozen=True):
    """A step as it was written."""

    seq: int
    at: Micros
    wall: Micros
    """Wall time when it was written."""
    kind: str
    step: Step


class Start(Struct, frozen=True):
    """A start of an engine."""

    epoch: int
    seq: int
    """Its first step comes after."""
    at: Micros
    wall: Micros
    versions: dict[str, str]
    ended: Micros | None
    """Wall time of its clean end."""


class BundleRow(Struct, frozen=True):
    """The exact files of a task (or of the site) that an engine had."""

    name: str
    """The task; `!site` = the site file and the catalogue."""
    bundle: str
    file: str
    texts: dict[str, str]
    origin: Literal["base", "loaded"]
    epoch: int


SITE_FILES: Final = "!site"


class Overtaken(SiteError):  # noqa: N818 - it names the state
    """Another engine took the site: this one may not write any more."""


class Unwritable(JournalError):  # noqa: N818 - it names the state
    """The journal cannot be written now: its disk is full, or its server is away. Nothing was written."""


class Journal:
    """The journal of one site; a context manager.

    Args:
        where: path of an SQLite file, or URL of a database.
        site: name of the site.
        durability: of commits.
        read_only: only look; the journal must be there.

    Raises:
        JournalError: it is damaged, newer, not ours, or cannot be reached; it was left as it is.
    """

    def __init__(
        self, where: str | Path, site: str, *, durability: Durability = "full", read_only: bool = False
    ) -> None:
        self.site = site
        self.database = Database(where, durability=durability, create=not read_only)
        self.where = self.database.where
        self.read_only = read_only
        self.epoch = 0
        self._release: Callable[[], None] | None = None
        self._write: Connection | None = None
        self._hot = _Hot(self.database)
        try:
            self._open()
        except BaseException:
            self.database.engine.dispose()
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

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the site back; may be called twice."""
        if self._release is not None:
            with suppress(SQLAlchemyError):  # its session has ended, and the lock with it
                self._release()
            self._release = None
        if self._write is not None:
            self._write.close()
            self._write = None
        self.database.engine.dispose()

    def _reading(self) -> "_Reading":
        return _Reading(self.database)

    # -- writing: who ------------------------------------------------------------------------------------------------
    def take(self, at_least: int = 1) -> int:
        """Take the site for an engine; return the epoch of this start, one higher than any before.

        Args:
            at_least: the epoch is not lower than this.

        Raises:
            SiteError: another engine has it.
            JournalError: the journal cannot be written.
        """
        assert not self.read_only, "opened to be read"
        with mapped(self.where):
            self._write = self.database.engine.connect()
            self._release = self.database.lock(self.site, self._write)
            if self._release is None:
                raise SiteError(self._taken())
            self._check_after_crash()
            with writing(self._write) as connection:
                self._teach(connection, codec.dictionary(), "", only_first=True)
                row = connection.execute(sa.select(schema.sites).where(schema.sites.c.name == self.site)).first()
                self.epoch = max(at_least, 1 if row is None else row.epoch + 1)
                holder = f"process {os.getpid()} on {socket.gethostname()}"
                if row is None:
                    values = {"name": self.site, "epoch": self.epoch, "seq": 0, "at_us": 0, "holder": holder}
                    made = connection.execute(sa.insert(schema.sites).values(values)).inserted_primary_key
                    assert made is not None
                    self.number = made[0]
                else:
                    self.number = row.site
                    connection.execute(
                        sa.update(schema.sites)
                        .where(schema.sites.c.site == self.number)
                        .values(epoch=self.epoch, holder=holder)
                    )
        return self.epoch

    def _taken(self) -> str:
        with self._reading() as connection:
            holder = connection.execute(
                sa.select(schema.sites.c.holder).where(schema.sites.c.name == self.site)
            ).scalar()
        who = f" ({holder})" if holder else ""
        return (
            f"another engine writes the journal of the site '{self.site}' in {self.where}{who}\n"
            "  help: use that one, or end it first: formiga down"
        )

    def _check_after_crash(self) -> None:
        file = self.database.file
        if file is None or self.number is None or file.stat().st_size > CHECK_BYTES:
            return
        last = self.starts()[-1:]
        if last and last[0].ended is None:
            with self._reading() as connection:
                said = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar()
            if said != "ok":
                raise JournalError(f"the journal {self.where} is damaged: {said}\n  help: {codec.RESTORE}")

    def _writer(self) -> Connection:
        assert self._write is not None, "take() the site first"
        if self._write.closed or self._write.invalidated:
            self._write.close()
            self._write = self.database.engine.connect()
            if not self.database.is_sqlite:
                # The session ended, and its lock with it. A server that has not noticed may still hold it for that session,
                # so who has the lock decides nothing here; whose epoch it is does, in each commit.
                self._release = self.database.lock(self.site, self._write)
        return self._write

    # -- writing: what -----------------------------------------------------------------------------------------------
    def begin(
        self, state: EngineState, wall: Micros, versions: Mapping[str, str] | None = None, at: Micros | None = None
    ) -> None:
        """Note a start of the engine, with the state that it begins with.

        Args:
            state: its `seq` and `now` are not before those of the last step.
            wall: wall time.
            versions: of libraries; those of formiga and Python are added.
            at: engine time of the start, if that is after the state's own.
        """
        said = {"formiga": __version__, "python": platform.python_version(), "node_state": str(NODE_STATE_VERSION)}
        begun = max(state.now, at or 0)
        row = {
            "site": self.number, "epoch": self.epoch, "seq": state.seq, "at_us": begun, "wall_us": wall,
            "versions": json.dumps({**said, **(versions or {})}), "ended_us": None,
        }  # fmt: skip
        with self._transaction(state.seq, state.now) as connection:
            connection.execute(sa.insert(schema.starts), row)
            self._put_snapshot(connection, state, begun)

    def append(self, rows: Sequence[Row], blocks: Sequence[Block] = ()) -> None:
        """Write steps and way points: all of them or nothing, durable when this returns.

        Raises:
            Unwritable: they cannot be written now.
            Overtaken: another engine has the site.
        """
        with self._transaction(rows[-1].seq if rows else None, rows[-1].at if rows else None) as connection:
            if rows:
                self._hot.steps.run(connection, *(self._step_row(row) for row in rows))
                touched = [{"site": self.number, "task": task, "seq": row.seq} for row in rows for task in row.tasks]
                if touched:
                    self._hot.step_tasks.run(connection, *touched)
            if blocks:
                connection.execute(sa.insert(schema.telemetry), [self._block_row(block) for block in blocks])

    def _step_row(self, row: Row) -> dict[str, Any]:
        return {
            "site": self.number, "seq": row.seq, "at_us": row.at, "wall_us": row.wall, "kind": row.kind, "blob": row.blob,
        }  # fmt: skip

    def _block_row(self, block: Block) -> dict[str, Any]:
        first, last = block.points[0], block.points[-1]
        return {
            "site": self.number, "agent": block.agent, "seq": first.seq, "to_seq": last.seq,
            "at_us": first.at, "to_us": last.at, "points": len(block.points), "blob": pack(block.points),
        }  # fmt: skip

    def snapshot(self, state: EngineState, at: Micros, gap: "Gap | None" = None) -> None:
        """Keep the whole state, as of its `seq`.

        Args:
            state: as the fold of what is kept has it.
            at: engine time, not before the state's own; of its way points.
            gap: what comes before it and is lost.

        Raises:
            Unwritable: it cannot be written now.
            Overtaken: another engine has the site.
        """
        with self._transaction(state.seq, state.now) as connection:
            self._put_snapshot(connection, state, at)
            if gap is not None:
                row = {"site": self.number, "seq": gap.seq, "to_seq": gap.to_seq, "at_us": gap.at, "to_us": gap.to_at}
                connection.execute(sa.insert(schema.gaps), {**row, "why": gap.why})

    def _put_snapshot(self, connection: Connection, state: EngineState, when: Micros) -> None:
        row = {"site": self.number, "epoch": self.epoch, "seq": state.seq, "at_us": when}
        at = (schema.snapshots.c.site == self.number) & (schema.snapshots.c.epoch == self.epoch)
        connection.execute(sa.delete(schema.snapshots).where(at, schema.snapshots.c.seq == state.seq))
        connection.execute(sa.insert(schema.snapshots), {**row, "blob": self.codec.encode_state(state)})

    def end(self, wall: Micros) -> None:
        """Note the clean end of this start."""
        mine = (schema.starts.c.site == self.number) & (schema.starts.c.epoch == self.epoch)
        with self._transaction(None, None) as connection:
            connection.execute(sa.update(schema.starts).where(mine).values(ended_us=wall))

    def teach(self, steps: Sequence[Step]) -> None:
        """Learn from steps of this site how to keep steps in less room; once for each version of formiga."""
        if self.is_taught:
            return
        with self._transaction(None, None) as connection:
            self._teach(connection, codec.learned(steps), __version__)

    @property
    def is_taught(self) -> bool:
        """Return whether steps of this version were learned from, or none can be any more."""
        return self._taught[1] == __version__ or self._taught[0] >= DICTIONARIES

    def _teach(self, connection: Connection, data: bytes, version: str, *, only_first: bool = False) -> None:
        rows = connection.execute(sa.select(schema.words.c.id, schema.words.c.version, schema.words.c.data)).all()
        known = {row.id: row.data for row in rows}
        number = max(known, default=0)
        if not (only_first and known) and number < DICTIONARIES:
            number += 1
            connection.execute(sa.insert(schema.words), {"id": number, "version": version, "data": data})
            known[number] = data
            self._taught = (number, version)
        self._dictionaries = known
        self.codec = codec.Codec(known, number)

    def _transaction(self, seq: int | None, at: Micros | None) -> "_Transaction":
        return _Transaction(self, seq, at)

    # -- bundles -----------------------------------------------------------------------------------------------------
    def keep_bundle(self, name: str, bundle: str, file: str, texts: Mapping[str, str], origin: str = "base") -> None:
        """Keep the exact files of a task under their hashes; may be called from any thread.

        Raises:
            JournalError: they cannot be written.
        """
        hashes = {path: hashlib.sha256(text.encode()).hexdigest() for path, text in texts.items()}
        with mapped(self.where), self.database.engine.connect() as plain, writing(plain) as connection:
            known = set(
                connection.execute(
                    sa.select(schema.texts.c.hash).where(schema.texts.c.hash.in_(list(hashes.values())))
                ).scalars()
            )
            new = {one: texts[path] for path, one in hashes.items() if one not in known}
            if new:
                connection.execute(sa.insert(schema.texts), [{"hash": h, "text": text} for h, text in new.items()])
            at = schema.bundles.c
            mine = (at.site == self.number) & (at.name == name) & (at.bundle == bundle)
            connection.execute(sa.delete(schema.bundles).where(mine))
            row = {"site": self.number, "name": name, "bundle": bundle, "file": file, "files": json.dumps(hashes)}
            connection.execute(sa.insert(schema.bundles), {**row, "origin": origin, "epoch": self.epoch})

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

    # -- reading -----------------------------------------------------------------------------------------------------
    def last(self) -> tuple[int, Micros]:
        """Return `seq` and engine time of the last step that was written; zeros if there is none."""
        with self._reading() as connection:
            row = connection.execute(
                sa.select(schema.sites.c.seq, schema.sites.c.at_us).where(schema.sites.c.site == self.number)
            ).first()
        return (0, 0) if row is None else (row.seq, row.at_us)

    def starts(self) -> list[Start]:
        """Return the starts of engines, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(schema.starts).where(schema.starts.c.site == self.number).order_by(schema.starts.c.epoch)
            ).all()
        return [
            Start(row.epoch, row.seq, row.at_us, row.wall_us, json.loads(row.versions), row.ended_us) for row in rows
        ]

    def gaps(self) -> "list[Gap]":
        """Return what could not be written, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(
                sa.select(schema.gaps).where(schema.gaps.c.site == self.number).order_by(schema.gaps.c.seq)
            ).all()
        return [Gap(row.seq, row.to_seq, row.at_us, row.to_us, row.why) for row in rows]

    def read(
        self, after: int = 0, to: int | None = None, *, until: Micros | None = None, task: str = ""
    ) -> Iterator[Kept]:
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
        if to is not None:
            query = query.where(at.seq <= to)
        if until is not None:
            query = query.where(at.at_us <= until)
        while True:
            with self._reading() as connection:
                rows = connection.execute(query.where(at.seq > after).order_by(at.seq).limit(PAGE)).all()
            for row in rows:
                yield Kept(row.seq, row.at_us, row.wall_us, row.kind, self._decode(row.blob, row.seq))
            if len(rows) < PAGE:
                return
            after = rows[-1].seq

    def _decode(self, blob: bytes, seq: int) -> Step:
        self._know(blob)
        return self.codec.decode(blob, f"step {seq}")

    def _know(self, blob: bytes) -> None:
        """Read the dictionaries anew if the writer has taught another one since."""
        if len(blob) > 1 and blob[1] and blob[1] not in self._dictionaries:
            with self._reading() as connection:
                rows = connection.execute(sa.select(schema.words.c.id, schema.words.c.data)).all()
            self._dictionaries = {row.id: row.data for row in rows}
            self.codec = codec.Codec(self._dictionaries, max(self._dictionaries, default=0))

    def snapshot_at(self, until: Micros | None = None) -> EngineState | None:
        """Return the newest snapshot of a moment, or of all time; None: there is none."""
        at = schema.snapshots.c
        query = sa.select(at.blob, at.seq).where(at.site == self.number)
        if until is not None:
            query = query.where(at.at_us <= until)
        with self._reading() as connection:
            row = connection.execute(query.order_by(at.epoch.desc(), at.seq.desc()).limit(1)).first()
        if row is None:
            return None
        self._know(row.blob)
        return self.codec.decode_state(row.blob, f"the snapshot after step {row.seq}")

    def first_snapshot_at(self) -> Micros | None:
        """Return the engine time of the oldest snapshot."""
        at = schema.snapshots.c
        with self._reading() as connection:
            return connection.execute(sa.select(sa.func.min(at.at_us)).where(at.site == self.number)).scalar()

    def way(self, agent: str = "", since: Micros = 0, until: Micros | None = None) -> Iterator[tuple[str, Point]]:
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

    def points_at(self, after: int, until: Micros | None = None) -> dict[str, Point]:
        """Return the newest way point of each agent: of steps after `after`, not later than `until`."""
        at = schema.telemetry.c
        newest = sa.select(at.agent, sa.func.max(at.seq).label("seq")).where(at.site == self.number, at.to_seq > after)
        if until is not None:
            newest = newest.where(at.at_us <= until)
        chosen = newest.group_by(at.agent).subquery()
        query = sa.select(at.agent, at.blob).where(
            at.site == self.number, at.agent == chosen.c.agent, at.seq == chosen.c.seq
        )
        found: dict[str, Point] = {}
        with self._reading() as connection:
            rows = connection.execute(query).all()
        for row in rows:
            for point in unpack(row.blob):
                if point.seq > after and (until is None or point.at <= until):
                    found[row.agent] = point
        return found


class _Hot:
    """The statements of every commit."""

    def __init__(self, database: Database) -> None:
        sites = schema.sites
        mine = (sites.c.site == sa.bindparam("the_site")) & (sites.c.epoch == sa.bindparam("the_epoch"))
        held = sa.update(sites).where(mine)
        moved = held.values(seq=sa.bindparam("last_seq"), at_us=sa.bindparam("last_us"))
        self.advance = Prepared(moved, database.engine)
        self.still_mine = Prepared(held.values(seq=sites.c.seq), database.engine)
        self.steps = Prepared(sa.insert(schema.steps).inline(), database.engine)
        self.step_tasks = Prepared(sa.insert(schema.step_tasks).inline(), database.engine)


class Gap(Struct, frozen=True):
    """Steps that could not be written, and did not fit into memory any more."""

    seq: int
    """Of the first."""
    to_seq: int
    at: Micros
    to_at: Micros
    why: str


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


class _Transaction:
    """One commit of the engine that has the site."""

    def __init__(self, journal: Journal, seq: int | None, at: Micros | None) -> None:
        self._journal = journal
        self._values: dict[str, Any] = {} if seq is None else {"last_seq": seq, "last_us": at}
        self._writing: writing | None = None

    def __enter__(self) -> Connection:
        try:
            self._writing = writing(self._journal._writer())
            connection = self._writing.__enter__()
            number, epoch, hot = self._journal.number, self._journal.epoch, self._journal._hot
            mine = {"the_site": number, "the_epoch": epoch, **self._values}
            touched = (hot.advance if self._values else hot.still_mine).run(connection, mine)
        except SQLAlchemyError as error:
            self._undo()
            raise Unwritable(told(self._journal.where, error)) from error
        if touched != 1:
            self._undo()
            raise Overtaken(
                f"another engine has taken the site '{self._journal.site}' in {self._journal.where}; this one ends"
            )
        return connection

    def __exit__(self, kind: Any, error: BaseException | None, trace: TracebackType | None) -> None:
        assert self._writing is not None
        try:
            if error is None:
                self._writing.__exit__(None, None, None)
                return
        except SQLAlchemyError as late:
            error = late
        self._undo()
        if isinstance(error, SQLAlchemyError):
            raise Unwritable(told(self._journal.where, error)) from error

    def _undo(self) -> None:
        try:
            if self._writing is not None:
                self._writing._connection.rollback()
        except SQLAlchemyError:
            pass  # the connection is gone, and with it what was not committed
