"""The runtime folder: one engine a site, an epoch that only rises, ids that never come twice."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from formiga_bt.errors import SiteError
from formiga_bt.site_folder import RESERVE, SiteFolder, find_engines, is_running, read_address


def test_a_second_engine_on_the_site_is_told_who_has_it(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as first:
        first.publish(epoch=1, url="http://127.0.0.1:9", endpoint="tcp/127.0.0.1:7")
        with pytest.raises(SiteError, match=f"runs on the site 'meadow' already .process {os.getpid()}, http://127"):
            SiteFolder(tmp_path, "meadow").take()
        with SiteFolder(tmp_path, "other"):
            assert [a.site for a in find_engines(tmp_path / "trees")] == ["meadow"]
    with SiteFolder(tmp_path, "meadow"):
        pass


def test_the_lock_goes_with_its_process(tmp_path: Path) -> None:
    code = (
        "import sys, os; from pathlib import Path; from formiga_bt.site_folder import SiteFolder\n"
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
        (folder.path / "epoch").write_text(text, encoding="utf-8")
        with pytest.raises(SiteError, match="epoch"):
            folder.next_epoch()


def test_counters_go_on_after_a_clean_end(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks() == (0, {"task": 0, "question": 0, "clearance": 0})
        folder.counted("task", 1, 500)
        folder.counted("deadline", 9, 600)
        folder.settle(700)
        folder.settle(650)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks() == (700, {"task": 1, "question": 0, "clearance": 0})


def test_after_a_crash_the_rest_of_what_was_set_aside_is_passed_over(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        folder.marks()
        for number in range(1, RESERVE + 3):
            folder.counted("task", number, number)
    with SiteFolder(tmp_path, "meadow") as folder:
        assert folder.marks()[1]["task"] > RESERVE + 2


@pytest.mark.parametrize("text", ["[]", "{", '{"counters": {"task": "x"}}', '{"counters": 3}'])
def test_damaged_marks_are_told(tmp_path: Path, text: str) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        (folder.path / "marks.json").write_text(text, encoding="utf-8")
        with pytest.raises(SiteError, match=r"marks\.json"):
            folder.marks()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / ".formiga").write_text("a file in the way", encoding="utf-8")
    with pytest.raises(SiteError, match="cannot write the site's runtime folder"):
        SiteFolder(tmp_path, "meadow").take()


@pytest.mark.parametrize("name", ["../up", "", "a/b", ".hidden"])
def test_a_name_that_is_no_folder_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SiteError, match="cannot name a folder"):
        SiteFolder(tmp_path, name).take()


def test_a_token_is_made_once_and_kept(tmp_path: Path) -> None:
    with SiteFolder(tmp_path, "meadow") as folder:
        token = folder.token()
        assert folder.token() == token
        (folder.path / "token").write_text("short\n", encoding="ascii")
        with pytest.raises(SiteError, match="no token of at least 16"):
            folder.token()


def test_an_engine_json_without_an_engine_is_not_an_engine(tmp_path: Path) -> None:
    folder = SiteFolder(tmp_path, "meadow")
    folder.take()
    address = folder.publish(epoch=4, url="http://127.0.0.1:9", endpoint="")
    text = (folder.path / "engine.json").read_text(encoding="utf-8")
    folder.release()
    folder.release()
    (folder.path / "engine.json").write_text(text, encoding="utf-8")
    found = read_address(folder.path)
    assert found is not None
    assert (found.epoch, found.url) == (address.epoch, address.url)
    assert find_engines(tmp_path) == []
    (folder.path / "engine.json").write_text("{}", encoding="utf-8")
    assert read_address(folder.path) is None


def test_where_a_killed_engine_has_been_is_forgotten_when_the_next_one_takes_the_site(tmp_path: Path) -> None:
    folder = SiteFolder(tmp_path, "field")
    folder.take()
    folder.publish(epoch=1, url="http://127.0.0.1:1", endpoint="tcp/127.0.0.1:2")
    left = (folder.path / "engine.json").read_text(encoding="utf-8")
    folder.release()
    (folder.path / "engine.json").write_text(left, encoding="utf-8")  # as after a kill

    again = SiteFolder(tmp_path, "field")
    again.take()

    assert find_engines(tmp_path) == []
    again.release()
