"""A journal: the steps of one site, in order, in a database.

One engine at a time writes (`Journal.take`), anybody may read, also while it writes. A commit writes all steps that it is given
or none, and only while this engine has the site: one whose epoch was overtaken writes nothing any more.
"""

import hashlib
import json
import os
import platform
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import msgspec
import sqlalchemy as sa
from sqlalchemy import Connection
from sqlalchemy.exc import SQLAlchemyError

from formiga_bt import __version__
from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal import codec, schema
from formiga_bt.journal.database import OWN_S, Database, Durability, Prepared, mapped, told, writing
from formiga_bt.journal.files import Identity
from formiga_bt.journal.outbox import NewsItem
from formiga_bt.journal.reading import Readable
from formiga_bt.journal.records import SITE_FILES, BundleRow, Gap, KeptStep, Start, StepRow
from formiga_bt.journal.thin import Block, pack
from formiga_bt.nodes.memory import NODE_STATE_VERSION

__all__ = [
    "SITE_FILES",
    "BundleRow",
    "Gap",
    "Gone",
    "Journal",
    "KeptStep",
    "Overtaken",
    "Start",
    "StepRow",
    "Unwritable",
]

DICTIONARIES: Final = 255


class Overtaken(SiteError):  # noqa: N818 - it names the state
    """Another engine took the site: this one may not write any more."""


class Unwritable(JournalError):  # noqa: N818 - it names the state
    """The journal cannot be written now: its disk is full, or its server is away. Nothing was written."""


class Gone(Unwritable):
    """The journal's files are missing, or others have their names. Nothing was written."""


class Journal(Readable):
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
        super().__init__(where, site, durability, read_only=read_only)
        self.epoch = 0
        self.in_snapshot: Callable[[], None] = lambda: None
        """Called when a snapshot is written and not yet committed; tests kill the engine there."""
        self._release: Callable[[], None] | None = None
        self._write: Connection | None = None
        self._hurries = False
        self._identity: Identity | None = None
        self._hot = _Hot(self.database)

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
        self.database.close()

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
                self._teach(connection, codec.dictionary, "", only_first=True)
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
            if self.database.file is not None:
                self._identity = Identity(self.database.file)
        return self.epoch

    def gone(self) -> str:
        """Return which of the files that this engine writes is missing or another one; an empty text if none, or no files."""
        return self._identity.gone() if self._identity is not None else ""

    def rescue(self) -> None:
        """Bring what was committed into the file, if only its log was removed: else a kill would lose it."""
        if self._identity is not None and self._identity.is_only_the_log_lost and self._write is not None:
            with suppress(SQLAlchemyError):  # then it is lost, which was told
                raw: Any = self._write.connection.dbapi_connection
                raw.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()

    def hold(self) -> bool:
        """Keep engines from the site until `close`, without being one; return False if an engine has it."""
        with mapped(self.where):
            self._write = self.database.engine.connect()
            self._release = self.database.lock(self.site, self._write)
        return self._release is not None

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
        last = self.starts()[-1:]
        if last and last[0].ended is None and (said := self.damage()):
            raise JournalError(f"the journal {self.where} is damaged: {said}", help=f"{codec.RESTORE}")

    def _writer(self) -> Connection:
        assert self._write is not None, "take() the site first"
        if self._write.closed or self._write.invalidated:
            self._write.close()
            self._write = self.database.engine.connect()
            if not self.database.is_sqlite:
                # The session ended, and its lock with it. A server that has not noticed may still hold it for that session,
                # so who has the lock decides nothing here; whose epoch it is does, in each commit.
                self._release = self.database.lock(self.site, self._write)
            if self._hurries:
                self.database.hurry(self._write)
        return self._write

    def hurry(self, *, on: bool = True) -> None:
        """Let who writes give up soon where others must be waited for, as an engine that flies must; or be patient again."""
        self._hurries = on
        if self._write is not None and not self._write.closed and not self._write.invalidated:
            with suppress(SQLAlchemyError):  # it is gone; the next one is told
                self.database.hurry(self._write, on=on)

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

    def append(self, rows: Sequence[StepRow], blocks: Sequence[Block] = ()) -> None:
        """Write steps and way points: all of them or nothing, durable when this returns.

        Raises:
            Unwritable: they cannot be written now.
            Overtaken: another engine has the site.
        """
        self.stage(rows, blocks)()

    def stage(self, rows: Sequence[StepRow], blocks: Sequence[Block] = ()) -> Callable[[], None]:
        """Write steps and way points, and return what commits them: it may be called in another thread, before anything else.

        Raises:
            Unwritable: they cannot be written now; what commits may raise it too.
            Overtaken: another engine has the site.
        """
        transaction = self._transaction(rows[-1].seq if rows else None, rows[-1].at if rows else None)
        connection = transaction.__enter__()
        try:
            if rows:
                self._hot.steps.run(connection, *(self._step_row(row) for row in rows))
                told = [self._news_row(item) for row in rows for item in row.news]
                if told:
                    self._hot.news.run(connection, *told)
                touched = [{"site": self.number, "task": task, "seq": row.seq} for row in rows for task in row.tasks]
                if touched:
                    self._hot.step_tasks.run(connection, *touched)
            if blocks:
                self._hot.telemetry.run(connection, *(self._block_row(block) for block in blocks))
        except BaseException as error:
            transaction.__exit__(type(error), error, None)
            raise
        return transaction.commit

    def _step_row(self, row: StepRow) -> dict[str, Any]:
        return {
            "site": self.number, "seq": row.seq, "at_us": row.at, "wall_us": row.wall, "kind": row.kind, "blob": row.blob,
        }  # fmt: skip

    def _news_row(self, item: NewsItem) -> dict[str, Any]:
        blob = msgspec.json.encode(item)
        return {"site": self.number, "seq": item.seq, "n": item.n, "urgent": item.urgent, "blob": blob}

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

    def snapshot_beside(self, state: EngineState, at: Micros, pause: Callable[[], None]) -> None:
        """Keep the whole state from another thread than the one that appends steps.

        Args:
            state: nobody changes it meanwhile; its `seq` is not after the last step that was written.
            at: engine time, as in `snapshot`.
            pause: called now and then, so that the engine has its turn.

        Raises:
            Unwritable: it cannot be written now.
            Overtaken: another engine has the site.
        """
        blob = self.codec.encode_state(state, pause)
        try:
            with self.database.engine.connect() as plain, writing(plain) as connection:
                if self._hot.still_mine.run(connection, {"the_site": self.number, "the_epoch": self.epoch}) != 1:
                    raise Overtaken(f"another engine has taken the site '{self.site}' in {self.where}; this one ends")
                self._put_blob(connection, blob, state.seq, at)
        except SQLAlchemyError as error:
            raise Unwritable(told(self.where, error)) from error

    def checkpoint(self) -> None:
        """Bring what was committed from the write-ahead log into the file, beside who writes; on SQLite."""
        if self.database.is_sqlite:
            with suppress(SQLAlchemyError), self.database.engine.connect() as connection:  # tried again later
                raw: Any = connection.connection.dbapi_connection
                raw.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()

    def _put_snapshot(self, connection: Connection, state: EngineState, when: Micros) -> None:
        self._put_blob(connection, self.codec.encode_state(state), state.seq, when)

    def _put_blob(self, connection: Connection, blob: bytes, seq: int, when: Micros) -> None:
        row = {"site": self.number, "epoch": self.epoch, "seq": seq, "at_us": when}
        at = (schema.snapshots.c.site == self.number) & (schema.snapshots.c.epoch == self.epoch)
        connection.execute(sa.delete(schema.snapshots).where(at, schema.snapshots.c.seq == seq))
        connection.execute(sa.insert(schema.snapshots), {**row, "blob": blob})
        self.in_snapshot()

    def end(self, wall: Micros) -> None:
        """Note the clean end of this start."""
        mine = (schema.starts.c.site == self.number) & (schema.starts.c.epoch == self.epoch)
        with self._transaction(None, None) as connection:
            connection.execute(sa.update(schema.starts).where(mine).values(ended_us=wall))

    def teach(self, steps: Sequence[EngineStep]) -> None:
        """Learn from steps of this site how to keep steps in less room; once for each version of formiga."""
        if self.is_taught:
            return
        before = self._dictionaries, self._taught, self.codec
        try:
            with self._transaction(None, None) as connection:
                self._teach(connection, lambda: codec.learned(steps), __version__)
        except BaseException:  # what is not written must not be used
            self._dictionaries, self._taught, self.codec = before
            raise

    @property
    def is_taught(self) -> bool:
        """Return whether steps of this version were learned from, or none can be any more."""
        return self._taught[1] == __version__ or self._taught[0] >= DICTIONARIES

    def _teach(
        self, connection: Connection, made: Callable[[], bytes], version: str, *, only_first: bool = False
    ) -> None:
        rows = connection.execute(sa.select(schema.words.c.id, schema.words.c.version, schema.words.c.data)).all()
        known = {row.id: row.data for row in rows}
        number = max(known, default=0)
        if not (only_first and known) and number < DICTIONARIES:
            number, data = number + 1, made()
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
        self.news = Prepared(sa.insert(schema.news).inline(), database.engine)
        self.telemetry = Prepared(sa.insert(schema.telemetry).inline(), database.engine)


class _Transaction:
    """One commit of the engine that has the site."""

    def __init__(self, journal: Journal, seq: int | None, at: Micros | None) -> None:
        self._journal = journal
        self._values: dict[str, Any] = {} if seq is None else {"last_seq": seq, "last_us": at}
        self._writing: writing | None = None

    def __enter__(self) -> Connection:
        if gone := self._journal.gone():
            raise Gone(gone)
        try:
            self._writing = writing(self._journal._writer(), OWN_S)
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

    def commit(self) -> None:
        """End it, and make what it wrote durable."""
        self.__exit__(None, None, None)

    def _undo(self) -> None:
        try:
            if self._writing is not None:
                self._writing.rollback()
        except SQLAlchemyError:
            pass  # the connection is gone, and with it what was not committed
