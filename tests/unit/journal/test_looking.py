"""A journal is looked at also where nothing can be written: a copy from a site that belongs to somebody else."""

import os
import sqlite3
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from sqlalchemy.exc import DBAPIError

from formiga_bt.base.errors import JournalError
from formiga_bt.cli.app import run
from formiga_bt.journal import looking
from formiga_bt.journal.looking import look_at
from formiga_bt.journal.past import Past
from formiga_bt.journal.reading import sites_of
from formiga_bt.journal.store import Journal
from tests.golden import Wording
from tests.unit.journal.conftest import Recording, as_told, steps_of

Captured = pytest.CaptureFixture[str]
NOBODY = 65534


@contextmanager
def nobody() -> Iterator[None]:
    """Be somebody whom permissions refuse."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def site() -> Iterator[Path]:
    """Return a folder with a journal whose last steps are in its write-ahead log, as a killed engine leaves it."""
    with tempfile.TemporaryDirectory() as made:  # that of pytest may only be entered by its owner
        Path(made).chmod(0o755)
        folder = Path(made) / "site"
        folder.mkdir()
        with Journal(Path(made) / "journal.db", "demo", durability="normal") as journal:
            journal.take()
            recording = Recording(journal, thin=False, snapshot_steps=10**9)
            recording.feed(steps_of("move_task")[:40], 10)
            journal.database.engine.dispose()
            journal.checkpoint()
            recording.feed(steps_of("move_task")[40:60], 10)
            files = [Path(made) / f"journal.db{end}" for end in ("", "-wal", "-shm")]
            subprocess.run(["cp", *map(str, files), str(folder)], check=True)  # this process has them open
        yield folder
        folder.chmod(0o755)


def shut(folder: Path) -> Path:
    for file in folder.iterdir():
        file.chmod(0o444)
    folder.chmod(0o555)
    return folder / "journal.db"


def seen(file: Path) -> tuple[int, bytes]:
    with Journal(file, "demo", read_only=True) as journal:
        return journal.last()[0], as_told(Past(journal).state())


def merged(folder: Path) -> Path:
    """Bring the log into the file, as the end of an engine does."""
    file = folder / "journal.db"
    connection = sqlite3.connect(file)
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    connection.close()
    assert traces(folder).keys() == {"journal.db"}
    return file


def traces(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    """Return what is in a folder, to the byte."""
    return {one.name: (one.stat().st_ino, one.stat().st_mtime_ns, one.read_bytes()) for one in folder.iterdir()}


def test_without_a_log_the_file_alone_is_looked_at(site: Path) -> None:
    wanted = seen(site / "journal.db")
    merged(site)
    file = shut(site)
    with nobody():
        assert look_at(file).uri == f"{file.resolve().as_uri()}?mode=ro&immutable=1"
        assert seen(file) == wanted
        assert sites_of(file) == ["demo"]
    assert [one.name for one in site.iterdir()] == ["journal.db"]


def test_steps_in_the_log_are_seen_in_a_copy_and_that_is_told(site: Path, wording: Wording) -> None:
    (site / "journal.db-shm").unlink()
    file = shut(site)
    with nobody():
        with Journal(file, "demo", read_only=True) as journal:
            assert journal.last()[0] == 60
            wording(journal.database.note)
            copy = Path(journal.database.note.rpartition(" ")[2])
            assert (copy / "journal.db").exists()
            assert journal.database.file == file, "sizes are those of the journal itself"
        assert not copy.exists()
    assert sorted(one.name for one in site.iterdir()) == ["journal.db", "journal.db-wal"]


def test_with_all_its_files_it_is_looked_at_where_it_lies(site: Path) -> None:
    """So it is, too, where an engine of somebody else writes: what it writes is seen."""
    file = shut(site)
    with nobody():
        assert look_at(file).uri == f"{file.resolve().as_uri()}?mode=ro&readonly_shm=1"
        assert seen(file)[0] == 60


LEFT: Final = {
    "a killed engine": ("journal.db", "journal.db-shm", "journal.db-wal"),
    "a copy without the index": ("journal.db", "journal.db-wal"),
    "an engine that ended": ("journal.db",),
    "a look that was killed": ("journal.db", "journal.db-shm", "journal.db-wal, empty"),
    "a log that is empty": ("journal.db", "journal.db-wal, empty"),
    "an index alone": ("journal.db", "journal.db-shm"),
}
"""What may lie in a folder without an engine: who left it -> files."""


@pytest.mark.parametrize("files", LEFT.values(), ids=LEFT)
def test_looking_leaves_everything_as_it_was_to_the_byte(site: Path, files: tuple[str, ...]) -> None:
    if "journal.db-wal" not in files:
        index = (site / "journal.db-shm").read_bytes()
        merged(site)
        (site / "journal.db-shm").write_bytes(index)
        (site / "journal.db-wal").touch()
    for one in site.iterdir():
        if not any(name.startswith(one.name) for name in files if one.name != "journal.db" or name == one.name):
            one.unlink()
    before = traces(site)
    assert len(before) == len(files)
    assert seen(site / "journal.db")[0] == 60
    assert sites_of(site / "journal.db") == ["demo"]
    assert traces(site) == before


def test_a_look_may_write_nothing(site: Path) -> None:
    for folder in (site, merged(site).parent):
        with (
            Journal(folder / "journal.db", "demo", read_only=True) as journal,
            journal._reading() as connection,
            pytest.raises(DBAPIError, match="readonly"),
        ):
            connection.exec_driver_sql("UPDATE formiga_sites SET seq = 0")


def test_who_looks_at_an_ended_engines_journal_sees_what_the_next_one_writes(site: Path) -> None:
    file = merged(site)
    with Journal(file, "demo", read_only=True) as looking_on:
        assert looking_on.last()[0] == 60
        with Journal(file, "demo", durability="normal") as journal:
            journal.take()
            Recording(journal, thin=False).feed(steps_of("move_task")[60:80], 10)
            assert looking_on.last()[0] == 80
        assert looking_on.last()[0] == 80


def test_what_cannot_be_read_is_told(site: Path, wording: Wording) -> None:
    (site / "journal.db-shm").unlink()
    file = shut(site)
    (site / "journal.db-wal").chmod(0o000)
    with nobody(), pytest.raises(JournalError) as told:
        look_at(file)
    wording(str(told.value))
    assert "Permission denied" in str(told.value)
    wording(str(told.value))


def test_a_copy_of_what_somebody_writes_is_made_again_then_given_up(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (site / "journal.db-shm").unlink()
    file, copied = site / "journal.db", []
    copy = looking._copy

    def written_meanwhile(*files: Path, folder: str) -> None:
        copy(*files, folder=folder)
        copied.append([one.name for one in files])
        with (site / "journal.db-wal").open("ab") as wal:
            wal.write(b"x")

    monkeypatch.setattr(looking, "_copy", written_meanwhile)
    with pytest.raises(JournalError) as refused:
        look_at(file)
    wording(refused.value)
    assert copied == [["journal.db", "journal.db-wal"]] * looking.TRIES
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("code", "refused"), [(14, True), (8, True), (8 | (5 << 8), True), (5, False), (11, False)])
def test_only_what_sqlite_may_not_do_counts_as_refused(
    code: int, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that is damaged, or kept busy, is told as ever."""

    def fail(_: str, uri: bool) -> None:
        error = sqlite3.OperationalError("no")
        error.sqlite_errorcode = code
        raise error

    monkeypatch.setattr(sqlite3, "connect", fail)
    assert looking.is_refused("file:journal.db") is refused


def test_verbs_look_at_it_and_say_once_that_it_is_a_copy(site: Path, capsys: Captured, wording: Wording) -> None:
    (site / "journal.db-shm").unlink()
    file = shut(site)
    assert (
        run(["journal", "stats", "--journal", str(site.parent / "journal.db")]) == 0
    )  # nobody may not read Python's own files
    capsys.readouterr()
    with nobody():
        assert run(["journal", "stats", "--journal", str(file)]) == 0
        said = capsys.readouterr()
        assert f"{file}, site demo\n" in said.out
        assert said.err.count("without its index") == 1
        assert run(["journal", "compact", "--journal", str(file), "--yes"]) == 1
        wording(capsys.readouterr().err)
