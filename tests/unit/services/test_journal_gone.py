"""While an engine runs its journal's files are removed, moved or replaced: that is noticed, told, and nothing new begins."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from formiga_bt.journal.files import Identity, all_of
from formiga_bt.journal.store import Journal
from formiga_bt.services.kept.journaling import JournalAt
from tests.copying import copied
from tests.unit.services.conftest import Service, Start

pytestmark = pytest.mark.network
KEPT = JournalAt(durability="normal")


def replaced(file: Path) -> None:
    subprocess.run(["cp", str(file), f"{file}.copy"], check=True)  # not in this process, which has it open
    Path(f"{file}.copy").replace(file)


HARM: Final[dict[str, Callable[[Path], object]]] = {
    "file removed": Path.unlink,
    "file replaced": replaced,
    "log removed": lambda file: all_of(file)[1].unlink(),
    "index removed": lambda file: all_of(file)[2].unlink(),
    "folder moved": lambda file: file.parent.rename(file.parent.with_name("elsewhere")),
}


def is_reported(service: Service) -> bool:
    health = service.get("/v1/health")
    return health["journal"] == "gone" and any("journal_gone" in str(line) for line in health["alarms"])


@pytest.fixture
def at(tmp_path: Path) -> JournalAt:
    """Return a journal in a folder of its own: the runtime folder stays."""
    (tmp_path / "disk").mkdir()
    return JournalAt(str(tmp_path / "disk" / "site.db"), "normal")


@pytest.mark.parametrize("harm", HARM)
def test_it_is_an_alarm_though_nothing_happens_and_no_task_is_taken(start: Start, at: JournalAt, harm: str) -> None:
    with start(journal=at) as service:
        assert service.submit("Heavy") == "Heavy-1"
        HARM[harm](Path(at.where))
        service.wait(lambda: is_reported(service))
        status, problem = service.call("POST", "/v1/tasks", {"task": "Heavy", "params": {}})
        assert (status, problem["code"]) == (409, "journal_gone")
        assert "formiga down" in str(problem)
        service.post("/v1/orders", {"order": "hold"})
        assert service.get("/v1/health")["status"] == "ok"


def test_a_request_of_the_very_moment_is_taken_back(
    start: Start, at: JournalAt, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody waits for the next second: each commit looks."""
    monkeypatch.setattr("formiga_bt.services.journal_watch.EVERY_S", 3600.0)
    with start(journal=at) as service:
        Path(at.where).unlink()
        status, problem = service.call("POST", "/v1/tasks", {"task": "Heavy", "params": {}})
        assert (status, problem["code"]) == (409, "journal_gone")


def test_the_same_files_are_back_and_what_waited_is_written(start: Start, at: JournalAt) -> None:
    folder = Path(at.where).parent
    with start(journal=at) as service:
        first = service.submit("Heavy")
        folder.rename(folder.with_name("elsewhere"))
        service.wait(lambda: is_reported(service))
        service.post("/v1/orders", {"order": "hold"})
        folder.with_name("elsewhere").rename(folder)
        service.wait(lambda: service.get("/v1/health")["journal"] == "ok")
        second = service.submit("Heavy")
    with Journal(at.where, "meadow", read_only=True) as journal:
        kinds = [kept.kind for kept in journal.read()]
        assert "Operator" in " ".join(kinds)
        assert journal.gaps() == []
    with start(journal=at) as service:
        assert {first, second} <= {one["id"] for one in service.get("/v1/tasks")["tasks"]}


def test_what_was_in_a_log_that_was_removed_outlives_a_kill(start: Start, tmp_path: Path) -> None:
    runtime, killed = tmp_path / ".formiga", tmp_path / "killed"
    with start(journal=KEPT) as service:
        tasks = {service.submit("Heavy"), service.submit("Heavy")}
        all_of(runtime / "meadow" / "journal.db")[1].unlink()
        service.wait(lambda: is_reported(service))
        copied(runtime, killed)
    subprocess.run(["rm", "-r", str(runtime)], check=True)
    killed.rename(runtime)
    with start(journal=KEPT) as service:
        assert {one["id"] for one in service.get("/v1/tasks")["tasks"]} == tasks


def test_a_journal_that_is_emptied_in_place_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "journal.db"
    for one in all_of(file):
        one.write_text("x")
    known = Identity(file)
    assert known.gone() == ""
    file.write_text("")
    assert known.gone() == f"{file} was emptied"
