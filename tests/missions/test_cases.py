"""The test files beside the shipped trees: every case passes, and together they reach every step and every branch."""

from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.rehearsal.cases.coverage import Coverage
from formiga_bt.rehearsal.cases.judging import judge
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.cases.running import play

TREES = folder("trees")
NAV2 = Path(__file__).parents[2] / "docs" / "examples" / "nav2"
SHELVES = (TREES, TREES / "cookbook", NAV2, TREES / "warehouse" / "trees")
FILES = sorted(p for shelf in SHELVES for p in shelf.glob("*.test.yaml"))
TASKS = sorted(
    p
    for shelf in SHELVES
    for p in shelf.glob("*.yaml")
    if not p.name.endswith((".test.yaml", "site.yaml", "nav2.yaml"))
)


def test_every_tree_has_its_cases() -> None:
    assert {str(p).removesuffix(".test.yaml") for p in FILES} == {str(p).removesuffix(".yaml") for p in TASKS}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_the_cases_pass_and_reach_everything(path: Path) -> None:
    loaded = load_cases(path)
    assert [str(problem) for problem in loaded.diagnostics] == []
    assert loaded.cases is not None
    coverage = Coverage(loaded.cases.task)

    differs = {case.name: judge(case, play(loaded.cases, case, coverage)) for case in loaded.cases.cases}

    assert {name: [str(one) for one in found] for name, found in differs.items() if found} == {}
    assert [f"{step.mark} {step.title}" for step in coverage.missed] == []
    assert [f"{step.mark} {step.title}: {way}" for step, way in coverage.untaken] == []
    assert coverage.percent == 100.0
    statuses = {case.expect.status for case in loaded.cases.cases}
    assert statuses == {"succeeded", "failed", "canceled"}
