"""Tables of the journal, and the steps by which an older journal becomes a new one.

The same tables in SQLite and PostgreSQL; one database may hold many sites. `formiga_meta` has the number of the schema.
A change of the tables is a new function at the end of `MIGRATIONS`; what was released is never changed.
"""

from collections.abc import Callable, Sequence
from typing import Final

import sqlalchemy as sa
from sqlalchemy import Connection

from formiga_bt.base.errors import JournalError

META: Final = "formiga_meta"
APPLICATION_ID: Final = 0x464F524D
"""Of SQLite files that are journals: the letters FORM."""

tables: Final = sa.MetaData()
_big = sa.BigInteger().with_variant(sa.Integer(), "sqlite")

meta: Final = sa.Table(
    META, tables,
    sa.Column("name", sa.String(40), primary_key=True),
    sa.Column("value", sa.Text, nullable=False),
)  # fmt: skip
sites: Final = sa.Table(
    "formiga_sites", tables,
    sa.Column("site", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("name", sa.String(200), nullable=False, unique=True),
    sa.Column("epoch", _big, nullable=False),
    sa.Column("seq", _big, nullable=False),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("holder", sa.Text, nullable=False),
)  # fmt: skip
"""`epoch`: of the engine that may write. `seq`, `at_us`: of the last step written."""
starts: Final = sa.Table(
    "formiga_starts", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("epoch", _big, primary_key=True),
    sa.Column("seq", _big, nullable=False),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("wall_us", _big, nullable=False),
    sa.Column("versions", sa.Text, nullable=False),
    sa.Column("ended_us", _big),
)  # fmt: skip
"""Each start of an engine: its first step is after `seq`. `ended_us`: wall time of a clean end."""
steps: Final = sa.Table(
    "formiga_steps", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("wall_us", _big, nullable=False),
    sa.Column("kind", sa.String(40), nullable=False),
    sa.Column("blob", sa.LargeBinary, nullable=False),
    sa.Index("formiga_steps_at", "site", "at_us"),
)  # fmt: skip
step_tasks: Final = sa.Table(
    "formiga_step_tasks", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("task", sa.String(200), primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sqlite_with_rowid=False,
)  # fmt: skip
snapshots: Final = sa.Table(
    "formiga_snapshots", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("epoch", _big, primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("blob", sa.LargeBinary, nullable=False),
    sa.Index("formiga_snapshots_at", "site", "at_us"),
)  # fmt: skip
news: Final = sa.Table(
    "formiga_news", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sa.Column("n", sa.Integer, primary_key=True),
    sa.Column("urgent", sa.Boolean, nullable=False),
    sa.Column("blob", sa.LargeBinary, nullable=False),
    sqlite_with_rowid=False,
)  # fmt: skip
"""The outbox: `NewsItem`s as JSON, of steps that may be there no more."""
telemetry: Final = sa.Table(
    "formiga_telemetry", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("agent", sa.String(200), primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sa.Column("to_seq", _big, nullable=False),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("to_us", _big, nullable=False),
    sa.Column("points", sa.Integer, nullable=False),
    sa.Column("blob", sa.LargeBinary, nullable=False),
    sqlite_with_rowid=False,
)  # fmt: skip
texts: Final = sa.Table(
    "formiga_texts", tables,
    sa.Column("hash", sa.String(64), primary_key=True),
    sa.Column("text", sa.Text, nullable=False),
)  # fmt: skip
bundles: Final = sa.Table(
    "formiga_bundles", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("name", sa.String(200), primary_key=True),
    sa.Column("bundle", sa.String(64), primary_key=True),
    sa.Column("file", sa.Text, nullable=False),
    sa.Column("files", sa.Text, nullable=False),
    sa.Column("origin", sa.String(20), nullable=False),
    sa.Column("epoch", _big, nullable=False),
)  # fmt: skip
"""`files`: JSON, path -> hash of its text. `epoch`: of the last start that served it."""
gaps: Final = sa.Table(
    "formiga_gaps", tables,
    sa.Column("site", sa.Integer, primary_key=True),
    sa.Column("seq", _big, primary_key=True),
    sa.Column("to_seq", _big, nullable=False),
    sa.Column("at_us", _big, nullable=False),
    sa.Column("to_us", _big, nullable=False),
    sa.Column("why", sa.Text, nullable=False),
)  # fmt: skip
"""Steps that could not be written for so long that they no longer fitted into memory."""
words: Final = sa.Table(
    "formiga_words", tables,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("version", sa.String(40), nullable=False),
    sa.Column("data", sa.LargeBinary, nullable=False),
)  # fmt: skip
"""Dictionaries of the codec. `version`: of formiga, empty for one that no site taught."""

OF_A_SITE: Final = (steps, step_tasks, news, snapshots, telemetry, bundles, starts, gaps)


def _first(connection: Connection) -> None:
    tables.create_all(connection)


def _with_news(connection: Connection) -> None:
    news.create(connection, checkfirst=True)


Migration = Callable[[Connection], None]
MIGRATIONS: Final[tuple[Migration, ...]] = (_first, _with_news)


def version(connection: Connection) -> int:
    """Return the number of a database's schema; 0: it holds no journal."""
    if not sa.inspect(connection).has_table(META):
        return 0
    value = connection.execute(sa.select(meta.c.value).where(meta.c.name == "schema")).scalar()
    return int(value) if value is not None else 0


def migrate(connection: Connection, where: str, migrations: Sequence[Migration] = MIGRATIONS) -> None:
    """Make the tables, or bring older ones to this version, in the transaction of `connection`.

    Raises:
        JournalError: a newer version made them.
    """
    found = version(connection)
    check_not_newer(found, where, len(migrations))
    if found == len(migrations):
        return
    for migration in migrations[found:]:
        migration(connection)
    connection.execute(sa.delete(meta).where(meta.c.name == "schema"))
    connection.execute(sa.insert(meta), {"name": "schema", "value": str(len(migrations))})


def check_not_newer(found: int, where: str, known: int = len(MIGRATIONS)) -> None:
    """Refuse a journal of a newer version.

    Raises:
        JournalError: it is one.
    """
    if found > known:
        raise JournalError(
            f"{where} was written by a newer version of formiga (schema {found}, this one knows {known})",
            help="use that version, or another journal: formiga up --journal FILE",
        )
