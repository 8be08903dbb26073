"""The runtime folder: one engine a site, an epoch that only rises, ids that never come twice."""

import fcntl
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from formiga_bt.base import site_folder
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import (
    LEFT,
    RESERVE,
    UNTOLD,
    SiteFolder,
    find_engines,
    is_running,
    read_address,
    read_lines,
)
from tests.golden import Wording


def test_a_second_engine_on_the_site_is_told_who_has_it(tmp_path: Path, wording: Wording) -> None:
    with SiteFolder(tmp_path, "meadow") as first:
        first.publish(epoch=1, url="http://127.0.0.1:9", endpoint="tcp/127.0.0.1:7")
        with pytest.raises(SiteError) as refused:
            SiteFolder(tmp_path, "meadow").take()
        wording(refused.value)
        with SiteFolder(tmp_path, "other"):
            assert [a.site for a in find_engines(tmp_path / "trees")] == ["meadow"]
    with SiteFolder(tmp_path, "meadow"):
        pass


def test_the_lock_goes_with_its_process(tmp_path: Path) -> None:
    code = (
        "import sys, os; from pathlib import Path; from formiga_bt.base.site_folder import SiteFolder\n"
        "SiteFolder(Path(sys.argv[1]), 'meadow').take(); print('has it', flush=True); os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.stdout == "has it\n"
    assert not is_running(tmp_path / ".formiga" / "meadow")
    with SiteFolder(tmp_path, "meadow"):
        assert is_running(tmp_path / ".formiga" / "meadow")


def test_the_epoch_rises_at_each_start(tmp_path: Path) -> None:
    epochs = []
    for _ in range(3):
        with SiteFolder(tmp_path, "meadow") as folder:
            epochs.append(folder.next_epoch())
    assert epochs == [1, 2, 3]


@pytest.mark.parametrize("text", ["", "x", "-4", "1.5", "\xb2"])
def test_a_damaged_epoch_is_never_guessed(tmp_path: Path, text: str) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        folder.next_epoch()
    (folder.path / "epoch").write_text(text, encoding="utf-8")
    with SiteFolder(tmp_path, "meadow") as folder:
        assert list(folder.unusable) == ["epoch"]
        assert 100 < folder.next_epoch() < 1000, "beyond what agents may have seen, within the step that they take"


def test_counters_go_on_after_a_clean_end(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks() == (0, {"task": 0, "question": 0, "clearance": 0, "safety": 0, "alarm": 0})
        folder.counted("task", 1, 500)
        folder.counted("deadline", 9, 600)
        folder.settle(700)
        folder.settle(650)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks() == (700, {"task": 1, "question": 0, "clearance": 0, "safety": 0, "alarm": 0})


def test_after_a_crash_the_rest_of_what_was_set_aside_is_passed_over(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        folder.marks()
        for number in range(1, RESERVE + 3):
            folder.counted("task", number, number)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks()[1]["task"] > RESERVE + 2


def test_ids_of_safety_goals_never_come_twice(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        folder.marks()
        folder.counted("safety", 7, 500)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks()[1]["safety"] >= 7
        (folder.path / "marks.json").write_text('{"now_us": 9, "counters": {"task": 3}}', encoding="utf-8")
        assert folder.marks()[1]["safety"] == UNTOLD, "an older version noted none"


class Full:
    """A disk that is full, or has room again; its clock is turned by hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.room, self.tries, self.clock = True, 0, 100.0
        for name in ("write_durably", "append_line"):
            monkeypatch.setattr(site_folder, name, partial(self._write, getattr(site_folder, name)))

    def _write(self, write: Callable[..., None], file: Path, what: object) -> None:
        self.tries += 1
        if not self.room:
            raise SiteError(f"cannot write {file.name}: No space left on device")
        write(file, what)

    def now(self) -> float:
        return self.clock


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Full:
    return Full(monkeypatch)


def test_on_a_full_disk_ids_are_left_and_what_must_be_kept_waits(tmp_path: Path, disk: Full, wording: Wording) -> None:
    with SiteFolder(tmp_path, "meadow", disk.now) as folder:
        folder.reserve(folder.marks()[1], 0)
        disk.room = False
        for number in range(1, RESERVE - LEFT + 1):
            folder.counted("task", number, number)
        assert (folder.lack, disk.tries) == ("", 1), "nothing had to be written"
        folder.counted("task", RESERVE - LEFT + 1, 60)
        folder.add_line("approvals.jsonl", {"n": 1})
        folder.add_line("approvals.jsonl", {"n": 2})
        assert disk.tries == 2
        wording(folder.lack)
        disk.clock += 1.0
        folder.write_waiting()
        assert disk.tries == 3, "tried again each second"
        disk.room = True
        folder.write_waiting()
        assert (folder.lack != "", disk.tries) == (True, 3)
        disk.clock += 1.0
        folder.write_waiting()
        assert folder.lack == ""
        assert read_lines(folder.path / "approvals.jsonl") == [{"n": 1}, {"n": 2}]
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks()[1]["task"] == RESERVE - LEFT + 1 + RESERVE


def test_a_start_that_knows_the_ids_better_goes_on_from_its_own(tmp_path: Path) -> None:
    for number in (1, 2, 3):  # each is killed, and its journal has all that it did
        with SiteFolder(tmp_path, "meadow") as folder:
            folder.marks()
            folder.reserve({"task": number, "alloc_at": 9}, number)
            folder.counted("task", number + 1, number)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks()[1]["task"] == 1 + RESERVE, "not once more at each start"
        folder.reserve({"task": 4}, 9)
        folder.settle(10)
        assert folder.marks()[1]["task"] == 4


def test_that_the_journal_has_every_id_is_noted_until_it_has_not(tmp_path: Path, disk: Full) -> None:
    def was_exact() -> bool:
        with SiteFolder(tmp_path, "meadow") as folder:
            folder.marks()
            return folder.was_exact

    assert not was_exact()
    with SiteFolder(tmp_path, "meadow", disk.now) as folder:
        folder.note_exact(True)
    assert was_exact()
    with SiteFolder(tmp_path, "meadow", disk.now) as folder:
        disk.room = False
        folder.note_exact(False)
        assert folder.lack == ""
    assert not was_exact()
    with SiteFolder(tmp_path, "meadow", disk.now) as folder:
        disk.room = True
        folder.note_exact(True)
        folder.settle(5)
    assert not was_exact(), "after a clean end the marks are"


def test_what_waits_is_written_at_the_end(tmp_path: Path, disk: Full, wording: Wording) -> None:
    with SiteFolder(tmp_path, "meadow", disk.now) as folder:
        disk.room = False
        folder.counted("task", 1, 10)
        folder.add_line("approvals.jsonl", {"n": 1})
        with pytest.raises(SiteError) as refused:
            folder.settle(20)
        wording(refused.value)
        disk.room = True
        folder.settle(30)
        assert read_lines(folder.path / "approvals.jsonl") == [{"n": 1}]
        assert folder.marks() == (30, {"task": 1, "question": 0, "clearance": 0, "safety": 0, "alarm": 0})


@pytest.mark.parametrize("text", ["[]", "{", '{"counters": {"task": "x"}}', '{"counters": 3}'])
def test_damaged_marks_are_told(tmp_path: Path, text: str) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        (folder.path / "marks.json").write_text(text, encoding="utf-8")
    with SiteFolder(tmp_path, "meadow") as folder:
        assert list(folder.unusable) == ["marks.json"]
        assert folder.lost_marks
        assert folder.marks()[0] == 0


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / ".formiga").write_text("a file in the way", encoding="utf-8")
    with pytest.raises(SiteError) as refused:
        SiteFolder(tmp_path, "meadow").take()
    wording(refused.value)


@pytest.mark.parametrize("name", ["../up", "", "a/b", ".hidden"])
def test_a_name_that_is_no_folder_is_refused(tmp_path: Path, name: str, wording: Wording) -> None:
    with pytest.raises(SiteError) as refused:
        SiteFolder(tmp_path, name).take()
    wording(refused.value)


def test_a_token_is_made_once_and_kept(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        token = folder.token()
        assert folder.token() == token
        (folder.path / "token").write_text("short\n", encoding="ascii")
    with SiteFolder(tmp_path, "meadow") as folder:
        assert list(folder.unusable) == ["token"]
        assert len(folder.token()) >= 16


def test_an_engine_json_without_an_engine_is_not_an_engine(tmp_path: Path) -> None:
    folder = SiteFolder(tmp_path, "meadow")
    folder.take()
    folder.publish(epoch=4, url="http://127.0.0.1:9", endpoint="")
    found = read_address(folder.path)
    assert found is not None
    assert (found.epoch, found.url) == (4, "http://127.0.0.1:9")
    text = (folder.path / "engine.json").read_text(encoding="utf-8")
    folder.release()
    folder.release()
    (folder.path / "engine.json").write_text(text, encoding="utf-8")
    assert read_address(folder.path) is None
    assert find_engines(tmp_path) == []


def test_where_a_killed_engine_has_been_is_forgotten_when_the_next_one_takes_the_site(tmp_path: Path) -> None:
    folder = SiteFolder(tmp_path, "field")
    folder.take()
    folder.publish(epoch=1, url="http://127.0.0.1:1", endpoint="tcp/127.0.0.1:2")
    left = (folder.path / "engine.json").read_text(encoding="utf-8")
    folder.release()
    (folder.path / "engine.json").write_text(left, encoding="utf-8")  # as after a kill
    with (folder.path / "lock").open(
        "r", encoding="utf-8"
    ) as lock:  # the next engine has the site, and nothing more yet
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert is_running(folder.path)
        assert find_engines(tmp_path) == []

    again = SiteFolder(tmp_path, "field")
    again.take()

    assert find_engines(tmp_path) == []
    again.release()
