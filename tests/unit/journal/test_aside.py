"""What a journal has of a site is set aside: its files, or, beside other sites, its name. On both databases."""

from pathlib import Path

import pytest

from formiga_bt.base.errors import SiteError
from formiga_bt.journal.aside import last_epoch, set_aside
from formiga_bt.journal.reading import sites_of
from formiga_bt.journal.store import Journal
from tests.golden import Wording


def begun(where: str, *sites: str) -> None:
    for site in sites:
        with Journal(where, site, durability="normal") as journal:
            journal.take()


def test_beside_another_site_the_history_gets_another_name(where: str, tmp_path: Path, wording: Wording) -> None:
    begun(where, "hill", "meadow", "meadow")
    assert last_epoch(where, "meadow") == 0, "no start was noted"
    wording(set_aside(where, "meadow", tmp_path))
    assert sites_of(where) == ["hill", "meadow-aside-1"]
    begun(where, "meadow")
    set_aside(where, "meadow", tmp_path)
    assert sites_of(where) == ["hill", "meadow-aside-1", "meadow-aside-2"]
    assert set_aside(where, "meadow", tmp_path) == "", "there is nothing left"


def test_what_an_engine_writes_stays(where: str, tmp_path: Path, wording: Wording) -> None:
    begun(where, "hill")
    with Journal(where, "meadow", durability="normal") as journal:
        journal.take()
        with pytest.raises(SiteError) as refused:
            set_aside(where, "meadow", tmp_path)
        wording(refused.value)
    assert sites_of(where) == ["hill", "meadow"]
    file = tmp_path / "own.db"
    with Journal(file, "meadow", durability="normal") as journal:
        journal.take()
        with pytest.raises(SiteError) as refused:
            set_aside(str(file), "meadow", tmp_path)
        wording(refused.value)
    assert file.exists()
