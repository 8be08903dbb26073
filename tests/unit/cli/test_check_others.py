"""`formiga check` of files that are no tasks: sites, catalogues, scenarios, tests, profiles."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("formiga_site: 1\nname: north\nbase: {lat: 66.5, lng: 25.7}\nmode: real\n", "E008: mode real needs pilots"),
        ("scenario: bad\nsite: nowhere.yaml\nagents: []\ntasks: []\n", "nowhere.yaml"),
        ("types: {lwd: {wings: 2}}\n", "wings"),
        ("formiga_test: 1\ntask: nothing.yaml\ncases: []\n", "nothing.yaml"),
    ],
)
def test_each_is_checked_as_what_it_says_it_is(text: str, problem: str, tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "file.yaml"
    file.write_text(text, encoding="utf-8")

    assert run(["check", str(file)]) == 1

    said = capsys.readouterr().out
    assert problem in said
    assert "refused: 1 file" in said


SHIPPED = ("actions/base.yaml", "trees/demo-site.yaml", "trees/scenarios/demo.yaml", "trees/pick_up.test.yaml")


@pytest.mark.parametrize("path", SHIPPED)
def test_what_ships_is_sound(path: str, capsys: Capture, wording: Wording) -> None:
    assert run(["check", "--strict", str(ROOT / path)]) == 0
    wording(capsys.readouterr().out)
