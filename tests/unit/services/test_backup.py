"""A backup has what a start elsewhere needs, private and whole; a restore writes nothing over, and believes no archive."""

import fcntl
import json
import os
import re
import sqlite3
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.base.errors import FormigaError, JournalError, SiteError
from formiga_bt.base.site_folder import SiteFolder
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.copying import check_copy, copy_journal
from formiga_bt.journal.store import Journal
from formiga_bt.services.kept import archive, restoring
from formiga_bt.services.kept.archive import MANIFEST

Capture = pytest.CaptureFixture[str]
COUNTED = {"task": 7, "question": 1, "clearance": 0, "safety": 3}


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A site that ran, with all sorts of files."""
    folder = tmp_path / "meadow"
    runtime = folder / ".formiga" / "meadow"
    (runtime / "drafts" / "d1").mkdir(parents=True)
    (runtime / "keys").mkdir()
    (folder / "trees" / "lib").mkdir(parents=True)
    text = re.sub("^terrain:.*$", "terrain: {file: ground/heights.asc}", start("site"), flags=re.MULTILINE)
    text = text.replace("@site", "meadow")
    (folder / "site.yaml").write_text(text, encoding="utf-8")
    (folder / "ground").mkdir()
    (folder / "ground" / "heights.asc").write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 9\n1 1\n1 1\n")
    (folder / "trees" / "lib" / "own.yaml").write_text("formiga: 1\n")
    (folder / "diary.txt").write_text("nobody's business")
    with Journal(runtime / "journal.db", "meadow") as journal:
        journal.take(4)
        journal.begin(EngineState(), wall=5_000_000)
        journal.end(6_000_000)
    (runtime / "epoch").write_text("4\n")
    (runtime / "marks.json").write_text(json.dumps({"now_us": 9, "counters": COUNTED}))
    for name in ("token", "accounts.json", "exact", "lock", "engine.json", "keys/ca.key", "drafts/d1/draft.yaml"):
        (runtime / name).write_text(name)
    (runtime / "sim").mkdir()
    (runtime / "sim" / "hwd_1.log").write_text("x")
    (runtime / "attachments").mkdir()
    (runtime / "attachments" / "photo").write_text("x")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def made(site: Path, tmp_path: Path) -> Path:
    file = tmp_path / "b.zip"
    assert run(["backup", str(file)]) == 0
    return file


def tree(folder: Path) -> dict[str, bytes]:
    return {str(one.relative_to(folder)): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file()}


def test_it_has_what_a_start_elsewhere_needs_and_nothing_else(made: Path) -> None:
    assert made.stat().st_mode & 0o777 == 0o600
    assert sorted(zipfile.ZipFile(made).namelist()) == [
        MANIFEST, "runtime/accounts.json", "runtime/drafts/d1/draft.yaml", "runtime/epoch", "runtime/journal.db",
        "runtime/keys/ca.key", "runtime/marks.json", "runtime/token", "site/ground/heights.asc", "site/site.yaml",
        "site/trees/lib/own.yaml",
    ]  # fmt: skip
    assert [one.name for one in made.parent.iterdir() if one.name.startswith(".")] == []


def test_secrets_of_news_are_not_in_it_so_a_copy_tells_nobody(site: Path, tmp_path: Path) -> None:
    (site / "secrets").mkdir(mode=0o700)
    for name in ("room.url", "room.secret", "mail.password"):
        (site / "secrets" / name).write_text("hush-hush")
    news = "webhook: {url: {file: secrets/room.url}, secret: {file: secrets/room.secret}}"
    mail = "mail: {host: a.example, from: a@b.example, to: [a@b.example], user: a, password: {file: secrets/mail.password}}"
    with (site / "site.yaml").open("a", encoding="utf-8") as file:
        file.write(f"news:\n  room:\n    {news}\n  night:\n    {mail}\n")
    for also_wrong in ("", "nonsense: true\n"):  # a site file with an error is backed up too
        with (site / "site.yaml").open("a", encoding="utf-8") as file:
            file.write(also_wrong)
        assert run(["backup", str(tmp_path / "b.zip"), "--force"]) == 0
        kept = zipfile.ZipFile(tmp_path / "b.zip")
        assert [one for one in kept.namelist() if "secret" in one] == []
        assert "site/ground/heights.asc" in kept.namelist()
        assert not any(b"hush-hush" in kept.read(one) for one in kept.namelist())


def test_attachments_come_along_where_that_is_said(site: Path, tmp_path: Path) -> None:
    assert run(["backup", str(tmp_path / "all.zip"), "--attachments"]) == 0
    assert "runtime/attachments/photo" in zipfile.ZipFile(tmp_path / "all.zip").namelist()


def test_a_restored_site_passes_over_ids_and_epochs_and_waits_for_a_person(made: Path, tmp_path: Path) -> None:
    into = tmp_path / "again"
    assert run(["restore", str(made), "--into", str(into)]) == 0
    runtime = into / ".formiga" / "meadow"
    assert tree(into / "trees") == {"lib/own.yaml": b"formiga: 1\n"}
    assert {one.stat().st_mode & 0o777 for one in runtime.rglob("*") if one.is_file()} == {0o600}
    assert {one.stat().st_mode & 0o777 for one in (runtime, *runtime.rglob("*")) if one.is_dir()} == {0o700}
    check_copy(runtime / "journal.db")
    with SiteFolder(into, "meadow") as folder:
        assert folder.was_restored
        assert not folder.was_exact
        _, counters = folder.marks()
        assert all(counters[name] >= 1_000_000 + count for name, count in COUNTED.items())
        assert 500 < folder.next_epoch() < 1000 + 4, "agents take a step of up to 1,000"


def test_no_file_of_a_restored_site_is_more_open_than_the_umask_says(made: Path, tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        restoring.restore(made, tmp_path / "again")
    finally:
        os.umask(before)
    assert [one for one in (tmp_path / "again").rglob("*") if one.stat().st_mode & 0o077] == []


def test_sites_of_one_backup_differ_by_when_they_were_made(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[tuple[int, int]] = []
    for hours in (0, 1, 1000):
        into = tmp_path / str(hours)
        now = os.stat(made).st_mtime_ns // 1000 + hours * 3600 * 1_000_000
        monkeypatch.setattr(restoring, "wall_clock_us", lambda now=now: now)
        restoring.restore(made, into)
        with SiteFolder(into, "meadow") as folder:
            begun.append((folder.marks()[1]["task"], folder.next_epoch()))
    tasks, epochs = zip(*begun, strict=True)
    assert sorted(set(tasks)) == list(tasks)
    assert sorted(set(epochs)) == list(epochs)
    assert epochs[-1] < 1000


def a_site(folder: Path) -> None:
    (folder / "site.yaml").write_text("x")


def trees(folder: Path) -> None:
    (folder / "trees").mkdir()


def a_runtime_folder(folder: Path) -> None:
    (folder / ".formiga" / "meadow").mkdir(parents=True)


def a_link_to_nowhere(folder: Path) -> None:
    (folder / "site.yaml").symlink_to("nowhere")


@pytest.mark.parametrize("there", [a_site, trees, a_runtime_folder, a_link_to_nowhere])
def test_nothing_is_written_over(there: Callable[[Path], None], made: Path, tmp_path: Path) -> None:
    into = tmp_path / "again"
    into.mkdir()
    there(into)
    before = sorted(into.rglob("*"))
    assert run(["restore", str(made), "--into", str(into)]) == 1
    assert sorted(into.rglob("*")) == before


def test_not_over_a_running_site(made: Path, site: Path, capsys: Capture) -> None:
    with SiteFolder(site, "meadow"):
        assert run(["restore", str(made)]) == 1
    assert "formiga down" in capsys.readouterr().err


def flipped(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)


def cut(file: Path) -> None:
    os.truncate(file, file.stat().st_size - 30)


def emptied(file: Path) -> None:
    os.truncate(file, 0)


def another_zip(file: Path) -> None:
    with zipfile.ZipFile(file, "w") as new:
        new.writestr("a", "b")


def _again(file: Path, change: Callable[[dict[str, bytes]], None]) -> None:
    with zipfile.ZipFile(file) as old:
        parts = {name: old.read(name) for name in old.namelist()}
    change(parts)
    with zipfile.ZipFile(file, "w") as new:
        for name, data in parts.items():
            new.writestr(name, data)


def _with_file(path: str) -> Callable[[Path], None]:
    def change(parts: dict[str, bytes]) -> None:
        told = json.loads(parts[MANIFEST])
        told["files"].append(
            {"path": path, "bytes": 1, "sha256": "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb"}
        )
        parts[MANIFEST] = json.dumps(told).encode()
        parts[path] = b"a"

    return lambda file: _again(file, change)


def longer_than_told(file: Path) -> None:
    def change(parts: dict[str, bytes]) -> None:
        parts["runtime/token"] += b"x" * 5_000_000

    _again(file, change)


def another_text(file: Path) -> None:
    def change(parts: dict[str, bytes]) -> None:
        parts["runtime/token"] = b"nekot"

    _again(file, change)


def a_newer_form(file: Path) -> None:
    def change(parts: dict[str, bytes]) -> None:
        parts[MANIFEST] = parts[MANIFEST].replace(b'"formiga_backup": 1', b'"formiga_backup": 2')

    _again(file, change)


def a_site_with_a_path_for_a_name(file: Path) -> None:
    def change(parts: dict[str, bytes]) -> None:
        parts[MANIFEST] = parts[MANIFEST].replace(b'"site": "meadow"', b'"site": "../../elsewhere"')

    _again(file, change)


def a_site_file_elsewhere(file: Path) -> None:
    def change(parts: dict[str, bytes]) -> None:
        parts[MANIFEST] = parts[MANIFEST].replace(b'"site_file": "site.yaml"', b'"site_file": "nothing.yaml"')

    _again(file, change)


@pytest.mark.parametrize(
    "spoil",
    [
        flipped, cut, emptied, another_zip, longer_than_told, another_text, a_newer_form, a_site_with_a_path_for_a_name,
        a_site_file_elsewhere, _with_file("../evil"), _with_file("/tmp/evil"), _with_file("site/../../evil"),
        _with_file("evil"),
        _with_file("site/trees/../x"), _with_file("site/.formiga/meadow/token"), _with_file("runtime/site\\evil"),
        _with_file("runtime/token"),
    ],
)  # fmt: skip
def test_an_archive_that_is_not_as_it_was_leaves_no_file(
    spoil: Callable[[Path], None], made: Path, tmp_path: Path, capsys: Capture
) -> None:
    spoil(made)
    before = sorted(tmp_path.rglob("*"))
    assert run(["restore", str(made), "--into", str(tmp_path / "again")]) == 1
    assert str(made) in capsys.readouterr().err
    left = [one for one in sorted(tmp_path.rglob("*")) if one not in before and one != tmp_path / "again"]
    assert left == []


def test_a_file_that_the_manifest_does_not_name_is_not_unpacked(made: Path, tmp_path: Path) -> None:
    _again(made, lambda parts: parts.update({"site/../../evil": b"x", "runtime/more": b"x"}))
    assert run(["restore", str(made), "--into", str(tmp_path / "again")]) == 0
    assert not (tmp_path / "again/.formiga/meadow/more").exists()
    assert not list(tmp_path.rglob("evil"))


def test_a_backup_is_replaced_only_by_a_whole_one(
    made: Path, site: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    before = made.read_bytes()
    assert run(["backup", str(made)]) == 2
    assert "--force" in capsys.readouterr().err

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(archive.os, "fsync", full)
        assert run(["backup", str(made), "--force"]) == 1
    with monkeypatch.context() as patch:
        patch.setattr(archive, "_put", lambda zipped, name, file: archive.File(name, 1, "0" * 64))
        assert run(["backup", str(made), "--force"]) == 1, "it is read again"
    assert made.read_bytes() == before
    assert [one.name for one in made.parent.iterdir() if one.name.startswith(".")] == []
    assert run(["backup", str(made), "--force"]) == 0


def test_what_a_killed_backup_left_is_in_nobodys_way_and_two_at_once_are(made: Path, site: Path) -> None:
    part, copy = made.with_name(f".{made.name}.part"), made.with_name(f".{made.name}.journal")
    part.write_text("half")
    copy.mkdir()
    (copy / "journal.db").write_text("half")
    with part.open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert run(["backup", str(made), "--force"]) == 1
    assert run(["backup", str(made), "--force"]) == 0
    assert (part.exists(), copy.exists()) == (False, False)


def test_a_journal_elsewhere_is_in_it_and_one_in_a_database_needs_a_word(
    site: Path, tmp_path: Path, capsys: Capture
) -> None:
    runtime = site / ".formiga" / "meadow"
    elsewhere = tmp_path / "elsewhere.db"
    (runtime / "journal.db").rename(elsewhere)
    (runtime / "journal.at").write_text(f"{elsewhere}\n")
    assert run(["backup", str(tmp_path / "1.zip")]) == 0
    assert run(["restore", str(tmp_path / "1.zip"), "--into", str(tmp_path / "one")]) == 0
    assert (tmp_path / "one/.formiga/meadow/journal.db").exists()
    assert not (tmp_path / "one/.formiga/meadow/journal.at").exists()

    (runtime / "journal.at").write_text("postgresql://fleet@db.example/journals\n")
    capsys.readouterr()
    assert run(["backup", str(tmp_path / "2.zip")]) == 1
    assert (
        "pg_dump --format=custom --file=journal.dump 'postgresql://fleet@db.example/journals'"
        in capsys.readouterr().err
    )
    assert run(["backup", str(tmp_path / "2.zip"), "--without-journal"]) == 0
    assert run(["restore", str(tmp_path / "2.zip"), "--into", str(tmp_path / "two")]) == 0
    assert "pg_restore" in capsys.readouterr().out
    assert (tmp_path / "two/.formiga/meadow/journal.at").exists()


def test_what_lies_outside_of_the_folder_is_named(site: Path, tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "team.yaml").write_text("x")
    (site / "trees" / "team.yaml").symlink_to(tmp_path / "team.yaml")
    assert run(["backup", str(tmp_path / "b.zip"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["left_out"] == [str(site / "trees" / "team.yaml")]


def test_a_damaged_journal_is_no_backup(site: Path, tmp_path: Path) -> None:
    journal = site / ".formiga/meadow/journal.db"
    data = bytearray(journal.read_bytes())
    data[8192 * 2 : 8192 * 3] = b"\x55" * 8192
    journal.write_bytes(data)
    assert run(["backup", str(tmp_path / "b.zip")]) == 1
    assert [one.name for one in tmp_path.iterdir()] == ["meadow"]


def test_a_copy_is_of_one_moment_while_somebody_writes(tmp_path: Path) -> None:
    """Two tables that change together are the same in each copy, and who writes never waits long."""
    import threading

    file = tmp_path / "journal.db"
    with Journal(file, "meadow") as journal:
        journal.take()
    over, rounds = threading.Event(), 0

    def write() -> None:
        nonlocal rounds
        own = sqlite3.connect(file, timeout=5, isolation_level=None)
        own.execute("CREATE TABLE a (n)")
        own.execute("CREATE TABLE b (n)")
        while not over.is_set():
            own.execute("BEGIN IMMEDIATE")
            for table in ("a", "b"):
                own.execute(f"INSERT INTO {table} VALUES (randomblob(3000))")
            own.execute("COMMIT")
            rounds += 1
        own.close()

    thread = threading.Thread(target=write)
    thread.start()
    try:
        seen = []
        for n in range(6):
            copy_journal(file, tmp_path / f"{n}.db")
            with sqlite3.connect(tmp_path / f"{n}.db") as copied:
                tables = {one for (one,) in copied.execute("SELECT name FROM sqlite_master WHERE name IN ('a', 'b')")}
                counts = [copied.execute(f"SELECT count(*) FROM {one}").fetchone()[0] for one in sorted(tables)]
            copied.close()
            seen.append(counts)
    finally:
        over.set()
        thread.join()
    assert all(len(set(counts)) <= 1 for counts in seen)
    assert seen[-1][0] > seen[1][0], "it wrote all the while"
    assert [
        one.name for one in tmp_path.iterdir() if one.name.endswith(("-wal", "-shm")) and one.name[0].isdigit()
    ] == []


def test_a_copy_that_is_no_journal_is_refused(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "other.db") as other:
        other.execute("CREATE TABLE t (n)")
    other.close()
    with pytest.raises(JournalError):
        check_copy(tmp_path / "other.db")
    with pytest.raises(FormigaError):
        copy_journal(tmp_path / "none.db", tmp_path / "copy.db")
    with pytest.raises(SiteError), archive.reading(tmp_path / "other.db"):
        pass
