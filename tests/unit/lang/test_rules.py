"""Standing rules stand in the site file and in files of rules/ beside it: both are checked, by whatever name they are given."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.editor.grammar import file_kind, is_ours
from formiga_bt.lang.any_file import check_text, kind_of
from formiga_bt.lang.compose import compose
from formiga_bt.lang.model import Catalogue
from tests.unit.engine.ruled import LEFT, SOS, site_in

MORE = "formiga_rules: 1\nrules:\n  more: {on: picker.geofence, request: Help, with: {who: '${event.agent}'}}\n"
WRONG = MORE.replace("'${event.agent}'", "watcher_1")


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A site with two rules of its own and a third in a file."""
    site_in(tmp_path, SOS, LEFT)
    (tmp_path / "rules").mkdir()
    (tmp_path / "rules" / "more.yaml").write_text(MORE, encoding="utf-8")
    return tmp_path


def test_rules_of_both_kinds_are_the_sites(here: Path) -> None:
    site = compose(here / "site.yaml").site
    assert site is not None
    assert list(site.rules) == ["sos", "left", "more"]
    assert run(["check", str(here / "site.yaml"), str(here / "rules" / "more.yaml")]) == 0


def test_a_wrong_file_of_rules_refuses_the_site_and_itself(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = here / "rules" / "more.yaml"
    file.write_text(WRONG, encoding="utf-8")
    for name in ("site.yaml", "rules/more.yaml"):
        assert run(["check", str(here / name)]) == 1
        assert f"{file}:3:" in capsys.readouterr().out
    assert compose(here / "site.yaml").site is None


def test_a_text_that_is_not_saved_yet_is_checked_as_it_is(here: Path) -> None:
    file = here / "rules" / "more.yaml"
    assert kind_of(WRONG) == file_kind(WRONG.splitlines()) == "rules"
    assert is_ours(WRONG.splitlines())
    assert {d.code for d in check_text(WRONG, file, Catalogue(), (), None)} == {"E013"}
    assert check_text(MORE, file, Catalogue(), (), None) == []
    assert check_text(MORE, here / "other" / "more.yaml", Catalogue(), (), None)[0].code == "E008"


def test_one_name_is_one_rule(here: Path) -> None:
    (here / "rules" / "two.yaml").write_text(MORE, encoding="utf-8")
    (found,) = compose(here / "site.yaml").diagnostics
    assert (found.code, Path(found.mark.file).name) == ("E018", "two.yaml")


def test_a_file_that_is_no_yaml_is_told(here: Path) -> None:
    (here / "rules" / "two.yaml").write_bytes(b"\xff\xfe")
    assert "E008" in {d.code for d in compose(here / "site.yaml").diagnostics}
