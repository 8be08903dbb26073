"""`formiga drafts`: list, show and delete."""

import json
from pathlib import Path

import pytest
from msgspec import structs

from formiga_bt.cli.app import run
from formiga_bt.llm.drafts import keep, numbers
from formiga_bt.llm.origin import approve
from formiga_bt.llm.records import Draft, Origin
from tests.golden import Wording

DAY = 86_400_000
NOW = 1_800_000_000_000
YAML = "formiga: 1\ntask: Circle\n"
DRAFT = Draft(request="a circle", kind="task", task="Circle", yaml=YAML)
ORIGIN = Origin(by="eve", request="a circle", provider="local", model="q15", prompt_sha256="0f", rounds=2)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder of four drafts: old, old and run, a question, new."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.time", lambda: NOW / 1000)
    place = tmp_path / ".formiga" / "rovaniemi" / "drafts"
    for age_days in (40, 35):
        kept = keep(place, DRAFT, structs.replace(ORIGIN, unix_millis=NOW - age_days * DAY))
    approve(kept, approved_by="ann", bundle="abcdef0123")
    asked = structs.replace(ORIGIN, unix_millis=NOW - 3_600_000, rounds=1, by="mcp:desk", provider="mcp:desk", model="")
    keep(place, Draft(request="go", kind="question", say="Where?"), asked)
    keep(place, DRAFT, structs.replace(ORIGIN, unix_millis=NOW - 5000, request="a circle\n" + "round " * 20))
    return place


def said(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert run(["drafts", *words]) == code
    out, err = capsys.readouterr()
    return out if code == 0 else err


@pytest.mark.usefixtures("folder")
def test_the_list(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    wording(said(capsys).splitlines())
    listed = json.loads(said(capsys, "list", "--json"))
    assert [(one["number"], one["kind"], one["approved_by"]) for one in listed] == [
        (1, "task", ""),
        (2, "task", "ann"),
        (3, "question", ""),
        (4, "task", ""),
    ]


def test_one_is_shown(folder: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    wording(said(capsys, "show", "2", "3"))
    (one,) = json.loads(said(capsys, "show", "1", "--json"))
    assert (one["task"], one["yaml"], one["model"]) == ("Circle", YAML, "q15")


def test_some_are_deleted_and_numbers_only_grow(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, "delete", "4", "1") == "2 drafts deleted\n"
    assert numbers(folder) == [2, 3]
    assert keep(folder, DRAFT, ORIGIN).number == 5
    assert said(capsys, "delete", "2") == "1 draft deleted\n"  # by its number, though somebody ran it


def test_old_ones_are_deleted_but_those_that_were_run(
    folder: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    wording(said(capsys, "delete", "--older-than", "30 d"))
    assert numbers(folder) == [2, 3, 4]
    assert json.loads(said(capsys, "delete", "--older-than", "10min", "--json")) == {"deleted": [3], "kept": 1}


@pytest.mark.parametrize(
    "words",
    [
        ["delete"],
        ["delete", "1", "--older-than", "1d"],
        ["delete", "1", "9"],
        ["delete", "--older-than", "30"],
        ["delete", "--older-than", "3 m"],
        ["--older-than", "1d"],
        ["show"],
        ["show", "9"],
        ["list", "3"],
        ["--site", "nowhere.yaml"],
    ],
)
def test_what_cannot_be_done_is_told_and_nothing_is_removed(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], wording: Wording
) -> None:
    wording(said(capsys, *words, code=2))
    assert numbers(folder) == [1, 2, 3, 4]


def test_a_link_in_place_of_a_draft_removes_nothing_elsewhere(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "keep.txt").write_text("x")
    (folder / "1" / "link").symlink_to(tmp_path / "mine")
    assert said(capsys, "delete", "1") == "1 draft deleted\n"
    assert (tmp_path / "mine" / "keep.txt").is_file()
    (folder / "9").symlink_to(folder / "2")
    wording(said(capsys, "delete", "9", code=2))
    assert numbers(folder) == [2, 3, 4, 9]


def test_without_drafts_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    wording(said(capsys))
    assert json.loads(said(capsys, "--json")) == []
