"""`formiga sim`: a scenario in virtual time, and what is said when it cannot be played. Processes are in tests/e2e."""

import json
import time
from pathlib import Path

import pytest

from formiga_bt.cli.app import run

Capture = pytest.CaptureFixture[str]


def test_all_five_missions_succeed_in_virtual_time(capsys: Capture) -> None:
    assert run(["sim", "demo", "--virtual", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [(task["task"], task["status"]) for task in report["tasks"]] == [
        ("MoveTask-1", "SUCCEEDED"),
        ("ExploreRegion-2", "SUCCEEDED"),
        ("PickUp-3", "SUCCEEDED"),
        ("WatchDogSOS-4", "SUCCEEDED"),
        ("WatchDogRequest-5", "SUCCEEDED"),
    ]
    assert (report["crashes"], report["unsafe_starts"], report["low_flights"], report["refused"]) == (0, 0, 0, [])
    finder = [row["state"] for row in report["actions"] if row["action"] == "MiniFinder"]
    assert len(finder) > 1  # the picker was lost: the first answer was not the last
    assert set(finder) == {"succeeded"}


def test_faults_and_failures_are_told_and_the_exit_code_says_no(capsys: Capture) -> None:
    assert run(["sim", "one-killed", "--virtual"]) == 1
    text = capsys.readouterr().out
    assert "35.0 s  fault: hwd_1: kill\n" in text
    assert "FAILED: agent_lost" in text
    assert "crashes: 0, starts near people without clearance: 0" in text


def test_a_speed_lets_people_watch(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "short.yaml"
    file.write_text(
        "scenario: short\nsite: demo-site.yaml\nagents: [{id: lwd_1}, {id: watcher_1, at: camp}]\n"
        "tasks: [{task: MoveTask, params: {robot: lwd_1}}]\n"
    )
    began = time.monotonic()
    assert run(["sim", str(file), "--virtual", "--speed", "200"]) == 0
    assert 0.2 < time.monotonic() - began < 5.0  # a minute of engine time
    assert "MoveTask-1  lwd_1" in capsys.readouterr().out


def test_a_scenario_with_errors_is_told_with_all_of_them(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(
        "scenario: bad\nsite: demo-site.yaml\nagents: [{id: hwd_1, at: p55}]\nfaults: [{at: 3, agent: hwd_1}]\n"
    )
    assert run(["sim", str(file), "--virtual"]) == 1
    said = capsys.readouterr().err
    assert "bad.yaml:3:26: E010: no port or place is called 'p55'; did you mean 'p5'?" in said
    assert "E017: 'at' needs a unit: 3 s?" in said
    assert "needs 'kind'" in said
    assert "cannot be played" in said


def test_what_is_not_there_is_named(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(["sim", "demmo", "--virtual"]) == 2
    assert "no scenario is called 'demmo'; did you mean 'demo'?" in capsys.readouterr().err
    assert run(["sim", "none.yaml", "--virtual"]) == 2
    assert "cannot read none.yaml" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert run(["sim", "demo"]) == 1
    assert "no engine runs" in capsys.readouterr().err
