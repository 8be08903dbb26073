"""Which catalogues a site uses, and what comes of two that say the same, or not."""

from pathlib import Path

import pytest

from formiga_bt.base.packaged import files, folder
from formiga_bt.lang.compose import Composed, compose
from formiga_bt.rehearsal.testing import packaged_world

SITE = """formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
ports: {p1: {at: {east: 0 m, north: 20 m}}}
agents: {crane_1: {type: crane, home: p1}}
"""
CRANE = "types:\n  crane: {extends: hwd, actions: [Winch]}\nactions:\n  Winch: {typical: 20 s}\n"
BASE = folder("actions") / "base.yaml"


@pytest.fixture
def yard(tmp_path: Path) -> Path:
    (tmp_path / "actions").mkdir()
    (tmp_path / "actions" / "mine.yaml").write_text(CRANE)
    (tmp_path / "site.yaml").write_text(SITE + "actions: [actions/mine.yaml]\n")
    return tmp_path


def with_actions(yard: Path, words: str, *more: Path) -> Composed:
    (yard / "site.yaml").write_text(SITE + f"actions: {words}\n")
    return compose(yard / "site.yaml", more)


def codes(found: Composed) -> list[str]:
    return [f"{d.code}@{Path(d.mark.file).name}:{d.mark.line}" for d in found.diagnostics]


def test_base_is_there_beside_what_a_site_names(yard: Path) -> None:
    found = compose(yard / "site.yaml")

    assert codes(found) == []
    assert found.site is not None
    assert found.files == (BASE, yard / "actions" / "mine.yaml")
    assert {"hwd", "crane"} <= set(found.catalogue.types)
    assert "Winch" in found.catalogue.types["crane"].actions


def test_a_site_that_says_nothing_has_base_and_no_site_has_it_too(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text(SITE.replace("crane", "hwd"))

    assert compose(tmp_path / "site.yaml").files == (BASE,)
    assert compose(None).files[0] == BASE
    assert set(compose(None).files) == set(files("actions"))
    assert compose(None).site is None


@pytest.mark.parametrize("words", ["[base, actions/mine.yaml]", "[actions/mine.yaml, base, ./actions/mine.yaml]"])
def test_nothing_is_read_twice(yard: Path, words: str) -> None:
    found = with_actions(yard, words)

    assert codes(found) == []
    assert found.files == (BASE, yard / "actions" / "mine.yaml")


def test_an_empty_list_means_no_catalogue_but_what_is_added(yard: Path) -> None:
    own = yard / "own.yaml"
    own.write_text(
        "types:\n  crane: {actions: [Winch], mobility: air}\nactions:\n  Winch: {typical: 20 s}\n".replace(
            ", mobility: air", ""
        )
    )
    found = with_actions(yard, "[]", own)

    assert found.files == (own,)
    assert list(found.catalogue.types) == ["crane"]


def test_what_is_added_goes_beside_what_the_site_names(yard: Path) -> None:
    more = yard / "more.yaml"
    more.write_text("types:\n  kite: {extends: lwd}\n")
    found = with_actions(yard, "[actions/mine.yaml]", more)

    assert codes(found) == []
    assert found.files[-1] == more
    assert {"crane", "kite", "lwd"} <= set(found.catalogue.types)


def test_the_same_entry_twice_is_fine_and_another_names_both_files(yard: Path) -> None:
    again = yard / "again.yaml"
    again.write_text(
        "# the same, laid out otherwise\n"
        + CRANE.replace("{extends: hwd, actions: [Winch]}", "\n    extends: hwd\n    actions: [ Winch ]")
    )
    assert codes(with_actions(yard, "[actions/mine.yaml, again.yaml]")) == []

    again.write_text(CRANE.replace("20 s", "30 s"))
    found = with_actions(yard, "[actions/mine.yaml, again.yaml]")
    (problem,) = found.diagnostics

    assert codes(found) == ["E018@again.yaml:4"]
    assert str(yard / "actions" / "mine.yaml") in problem.message


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("[bas]", "E008"),
        ("[actions/none.yaml]", "E008"),
        ("base", "E008"),
        ("[base, 3.yaml]", "E008"),
    ],
)
def test_what_is_not_there_is_reported_in_the_site(yard: Path, words: str, code: str) -> None:
    (yard / "site.yaml").write_text(SITE.replace("crane", "hwd") + f"actions: {words}\n")
    found = compose(yard / "site.yaml")

    assert codes(found) == [f"{code}@site.yaml:6"]


def test_who_misses_a_type_that_ships_is_told_where_it_is(yard: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ground = yard / "ground.yaml"
    ground.write_text("types:\n  crane: {extends: hwd}\n")
    monkeypatch.setattr("formiga_bt.lang.shipped.packaged_files", lambda _: [BASE, ground])
    (problem,) = with_actions(yard, "[base]").diagnostics

    assert problem.code == "E020"
    assert "actions: [ground]" in problem.help
    assert codes(with_actions(yard, "[ground]")) == []


def test_the_digest_covers_each_catalogue_that_is_used(yard: Path) -> None:
    before = compose(yard / "site.yaml").catalogue.digest
    (yard / "actions" / "mine.yaml").write_text(CRANE.replace("20 s", "30 s"))
    after = compose(yard / "site.yaml").catalogue.digest

    assert len({before, after, packaged_world()[1].digest}) == 3
