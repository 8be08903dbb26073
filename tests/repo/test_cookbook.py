"""docs/cookbook.md shows the files of trees/cookbook as they are, some as BehaviorTree.CPP too, and its commands fly them.

`pytest tests/repo/test_cookbook.py --update-golden` copies the files into the page. Their cases are played by tests/missions.
"""

import re
import shlex
import shutil
import tempfile
import textwrap
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import read_world
from formiga_bt.cli.operator.library import read_library
from tests.golden import Wording

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "cookbook.md"
FOLDER = ROOT / "trees" / "cookbook"
BLOCK = re.compile(r"(<!-- file: ([\w/]+) -->\n).*?(<!-- end -->)", re.DOTALL)
EXPORTED = re.compile(r"(<!-- btcpp: ([\w/]+) -->\n).*?(<!-- end -->)", re.DOTALL)
OWN = ROOT / "docs" / "examples"
"""Where those recipes stand that have a site of their own, each in a folder."""
COMMANDS = re.findall(r"^formiga (dryrun .*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def file_of(recipe: str) -> Path:
    return (OWN if "/" in recipe else FOLDER) / f"{recipe}.yaml"


def filled(found: "re.Match[str]") -> str:
    text = file_of(found[2]).read_text(encoding="utf-8")
    return f"{found[1]}\n```yaml\n{text}```\n\n{found[3]}"


def exported(found: "re.Match[str]") -> str:
    """Return the block of a recipe as BehaviorTree.CPP: its own tree, without the places in our file, and lines counted."""
    file = file_of(found[2])
    site = file.parent / "site.yaml"
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "tree.xml"
        assert (
            run(["export", str(file), "--to", "btcpp", "-o", str(out), *(["--site", str(site)] * site.is_file())]) == 0
        )
        xml = out.read_text(encoding="utf-8")
    start, end = xml.index("  <BehaviorTree "), xml.index("  </BehaviorTree>") + len("  </BehaviorTree>")
    tree = re.sub(r' _description="[^"]*"', "", textwrap.dedent(xml[start:end]))
    yaml = [line for line in file.read_text(encoding="utf-8").splitlines() if line.strip() and line.strip()[0] != "#"]
    own = re.findall(r'^    <(?:Action|Condition|Control|Decorator) ID="(\w+)"', xml, re.MULTILINE)
    used = [node for node in own if f"<{node}" in tree]
    lost = sorted(set(re.findall(r"^     (L\d\d) ", xml, re.MULTILINE)))
    said = (
        f"As BehaviorTree.CPP: {len(tree.splitlines())} lines for {len(yaml)} of YAML, and {len(used)} kinds of nodes that its "
        f"host must bring: {', '.join(used)}. What it cannot say: {', '.join(lost)} ([btcpp.md](btcpp.md#export))."
    )
    return f"{found[1]}{textwrap.fill(said, 128, break_long_words=False)}\n\n```xml\n{tree}\n```\n\n{found[3]}"


def test_the_page_shows_every_file_as_it_is(wording: Wording) -> None:
    text = PAGE.read_text(encoding="utf-8")

    wording.file(PAGE, EXPORTED.sub(exported, BLOCK.sub(filled, text)))
    shown = [found[1] for found in BLOCK.findall(text)]
    assert sorted(shown) == sorted(
        str(path.relative_to(folder).with_suffix(""))
        for folder in (FOLDER, OWN)
        for path in folder.rglob("*.yaml")
        if "\ntask:" in path.read_text(encoding="utf-8") and not path.name.endswith(".test.yaml")
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_flies_its_task(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT if "docs/" in command else tmp_path)
    code = run(shlex.split(command))
    assert code == 0, "".join(capsys.readouterr())


def test_every_task_of_the_page_has_its_command() -> None:
    named = {Path(command.split()[1]).stem.title().replace("_", "") for command in COMMANDS if ".yaml" in command}
    named |= {command.split()[1] for command in COMMANDS if ".yaml" not in command}
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
