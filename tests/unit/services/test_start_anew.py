"""A journal that an earlier start kept and that is gone is reported; a person may say to begin anew, and nothing is deleted."""

import json
import os
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from formiga_bt.base.clock import SECOND, wall_clock_us
from formiga_bt.base.errors import JournalError
from formiga_bt.journal.store import Journal
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.services.kept.resuming import last_sign
from tests.copying import copied
from tests.golden import Wording
from tests.unit.services.conftest import Start

pytestmark = pytest.mark.network
KEPT = JournalAt(durability="normal")
FILES = ("journal.db", "journal.db-wal", "journal.db-shm")


def truncated(file: Path, part: float) -> None:
    os.truncate(file, round(file.stat().st_size * part))


def nothing_of_the_site(file: Path) -> None:
    gone(file)
    Journal(file, "elsewhere").close()


def gone(file: Path) -> None:
    for end in ("", "-wal", "-shm"):
        file.with_name(file.name + end).unlink(missing_ok=True)


LOST: Final[dict[str, Callable[[Path], None]]] = {
    "missing": gone,
    "missing, with its log left": Path.unlink,
    "empty": lambda file: truncated(file, 0.0),
    "cut short": lambda file: truncated(file, 0.5),
    "cut short in its head": lambda file: os.truncate(file, 60),
    "cut short in its last page": lambda file: os.truncate(file, file.stat().st_size - 1),
    "garbage": lambda file: file.write_bytes(b"garbage" * 1000) and None,
    "of another site": nothing_of_the_site,
}


IN_THE_LOG: Final = {one for one in LOST if one.startswith(("cut short", "garbage"))}
"""So short a history is in the log whole: what becomes of the file under it does no harm."""


def of_journal(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES if (folder / name).exists() and "shm" not in name}


@pytest.fixture
def killed(start: Start, tmp_path: Path) -> Callable[[], Path]:
    """Leave what an engine leaves that is killed: return its runtime folder."""

    def run() -> Path:
        runtime = tmp_path / ".formiga"
        with start(journal=KEPT) as service:
            assert service.submit("Heavy") == "Heavy-1"
            copied(runtime, tmp_path / "killed")
        for path in sorted(runtime.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        runtime.rmdir()
        (tmp_path / "killed").rename(runtime)
        return runtime / "meadow"

    return run


def merge(file: Path) -> None:
    """Bring the log into the file, as a clean end does."""
    connection = sqlite3.connect(file)
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    connection.close()


@pytest.mark.parametrize("how", LOST)
@pytest.mark.parametrize("end", ["killed", "clean"])
def test_a_journal_that_is_gone_needs_a_word_to_begin_anew(
    start: Start, killed: Callable[[], Path], how: str, end: str
) -> None:
    folder = killed()
    file = folder / "journal.db"
    if end == "clean":
        merge(file)
    LOST[how](file)
    if end == "killed" and how in IN_THE_LOG:
        with start(journal=KEPT) as service:
            assert [one["id"] for one in service.get("/v1/tasks")["tasks"]] == ["Heavy-1"]
        return
    before = of_journal(folder)
    with pytest.raises(JournalError) as refused, start(journal=KEPT):
        pass
    assert "formiga up --start-anew" in str(refused.value)
    assert of_journal(folder) == before, "nothing was written"

    with start(journal=KEPT, start_anew=True) as service:
        assert service.host.epoch > 1
        assert service.get("/v1/tasks")["tasks"] == []
        assert service.submit("Heavy") == "Heavy-101"
        assert of_journal(folder / "aside-1") == before
    with start(journal=KEPT) as service:
        assert [one["id"] for one in service.get("/v1/tasks")["tasks"]] == ["Heavy-101"]


def test_a_whole_journal_is_set_aside_with_the_time_it_had(start: Start, tmp_path: Path) -> None:
    folder = tmp_path / ".formiga" / "meadow"
    with start(journal=KEPT, speed=20.0) as service:
        service.submit("Hello")
        service.ends("Hello-1")
    marks = json.loads((folder / "marks.json").read_text())
    (folder / "marks.json").write_text(json.dumps({**marks, "now_us": wall_clock_us() + 3600 * SECOND}))
    with start(journal=KEPT, start_anew=True) as service:
        assert service.host.epoch == 2
        assert service.submit("Hello") == "Hello-2"
        assert abs(service.host.driver.now() - wall_clock_us()) < 60 * SECOND
        assert service.host.journaling.aside == [str(folder / "aside-1" / "journal.db"), str(folder / "aside-1")]
    with Journal(folder / "aside-1" / "journal.db", "meadow", read_only=True) as old:
        assert [one.epoch for one in old.starts()] == [1]
    with start(journal=KEPT, start_anew=True):
        pass
    assert sorted(one.name for one in folder.glob("aside-*")) == ["aside-1", "aside-2"]


def test_of_a_file_with_other_sites_only_the_own_history_is_set_aside(
    start: Start, tmp_path: Path, wording: Wording
) -> None:
    where = tmp_path / "shared.db"
    with Journal(where, "hill", durability="normal") as other:
        other.take()
    at = JournalAt(str(where), "normal")
    with start(journal=at) as service:
        service.submit("Hello")
    with start(journal=at, start_anew=True) as service:
        assert service.get("/v1/tasks")["tasks"] == []
        assert service.host.epoch == 2
        wording(service.host.journaling.aside[0])
    for site, epochs in (("meadow-aside-1", [1]), ("meadow", [2])):
        with Journal(where, site, read_only=True) as journal:
            assert [one.epoch for one in journal.starts()] == epochs


def test_ids_are_never_given_twice_though_nobody_knows_how_many_were(start: Start, killed: Callable[[], Path]) -> None:
    folder = killed()
    for name in (*FILES, "marks.json"):
        (folder / name).unlink(missing_ok=True)
    with start(journal=KEPT, start_anew=True) as service:
        assert service.submit("Heavy") == "Heavy-2000001"


def test_who_kept_no_journal_is_not_asked_for_one(start: Start, tmp_path: Path) -> None:
    folder = tmp_path / ".formiga" / "meadow"
    with start(journal=None):
        assert (folder / "no-journal").exists()
    with start(journal=KEPT) as service:
        assert service.host.epoch == 2
        assert not (folder / "no-journal").exists()


def test_a_start_that_ended_before_the_journal_had_the_site_is_no_earlier_run(start: Start, tmp_path: Path) -> None:
    where = tmp_path / "journal.db"

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Journal, "take", fail)
        with pytest.raises(KeyboardInterrupt), start(journal=JournalAt(str(where), "normal")):
            pass
    assert (tmp_path / ".formiga" / "meadow" / "epoch").exists()
    with start(journal=JournalAt(str(where), "normal")) as service:
        assert service.host.epoch == 2


def test_a_journal_that_lacks_its_end_is_told(start: Start, killed: Callable[[], Path], tmp_path: Path) -> None:
    folder = killed()
    merge(folder / "journal.db")
    copied(folder, tmp_path / "older")
    with start(journal=KEPT) as service:
        service.submit("Heavy")
        wrote = service.host.journaling.written
        service.wait(lambda: (sign := last_sign(folder)) is not None and sign.written >= wrote > 0)
    assert last_sign(folder) is not None
    (folder / "journal.db").unlink()
    (tmp_path / "older" / "journal.db").rename(folder / "journal.db")
    with start(journal=KEPT) as service:
        service.wait(lambda: "journal_older" in str(service.get("/v1/health")["alarms"]))
        assert service.host.driver.engine.state.seq > wrote, "no number comes twice"
    with start(journal=KEPT) as service:
        assert "journal_older" not in str(service.get("/v1/health")["alarms"])
