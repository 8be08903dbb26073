"""The verbs over a folder in which no engine runs: the journal tells, and one line says so."""

import json
import shutil
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.journal.store import Journal
from tests.unit.replay.flown import SITE, Flown

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
    here: Path, blocked: Flown, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From anywhere, with the file's name; at a time the task still flies."""
    monkeypatch.chdir(here.parent)
    assert run(["why", "PickUp-1", "--journal", str(blocked.where), "--at", "PickUp-1 start +5 s"]) == 0
    said = capsys.readouterr()
    assert "PickUp-1 ACTIVE\n  hwd_1 does TakeOff" in said.out
    assert said.err == "the journal of rovaniemi as of 1970-01-12 13:46:46\n"

    assert run(["why", "PickUp-1"]) == 1
    assert "no engine runs for" in capsys.readouterr().err
    assert run(["why", "PickUp-1", "--journal", str(blocked.where), "--url", "http://127.0.0.1:1"]) == 2
    assert "--url asks an engine, --journal looks at a file" in capsys.readouterr().err
    assert run(["why", "PickUp-1", "--at", "10:00"]) == 1
    assert "no journal lies in" in capsys.readouterr().err


def test_a_task_that_never_was(here: Path, capsys: Captured) -> None:
    assert run(["why", "PickUp-2"]) == 1
    assert "PickUp-1" in capsys.readouterr().err
    assert run(["show", "PickUp-1", "--live"]) == 2
    assert "--live follows an engine that runs, and this is its past" in capsys.readouterr().err


# -- formiga journal ---------------------------------------------------------------------------------------------------
def test_stats_tell_what_takes_the_room(here: Path, capsys: Captured) -> None:
    assert run(["journal", "stats"]) == 0
    told = capsys.readouterr().out
    assert "from 1970-01-12 13:46:40 to 1970-01-12 13:47:25" in told
    assert "KIND          COUNT  BYTES    EACH" in told
    assert "steps are kept for 30 days, way points for 7: nothing would be removed now" in told

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
    assert run(words) == 0
    assert "removed: " in capsys.readouterr().out
    with Journal(where, SITE, read_only=True) as left:
        assert 0 < len(list(left.read())) < before
        assert [start.epoch for start in left.starts()] == [1]


def test_tables(here: Path, capsys: Captured) -> None:
    assert run(["journal", "export", "-o", "out", "--what", "tasks", "--what", "goals"]) == 0
    assert sorted(file.name for file in (here / "out").iterdir()) == ["goals.csv", "tasks.csv"]
    assert "blocked" in (here / "out" / "goals.csv").read_text()
    capsys.readouterr()
    assert run(["journal", "export"]) == 2
    assert "formiga journal export -o FOLDER" in capsys.readouterr().err
