"""`formiga new`: every kind checks without a warning, is laid out canonically, and flies."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.author.new import StartKind
from formiga_bt.lang.text.formatting import format_text
from tests.golden import Wording


@pytest.fixture(autouse=True)
def somewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("kind", list(StartKind))
def test_a_new_task_checks_without_a_warning_and_flies(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["new", "LookAround", "--kind", kind]) == 0
    said = capsys.readouterr().out
    assert "made look_around.yaml" in said
    text = Path("look_around.yaml").read_text(encoding="utf-8")
    assert format_text(text, "look_around.yaml").text == text

    assert run(["check", "--strict", "look_around.yaml", "--site", "demo"]) == 0
    command = next(line.split("formiga ", 1)[1] for line in text.splitlines() if "formiga dryrun" in line)
    assert run(command.split()) == 0, capsys.readouterr()
    assert "SUCCEEDED" in capsys.readouterr().out.upper()


def test_a_file_that_is_there_stays(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["new", "LookAround"]) == 0
    Path("look_around.yaml").write_text("mine", encoding="utf-8")

    assert run(["new", "LookAround", "--kind", "ask"]) == 2
    wording(capsys.readouterr().err)
    assert Path("look_around.yaml").read_text(encoding="utf-8") == "mine"


def test_it_goes_where_the_trees_are() -> None:
    Path("trees").mkdir()

    assert run(["new", "Look2Around"]) == 0
    assert Path("trees/look2_around.yaml").exists()


def test_a_name_that_cannot_be_one_is_refused_with_one_that_can(
    capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert run(["new", "look-around"]) == 2
    wording(capsys.readouterr().err)
