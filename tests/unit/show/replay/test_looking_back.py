"""What a look back says when the moment is not there, when no engine is there, and when one ended in between."""

import json
from pathlib import Path

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.cli.app import run
from formiga_bt.show.replay.machine import Restart, TimeMachine
from formiga_bt.show.replay.source import NOT_YET, JournalSource
from formiga_bt.show.replay.story import tale
from tests.golden import Wording
from tests.unit.show.replay.flown import Flown

Captured = pytest.CaptureFixture[str]
ENDS = "the journal of rovaniemi ends at 1970-01-12 13:47:25, before 1970-01-12 {}; this is what stood at its end\n"


@pytest.mark.parametrize(
    ("at", "asked"),
    [("13:47:40", "13:47:40"), ("1970-01-12 14:00", "14:00:00"), ("PickUp-1 end +1 min", "13:48:25")],
)
def test_a_moment_after_the_end_is_told_beside_what_is_shown(at: str, asked: str, here: Path, capsys: Captured) -> None:
    """Also a time of the day, if the journal has not that of the day before. What programs read is as ever."""
    assert run(["why", "PickUp-1", "--at", at]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("PickUp-1 FAILED\n")
    assert said.err == ENDS.format(asked)
    assert run(["replay", "--at", at, "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["counts"] == {"FAILED": 1}
    assert said.err == ENDS.format(asked)


def test_the_end_itself_is_not_after_the_end(here: Path, capsys: Captured, wording: Wording) -> None:
    assert run(["why", "PickUp-1", "--at", "end"]) == 0
    wording(capsys.readouterr().err)


@pytest.mark.parametrize("words", [["show"], ["why"], ["gantt"], ["map"], ["replay", "--task"]])
def test_a_moment_before_a_task_says_when_it_was_requested(
    words: list[str], here: Path, capsys: Captured, wording: Wording
) -> None:
    assert run([*words, "PickUp-1", "--at", "start"]) == 1
    wording(capsys.readouterr().err)


def test_what_never_was_is_still_unknown(here: Path, blocked: Flown, capsys: Captured, wording: Wording) -> None:
    assert run(["show", "PickUp-9", "--at", "end"]) == 1
    wording(capsys.readouterr().err)
    with blocked.machine() as machine:
        with pytest.raises(TaskError) as never:
            JournalSource(machine, machine.first).task("PickUp-9")
        with pytest.raises(TaskError) as later:
            JournalSource(machine, machine.first).task("PickUp-1")
    assert (never.value.code, later.value.code) == ("unknown_task", NOT_YET)


def test_without_an_engine_tasks_says_what_shows_the_journal_and_that_lists_them(
    here: Path, capsys: Captured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    assert run(["tasks"]) == 1
    wording(capsys.readouterr().err)
    assert run(["replay", "--text"]) == 0
    wording(capsys.readouterr().out)
    monkeypatch.chdir(tmp_path)
    assert run(["tasks"]) == 1
    assert "its journal" not in capsys.readouterr().err


def test_a_picture_in_a_file_is_told(here: Path, capsys: Captured) -> None:
    assert run(["show", "PickUp-1", "-o", "tree.txt"]) == 0
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.endswith("\nwritten: tree.txt\n")


@pytest.mark.parametrize(
    ("restart", "severity", "text"),
    [
        ((8, 8, False), "warning", "the engine ended without notice, started again after 8.0 s"),
        ((9, 8, True), "info", "the engine was ended, started again after 8.0 s"),
        (
            (160, 8, False),
            "warning",
            "the engine ended without notice, started again after 8.0 s (160 s of engine time)",
        ),
    ],
)
def test_a_story_tells_that_the_engine_ended_in_between(
    restart: tuple[int, int, bool], severity: str, text: str, blocked: Flown, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At its last sign of life; how long it was away is as the wall has it."""
    passed, away, clean = restart
    with blocked.machine() as machine:
        begun = machine.record("PickUp-1")
        assert begun is not None
        ends = [begun.times.submitted_at + s * SECOND for s in (37, 60)]  # the second after the task's end
        found = [Restart(end, end + passed * SECOND, away * SECOND, is_clean=clean) for end in ends]
        monkeypatch.setattr(TimeMachine, "restarts", lambda *_: found)
        told = [one for one in tale(JournalSource(machine), "PickUp-1").events if "engine" in one.text]
    assert [(one.at, one.severity, one.text) for one in told] == [
        (begun.times.submitted_at + 37 * SECOND, severity, text)
    ]
