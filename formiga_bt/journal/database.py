"""The database under a journal: SQLite in a file, or PostgreSQL; what differs between the two stands here.

SQLite is in WAL mode: who reads never waits for who writes. One engine writes a site: it holds a lock that goes with its
process, a file lock beside the SQLite file, or a session lock in PostgreSQL.
"""

import fcntl
import hashlib
import sqlite3
import threading
from collections.abc import Callable, Mapping
from itertools import chain
from pathlib import Path
from typing import IO, Any, Final, Literal
from weakref import WeakKeyDictionary

import sqlalchemy as sa
from sqlalchemy import Connection, Engine
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, OperationalError, SQLAlchemyError

from formiga_bt.base.errors import JournalError
from formiga_bt.base.extras import install
from formiga_bt.journal import schema
from formiga_bt.journal.codec import RESTORE
from formiga_bt.journal.files import beside, check_file, size_of
from formiga_bt.journal.looking import look_at

Durability = Literal["full", "normal"]
"""`full`: a commit survives a power cut. `normal`: it survives the end of the process; a power cut may take the last ones."""
WRITES: Final = "formiga_writes"
BUSY_S: Final = 10.0
"""So long a database that is kept busy is waited for."""
HURRY_S: Final = 0.2
"""So long by an engine that flies, on SQLite: meanwhile it does nothing else, heartbeats and stops included."""
OWN_S: Final = 2.0
"""So long if it is kept busy by this process, which lets go of it; and a server that says nothing, by an engine that flies."""
ROWS: Final = 32
"""So many rows go into a statement."""
SERVER: Final = {
    "connect_timeout": 2, "tcp_user_timeout": 2000, "keepalives_idle": 2, "keepalives_interval": 1, "keepalives_count": 2,
}  # fmt: skip
"""A PostgreSQL server that went away is noticed soon: an engine that waits for it does nothing else."""
CHECK_BYTES: Final = 256 * 1024 * 1024
"""A smaller SQLite file is looked through after an end that was not clean."""


def read_url(word: str) -> URL:
    """Return the URL of a database; a plain path is that of an SQLite file.

    Raises:
        JournalError: it is none that a journal may be in.
    """
    if "://" not in word:
        return URL.create("sqlite", database=word)
    try:
        url = make_url(word)
    except (ArgumentError, ValueError) as error:
        raise JournalError(f"{word} is no address of a journal: {error}", help=f"{EXAMPLES}") from error
    backend = url.get_backend_name()
    if backend == "postgresql":
        return url.set(drivername="postgresql+psycopg")
    if backend == "sqlite" and url.database and url.database != ":memory:":
        return url.set(drivername="sqlite")
    raise JournalError(
        f"{url.render_as_string()}: a journal is an SQLite file or a PostgreSQL database", help=f"{EXAMPLES}"
    )


EXAMPLES: Final = "such as: --journal site.db, or --journal postgresql://user@host/database"


class Database:
    """Where journals lie.

    Args:
        word: a path or a URL.
        durability: of commits.
        create: make an SQLite file that is not there; False: only look, also where nothing can be written.

    Raises:
        JournalError: it cannot be used; nothing in it was changed.
    """

    def __init__(self, word: str | Path, *, durability: Durability = "full", create: bool = True) -> None:
        self.url = read_url(str(word))
        self.is_sqlite = self.url.get_backend_name() == "sqlite"
        shown = self.url.set(drivername="postgresql").render_as_string()
        self.where = self.url.database or "" if self.is_sqlite else shown
        """As people are told; without a password."""
        self.durability = durability
        if self.is_sqlite:
            check_file(Path(self.where), create=create)
        self._look = look_at(Path(self.where)) if self.is_sqlite and not create else None
        self.note = self._look.note if self._look is not None else ""
        """What people are told of how it is looked at; mostly nothing."""
        self.engine = self._engine()

    def close(self) -> None:
        """Let it go; may be called twice."""
        self.engine.dispose()
        if self._look is not None and self._look.folder is not None:
            self._look.folder.cleanup()

    @property
    def address(self) -> str:
        """Return where it can be found again from anywhere: the whole path, or the URL without its password."""
        if self.is_sqlite:
            return str(Path(self.where).resolve())
        url = self.url
        return URL.create(
            "postgresql", url.username, None, url.host, url.port, url.database, url.query
        ).render_as_string()

    @property
    def file(self) -> Path | None:
        """Return the SQLite file."""
        return Path(self.where) if self.is_sqlite else None

    def _engine(self) -> Engine:
        try:
            if not self.is_sqlite:
                # What the URL says itself counts.
                told = {name: value for name, value in SERVER.items() if name not in self.url.query}
                engine = sa.create_engine(self.url, pool_pre_ping=True, connect_args=told)
                sa.event.listen(engine, "connect", self._on_connect_postgres)
                return engine
            options: dict[str, Any] = {"timeout": BUSY_S, "check_same_thread": False}
            if self._look is not None:
                uri = self._look.uri
                engine = sa.create_engine(self.url, creator=lambda: sqlite3.connect(uri, uri=True, **options))
            else:
                engine = sa.create_engine(self.url, connect_args=options)
        except ModuleNotFoundError as error:
            raise JournalError(
                f"a journal in PostgreSQL needs {error.name}, which is not installed", help=f"{install('postgres')}"
            ) from error
        sa.event.listen(engine, "connect", self._on_connect_sqlite)
        sa.event.listen(engine, "begin", _begin)
        return engine

    def _on_connect_postgres(self, connection: Any, _record: Any) -> None:
        with connection.cursor() as cursor:
            cursor.execute(f"SET synchronous_commit = {'on' if self.durability == 'full' else 'off'}")
        connection.commit()

    def _on_connect_sqlite(self, connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # transactions begin where we say so
        only = ("query_only = ON",) if self._look is not None else ()
        for pragma in (f"synchronous = {self.durability.upper()}", "foreign_keys = ON", "temp_store = MEMORY", *only):
            connection.execute(f"PRAGMA {pragma}")

    def hurry(self, connection: Connection, *, on: bool = True) -> None:
        """Let what a connection does next give up soon if it must wait for others, or be patient again."""
        if self.is_sqlite:
            raw: Any = connection.connection.dbapi_connection
            raw.execute(f"PRAGMA busy_timeout = {round((HURRY_S if on else BUSY_S) * 1000)}")
        else:
            connection.exec_driver_sql(f"SET statement_timeout = {round(OWN_S * 1000) if on else 0}")
            connection.commit()

    # -- opening -----------------------------------------------------------------------------------------------------
    def prepare(self) -> None:
        """Make the tables, or bring older ones to this version.

        Raises:
            JournalError: the database is damaged, newer, not ours, or cannot be reached; nothing in it was changed.
        """
        if self.file is not None:
            self._check_log(self.file)
        with mapped(self.where), self.engine.connect() as connection:
            if self.is_sqlite:
                self._check_ours(connection)
                connection.rollback()
                raw: Any = connection.connection.dbapi_connection
                self._check_size(raw)
                if not raw.execute("PRAGMA page_count").fetchone()[0]:
                    raw.execute("PRAGMA page_size = 8192")
                    raw.execute("PRAGMA auto_vacuum = INCREMENTAL")
                raw.execute("PRAGMA journal_mode = WAL")
            with writing(connection):
                is_new = schema.version(connection) == 0
                schema.migrate(connection, self.where)
                if self.is_sqlite and is_new:
                    connection.exec_driver_sql(f"PRAGMA application_id = {schema.APPLICATION_ID}")

    def check(self) -> None:
        """Look whether there is a journal of this version, and change nothing.

        Raises:
            JournalError: there is none, or it is damaged, newer or not ours.
        """
        with mapped(self.where), self.engine.connect() as connection:
            if self.is_sqlite:
                self._check_ours(connection)
            found = schema.version(connection)
            schema.check_not_newer(found, self.where)
            if found != len(schema.MIGRATIONS):
                what = f"is of schema {found}, this version reads {len(schema.MIGRATIONS)}" if found else "is empty"
                raise JournalError(f"{self.where} {what}", help="an engine that starts with it makes it ready")

    def _check_log(self, file: Path) -> None:
        """Look through a file in whose write-ahead log steps wait, before they are brought into it: it may be cut short."""
        size = size_of(file)
        if not size or size > CHECK_BYTES or not size_of(beside(file)):
            return
        try:
            plain = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True, timeout=BUSY_S)
            try:
                said = plain.execute("PRAGMA quick_check(1)").fetchone()[0]
            finally:
                plain.close()
        except sqlite3.Error as error:
            raise JournalError(told(self.where, error)) from error
        if said != "ok":
            raise JournalError(f"the journal {self.where} is damaged: {said.splitlines()[-1]}", help=f"{RESTORE}")

    def _check_size(self, raw: Any) -> None:
        """Refuse a file that is cut short."""
        assert self.file is not None
        pages, page = (raw.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_count", "page_size"))
        size = size_of(self.file) or 0
        if not size_of(beside(self.file)) and size < pages * page:
            raise JournalError(
                f"the journal {self.where} is damaged: it is cut short, {size} of {pages * page} bytes",
                help=f"{RESTORE}",
            )

    def _check_ours(self, connection: Connection) -> None:
        names = sa.inspect(connection).get_table_names()
        if names and schema.META not in names:
            raise JournalError(
                f"{self.where} is a database of something else (it has {', '.join(sorted(names)[:3])})",
                help="name a file of its own for the journal: formiga up --journal FILE",
            )

    # -- who writes ----------------------------------------------------------------------------------------------------
    def lock(self, site: str, connection: Connection) -> Callable[[], None] | None:
        """Take the site; return what gives it back, or None if somebody has it."""
        if self.is_sqlite:
            return lock_file(Path(f"{self.where}.{site}.lock"))
        key = lock_key(site)
        taken = connection.execute(sa.select(sa.func.pg_try_advisory_lock(key))).scalar()
        connection.commit()
        if not taken:
            return None

        def release() -> None:
            connection.execute(sa.select(sa.func.pg_advisory_unlock(key)))
            connection.commit()

        return release


def lock_key(site: str) -> int:
    """Return the number of a site's session lock in PostgreSQL."""
    return int.from_bytes(hashlib.sha256(f"formiga journal {site}".encode()).digest()[:8], "big", signed=True)


def lock_file(path: Path) -> Callable[[], None] | None:
    """Take the lock of a site's journal; return what gives it back, or None if somebody has it.

    Raises:
        JournalError: it cannot be written.
    """
    try:
        lock: IO[str] = path.open("a+", encoding="utf-8")
    except OSError as error:
        raise JournalError(f"cannot write {path}: {error.strerror or error}") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        return None
    return lock.close


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE" if connection.get_execution_options().get(WRITES) else "BEGIN")


class writing:  # noqa: N801 - it is used as a statement
    """Run what is inside as one transaction that writes.

    Args:
        connection: of the database.
        own_s: if a thread of this process is just writing there, it is waited for so long.
    """

    def __init__(self, connection: Connection, own_s: float = 0.0) -> None:
        self._connection = connection.execution_options(**{WRITES: True})
        self._turn = _turn_of(connection.engine)
        self._own_s = own_s
        self._has_turn = False

    def __enter__(self) -> Connection:
        try:
            self._connection.begin()
        except OperationalError:
            if not (self._own_s and self._turn.locked() and self._turn.acquire(timeout=self._own_s)):
                raise
            self._turn.release()
            self._connection.begin()
        self._has_turn = self._turn.acquire(blocking=False)
        return self._connection

    def __exit__(self, kind: Any, *_: object) -> None:
        try:
            if kind is None:
                self._connection.commit()
            else:
                self.rollback()
        finally:
            self._let_go()

    def rollback(self) -> None:
        """Leave everything as it was."""
        try:
            self._connection.rollback()
        finally:
            self._let_go()

    def _let_go(self) -> None:
        if self._has_turn:
            self._has_turn = False
            self._turn.release()


_TURNS: "WeakKeyDictionary[Engine, threading.Lock]" = WeakKeyDictionary()


def _turn_of(engine: Engine) -> threading.Lock:
    """Return what is held while this process writes into a database."""
    return _TURNS.setdefault(engine, threading.Lock())


class Prepared:
    """A statement that runs often: made into text once.

    Args:
        statement: with a parameter for each value.
        engine: of the database.
    """

    def __init__(self, statement: sa.ClauseElement, engine: Engine) -> None:
        compiled: Any = statement.compile(dialect=engine.dialect)
        self._text = str(compiled)
        self._order: list[str] | None = compiled.positiontup
        head, _, values = self._text.partition(" VALUES ")
        self._insert = (head, values) if values and self._order is not None else None

    def run(self, connection: Connection, *rows: Mapping[str, Any]) -> int:
        """Run it for each row; return how many rows of the table it touched."""
        if self._order is None:
            return connection.exec_driver_sql(self._text, rows[0] if len(rows) == 1 else list(rows)).rowcount
        given = [tuple([row[name] for name in self._order]) for row in rows]
        if self._insert is None or len(rows) == 1:
            return connection.exec_driver_sql(self._text, given[0] if len(rows) == 1 else given).rowcount
        # One statement for many rows: after each one other threads may take the interpreter, and keep it for a while.
        head, values = self._insert
        touched = 0
        for part in (given[at : at + ROWS] for at in range(0, len(given), ROWS)):
            text = f"{head} VALUES {', '.join([values] * len(part))}"
            touched += connection.exec_driver_sql(text, tuple(chain.from_iterable(part))).rowcount
        return touched


class mapped:  # noqa: N801 - it is used as a statement
    """Turn a database's errors inside into ours.

    Args:
        where: of the journal, for people.
    """

    def __init__(self, where: str) -> None:
        self._where = where

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: Any, error: BaseException | None, _trace: Any) -> None:
        if isinstance(error, SQLAlchemyError):
            raise JournalError(told(self._where, error)) from error


REFUSED: Final = ("readonly database", "unable to open database file")
DAMAGED: Final = ("malformed", "corrupt")
FULL: Final = ("database or disk is full", "No space left", "disk I/O error")


def told(where: str, error: SQLAlchemyError | sqlite3.Error) -> str:
    """Return what a database's error means, and what to do."""
    text = str(error.orig if isinstance(error, DBAPIError) and error.orig is not None else error).strip()
    text = text.splitlines()[0] if text else type(error).__name__
    if "not a database" in text:
        return (
            f"{where} is no journal: it is not a database\n"
            f"  help: name another file: formiga up --journal FILE; if it was one, {RESTORE}"
        )
    if any(word in text for word in DAMAGED):
        return f"the journal {where} is damaged: {text}\n  help: {RESTORE}"
    if any(word in text for word in FULL):
        return f"the journal {where} cannot be written: {text}\n  help: make room on its disk"
    if any(word in text for word in REFUSED):
        return (
            f"the journal {where} cannot be written: {text}\n"
            "  help: look who may write the file and its folder; or copy it into a folder of yours, and name that"
        )
    if "locked" in text:
        return f"the journal {where} is kept busy by another program: {text}\n  help: end what else writes to it"
    return f"the journal {where} cannot be used: {text}"
