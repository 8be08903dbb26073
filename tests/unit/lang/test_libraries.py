"""Libraries of a site: folders of its own subtrees, found by whoever reads its tasks, before what ships."""

from pathlib import Path

import pytest

from formiga_bt.lang.compose import Composed, compose
from formiga_bt.lang.loader import Loaded, load_library_text, load_task

SITE = "formiga_site: 1\nname: here\nbase: {lat: 66.5, lng: 25.7, ground_msl: 120 m}\nlibraries: [own, more]\n"
CLIMB = "formiga: 1\nsubtrees:\n  Climb:\n    params: {drone: agent}\n    steps:\n      - do: drone.TakeOff\n"
TASK = """formiga: 1
task: Try
imports: [climbs.yaml, lib/flying.yaml]
agents:
  drone: {type: lwd, near: "${base}"}
steps:
  - call: Climb
    with: {drone: "${drone}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


@pytest.fixture
def here(tmp_path: Path) -> Path:
    for name in ("own", "more", "trees"):
        (tmp_path / name).mkdir()
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    (tmp_path / "trees" / "try.yaml").write_text(TASK, encoding="utf-8")
    return tmp_path


def loaded(here: Path, world: Composed | None = None) -> Loaded:
    world = world or compose(here / "site.yaml")
    assert not world.diagnostics
    return load_task(here / "trees" / "try.yaml", catalogue=world.catalogue, site=world.site)


def codes(found: Loaded) -> list[str]:
    return [one.code for one in found.diagnostics]


def test_an_import_is_found_in_a_library_of_the_site(here: Path) -> None:
    (here / "more" / "climbs.yaml").write_text(CLIMB, encoding="utf-8")
    found = loaded(here)

    assert codes(found) == []
    assert found.task is not None
    assert str(here / "more" / "climbs.yaml") in found.sources


def test_without_the_site_it_is_not_found_and_what_could_be_is_told(here: Path) -> None:
    (here / "more" / "climb.yaml").write_text(CLIMB, encoding="utf-8")

    assert "did you mean 'climb.yaml'?" in loaded(here).diagnostics[0].message
    assert codes(loaded(here, compose(None)))[0] == "E008"


@pytest.mark.parametrize(("first", "then"), [("trees", "own"), ("own", "more")])
def test_of_two_the_nearer_counts_and_hides_the_other(first: str, then: str, here: Path) -> None:
    (here / first / "climbs.yaml").write_text(CLIMB, encoding="utf-8")
    (here / then / "climbs.yaml").write_text(CLIMB + "      - wait: 5 s\n", encoding="utf-8")
    found = loaded(here)

    assert codes(found) == ["W180"]
    assert str(here / then / "climbs.yaml") in found.diagnostics[0].message
    assert found.sources[str(here / first / "climbs.yaml")] == CLIMB


def test_a_copy_hides_nothing(here: Path) -> None:
    for folder in ("own", "more"):
        (here / folder / "climbs.yaml").write_text(CLIMB, encoding="utf-8")

    assert codes(loaded(here)) == []


def test_a_file_of_the_same_path_as_one_that_ships_is_another_file(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (here / "own" / "lib").mkdir()
    (here / "own" / "climbs.yaml").write_text(CLIMB.replace("\n", "\nimports: [lib/ways.yaml]\n", 1), encoding="utf-8")
    (here / "trees" / "lib").mkdir()
    (here / "trees" / "lib" / "flying.yaml").write_text(CLIMB.replace("Climb", "ReturnHome"), encoding="utf-8")
    monkeypatch.chdir(here)
    world = compose(Path("site.yaml"))
    found = load_task(Path("trees/try.yaml"), catalogue=world.catalogue)

    assert {"trees/lib/flying.yaml", str(here / "trees" / "lib" / "flying.yaml")} & set(found.sources)
    assert len([name for name in found.sources if name.endswith("flying.yaml")]) == 2


def test_a_library_imports_from_libraries(here: Path) -> None:
    (here / "own" / "climbs.yaml").write_text(CLIMB, encoding="utf-8")
    text = CLIMB.replace("Climb", "Up").replace("formiga: 1\n", "formiga: 1\nimports: [climbs.yaml]\n")
    text = text.replace("do: drone.TakeOff", 'call: Climb\n        with: {drone: "${drone}"}')
    catalogue = compose(here / "site.yaml").catalogue

    assert not load_library_text(text, "up.yaml", catalogue=catalogue).diagnostics
