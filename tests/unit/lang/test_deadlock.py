"""E035 between tasks: each holds what another one waits for in mid-task."""

from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.cli.author.checking import check
from formiga_bt.cli.inputs import read_world
from formiga_bt.cli.operator.library import read_library, warn_of_waits
from formiga_bt.lang.checks.deadlock import check_tasks
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Task
from formiga_bt.lang.site import load_site_text
from tests.golden import Wording

Tasks = Callable[..., list[str]]
ONE_DRONE = """\
formiga_site: 1
name: yard
base: {lat: 60.0, lng: 25.0}
ports: {p1: {at: {east: 0 m, north: 0 m}}}
agents: {hwd_1: {type: hwd, home: p1}}
"""


def text(name: str, holds: str, wants: str) -> str:
    return (
        f"formiga: 1\ntask: {name}\nagents:\n  mine: {{type: {holds}}}\nsteps:\n  - with_agents:\n"
        f"      more: {{type: {wants}}}\n    steps:\n      - notify: ${{mine.id}} ${{more.id}}\n"
    )


@pytest.fixture
def found(catalogue: Catalogue) -> Tasks:
    def read(*pairs: tuple[str, str, str]) -> list[str]:
        tasks: list[Task] = []
        for one in pairs:
            loaded = load_task_text(text(*one), f"{one[0]}.yaml", catalogue=catalogue)
            assert loaded.task is not None, loaded.diagnostics
            tasks.append(loaded.task)
        return [f"{d.mark.file}:{d.mark.line}: {d.code}: {d.message}" for d in check_tasks(tasks, catalogue)]

    return read


def test_two_tasks_that_hold_and_want_one_kind_are_told_with_their_roles_and_lines(
    found: Tasks, wording: Wording
) -> None:
    wording(found(("Patrol", "lwd", "lwd"), ("Escort", "lwd", "lwd")))


def test_two_tasks_that_take_two_kinds_in_opposite_order_are_told(found: Tasks, wording: Wording) -> None:
    (told,) = found(("Patrol", "lwd", "hwd"), ("Escort", "hwd", "lwd"))

    wording(told)


def test_a_circle_of_three_is_told_once(found: Tasks) -> None:
    assert len(found(("One", "lwd", "hwd"), ("Two", "hwd", "picker"), ("Three", "lwd", "lwd"))) == 0
    assert len(found(("One", "lwd", "hwd"), ("Two", "hwd", "lwd"), ("Three", "picker", "lwd"))) == 1


@pytest.mark.parametrize(
    "pairs",
    [
        [("One", "lwd", "hwd"), ("Two", "lwd", "hwd")],
        [("One", "lwd", "lwd")],
        [("One", "picker", "picker"), ("Two", "picker", "picker")],
        [("One", "lwd", "lwd"), ("Two", "hwd", "hwd")],
    ],
    ids=["the same order", "one task alone", "people are shared", "other pools"],
)
def test_what_cannot_wait_in_a_circle_is_fine(found: Tasks, pairs: list[tuple[str, str, str]]) -> None:
    assert found(*pairs) == []


def test_check_with_several_files_tells_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    files = []
    for name in ("Patrol", "Escort"):
        files.append(tmp_path / f"{name}.yaml")
        files[-1].write_text(text(name, "lwd", "lwd"), encoding="utf-8")

    assert check(files[:1], None, (), strict=True, form="text") == 0
    assert check(files, None, (), strict=False, form="text") == 1
    wording(capsys.readouterr().out)


def test_an_engine_that_starts_warns_of_it_and_serves_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    world = read_world([], folder("trees") / "demo-site.yaml")
    for name in ("Patrol", "Escort"):
        (tmp_path / f"{name}.yaml").write_text(text(name, "lwd", "lwd"), encoding="utf-8")
    served, _ = read_library([tmp_path], tmp_path, world, {}, "")

    warn_of_waits(served, world)

    said = capsys.readouterr().err
    assert {"Patrol", "Escort"} <= set(served)
    wording(said)
    assert said.count("E035") == 1


@pytest.mark.parametrize(("first", "codes"), [("", ["E025"]), ("  - release: mine\n", [])])
def test_a_block_may_ask_for_the_machine_that_was_given_back(
    first: str, codes: list[str], catalogue: Catalogue
) -> None:
    site, _, _ = load_site_text(ONE_DRONE, "site.yaml", catalogue)
    written = text("Relief", "hwd", "hwd").replace("steps:\n", f"steps:\n{first}", 1).replace("${mine.id} ", "")
    found = load_task_text(written, "relief.yaml", catalogue=catalogue, site=site).diagnostics
    assert [d.code for d in found if d.severity == "error"] == codes
