"""The journal in each kind of database: what goes in comes out, one engine writes, nothing is torn or overwritten."""

import sqlite3
from pathlib import Path

import pytest
import sqlalchemy as sa

from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.journal import schema
from formiga_bt.journal.database import Database, writing
from formiga_bt.journal.store import SITE_FILES, Journal, Overtaken, StepRow, Unwritable
from formiga_bt.journal.writer import kind_of, tasks_of
from tests.golden import Wording
from tests.unit.journal.conftest import WALL, Opener, Recording, folded, steps_of


def rows(journal: Journal, first: int, last: int) -> list[StepRow]:
    steps = steps_of("move_task")[first - 1 : last]
    return [StepRow(s.seq, s.at, WALL, kind_of(s.input), tasks_of(s), journal.codec.encode(s)) for s in steps]


@pytest.mark.parametrize("batch", [1, 7, 1000])
def test_steps_come_back_in_order_and_their_fold_is_the_live_state(taken: Journal, opened: Opener, batch: int) -> None:
    steps = steps_of("errand")
    recording = Recording(taken, thin=False)
    recording.feed(steps, batch)
    reader = opened(read_only=True)
    assert [kept.step for kept in reader.read()] == list(steps)
    assert [kept.step for kept in reader.read(10, 20)] == list(steps[10:20])
    assert reader.last() == (steps[-1].seq, steps[-1].at)
    assert recording.writer.commits == -(-len(steps) // batch)
    assert snapshot(folded([kept.step for kept in reader.read()])) == snapshot(recording.state)


def test_steps_are_found_by_the_tasks_that_they_touched(taken: Journal) -> None:
    steps = steps_of("errand")
    Recording(taken, thin=False).feed(steps, 50)
    for task in ("Errand-1", "MoveTask-2"):
        found = [kept.seq for kept in taken.read(task=task)]
        assert found == [step.seq for step in steps if task in tasks_of(step)]
        assert len(found) > 5
    kinds = {kept.kind for kept in taken.read(task="Errand-1")}
    assert {"Submit", "TimerDue", "GoalEvent"} <= kinds


def test_a_commit_writes_all_of_its_steps_or_none(taken: Journal) -> None:
    taken.append(rows(taken, 1, 3))
    with pytest.raises(Unwritable):
        taken.append(rows(taken, 3, 5))  # the third is there already
    assert [kept.seq for kept in taken.read()] == [1, 2, 3]
    assert taken.last()[0] == 3
    taken.append(rows(taken, 4, 5))
    assert [kept.seq for kept in taken.read()] == [1, 2, 3, 4, 5]


def test_a_second_engine_is_refused_while_the_first_has_the_site(
    taken: Journal, opened: Opener, wording: Wording
) -> None:
    other = opened()
    with pytest.raises(SiteError) as told:
        other.take()
    wording(str(told.value))
    assert opened(site="elsewhere").take() == 1, "another site in the same database"
    taken.close()
    assert opened().take() == 2


def test_each_start_has_a_higher_epoch_than_any_before(opened: Opener) -> None:
    epochs = []
    for at_least in (1, 1, 7, 3):
        with opened() as journal:
            epochs.append(journal.take(at_least))
    assert epochs == [1, 2, 7, 8]


def test_an_engine_that_was_overtaken_writes_nothing(taken: Journal, opened: Opener, wording: Wording) -> None:
    taken.append(rows(taken, 1, 2))
    other = opened()
    with other.database.engine.connect() as plain, writing(plain) as connection:  # as one that took over
        connection.execute(sa.update(schema.sites).values(epoch=5))
    with pytest.raises(Overtaken) as refused:
        taken.append(rows(taken, 3, 4))
    wording(refused.value)
    with pytest.raises(Overtaken):
        taken.snapshot(EngineState(seq=4), 0)
    assert [kept.seq for kept in opened(read_only=True).read()] == [1, 2]


def test_starts_are_noted_with_versions_and_their_end(opened: Opener) -> None:
    steps = steps_of("move_task")
    first = opened()
    first.take()
    recording = Recording(first)
    recording.feed(steps)
    recording.writer.end()
    first.close()
    second = opened()
    second.take()
    seq, at = second.last()
    second.begin(EngineState(seq=seq, now=at + 1), WALL, {"msgspec": "0.22"})
    (one, two) = opened(read_only=True).starts()
    assert (one.epoch, one.seq, one.ended) == (1, 0, WALL)
    assert (two.epoch, two.seq, two.at, two.ended) == (2, seq, at + 1, None)
    assert set(one.versions) == {"formiga", "python", "node_state"}
    assert two.versions["msgspec"] == "0.22"


def test_files_are_kept_once_for_each_content(taken: Journal, opened: Opener) -> None:
    lib = "subtrees: {}\n"
    taken.keep_bundle("A", "b1", "trees/a.yaml", {"trees/a.yaml": "task: A\n", "lib/flying.yaml": lib})
    taken.keep_bundle("B", "b2", "trees/b.yaml", {"trees/b.yaml": "task: B\n", "lib/flying.yaml": lib}, "loaded")
    taken.keep_bundle("A", "b1", "trees/a.yaml", {"trees/a.yaml": "task: A\n", "lib/flying.yaml": lib})
    taken.keep_bundle(SITE_FILES, "", "site.yaml", {"site.yaml": "näme: x\n"})
    found = {row.name: row for row in opened(read_only=True).bundles()}
    assert list(found) == [SITE_FILES, "A", "B"]
    assert found["A"].texts == {"trees/a.yaml": "task: A\n", "lib/flying.yaml": lib}
    assert (found["B"].bundle, found["B"].file, found["B"].origin) == ("b2", "trees/b.yaml", "loaded")
    assert found[SITE_FILES].texts == {"site.yaml": "näme: x\n"}
    with taken.database.engine.connect() as connection:
        assert connection.execute(sa.select(sa.func.count()).select_from(schema.texts)).scalar() == 4


def test_a_journal_learns_from_its_first_steps_and_all_are_read(taken: Journal, opened: Opener) -> None:
    reader = opened(read_only=True)
    steps = steps_of("pick_up")
    recording = Recording(taken, thin=False)
    recording.feed(steps[:100], 10)
    before = list(reader.read())
    recording.feed(steps[100:], 10)
    assert [kept.step for kept in before] + [kept.step for kept in reader.read(100)] == list(steps)
    assert taken.is_taught
    with opened() as nothing_new:
        assert [kept.step for kept in nothing_new.read()] == list(steps)
        assert nothing_new.is_taught


def test_a_newer_journal_is_told_and_left_alone(taken: Journal, opened: Opener, where: str, wording: Wording) -> None:
    taken.append(rows(taken, 1, 2))
    with taken.database.engine.connect() as plain, writing(plain) as connection:
        connection.execute(sa.update(schema.meta).where(schema.meta.c.name == "schema").values(value="99"))
    taken.close()
    for options in ({}, {"read_only": True}):
        with pytest.raises(JournalError) as told:
            opened(**options)
        wording(str(told.value))


def test_an_older_journal_is_brought_to_this_version_in_one_go(where: str) -> None:
    def more(connection: sa.Connection) -> None:
        connection.exec_driver_sql("ALTER TABLE formiga_starts ADD COLUMN note VARCHAR(9)")

    def breaks(connection: sa.Connection) -> None:
        more(connection)
        raise ZeroDivisionError

    database = Database(where)
    database.prepare()
    with database.engine.connect() as connection:
        with pytest.raises(ZeroDivisionError), writing(connection) as inside:
            schema.migrate(inside, "here", (*schema.MIGRATIONS, breaks))
        assert schema.version(connection) == len(schema.MIGRATIONS)
        connection.rollback()
        with writing(connection) as inside:
            schema.migrate(inside, "here", (*schema.MIGRATIONS, more))
        assert schema.version(connection) == len(schema.MIGRATIONS) + 1
        connection.execute(sa.text("SELECT note FROM formiga_starts"))
    database.engine.dispose()


def test_a_journal_of_before_the_outbox_gets_one(tmp_path: Path) -> None:
    database = Database(str(tmp_path / "journal.db"))
    database.prepare()
    with database.engine.connect() as connection, writing(connection) as inside:
        schema.news.drop(inside)
        inside.execute(sa.update(schema.meta).where(schema.meta.c.name == "schema").values(value="1"))
    database.engine.dispose()
    with Journal(tmp_path / "journal.db", "meadow") as journal:
        journal.take()
        assert journal.news(0, urgent=False, most=1) == []


@pytest.mark.external
@pytest.mark.network
def test_a_server_that_was_away_is_gone_on_with_unless_another_engine_took_over(database: str) -> None:
    def hang_up(journal: Journal) -> None:
        with journal.database.engine.connect() as connection:
            connection.exec_driver_sql(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
                "WHERE pid <> pg_backend_pid() AND backend_type = 'client backend'"
            )

    with Journal(database, "away") as journal:
        journal.take()
        journal.append(rows(journal, 1, 2))
        hang_up(journal)
        with pytest.raises(Unwritable, match=r"^the journal postgresql://formiga@/postgres"):
            journal.append(rows(journal, 3, 4))
        journal.append(rows(journal, 3, 4))
        assert [kept.seq for kept in journal.read()] == [1, 2, 3, 4]
        with Journal(database, "away") as other, pytest.raises(SiteError):
            other.take()
        hang_up(journal)
        with Journal(database, "away") as other:
            assert other.take() == 2
            with pytest.raises(Unwritable):
                journal.append(rows(journal, 5, 6))
            for _ in range(2):
                with pytest.raises(Overtaken):
                    journal.append(rows(journal, 5, 6))
        with pytest.raises(Overtaken):
            journal.append(rows(journal, 5, 6))


# -- SQLite files ------------------------------------------------------------------------------------------------------
def refused(path: Path, **options: bool) -> str:
    with pytest.raises(JournalError) as told:
        Journal(path, "demo", **options)  # type: ignore[arg-type]
    return str(told.value)


def test_a_file_that_is_no_database_is_left_alone(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("buy milk\n" * 100)
    wording(refused(path))
    assert path.read_text() == "buy milk\n" * 100


def test_a_database_of_something_else_is_left_alone(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "other.db"
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE shopping (what)")
    before = path.read_bytes()
    wording(refused(path), refused(path, read_only=True))
    assert path.read_bytes() == before


def test_a_damaged_file_is_told_and_left_alone(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "journal.db"
    with Journal(path, "demo", durability="normal") as journal:
        journal.take()
        Recording(journal, thin=False).feed(steps_of("pick_up"), 50)
    whole = path.read_bytes()
    spoiled = bytearray(whole)
    for first in range(8192 * 4, len(whole), 8192):
        spoiled[first : first + 200] = b"\xee" * 200
    path.write_bytes(spoiled)
    with pytest.raises(JournalError) as told, Journal(path, "demo", durability="normal") as journal:
        journal.take()
    assert str(told.value).startswith(f"the journal {path} is damaged: ")
    assert "docs/journal.md#damaged" in str(told.value)
    assert path.read_bytes() == bytes(spoiled)
    spoiled = bytearray(whole)
    spoiled[16:8192] = b"\xee" * (8192 - 16)
    path.write_bytes(spoiled)
    wording(refused(path))
    assert path.read_bytes() == bytes(spoiled)


def test_a_journal_that_is_not_there_is_not_made_by_looking(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "journal.db"
    wording(refused(path, read_only=True))
    assert not path.exists()


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "journal.db"
    wording(refused(path))


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("mysql://a@b/c", "mysql://a@b/c: a journal is an SQLite file or a PostgreSQL database"),
        ("sqlite://", "sqlite://: a journal is an SQLite file or a PostgreSQL database"),
        ("://", ":// is no address of a journal: "),
    ],
)
def test_an_address_that_is_none_is_told(word: str, text: str, wording: Wording) -> None:
    with pytest.raises(JournalError) as told:
        Journal(word, "demo")
    assert str(told.value).startswith(text)
    wording(str(told.value))


def test_a_server_that_is_not_there_is_told_without_its_password(tmp_path: Path) -> None:
    pytest.importorskip("psycopg")
    with pytest.raises(JournalError) as told:
        Journal(f"postgresql://me:secret@/none?host={tmp_path}", "demo")
    assert str(told.value).startswith("the journal postgresql://me:***@/none")
    assert "secret" not in str(told.value)


@pytest.mark.parametrize(("durability", "level"), [("full", 2), ("normal", 1)])
def test_durability_is_that_of_each_connection(tmp_path: Path, durability: str, level: int) -> None:
    with Journal(tmp_path / "journal.db", "demo", durability=durability) as journal:  # type: ignore[arg-type]
        journal.take()
        assert journal._write is not None
        said = {
            name: journal._write.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("synchronous", "journal_mode", "auto_vacuum", "application_id")
        }
    assert said == {"synchronous": level, "journal_mode": "wal", "auto_vacuum": 2, "application_id": 0x464F524D}
