"""`formiga up` and its journal: what a start writes, what the next one goes on from, what is refused."""

import json
import shutil
from pathlib import Path

import pytest

from formiga_bt.base import site_folder
from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.cli.past import JournalAddress, journals
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.journal.database import Database
from formiga_bt.journal.keep import stats
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal, Unwritable
from formiga_bt.services.kept.journaling import SITE_FILES, JournalAt
from formiga_bt.services.words import NOT_KEPT
from tests.copying import copied
from tests.golden import Wording
from tests.unit.services.conftest import Start

pytestmark = pytest.mark.network
NORMAL = JournalAt(durability="normal")


def file_of(folder: Path) -> Path:
    return folder / ".formiga" / "meadow" / "journal.db"


def test_a_site_at_work_can_be_read_from_its_journal_and_after(start: Start, tmp_path: Path) -> None:
    texts = {"MoveTask": {"trees/move_task.yaml": "text"}, SITE_FILES: {"base.yaml": "types", "site.yaml": "site"}}
    with start(journal=NORMAL, texts=texts) as service:
        task = service.post("/v1/tasks", {"task": "Hello", "params": {}}) if "Hello" in service.host.served else None
        with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
            service.wait(lambda: len(Past(journal).state().agents) == 2)
        live = service.host.driver.engine
    with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
        past = Past(journal)
        assert set(past.state().agents) == set(live.state.agents)
        assert past.state().tasks == live.state.tasks
        assert task is None or past.state().tasks
        (one,) = journal.starts()
        assert (one.epoch, one.ended is not None) == (1, True)
        assert past.first() == one.at > 10**15, "not long before"
        assert {"msgspec", "sqlalchemy", "formiga", "node_state"} <= set(one.versions)
        kept = {row.name: row for row in journal.bundles()}
        assert kept[SITE_FILES].texts == texts[SITE_FILES]
        assert stats(journal).starts == 1
        assert snapshot(past.state()) == snapshot(past.state(past.state().now))


def test_the_files_of_what_is_loaded_are_kept_and_again_at_the_next_start(start: Start, tmp_path: Path) -> None:
    text = "formiga: 1\ntask: New\nsteps: [{wait: 1 s}]\n"
    for epoch in (1, 2):
        with start(journal=NORMAL) as service:
            if epoch == 1:
                service.post("/v1/library", {"file": "new.yaml", "texts": {"new.yaml": text}, "by": "eve"})
            assert "New" in service.host.served
        with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
            (row,) = [one for one in journal.bundles() if one.name == "New"]
        assert (row.file, row.origin, row.epoch) == ("new.yaml", "loaded", epoch)
        assert row.texts == {"new.yaml": text}


def test_numbers_instants_and_epochs_go_on_at_the_next_start(start: Start, tmp_path: Path) -> None:
    with start(journal=NORMAL) as service:
        assert service.host.epoch == 1
    with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
        seq, at = journal.last()
    (tmp_path / ".formiga" / "meadow" / "epoch").write_text("0\n")  # as of a folder on another machine
    with start(journal=NORMAL) as service:
        assert service.host.epoch == 2
        assert service.host.driver.engine.state.seq > seq
        assert service.host.driver.engine.state.now > at
    assert (tmp_path / ".formiga" / "meadow" / "epoch").read_text() == "2\n"
    with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
        assert [one.epoch for one in journal.starts()] == [1, 2]
        seqs = [kept.seq for kept in journal.read()]
        assert seqs == sorted(set(seqs))


def test_one_journal_has_one_engine(start: Start, tmp_path: Path, wording: Wording) -> None:
    where = tmp_path / "shared.db"
    with Journal(where, "meadow", durability="normal") as other:
        other.take()
        with (
            pytest.raises(SiteError) as refused,
            start(journal=JournalAt(str(where), "normal")),
        ):
            pass
        wording(refused.value)
    with start(journal=JournalAt(str(where), "normal")) as service:
        assert service.host.journaling.text == f"{where} (durability normal)"


def test_a_journal_elsewhere_is_found_by_the_next_start_and_by_who_looks_at_it(start: Start, tmp_path: Path) -> None:
    where, beside = tmp_path / "disk" / "site.db", tmp_path / ".formiga" / "meadow"
    assert journals(tmp_path) == []
    with start(journal=JournalAt(str(where), "normal")):
        assert journals(tmp_path) == [JournalAddress(str(where), "meadow")]
    with start(journal=NORMAL) as service:
        assert service.host.journaling.text == f"{where} (durability normal)"
        assert service.host.journaling.word == str(where)
    assert not file_of(tmp_path).exists()
    assert journals(tmp_path / "site.yaml") == [JournalAddress(str(where), "meadow")]
    with start(journal=JournalAt(str(file_of(tmp_path)), "normal"), start_anew=True):
        pass
    assert where.exists(), "it is another one, and stays"
    assert not (beside / "journal.at").exists()
    assert journals(tmp_path) == [JournalAddress(str(file_of(tmp_path)), "meadow")]


def test_orders_on_a_full_disk_act_and_say_that_they_are_not_kept(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    def full(*_: object) -> None:
        raise Unwritable("no room\n  help: make room")

    with start(journal=NORMAL) as service:
        journal = service.host.journaling.journal
        assert journal is not None
        service.submit("Ask")
        service.wait(lambda: [q["shown"] for q in service.get("/v1/inbox")["questions"]] == [["watcher_1"]])
        with monkeypatch.context() as patch:
            patch.setattr(journal, "stage", full)
            said = service.post("/v1/lockdown", {"how": "land"})
            wording(said["text"])
            service.wait(lambda: any("journal_full" in str(line) for line in service.get("/v1/health")["alarms"]))
            status, problem = service.call("POST", "/v1/lockdown", {"how": "release"})
            assert (status, problem["code"]) == (409, "journal_full")
            wording(problem["text"])
            said = service.post("/v1/orders", {"order": "hold"})
            assert said["text"].endswith(f"({NOT_KEPT})")
            said = service.post("/v1/inbox/Q1/answer", {"option": "yes_it_is"})
            wording(said["text"])
        service.wait(lambda: service.call("POST", "/v1/lockdown", {"how": "release"})[0] == 200)
        assert "not kept" not in service.post("/v1/orders", {"order": "hold"})["text"]
    with Journal(file_of(tmp_path), "meadow", read_only=True) as journal:
        assert "LockdownOrder" in stats(journal).kinds, "what waited was kept in the end"


@pytest.mark.parametrize("journal", [None, NORMAL])
def test_a_runtime_folder_that_cannot_be_written_ends_nothing(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, journal: JournalAt | None, wording: Wording
) -> None:
    def full(file: Path, *_: object) -> None:
        raise SiteError(f"cannot write {file}: No space left on device")

    with start(journal=journal) as service:
        with monkeypatch.context() as patch:
            patch.setattr(site_folder, "write_durably", full)
            folder = service.host._folder
            folder._reserved = dict.fromkeys(folder._reserved, 0)  # as after many tasks
            problem = service.refused("POST", "/v1/tasks", {"task": "Hello", "params": {}})
            assert problem["code"] == "journal_full"
            service.wait(lambda: service.get("/v1/health")["alarms"])
            (alarm,) = [line["text"] for line in service.get("/v1/health")["alarms"]]
            wording(alarm)
            assert service.post("/v1/orders", {"order": "hold"})["text"].endswith(f"({NOT_KEPT})")
        service.wait(lambda: service.host.driver.engine.state.counters.get("journal") == 0)
        assert service.submit("Hello").startswith("Hello-")
        assert service.host.driver.error is None


@pytest.mark.parametrize(
    ("durability", "how", "next_id"),
    [
        ("full", "killed", "Hello-2"),
        ("normal", "killed", "Hello-101"),
        ("full", "full", "Hello-101"),
        ("full", "older", "Hello-201"),
        ("full", "ended", "Hello-201"),
        (None, "killed", "Hello-101"),
    ],
)
def test_ids_that_the_journal_may_not_know_are_passed_over(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, durability: str | None, how: str, next_id: str
) -> None:
    """Whatever this start is told: what counts is how the one that died kept its journal."""

    def full(*_: object) -> None:
        raise Unwritable("no room")

    runtime, killed = tmp_path / ".formiga", tmp_path / "killed"
    with start(journal=JournalAt(durability="full")):
        pass
    with start(journal=JournalAt(durability=durability) if durability else None) as service:
        assert service.submit("Hello") == "Hello-1"
        service.ends("Hello-1")
        journal = service.host.journaling.journal
        if how == "full":
            assert journal is not None
            with monkeypatch.context() as patch:
                patch.setattr(journal, "stage", full)
                service.post("/v1/orders", {"order": "hold"})
            service.wait(lambda: service.host.driver.engine.state.counters.get("journal") == 0)
        copied(runtime, killed)
    if how != "ended":
        shutil.rmtree(runtime)
        killed.rename(runtime)
    if how in ("older", "ended"):  # an older copy of the journal was restored: it lacks more than was set aside once
        marks = runtime / "meadow" / "marks.json"
        said = json.loads(marks.read_text())
        said["counters"]["task"] = 200
        marks.write_text(json.dumps(said))
    with start(journal=JournalAt(durability="full")) as service:
        assert service.submit("Hello") == next_id


def test_an_address_in_the_site_folder_has_no_password(tmp_path: Path) -> None:
    pytest.importorskip("psycopg")
    url = "postgresql://ann:secret@db.example/formiga"
    assert Database(url).address == "postgresql://ann@db.example/formiga"
    (tmp_path / "site.db").touch()
    assert Database(tmp_path / "disk" / ".." / "site.db").address == str(tmp_path / "site.db")


def test_a_journal_that_is_none_ends_the_start_and_gives_the_site_back(
    start: Start, tmp_path: Path, wording: Wording
) -> None:
    where = tmp_path / "notes.txt"
    where.write_text("buy milk")
    with pytest.raises(JournalError, match="is no journal"), start(journal=JournalAt(str(where))):
        pass
    assert where.read_text() == "buy milk"
    with start() as service:
        wording(service.host.journaling.text)
    assert not file_of(tmp_path).exists()
