"""Drafts that wait for a person."""

from pathlib import Path

import pytest

from formiga_bt.errors import SiteError, UnusableFile
from formiga_bt.llm.drafts import drafts_folder, keep, numbers, read_draft
from formiga_bt.llm.records import Draft, Origin, Value

DRAFT = Draft(
    request="a circle", kind="task", task="Circle", yaml="formiga: 1", values=(Value("radius", "3 m", "three"),)
)
ORIGIN = Origin(by="eve", request="a circle", provider="local", model="q15", prompt_sha256="0f", rounds=2)


def test_a_draft_is_found_again_as_it_was_kept(tmp_path: Path) -> None:
    folder = drafts_folder(tmp_path / "site.yaml", "meadow")
    kept = keep(folder, DRAFT, ORIGIN)
    assert (kept.number, kept.folder) == (1, tmp_path / ".formiga" / "meadow" / "drafts" / "1")
    found = read_draft(folder, 1)
    assert found.origin == ORIGIN
    assert found.draft == Draft(**{**{f: getattr(DRAFT, f) for f in DRAFT.__struct_fields__}, "yaml": "formiga: 1\n"})


def test_the_task_is_what_its_file_says_now(tmp_path: Path) -> None:
    kept = keep(tmp_path, DRAFT, ORIGIN)
    (kept.folder / "task.yaml").write_text("mended", encoding="utf-8")
    assert read_draft(tmp_path, 1).draft.yaml == "mended"


def test_numbers_only_grow_and_a_half_written_folder_is_passed_over(tmp_path: Path) -> None:
    assert numbers(tmp_path / "nothing") == []
    (tmp_path / "7").mkdir()
    (tmp_path / "x").mkdir()
    assert keep(tmp_path, DRAFT, ORIGIN).number == 8
    assert keep(tmp_path, DRAFT, ORIGIN).number == 9
    assert numbers(tmp_path) == [8, 9]


def test_what_is_not_there_or_damaged_is_told_with_what_to_do(tmp_path: Path) -> None:
    kept = keep(tmp_path, DRAFT, ORIGIN)
    with pytest.raises(UnusableFile, match=r"there is no draft 2 in .*; drafts: 1"):
        read_draft(tmp_path, 2)
    (kept.folder / "draft.json").write_text("{")
    with pytest.raises(UnusableFile, match=r"draft 1 cannot be read: .*\n  help: remove "):
        read_draft(tmp_path, 1)


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises((UnusableFile, SiteError), match="cannot write "):
        keep(tmp_path / "file", DRAFT, ORIGIN)
