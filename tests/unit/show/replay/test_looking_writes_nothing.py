"""No verb that looks at the past writes anything, whatever lies there: no file is made, none is changed, to the byte."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from formiga_bt.cli.app import run
from tests.unit.show.replay.flown import Flown

VERBS: Final = (
    ["replay", "--text"], ["replay", "--text", "--json"], ["replay", "--task", "PickUp-1"], ["show", "PickUp-1", "--ascii"],
    ["why", "PickUp-1"], ["gantt", "--all", "--ascii"], ["map", "--all", "--ascii"], ["stats", "--ascii"], ["journal", "stats"],
    ["why", "PickUp-1", "--at", "PickUp-1 start"],
)  # fmt: skip
KILLED: Final = """
import os, sqlite3, sys
connection = sqlite3.connect(sys.argv[1])
connection.execute("PRAGMA journal_mode = WAL")
connection.execute("UPDATE formiga_sites SET holder = 'somebody'")
connection.commit()
os._exit(9)
"""


def traces(folder: Path) -> dict[str, tuple[int, int, int, bytes]]:
    found = {}
    for one in sorted(folder.rglob("*")):
        about = one.stat()
        data = one.read_bytes() if one.is_file() else b""
        found[str(one.relative_to(folder))] = (about.st_ino, about.st_mtime_ns if data else 0, about.st_mode, data)
    return found


def words_of(verb: list[str]) -> str:
    return " ".join(verb)


@pytest.mark.parametrize("how", ["ended", "killed", "killed, without the index"])
@pytest.mark.parametrize("verb", VERBS, ids=words_of)
def test_a_look_leaves_no_trace(
    verb: list[str], how: str, blocked: Flown, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(blocked.folder / ".formiga", tmp_path / ".formiga")
    (file,) = tmp_path.glob(".formiga/*/journal.db")
    if how != "ended":
        subprocess.run([sys.executable, "-c", KILLED, str(file)], check=False)
        assert (file.parent / "journal.db-wal").stat().st_size > 0
    if how == "killed, without the index":
        (file.parent / "journal.db-shm").unlink()
    monkeypatch.chdir(tmp_path)
    before = traces(tmp_path)
    assert run(verb) == 0
    assert traces(tmp_path) == before


@pytest.mark.parametrize("verb", VERBS, ids=words_of)
@pytest.mark.parametrize("where", ["", "gone/journal.db", "empty.db"])
def test_nothing_is_made_where_there_is_no_journal(
    verb: list[str], where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".formiga" / "meadow").mkdir(parents=True)
    (tmp_path / "empty.db").touch()
    monkeypatch.chdir(tmp_path)
    before = traces(tmp_path)
    assert run([*verb, "--journal", where] if where else verb) == 1
    assert traces(tmp_path) == before
