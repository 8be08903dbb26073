"""Whatever stands in the runtime folder, the next start succeeds or says in one line what a person must do."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.site_folder import SiteFolder
from formiga_bt.base.unusable_files import FILES
from formiga_bt.services.kept.bundles import BundleStore
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Start, starter
from tests.unit.services.test_api_library import SHORT

pytestmark = pytest.mark.network
KEPT: Final = JournalAt(durability="normal")


def removed(path: Path) -> None:
    path.unlink()


def empty(path: Path) -> None:
    path.write_bytes(b"")


def truncated(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def garbage(path: Path) -> None:
    path.write_bytes(b'\xff\x00{"a": [' * 200)


def a_folder(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.mkdir()
    (path / "inside").write_text("x")


def a_pipe(path: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def a_link_to_nowhere(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(path.with_name("nowhere"))


def a_link_in_a_circle(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(path)


HARMS: Final = (removed, empty, truncated, garbage, a_folder, a_pipe, a_link_to_nowhere, a_link_in_a_circle)
JOURNAL: Final = ("journal.db", "journal.db-wal", "journal.db-shm")


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A runtime folder with each file that an engine may leave."""
    beside = tmp_path_factory.mktemp("left")
    with starter(beside)(journal=KEPT) as service:
        load(service, SHORT.replace("Stay", "Brief"), "drafts/brief.yaml")
        service.ends(service.submit("Brief"))
    folder = beside / ".formiga" / "meadow"
    for name, text in {
        "exact": "", "engine.json": "{}", "approvals.jsonl": '{"digest": "a", "by": "x"}\n', "drafted.jsonl": "{}\n",
        "fleet.jsonl": "{}\n", "fleets.jsonl": "{}\n",
        "flights.jsonl": "", "flying.json": "{}", "resuming.json": "{}",
    }.items():  # fmt: skip
        if not (folder / name).exists():
            (folder / name).write_text(text)
    return folder


@pytest.fixture
def used(left: Path, tmp_path: Path) -> Path:
    """A copy of it, where `start` starts."""
    folder = tmp_path / ".formiga" / "meadow"
    shutil.copytree(left, folder, ignore=lambda *_: ["local.sock", "local"])
    (folder / "journal.at").write_text(str(folder / "journal.db"))
    return folder


def names_in(used: Path) -> list[str]:
    """Return the files that are harmed."""
    bundle = next(one for one in (used / "bundles").iterdir() if one.name != "served.json")
    return [*sorted(FILES.keys() - {"no-journal"}), "lock", "bundles/served.json", f"bundles/{bundle.name}"]


def groups(names: list[str], turn: int) -> list[list[str]]:
    """Return the files four by four, other ones together each turn; by itself the one whose harm may end the start."""
    others = [name for name in names if name != "journal.at"]
    return [["journal.at"], *(others[(first + turn) % 4 :: 4] for first in range(4))]


def load(service: Any, text: str, file: str) -> None:
    service.post("/v1/library", {"file": file, "texts": {file: text}, "by": "eve"})


@pytest.mark.parametrize("harm", HARMS)
def test_each_file_by_itself_ends_no_reading_of_the_folder(used: Path, harm: Callable[[Path], None]) -> None:
    for name in names_in(used):
        path = used / name
        before = path.read_bytes() if path.is_file() else None
        harm_one(path, harm)
        with SiteFolder(used.parents[1], "meadow") as folder:
            assert set(folder.unusable) <= {name, "engine.json"}
        restore(path, before)


@pytest.mark.parametrize("turn", range(len(HARMS)))
def test_some_files_at_once_end_no_start(used: Path, start: Start, turn: int) -> None:
    """Which files come together, and next to which, differs with each harm."""
    failed = {}
    for names in groups(names_in(used), turn):
        paths = [used / name for name in names]
        before = [path.read_bytes() if path.is_file() else None for path in paths]
        highest = int((used / "epoch").read_text())
        for path in paths:
            harm_one(path, HARMS[turn])
        try:
            with start(journal=KEPT) as service:
                assert service.host.epoch > highest, names
                last = int(service.submit("Stay").rpartition("-")[2])
                assert last > 1, names
        except FormigaError as error:
            failed[names[0]] = str(error)
        for path, text in zip(paths, before, strict=True):
            if names[0] in failed or not path.exists():
                restore(path, text)
    where = failed.pop("journal.at", "")
    assert failed == {}
    assert not where or "\n  help: " in where, "a path that was cut short is a path, but no journal is there"


def harm_one(path: Path, harm: Callable[[Path], None]) -> None:
    if not path.is_file():
        path.write_bytes(b"{}")
    harm(path)


def restore(path: Path, text: bytes | None) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    if text is not None:
        path.write_bytes(text)


@pytest.mark.parametrize("harm", [harm for harm in HARMS if harm is not removed])
def test_the_journal_is_a_matter_for_a_person(used: Path, start: Start, harm: Callable[[Path], None]) -> None:
    """It starts, because nothing is lost, or says in one line what is wrong, and what to do."""
    for name in JOURNAL:
        if not (used / name).exists():
            continue
        harm(used / name)
        try:
            with start(journal=KEPT):
                pass
        except FormigaError as error:
            what, _, help_ = str(error).partition("\n")
            assert "journal" in what
            assert "help: " in help_
            break


def test_an_epoch_of_forty_digits(used: Path, start: Start) -> None:
    before = int((used / "epoch").read_text())
    (used / "epoch").write_text("9" * 40)
    with start(journal=KEPT) as service:
        assert before < service.host.epoch < before + 1000
        assert [one["code"] for one in service.get("/v1/health")["house"]] == ["set_aside"]
    assert [path.read_text() for path in used.glob("aside-*/epoch")] == ["9" * 40]


def test_without_a_journal_no_id_comes_twice(start: Start, tmp_path: Path) -> None:
    with start() as service:
        first = service.submit("Stay")
        epoch = service.host.epoch
    folder = tmp_path / ".formiga" / "meadow"
    for name in ("marks.json", "epoch"):
        garbage(folder / name)
    with start() as service:
        assert int(service.submit("Stay").rpartition("-")[2]) > int(first.rpartition("-")[2])
        assert service.host.epoch > epoch


def test_an_approval_that_cannot_be_read_is_none(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        pass
    (folder.path / "approvals.jsonl").write_text('{"digest": "a"}\n{"dig\n{"digest": "b"}\n')
    with SiteFolder(tmp_path, "meadow") as again:
        assert list(again.unusable) == ["approvals.jsonl"]
        assert not (folder.path / "approvals.jsonl").exists()


NAMES: Final = (
    "q.yaml/look.yaml", "bundle.json/x.yaml", "Ä ö/ü.yaml", "a/A/a.yaml", "trees/Look.yaml", "trees/look.yaml",
    "x" * 190 + ".yaml", "a/b/c/d/e/f/g/h/i/j.yaml", "CON.yaml", "served.json/served.yaml",
)  # fmt: skip


def test_a_path_of_a_request_is_never_a_path_on_the_disk(tmp_path: Path) -> None:
    store = BundleStore(tmp_path)
    for number, name in enumerate(NAMES):
        stored, is_new = store.keep(name, {name: f"# {number}", "lib/x.yaml": "x"}, by="eve", unix_millis=1)
        assert is_new
        store.serve(f"T{number}", stored)
    again = BundleStore(tmp_path).served()
    assert [again[f"T{n}"].text() for n in range(len(NAMES))] == [f"# {n}" for n in range(len(NAMES))]
    assert {path.suffix for path in (tmp_path / "bundles").iterdir()} == {".json"}
    assert again["T0"].read(again["T0"].folder / "q.yaml" / ".." / "lib" / "x.yaml") == "x"
    with pytest.raises(FileNotFoundError):
        again["T0"].read(again["T0"].folder / ".." / ".." / "secret")


def test_what_was_loaded_from_a_folder_called_like_a_file_is_served_again(start: Start) -> None:
    with start(journal=KEPT) as service:
        load(service, SHORT.replace("Stay", "Brief"), "trees/q.yaml/brief.yaml")
    with start(journal=KEPT) as service:
        assert service.ends(service.submit("Brief"))["status"] == "SUCCEEDED"


def test_served_names_are_no_paths(tmp_path: Path) -> None:
    store = BundleStore(tmp_path)
    store.path.mkdir()
    (tmp_path / "secret.json").write_text('{"file": "a.yaml", "texts": {"a.yaml": "x"}}')
    (store.path / "served.json").write_text(json.dumps({"T": "../secret"}))
    assert store.served() == {}
