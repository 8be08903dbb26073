"""Commands of docs/operating.md about a site's backup do as the page says."""

import re
import shlex
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.store import Journal

PAGE = Path(__file__).parents[2] / "docs" / "operating.md"


def section(title: str) -> str:
    return PAGE.read_text(encoding="utf-8").partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def commands(title: str) -> list[str]:
    (block,) = re.findall(r"^```\n(.*?)^```", section(title), re.MULTILINE | re.DOTALL)
    return re.findall(r"^formiga (.*?)(?:\s+#.*)?$", block, re.MULTILINE)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "meadow"
    runtime = folder / ".formiga" / "meadow"
    runtime.mkdir(parents=True)
    (folder / "site.yaml").write_text(start("site").replace("@site", "meadow"), encoding="utf-8")
    with Journal(runtime / "journal.db", "meadow") as journal:
        journal.take()
        journal.begin(EngineState(), wall=1)
    monkeypatch.chdir(folder)
    return folder


def test_the_commands_of_backup_and_restore_work_in_their_order(site: Path) -> None:
    found = commands("Backup and restore")
    assert len(found) == 3
    for command in found:
        assert run(shlex.split(command)) == 0, command
    assert (site.parent / "meadow-again" / ".formiga" / "meadow" / "restored.json").is_file()
