"""Where what a test file names is looked up; what is wrong in it is told as tests/lang_errors/cases has it."""

from pathlib import Path

from formiga_bt.base.packaged import folder
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.testing import packaged_world
from tests.golden import Wording

CATALOGUE = packaged_world()[1]


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    loaded = load_cases(tmp_path / "no.test.yaml", catalogue=CATALOGUE)

    assert [d.code for d in loaded.diagnostics] == ["E008"]


def test_a_task_with_errors_is_reported_with_its_own_place(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("formiga: 1\ntask: Mine\nsteps:\n  - wait: 5\n", encoding="utf-8")
    file = tmp_path / "mine.test.yaml"
    file.write_text("formiga_test: 1\ntask: mine.yaml\ncases:\n  - {name: one, expect: {}}\n", encoding="utf-8")

    loaded = load_cases(file, catalogue=CATALOGUE)

    assert loaded.cases is None
    assert [(d.code, Path(d.mark.file).name) for d in loaded.diagnostics] == [("E017", "mine.yaml")]


def test_a_task_of_the_sites_own_folder_is_found_by_its_file(tmp_path: Path, wording: Wording) -> None:
    for part in ("trees", "tests"):
        (tmp_path / part).mkdir()
    site = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8")
    (tmp_path / "site.yaml").write_text(site, encoding="utf-8")
    (tmp_path / "trees/mine.yaml").write_text("formiga: 1\ntask: Mine\nsteps:\n  - wait: 5 s\n", encoding="utf-8")
    file = tmp_path / "tests/mine.test.yaml"
    text = "formiga_test: 1\nsite: ../site.yaml\ntask: {}.yaml\ncases:\n  - {{name: one, expect: {{}}}}\n"
    file.write_text(text.format("mine"), encoding="utf-8")

    cases = load_cases(file, catalogue=CATALOGUE).cases
    file.write_text(text.format("mime"), encoding="utf-8")
    (problem,) = load_cases(file, catalogue=CATALOGUE).diagnostics

    assert cases is not None
    assert Path(cases.task.mark.file).resolve() == (tmp_path / "trees/mine.yaml").resolve()
    wording(problem.message)


def test_a_task_of_the_library_and_its_site_are_found_without_paths(tmp_path: Path) -> None:
    file = tmp_path / "move.test.yaml"
    file.write_text("formiga_test: 1\ntask: move_task.yaml\ncases:\n  - {name: one, expect: {}}\n", encoding="utf-8")

    cases = load_cases(file, catalogue=CATALOGUE).cases

    assert cases is not None
    assert (cases.task.name, cases.site.name) == ("MoveTask", "rovaniemi")
    assert Path(cases.task.mark.file) == folder("trees") / "move_task.yaml"
