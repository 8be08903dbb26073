"""`with_resource` and the site's resources: read, checked over several tasks, and the same in JSON and in a formatted file."""

from pathlib import Path

import pytest

from formiga_bt.lang.checks.deadlock import check_tasks
from formiga_bt.lang.json_form.reading import load_task_json
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Task, WithResource
from formiga_bt.lang.site import load_site_text
from formiga_bt.lang.text.formatting import format_text

ROOT = Path(__file__).parents[3]
HALL = ROOT / "tests" / "lang_errors" / "catalogue" / "hall-site.yaml"


def read(text: str, catalogue: Catalogue, name: str = "Try") -> Task:
    loaded = load_task_text(f"formiga: 1\ntask: {name}\n{text}\n", f"{name}.yaml", catalogue=catalogue)
    assert loaded.task is not None, loaded.diagnostics
    return loaded.task


def block(task: Task) -> WithResource:
    (step,) = task.steps
    assert isinstance(step, WithResource)
    return step


@pytest.mark.parametrize(
    ("written", "units"),
    [
        ("lift_1", {"lift_1": 1}),
        ("[lift_1, dock_bay: 2]", {"lift_1": 1, "dock_bay": 2}),
        ("[dock_bay: 2]", {"dock_bay": 2}),
        ("{lift_1: 1, dock_bay: 3}", {"lift_1": 1, "dock_bay": 3}),
    ],
)
def test_a_block_names_its_resources_and_their_units(written: str, units: dict[str, int], catalogue: Catalogue) -> None:
    assert block(read(f"steps: [{{with_resource: {written}, steps: [{{wait: 1 s}}]}}]", catalogue)).units == units


def test_a_site_has_resources_with_a_capacity_and_a_region(catalogue: Catalogue) -> None:
    site, found, _ = load_site_text(HALL.read_text(encoding="utf-8"), "hall.yaml", catalogue)

    assert site is not None, found
    assert {name: one.capacity for name, one in site.resources.items()} == {"lift_1": 1, "bridge": 1, "dock_bay": 4}
    assert [name for name, one in site.resources.items() if one.region is not None] == ["bridge"]


def nested(outer: str, inner: str) -> str:
    return f"steps: [{{with_resource: {outer}, steps: [{{with_resource: {inner}, steps: [{{wait: 1 s}}]}}]}}]"


@pytest.mark.parametrize(
    ("pairs", "circles"),
    [
        ([("a", "b"), ("b", "a")], 1),
        ([("a", "b"), ("b", "c")], 0),
        ([("a", "b"), ("b", "c"), ("c", "a")], 1),
        ([("a", "b"), ("a", "b")], 0),
    ],
)
def test_orders_of_several_tasks_are_compared(pairs: list[tuple[str, str]], circles: int, catalogue: Catalogue) -> None:
    tasks = [read(nested(*pair), catalogue, f"T{n}") for n, pair in enumerate(pairs)]

    assert [one.code for one in check_tasks(tasks, catalogue)] == ["E113"] * circles


def test_a_call_counts_as_what_it_calls(catalogue: Catalogue) -> None:
    inside = "subtrees: {In: {steps: [{with_resource: a, steps: [{wait: 1 s}]}]}}"
    called = read(f"steps: [{{with_resource: b, steps: [{{call: In}}]}}]\n{inside}", catalogue, "Called")

    assert [one.code for one in check_tasks([called, read(nested("a", "b"), catalogue, "Other")], catalogue)] == [
        "E113"
    ]


def test_it_comes_back_from_json_and_from_a_formatted_file_as_it_was(catalogue: Catalogue) -> None:
    text = (
        "formiga: 1\ntask: Try\nsteps:\n  - with_resource: [lift_1, dock_bay: 2]\n    wait: 5 min\n    steps:\n"
        "      - with_resource: bridge\n        steps:\n          - wait: 1 s\n"
    )
    back = load_task_json(from_yaml(text, catalogue), catalogue=catalogue)

    assert back.task is not None, back.problems
    assert block(back.task).units == {"lift_1": 1, "dock_bay": 2}
    assert format_text(text, "try.yaml").text == text
