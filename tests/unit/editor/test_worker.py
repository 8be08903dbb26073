"""The process that checks: what it reports is what a check in this process finds; it is replaced when it is killed."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.editor import worker
from formiga_bt.editor.checks import check
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.worker import CheckerProcess, CheckJob, Report
from tests.golden import Wording
from tests.unit.editor.conftest import TASK

BIG = "formiga: 1\ntask: Big\nagents:\n  drone: {type: hwd}\nsteps:\n" + "  - check: drone.battery > 10 %\n" * 6000


@pytest.fixture
def checker() -> Iterator[CheckerProcess]:
    made = CheckerProcess()
    yield made
    made.stop()


def job(file: Path, text: str, version: int = 1, **others: str) -> CheckJob:
    project = Project(site=folder("trees") / "demo-site.yaml")
    texts = {file: (version, text), **{file.parent / name: (1, one) for name, one in others.items()}}
    return CheckJob(tuple(project.actions), project.site, None, file, texts)


def found(report: Report | None) -> list[tuple[str, int]]:
    assert report is not None
    return [(one.code, one.mark.line) for one in report.diagnostics]


def test_it_reports_what_a_check_here_finds_and_what_was_visible(checker: CheckerProcess, tmp_path: Path) -> None:
    text = TASK.replace("drone.id", "drone.ident")
    asked = job(tmp_path / "look.yaml", text)
    project = Project(asked.actions, asked.site)
    document = Document(asked.path, text, 1)
    here = check(project, document)

    report = checker.check(asked)

    assert report is not None
    there = report.checked(document, project.catalogue(document.path), project.site_of(document.path))
    assert there.diagnostics == here.diagnostics
    assert there.seen is not None
    assert here.seen is not None
    assert [(line, col) for line, col, _ in there.seen.at] == [(line, col) for line, col, _ in here.seen.at]
    for (_, _, mine), (_, _, other) in zip(here.seen.at, there.seen.at, strict=True):
        assert (mine.names, mine.maybe_unset, mine.roles, mine.visible()) == (
            other.names, other.maybe_unset, other.roles, other.visible(),
        )  # fmt: skip
        assert set(mine.agent_types) == set(other.agent_types)


def test_files_that_are_open_count_as_they_are_typed(checker: CheckerProcess, tmp_path: Path) -> None:
    text = "formiga: 1\ntask: T\nimports: [own.yaml]\nsteps: [{call: Own}]\n"
    own = "formiga: 1\nsubtrees: {Own: {steps: [{wait: WAIT}]}}\n"
    (tmp_path / "own.yaml").write_text(own, encoding="utf-8")
    wrong = checker.check(job(tmp_path / "t.yaml", text, **{"own.yaml": own.replace("WAIT", "1")}))
    right = checker.check(job(tmp_path / "t.yaml", text, 2, **{"own.yaml": own.replace("WAIT", "1 s")}))
    assert "E017" in [code for code, _ in found(wrong)]
    assert "E017" not in [code for code, _ in found(right)]


def test_a_newer_text_ends_the_check_of_the_last_one_and_the_next_check_is_made(
    checker: CheckerProcess, tmp_path: Path
) -> None:
    checker.warm_up()
    reports: list[Report | None] = []
    thread = threading.Thread(target=lambda: reports.append(checker.check(job(tmp_path / "big.yaml", BIG))))
    thread.start()
    while checker._path is None:
        time.sleep(0.01)

    checker.overtake(tmp_path / "other.yaml")
    assert thread.is_alive()
    checker.overtake(tmp_path / "big.yaml")
    thread.join(30)

    assert reports == [None]
    assert found(checker.check(job(tmp_path / "t.yaml", "formiga: 1\ntask: T\nsteps: [{wait: 1 s}]\n"))) == []


def test_a_check_that_goes_wrong_is_told_and_the_process_goes_on(checker: CheckerProcess, tmp_path: Path) -> None:
    bad = CheckJob((), None, None, tmp_path / "nowhere.yaml", {})
    with pytest.raises(RuntimeError, match="KeyError"):
        checker.check(bad)
    process = checker._process
    assert found(checker.check(job(tmp_path / "t.yaml", "formiga: 1\ntask: T\nsteps: [{wait: 1 s}]\n"))) == []
    assert checker._process is process


def test_a_process_that_ended_by_itself_is_told_and_replaced(
    checker: CheckerProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    good = job(tmp_path / "t.yaml", "formiga: 1\ntask: T\nsteps: [{wait: 1 s}]\n")
    with monkeypatch.context() as patch:
        patch.setattr(worker, "_START", "import sys; sys.stdin.buffer.read(1); sys.exit(3)")
        with pytest.raises(RuntimeError) as refused:
            checker.check(good)
        wording(refused.value)
    assert found(checker.check(good)) == []
