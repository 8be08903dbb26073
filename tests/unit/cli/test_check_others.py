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


def test_a_folder_is_checked_with_all_that_lies_in_it(tmp_path: Path, capsys: Capture) -> None:
    files = {
        "go.yaml": "formiga: 1\ntask: Go\nsteps:\n  - wait: 5 s\n",
        "lib/hop.yaml": "formiga: 1\nsubtrees:\n  Hop:\n    params: {drone: agent}\n    steps:\n      - do: drone.Hop\n",
        "site.yaml": "formiga_site: 1\nname: north\nbase: {lat: 66.5, lng: 25.7}\nmode: real\n",
        "mine.yaml": "types: {lwd: {wings: 2}}\n",
        "go.test.yaml": "formiga_test: 1\ntask: nothing.yaml\ncases: []\n",
        "compose.yaml": "services: {}\n",
    }
    for name, text in files.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")

    assert run(["check", str(tmp_path)]) == 1

    said = capsys.readouterr().out
    wrong = {name for name in files if f"{name}:" in said}
    assert wrong == {"lib/hop.yaml", "site.yaml", "mine.yaml", "go.test.yaml"}
    assert "refused: 5 files" in said
    assert "compose.yaml" in said  # what is none of these is named


def test_a_folder_of_libraries_alone_is_checked(tmp_path: Path, capsys: Capture) -> None:
    text = "formiga: 1\nsubtrees:\n  Hold:\n    steps:\n      - wait: 5\n"
    (tmp_path / "hold.yaml").write_text(text, encoding="utf-8")

    assert run(["check", str(tmp_path)]) == 1
    assert "E017" in capsys.readouterr().out
