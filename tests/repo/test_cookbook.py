"""docs/cookbook.md shows the files of trees/cookbook as they are, and its commands fly them.

`pytest tests/repo/test_cookbook.py --update-golden` copies the files into the page. Their cases are played by tests/missions.
"""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import read_world
from formiga_bt.cli.operator.library import read_library
from tests.golden import Wording

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "cookbook.md"
FOLDER = ROOT / "trees" / "cookbook"
BLOCK = re.compile(r"(<!-- file: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
COMMANDS = re.findall(r"^formiga (dryrun .*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def filled(found: "re.Match[str]") -> str:
    text = (FOLDER / f"{found[2]}.yaml").read_text(encoding="utf-8")
    return f"{found[1]}\n```yaml\n{text}```\n\n{found[3]}"


def test_the_page_shows_every_file_as_it_is(wording: Wording) -> None:
    text = PAGE.read_text(encoding="utf-8")

    wording.file(PAGE, BLOCK.sub(filled, text))
    shown = [found[1] for found in BLOCK.findall(text)]
    assert sorted(shown) == sorted(p.stem for p in FOLDER.glob("*.yaml") if not p.name.endswith(".test.yaml"))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_flies_its_task(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code = run(shlex.split(command))
    assert code == 0, "".join(capsys.readouterr())


def test_every_task_of_the_page_has_its_command() -> None:
    named = {command.split()[1] for command in COMMANDS}
    tasks = set(re.findall(r"^task: (\w+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
    assert named == tasks


def test_a_site_serves_its_copies_of_recipes_only(tmp_path: Path) -> None:
    world = read_world(site=Path("demo"))
    served, _ = read_library(None, tmp_path, world, {}, "")
    assert "Circle" in served
    assert "Convoy" not in served

    (tmp_path / "trees").mkdir()
    shutil.copy(FOLDER / "convoy.yaml", tmp_path / "trees")

    served, refused = read_library(None, tmp_path, world, {}, "")
    assert served["Convoy"].mark.file == str(tmp_path / "trees" / "convoy.yaml")
    assert refused == []
