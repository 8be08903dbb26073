"""`formiga check`, with the shipped catalogue."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording

GOOD = """\
formiga: 1
task: Hello
agents:
  watcher:
    type: watcher
steps:
  - notify: Hello, watcher.
    to: [watcher]
"""


@pytest.fixture
def good(tmp_path: Path) -> Path:
    path = tmp_path / "hello.yaml"
    path.write_text(GOOD, encoding="utf-8")
    return path


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    path = tmp_path / "bad.yaml"
    path.write_text(GOOD.replace("steps:", "stepz:"), encoding="utf-8")
    return path


@pytest.fixture
def doubtful(tmp_path: Path) -> Path:
    """A file with a warning and no error."""
    path = tmp_path / "doubtful.yaml"
    path.write_text(GOOD.replace("agents:", "params:\n  spare: place\nagents:"), encoding="utf-8")
    return path


def test_a_clean_file_is_ok(good: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["check", str(good)]) == 0
    wording(capsys.readouterr().out)


def test_an_error_has_its_place_and_its_fix(bad: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["check", str(bad)]) == 1
    said = capsys.readouterr().out
    assert f"{bad}:6:1: E004" in said
    wording(said)
    assert "6 | stepz:" in said
    assert said.splitlines()[-1].startswith("refused: 1 file, ")


def test_a_warning_is_refused_only_when_strict(
    doubtful: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert run(["check", str(doubtful)]) == 0
    wording(capsys.readouterr().out)
    assert run(["check", "--strict", str(doubtful)]) == 1
    wording(capsys.readouterr().out)


def test_of_each_file_the_errors_come_first(bad: Path, doubtful: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = doubtful.read_text(encoding="utf-8")
    doubtful.write_text(text.replace("to: [watcher]", "too: [watcher]"), encoding="utf-8")

    assert run(["check", str(bad), str(doubtful)]) == 1
    text = capsys.readouterr().out
    run(["check", "--json", str(bad), str(doubtful)])

    said = [line.split(": ")[:2] for line in text.splitlines() if line.startswith(str(bad.parent))]
    by_place = [(one["file"], one["line"]) for one in json.loads(capsys.readouterr().out)["diagnostics"]]
    assert said == [[f"{bad}:6:1", "E004"], [f"{doubtful}:10:5", "E004"], [f"{doubtful}:4:3", "W060"]]
    assert by_place == sorted(by_place)


def test_json_says_the_same_to_programs(bad: Path, good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--json", str(bad), str(good)]) == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["ok"], report["files"]) == (False, 2)
    first = next(d for d in report["diagnostics"] if d["code"] == "E004")
    assert (first["file"], first["severity"]) == (str(bad), "error")
    assert {"code", "line", "col", "end_line", "end_col", "message", "help", "within", "fix"} <= first.keys()


def test_a_folder_means_the_task_files_below_it(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(good.parent)]) == 0
    assert "1 file," in capsys.readouterr().out


def test_files_of_a_folder_that_are_no_tasks_are_named(
    good: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    (good.parent / "second.yml").write_text(good.read_text(encoding="utf-8"), encoding="utf-8")
    (good.parent / "tsk.yaml").write_text("formiga: 1\ntsk: Typo\n", encoding="utf-8")
    os.mkfifo(good.parent / "pipe.yaml")
    assert run(["check", str(good.parent)]) == 0
    said = capsys.readouterr().out
    wording(said)
    assert f"{good.parent / 'pipe.yaml'}, {good.parent / 'tsk.yaml'}" in said


@pytest.mark.parametrize("verb", ["check", "show", "dryrun"])
def test_a_pipe_is_refused(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    assert run([verb, str(tmp_path / "pipe.yaml")]) == 2
    wording(capsys.readouterr().err)


@pytest.mark.parametrize("args", [["nope.yaml"], ["--site", "nope.yaml", "GOOD"], ["--actions", "nope.yaml", "GOOD"]])
def test_a_file_that_cannot_be_read_is_a_usage_error(
    args: list[str], good: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["check", *(str(good) if arg == "GOOD" else arg for arg in args)]) == 2
    assert "cannot read nope.yaml" in capsys.readouterr().err


def test_an_empty_folder_is_a_usage_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(tmp_path)]) == 2
    assert "no task file" in capsys.readouterr().err


def test_a_file_that_is_not_text_is_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"\xff\xfe\x00task")
    assert run(["check", str(path)]) in {1, 2}
    streams = capsys.readouterr()
    assert str(path) in streams.out + streams.err


def test_check_loads_nothing_heavy(good: Path) -> None:
    heavy = {"numpy", "lap", "zenoh", "py_trees", "pyproj", "shapely", "graphviz", "sqlalchemy"}
    start = f"import sys; from formiga_bt.cli.app import run; run(['check', {str(good)!r}])"
    code = f"{start}; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_show_prints_the_tree(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["show", "--ascii", "--width", "60", str(good)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Hello  priority medium")
    assert any(line.startswith('`- notify to watcher: "Hello, watcher."') for line in lines)
    assert max(map(len, lines)) <= 60


def test_show_of_a_wrong_file_reports_its_errors(bad: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["show", str(bad)]) == 1
    assert "E004" in capsys.readouterr().err
