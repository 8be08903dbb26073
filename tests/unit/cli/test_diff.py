"""`formiga diff` as it is typed."""

import json
import subprocess
from pathlib import Path

import pytest

from formiga_bt.cli.app import run as main
from tests.golden import Wording

TASK = """\
formiga: 1
task: Up
imports: [lib/pause.yaml]
agents:
  drone: {type: lwd}
steps:
  - do: drone.TakeOff
  - call: Pause
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
LIBRARY = "formiga: 1\nsubtrees:\n  Pause:\n    steps:\n      - wait: 5 s\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/pause.yaml").write_text(LIBRARY, encoding="utf-8")
    (tmp_path / "a.yaml").write_text(TASK, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_same(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "b.yaml").write_text("# the same\n" + TASK, encoding="utf-8")

    assert main(["diff", "a.yaml", "b.yaml"]) == 0
    assert capsys.readouterr().out == "no change\n"


def test_another(here: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    (here / "b.yaml").write_text(
        TASK.replace("  - call: Pause\n", "  - call: Pause\n    timeout: 9 s\n"), encoding="utf-8"
    )

    assert main(["diff", "a.yaml", "b.yaml", "--ascii", "--width", "60"]) == 1
    wording(capsys.readouterr().out.splitlines())


def test_json(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "b.yaml").write_text(TASK.replace("LandIn", "LandIn\n    timeout: 9 min"), encoding="utf-8")

    assert main(["diff", "b.yaml", "a.yaml", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "same": False,
        "counts": {"changed": 1},
        "changes": [
            {
                "what": "changed",
                "kind": "do",
                "title": "drone.LandIn",
                "path": "steps/steps[2]",
                "fields": [{"field": "timeout", "before": "9 min", "after": ""}],
                "before": {"file": "b.yaml", "line": 9, "column": 5},
                "after": {"file": "a.yaml", "line": 9, "column": 5},
            }
        ],
        "look_at": [
            {
                "text": "timeout of drone.LandIn is removed: 9 min",
                "spot": {"file": "a.yaml", "line": 9, "column": 5},
            }
        ],
    }


def test_a_file_with_errors_is_not_compared(here: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    (here / "b.yaml").write_text(TASK.replace("TakeOff", "Takeoff"), encoding="utf-8")

    assert main(["diff", "a.yaml", "b.yaml"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "b.yaml:7:15: E021" in said.err
    wording(said.err)


@pytest.mark.parametrize(
    "words", [["a.yaml"], ["a.yaml", "gone.yaml"], ["a.yaml", "lib/pause.yaml"], ["a.yaml", "a.yaml", "--git", "HEAD"]]
)
def test_what_cannot_be_used(
    here: Path, capsys: pytest.CaptureFixture[str], words: list[str], wording: Wording
) -> None:
    assert main(["diff", *words]) == 2
    wording(capsys.readouterr().err)


def git(*words: str) -> None:
    names = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "init.defaultBranch=main"]
    subprocess.run(["git", *names, *words], check=True, capture_output=True)


@pytest.mark.network
def test_a_revision_of_git_with_its_imports_of_then(
    here: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert main(["diff", "--git", "HEAD", "a.yaml"]) == 2
    wording(capsys.readouterr().err)
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    assert main(["diff", "--git", "HEAD", "a.yaml"]) == 0
    (here / "lib/pause.yaml").write_text(LIBRARY.replace("5 s", "8 s"), encoding="utf-8")
    capsys.readouterr()

    assert main(["diff", "--git", "HEAD", "a.yaml", "--json"]) == 1
    (change,) = json.loads(capsys.readouterr().out)["changes"]
    assert change["fields"] == [{"field": "wait", "before": "5 s", "after": "8 s"}]
    assert change["before"]["file"] == "HEAD:lib/pause.yaml"

    assert main(["diff", "--git", "nope", "a.yaml"]) == 2
    wording(capsys.readouterr().err)
    (here / "new.yaml").write_text(TASK, encoding="utf-8")
    assert main(["diff", "--git", "HEAD", "new.yaml"]) == 2
    wording(capsys.readouterr().err)
