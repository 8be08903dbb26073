"""What a running engine opens of its journal, it opens through SQLite: the interpreter itself tells of each file it opens."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.journal.files import all_of
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Start

pytestmark = pytest.mark.network
KEPT = JournalAt(durability="normal")
Opened = list[str]


@pytest.fixture(scope="module")
def listening() -> list[Opened]:
    """Listen to the files that this process opens; a hook cannot be taken away again."""
    lists: list[Opened] = []

    def hook(event: str, args: tuple[Any, ...]) -> None:
        if event in ("open", "os.link", "os.symlink", "os.truncate") and lists:
            lists[-1] += [one for one in map(str, args[:2]) if "journal.db" in one]

    sys.addaudithook(hook)
    return lists


@pytest.fixture
def opened(listening: list[Opened]) -> Iterator[Opened]:
    """Return the files of a journal that were opened but by SQLite."""
    found: Opened = []
    listening.append(found)
    yield found
    listening.clear()


def test_an_engine_opens_its_journal_through_sqlite_only(start: Start, opened: Opened, tmp_path: Path) -> None:
    with start(journal=KEPT) as service:
        old = service.submit("Hello")
        service.ends(old)
    with start(journal=KEPT) as service:
        service.submit("Heavy")
        for path in (
            "/v1/past",
            "/v1/past/timeline",
            "/v1/past/stats",
            f"/v1/past/tasks/{old}",
            f"/v1/tasks/{old}/why",
        ):
            service.get(path)
        assert service.get("/v1/health")["journal"] == "ok"
    assert {Path(one).name for one in opened} <= {"journal.db.meadow.lock"}


@pytest.mark.parametrize(
    "look",
    [
        lambda file: file.read_bytes(),
        lambda file: file.open("rb").close(),
        lambda file: file.with_name("b").hardlink_to(file),
    ],
)
def test_a_look_past_sqlite_would_be_found(look: Callable[[Path], object], opened: Opened, tmp_path: Path) -> None:
    file = tmp_path / "journal.db"
    file.touch()
    opened.clear()
    look(file)
    assert {str(file)} <= set(opened)
    assert [one.name for one in all_of(file)] == ["journal.db", "journal.db-wal", "journal.db-shm"]
