"""The verbs over a folder in which no engine runs: the journal tells, and one line says so."""

import io
import json
import re
import shutil
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from tests.golden import Wording, having
from tests.unit.journal.conftest import Recording, as_told, steps_of
from tests.unit.show.replay.flown import SITE, Flown

Captured = pytest.CaptureFixture[str]
AS_OF = "no engine runs; the journal of rovaniemi as of 1970-01-12 13:47:25\n"


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        (["show", "PickUp-1", "--ascii"], "x drone.GoTo"),
        (["why", "PickUp-1"], "first failed: drone.GoTo at"),
        (["gantt", "PickUp-1", "--ascii"], "PickUp-1  FAILED (failed:blocked) after 44.2 s"),
        (["map", "PickUp-1", "--ascii"], "hwd_1"),
        (["stats", "--ascii"], "PickUp  0       1"),
    ],
)
def test_without_an_engine_the_journal_tells(words: list[str], shown: str, here: Path, capsys: Captured) -> None:
    assert run(words) == 0
    said = capsys.readouterr()
    assert shown in said.out
    assert said.err == AS_OF


def test_a_moment_and_a_journal_are_chosen(
    here: Path, blocked: Flown, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    """From anywhere, with the file's name; at a time the task still flies."""
    monkeypatch.chdir(here.parent)
    assert run(["why", "PickUp-1", "--journal", str(blocked.where), "--at", "PickUp-1 start +5 s"]) == 0
    said = capsys.readouterr()
    wording(said.out, said.err)

    assert run(["why", "PickUp-1"]) == 1
    wording(capsys.readouterr().err)
    assert run(["why", "PickUp-1", "--journal", str(blocked.where), "--url", "http://127.0.0.1:1"]) == 2
    wording(capsys.readouterr().err)
    assert run(["why", "PickUp-1", "--at", "10:00"]) == 1
    wording(capsys.readouterr().err)


def test_a_task_that_never_was(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["why", "PickUp-2"]) == 1
    assert "PickUp-1" in capsys.readouterr().err
    assert run(["show", "PickUp-1", "--live"]) == 2
    wording(capsys.readouterr().err)


# -- formiga journal ---------------------------------------------------------------------------------------------------
def test_stats_tell_what_takes_the_room(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["journal", "stats"]) == 0
    told = capsys.readouterr().out
    wording(having(told, "KIND", "kept for"))

    assert run(["journal", "stats", "--json", "--history", "0", "--tracks", "0"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"Submit", "GoalEvent", "(snapshots)"} <= {one["kind"] for one in found["kinds"]}
    assert sum(one["count"] for one in found["kinds"] if one["kind"][0] != "(") == found["retention"]["steps"]


def test_compact_removes_what_is_old_but_never_under_an_engine(
    tmp_path: Path, blocked: Flown, capsys: Captured
) -> None:
    shutil.copytree(blocked.folder / ".formiga", tmp_path / ".formiga")
    where = tmp_path / ".formiga" / SITE / "journal.db"
    words = ["journal", "compact", "--journal", str(where), "--history", "0.0001"]
    with Journal(where, SITE, durability="normal") as engine:
        engine.take()
        assert run(words) == 1
        assert "an engine writes" in capsys.readouterr().err
        assert engine.first_snapshot_at() is not None
        before = len(list(engine.read()))
    assert run([*words, "--yes"]) == 0
    assert "removed: " in capsys.readouterr().out
    with Journal(where, SITE, read_only=True) as left:
        assert 0 < len(list(left.read())) < before
        assert [start.epoch for start in left.starts()] == [1]


@pytest.fixture
def copy(tmp_path: Path, blocked: Flown, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a journal of one's own."""
    monkeypatch.setenv("TZ", "UTC")
    return shutil.copy(blocked.where, tmp_path / "copy.db")


ALL = """\
  N steps, 2 snapshots, N way points: about SIZE
  all moments from 1970-01-12 13:46:40 to 1970-01-12 13:47:25
  what 1 task did then: no verb shows or explains it any more
  what an engine needs to go on stays
"""


def sizeless(text: str) -> str:
    """Return a text without the number and size of records, which change with what an engine does and each field of theirs."""
    text = re.sub(r"about [1-9]\d{0,2}(?:\.\d)? kB", "about SIZE", text)
    return re.sub(r"\b[1-9]\d+ (steps|way points)", r"N \1", text)


def test_compact_tells_what_would_be_gone_and_removes_it_only_if_that_is_confirmed(
    copy: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    words = ["journal", "compact", "--journal", str(copy), "--history", "0"]
    before = copy.stat().st_size
    assert run(words) == 2
    wording(sizeless(capsys.readouterr().err))
    monkeypatch.setattr("sys.stdin", Terminal("n\n"))
    assert run(words) == 1
    said = capsys.readouterr()
    assert f"To compact {copy} removes for ever\n{ALL}Remove it? [y/N]:" in sizeless(said.err)
    with Journal(copy, SITE, read_only=True) as left:
        assert len(list(left.read())) > 40

    monkeypatch.setattr("sys.stdin", Terminal("y\n"))
    assert run([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["steps"] > 40, found["bytes_before"], found["bytes_after"]) == (True, before, copy.stat().st_size)
    assert found["bytes_after"] < before

    assert run(words) == 0
    told = "nothing to remove: steps are kept for 0 days, way points for 7; "
    assert capsys.readouterr().out.startswith(told)


class Terminal(io.StringIO):
    """A terminal at which somebody types."""

    def isatty(self) -> bool:
        return True


def test_sizes_are_those_on_the_disk_with_what_waits_in_the_log(copy: Path, capsys: Captured) -> None:
    """Whoever looks meanwhile keeps the log where it is: it is counted."""
    with Journal(copy, SITE, read_only=True) as looking, looking._reading() as connection:
        connection.exec_driver_sql("SELECT count(*) FROM formiga_steps").scalar()
        assert run(["journal", "compact", "--journal", str(copy), "--history", "0", "--yes", "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        log = copy.with_name("copy.db-wal").stat().st_size
        assert log > 0
        assert found["bytes_after"] == copy.stat().st_size + log


def test_tasks_that_are_open_stay_whatever_is_removed(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    steps = steps_of("survey")[:150]  # in the middle: tasks, goals and questions are open
    where = tmp_path / "open.db"
    with Journal(where, "demo", durability="normal") as journal:
        journal.take()
        Recording(journal, thin=False).feed(steps, 10)
        was = Past(journal).state()
    open_ = [task.id for task in was.tasks.values() if not task.ended]
    assert open_
    assert was.goals
    words = ["journal", "compact", "--journal", str(where), "--history", "0", "--tracks", "0"]
    assert run(words) == 2
    wording(having(capsys.readouterr().err, "stays"))
    assert run([*words, "--yes"]) == 0
    with Journal(where, "demo") as journal:
        assert list(journal.read()) == []
        assert as_told(Past(journal).state()) == as_told(was)
        assert journal.take() == 2


def test_tables(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["journal", "export", "-o", "out", "--what", "tasks", "--what", "goals"]) == 0
    assert sorted(file.name for file in (here / "out").iterdir()) == ["goals.csv", "tasks.csv"]
    assert "blocked" in (here / "out" / "goals.csv").read_text()
    capsys.readouterr()
    assert run(["journal", "export", "-o", "out"]) == 2
    wording(capsys.readouterr().err)
    assert not (here / "out" / "steps.csv").exists(), "nothing is written"
    assert run(["journal", "export", "-o", "out", "--what", "steps"]) == 0
    (here / "out" / "goals.csv").write_text("old")
    assert run(["journal", "export", "-o", "out", "--force"]) == 0
    assert "blocked" in (here / "out" / "goals.csv").read_text()
    assert run(["journal", "export"]) == 2
    wording(capsys.readouterr().err)
