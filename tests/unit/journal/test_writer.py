"""The driver's seam: what it does when the disk is slow, full, and well again."""

import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import sqlalchemy as sa

from formiga_bt.base.errors import JournalError
from formiga_bt.engine.drivers.persist import DURABLE, Outcome
from formiga_bt.engine.kernel.inputs import EngineStep, JournalState
from formiga_bt.engine.kernel.state import EngineState, fold
from formiga_bt.journal import database
from formiga_bt.journal.database import writing
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal, Unwritable
from formiga_bt.journal.writer import tasks_of
from tests.golden import Wording
from tests.unit.journal.conftest import Recording, as_told, steps_of

LONG = steps_of("pick_up")


class Rig(Recording):
    """A recording whose disk fills, and whose clock is turned by hand."""

    def __init__(self, journal: Journal, **options: object) -> None:
        super().__init__(journal, EngineState(), thin=False, **options)
        self.journal = journal
        self.outcomes: list[Outcome] = []

    def give(self, steps: Sequence[EngineStep]) -> Outcome:
        for step in steps:
            fold(self.state, self.board, step)
        self.outcomes.append(self.writer.keep(steps))
        return self.outcomes[-1]

    def fill(self) -> None:
        assert self.journal._write is not None
        used = self.journal._write.exec_driver_sql("PRAGMA page_count").scalar()
        self.journal._write.exec_driver_sql(f"PRAGMA max_page_count = {used}")
        self.journal._write.commit()

    def free(self) -> None:
        assert self.journal._write is not None
        self.journal._write.exec_driver_sql("PRAGMA max_page_count = 1000000")
        self.journal._write.commit()


@pytest.fixture
def where(tmp_path: Path) -> str:
    return str(tmp_path / "journal.db")


@pytest.fixture
def rig(taken: Journal) -> Rig:
    return Rig(taken)


def test_a_full_disk_is_told_once_and_steps_wait_until_there_is_room(rig: Rig) -> None:
    assert rig.give(LONG[:20]) == DURABLE
    rig.fill()
    told = rig.give(LONG[20:200])
    assert told == Outcome(
        False,
        JournalState(
            "full",
            f"the journal {rig.journal.where} cannot be written: database or disk is full; make room on its disk",
        ),
    )
    rig.clock += 0.5
    assert rig.give(LONG[200:210]) == Outcome(False)
    rig.clock += 1.0
    assert rig.give(LONG[210:220]) == Outcome(False), "tried again, still full"
    rig.free()
    assert rig.give(LONG[220:230]) == Outcome(False), "not before a second is over"
    rig.clock += 1.1
    assert rig.give(LONG[230:240]) == Outcome(True, JournalState("ok"))
    assert [kept.step for kept in rig.journal.read()] == list(LONG[:240])
    assert as_told(Past(rig.journal).state()) == as_told(rig.state)


def test_what_no_longer_fits_into_memory_is_a_gap_and_a_snapshot_follows(taken: Journal, wording: Wording) -> None:
    rig = Rig(taken, backlog_bytes=20_000)
    rig.give(LONG[:20])
    rig.fill()
    for first in range(20, 400, 20):
        rig.clock += 2.0
        rig.give(LONG[first : first + 20])
    rig.free()
    rig.clock += 2.0
    assert rig.give(LONG[400:410]) == Outcome(True, JournalState("ok"))
    rig.give(LONG[410:])
    gaps = taken.gaps()
    lost = [seq for gap in gaps for seq in range(gap.seq, gap.to_seq + 1)]
    assert sorted([*lost, *(kept.seq for kept in taken.read())]) == list(range(1, len(LONG) + 1))
    assert 100 < len(lost) <= 390
    assert {gap.why for gap in gaps} == {"the journal could not be written for too long"}
    past = Past(taken)
    assert as_told(past.state()) == as_told(rig.state)
    assert past.state(LONG[10].at).seq >= 11
    with pytest.raises(JournalError) as refused:
        past.state(gaps[-1].at)
    wording(refused.value)


def test_a_slow_disk_is_told_and_calm_again_after_ten_seconds(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    stage, takes = rig.journal.stage, 0.0

    def slowly(*rows: object) -> Callable[[], None]:
        rig.clock += takes
        return stage(*rows)  # type: ignore[arg-type]

    monkeypatch.setattr(rig.journal, "stage", slowly)
    takes = 0.4
    assert rig.give(LONG[:5]) == DURABLE
    takes = 0.7
    text = f"a commit to {rig.journal.where} took 0.7 s"
    assert rig.give(LONG[5:10]) == Outcome(True, JournalState("slow", text))
    assert rig.give(LONG[10:15]) == Outcome(True)
    takes = 0.0
    rig.clock += 9.9
    assert rig.give(LONG[15:20]) == Outcome(True)
    rig.clock += 0.2
    assert rig.give(LONG[20:25]) == Outcome(True, JournalState("ok"))


def test_a_batch_of_telemetry_alone_needs_no_commit(taken: Journal) -> None:
    recording = Recording(taken)
    commits = []
    for step in LONG:
        recording.feed([step])
        commits.append(recording.writer.commits)
    assert recording.writer.commits < len(LONG) / 2
    assert recording.writer.kept < len(LONG) / 2


def test_another_program_that_holds_the_file_is_full_too(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    rig.give(LONG[:5])
    assert rig.journal._write is not None
    rig.journal._write.exec_driver_sql("PRAGMA busy_timeout = 1")
    rig.journal._write.commit()
    other = sqlite3.connect(rig.journal.where, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    told = rig.give(LONG[5:10])
    assert told.news is not None
    wording(told.news.text)
    other.execute("ROLLBACK")
    other.close()
    rig.clock += 1.1
    assert rig.give(LONG[10:15]) == Outcome(True, JournalState("ok"))


def test_an_engine_that_flies_waits_for_others_a_moment_only(rig: Rig) -> None:
    def patience_ms() -> int:
        assert rig.journal._write is not None
        return int(rig.journal._write.connection.dbapi_connection.execute("PRAGMA busy_timeout").fetchone()[0])

    assert patience_ms() == 200
    rig.give(LONG[:5])
    assert rig.journal._write is not None
    rig.journal._write.close()  # as after a lost connection
    rig.give(LONG[5:10])
    assert patience_ms() == 200
    rig.writer.end()
    assert patience_ms() == 10_000


def test_what_takes_long_to_fail_is_tried_less_often(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    tries = []

    def slowly(*_: object) -> Callable[[], None]:
        rig.clock += 2.0
        tries.append(rig.clock)
        raise Unwritable("locked")

    monkeypatch.setattr(rig.journal, "stage", slowly)
    for _ in range(40):
        rig.give(LONG[:1] if not tries else ())
        rig.clock += 0.5
    assert tries == [2.0, 12.0, 22.0], "8 s after the end of the last one"


@pytest.mark.parametrize("where", ["sqlite"], indirect=True)
def test_who_writes_waits_for_another_thread_of_its_own_process(
    taken: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = taken.database.engine.connect()
    beside = writing(plain)
    waited: list[float] = []

    class Turn:
        """Ends what is written beside when it is waited for."""

        def locked(self) -> bool:
            return True

        def acquire(self, *, timeout: float = -1, blocking: bool = True) -> bool:
            if blocking:
                waited.append(timeout)
                beside.__exit__(None)
            return True

        def release(self) -> None:
            pass

    rig = Rig(taken)
    assert taken._write is not None
    taken._write.exec_driver_sql("PRAGMA busy_timeout = 1")
    taken._write.commit()
    beside.__enter__()
    monkeypatch.setattr(database, "_turn_of", lambda _: Turn())
    assert rig.give(LONG[:5]) == DURABLE
    assert waited == [database.OWN_S]
    plain.close()


@pytest.mark.external
def test_a_server_that_went_away_is_noticed_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[dict[str, object]] = []
    create = sa.create_engine
    monkeypatch.setattr(sa, "create_engine", lambda *a, **o: made.append(o["connect_args"]) or create(*a, **o))
    database.Database("postgresql://ann@db.example/formiga")
    database.Database("postgresql://ann@db.example/formiga?connect_timeout=9")
    assert made[0] == database.SERVER
    assert made[0]["connect_timeout"] == 2
    assert made[0]["tcp_user_timeout"] == 2000
    assert "connect_timeout" not in made[1], "what the URL says counts"


def test_the_end_writes_what_waits_and_a_snapshot(rig: Rig) -> None:
    rig.give(LONG[:100])
    rig.fill()
    rig.give(LONG[100:300])
    rig.free()
    rig.writer.end()
    assert [kept.seq for kept in rig.journal.read()] == list(range(1, 301))
    state = rig.journal.snapshot_at()
    assert state == rig.state
    (start,) = rig.journal.starts()
    assert start.ended is not None


def test_what_was_learned_is_not_used_if_it_could_not_be_written(rig: Rig) -> None:
    rig.give(LONG[:20])
    rig.fill()
    with pytest.raises(Unwritable):
        rig.journal.teach(LONG)
    assert not rig.journal.is_taught
    rig.free()
    rig.give(LONG[20:40])
    with Journal(rig.journal.where, "demo", read_only=True) as reader:
        assert [kept.step for kept in reader.read()] == list(LONG[:40])


def test_an_end_without_room_is_quiet(rig: Rig) -> None:
    rig.give(LONG[:100])
    rig.fill()
    rig.give(LONG[100:300])
    rig.writer.end()
    rig.free()
    assert [kept.seq for kept in rig.journal.read()] == list(range(1, 101))


def test_a_journal_that_nobody_took_writes_nothing(opened: object, where: str) -> None:
    with Journal(where, "demo") as journal, pytest.raises(AssertionError, match="take"):
        journal.append([])


def test_tasks_touched_are_those_of_the_parts_of_a_step() -> None:
    submit = next(step for step in LONG if type(step.input).__name__ == "Submit")
    assert tasks_of(submit) == ("PickUp-1",)
    assert all("|" not in task for step in LONG for task in tasks_of(step))


def test_unwritable_is_a_journal_error() -> None:
    assert issubclass(Unwritable, JournalError)
