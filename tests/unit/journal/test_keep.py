"""Retention forgets history, never what an engine needs to go on; figures and tables tell what there is."""

import csv
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import JournalError
from formiga_bt.journal import export as exporting
from formiga_bt.journal.export import COLUMNS, export
from formiga_bt.journal.figures import Leaving, leaving
from formiga_bt.journal.keep import DAY_US, Removed, Retention, compact, stats
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from tests.golden import Wording
from tests.unit.journal.conftest import Opener, Recording, as_told, steps_of

LONG = "pick_up"


def keep(seconds: float) -> Retention:
    days = seconds * SECOND / DAY_US
    return Retention(history_days=days, telemetry_days=days)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(0, 1), min_size=1, max_size=3).map(sorted), st.sampled_from([30, 10**9]), st.booleans())
def test_what_is_left_after_a_compaction_tells_the_same(
    opened: Opener, tmp_path_factory: pytest.TempPathFactory, cuts: list[float], often: int, thin: bool
) -> None:
    steps = steps_of(LONG)
    first, last = steps[0].at, steps[-1].at
    path = tmp_path_factory.mktemp("kept") / "journal.db"
    with Journal(path, "demo", durability="normal") as journal:
        journal.take()
        recording = Recording(journal, thin=thin, snapshot_steps=often)
        recording.feed(steps, 16)
        journal.append((), recording.writer._thinner.blocks(0, all_=True))
        past = Past(journal)
        for cut in cuts:
            before = round(first + cut * (last - first))
            moments = [before + 2, (before + last) // 2, last]
            was = [as_told(past.state(at)) for at in moments]
            resume = as_told(past.state())
            rule = keep((last + SECOND - before) / SECOND)
            told = leaving(journal, last + SECOND, rule)
            assert compact(journal, last + SECOND, rule) == Removed(told.steps, told.snapshots, told.points)
            assert as_told(past.state()) == resume
            assert [as_told(past.state(at)) for at in moments] == was
            assert all(kept.at >= before for kept in journal.read())
            earliest = past.first()
            assert earliest is not None
            assert earliest <= before + 1


def test_however_old_it_is_what_resume_needs_stays(taken: Journal) -> None:
    steps = steps_of("survey")[:150]  # in the middle: tasks, goals and questions are open
    recording = Recording(taken, thin=False)
    recording.feed(steps, 10)
    live = recording.state
    assert live.goals
    assert live.memory
    before = stats(taken)
    removed = compact(taken, steps[-1].at + 400 * DAY_US)
    assert removed == Removed(150, 1, 0)
    assert as_told(Past(taken).state()) == as_told(live)
    assert compact(taken, steps[-1].at + 400 * DAY_US) == Removed()
    after = stats(taken)
    assert (before.steps, after.steps, after.snapshots) == (150, 0, 1)
    taken.append([])
    assert taken.last()[0] == 150, "numbers go on"


def test_what_would_be_removed_is_told_and_stays(taken: Journal) -> None:
    """Which steps, of which tasks, from when to when, and how much room they take."""
    steps = steps_of("move_task")
    Recording(taken, thin=False).feed(steps, 10)
    before = stats(taken)
    told = leaving(taken, steps[-1].at, Retention(history_days=0, telemetry_days=None))
    assert (told.steps, told.first, told.until) == (len(steps), steps[0].at, steps[-1].at)
    assert told.tasks == {"MoveTask-1"}
    assert told.bytes == before.bytes_steps + before.bytes_snapshots + before.bytes_points
    assert leaving(taken, steps[-1].at) == Leaving()
    assert stats(taken) == before


def test_nothing_young_is_removed(taken: Journal) -> None:
    steps = steps_of("move_task")
    Recording(taken).feed(steps, 10)
    assert compact(taken, steps[-1].at) == Removed()
    assert compact(taken, steps[-1].at + 400 * DAY_US, Retention(history_days=None, telemetry_days=None)) == Removed()


def test_compaction_while_an_engine_writes(taken: Journal, opened: Opener) -> None:
    steps = steps_of(LONG)
    recording = Recording(taken, thin=False, snapshot_steps=50)
    other = opened()
    for first in range(0, len(steps), 60):
        recording.feed(steps[first : first + 60], 6)
        compact(other, recording.state.now, keep(20))
    assert as_told(Past(other).state()) == as_told(recording.state)
    assert stats(other).steps < len(steps) / 2


def test_room_is_given_back_to_the_disk(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    with Journal(path, "demo", durability="normal") as journal:
        journal.take()
        Recording(journal, thin=False).feed(steps_of(LONG), 50)
    before = path.stat().st_size
    with Journal(path, "demo", durability="normal") as journal:
        assert compact(journal, 10**18).steps == len(steps_of(LONG))
    assert path.stat().st_size < before - 150_000, "tables alone take some room"


def test_figures_count_what_is_there(taken: Journal) -> None:
    steps = steps_of("move_task")
    recording = Recording(taken)
    recording.feed(steps, 10)
    recording.writer.end()
    found = stats(taken)
    assert (found.site, found.where, found.starts, found.snapshots, found.gaps) == ("demo", taken.where, 1, 2, 0)
    assert found.steps == recording.writer.kept == sum(found.kinds.values())
    assert found.points > 0
    assert list(found.kinds.values()) == sorted(found.kinds.values(), reverse=True)
    assert (found.first, found.last) == (0, max(kept.at for kept in taken.read()))
    assert min(found.bytes_steps, found.bytes_points, found.bytes_snapshots) > 0
    assert (found.bytes_file is not None) == taken.database.is_sqlite


def test_a_site_without_history_has_figures_too(opened: Opener) -> None:
    opened()
    found = stats(opened(read_only=True))
    assert (found.steps, found.points, found.first, found.last) == (0, 0, None, None)
    assert compact(opened(site="nobody"), 10**18) == Removed()


# -- tables ------------------------------------------------------------------------------------------------------------
def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_tables_tell_steps_tasks_actions_and_ways(taken: Journal, tmp_path: Path) -> None:
    recording = Recording(taken)
    recording.feed(steps_of("move_task"), 10)
    recording.writer.end()
    files = export(taken, tmp_path / "out")
    assert [file.name for file in files] == ["steps.csv", "tasks.csv", "goals.csv", "tracks.csv", "questions.csv"]
    steps, tasks, actions, ways, _ = map(table, files)
    assert [int(row["seq"]) for row in steps] == [kept.seq for kept in taken.read()]
    assert [row["reply"] for row in steps if row["input"] == "Submit"] == ["MoveTask-1"]
    assert [(row["task"], row["status"]) for row in tasks] == [("MoveTask-1", "SUCCEEDED")]
    assert next(row["action"] for row in actions if row["task"] == "MoveTask-1") == "TakeOff"
    assert {row["state"] for row in actions} == {"succeeded"}
    mine = [int(row["unix_millis"]) for row in ways if row["agent"] == "lwd_1"]
    assert mine == sorted(mine)
    assert all(after > before for before, after in pairwise(mine))


def test_a_table_by_its_name(taken: Journal, tmp_path: Path) -> None:
    """Questions have who was asked, what was answered, and when."""
    Recording(taken).feed(steps_of("pick_up"), 10)
    (file,) = export(taken, tmp_path / "out", what=["questions"])
    assert file.name == "questions.csv"
    asked = [row for row in table(file) if row["kind"] == "ask"]
    assert asked
    assert {row["answer"] for row in asked} <= {"loaded", "not_yet", "nothing_to_load"}
    for row in asked:
        assert "picker_1" in row["asked"]
        assert int(row["unix_millis_answered"]) > int(row["unix_millis_asked"])


def test_tables_of_a_time(taken: Journal, tmp_path: Path) -> None:
    steps = steps_of("move_task")
    Recording(taken, thin=False).feed(steps, 10)
    since, until = steps[40].at, steps[80].at
    found = table(export(taken, tmp_path, since=since, until=until)[0])
    assert {int(row["unix_millis"]) for row in found} == {s.at // 1000 for s in steps if since <= s.at <= until}


def test_parquet_without_its_library_is_told(
    taken: Journal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    def gone(name: str) -> None:
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(exporting, "import_module", gone)
    with pytest.raises(JournalError) as refused:
        export(taken, tmp_path, form="parquet")
    wording(refused.value)


@pytest.mark.external
def test_parquet_files_have_the_same_rows(taken: Journal, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    recording = Recording(taken)
    recording.feed(steps_of("move_task"), 10)
    recording.writer.end()
    as_csv = export(taken, tmp_path / "csv")
    for one, other in zip(as_csv, export(taken, tmp_path / "parquet", form="parquet"), strict=True):
        read = parquet.read_table(other)
        assert read.column_names == list(COLUMNS[one.stem])
        assert read.num_rows == len(table(one))
