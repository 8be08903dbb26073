"""`formiga diff`: nothing where only the layout differs; a known edit is told as that edit, and nothing else."""

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.lang.text.formatting import format_text
from formiga_bt.show.diff.changes import Difference, compare
from formiga_bt.show.diff.terminal import draw
from tests.mutation import operators
from tests.property.strategies import load, task_text
from tests.shares import some

ROOT = Path(__file__).parents[2]
CATALOGUE = load_catalogue(sorted((ROOT / "actions").glob("*.yaml")))[0]
SHIPPED = [path for path in sorted((ROOT / "trees").rglob("*.yaml")) if "\nsteps:" in path.read_text(encoding="utf-8")]
LISTS = ("steps", "then", "else", "default", "sequence", "fallback", "parallel", "finally", "on_failure", "on_abort")


def drawn(seed: int) -> tuple[Any, Task]:
    """Draw a task as plain data; a few drafts are refused."""
    dice = Random(seed)
    while True:
        text = task_text(dice)
        task = load(text)
        if task is not None:
            return json.loads(text), task


def difference(old: Any, new: Any) -> Difference | None:
    texts = [json.dumps(one, indent=1) for one in (old, new)]
    tasks = [load(text) for text in texts]
    if tasks[0] is None or tasks[1] is None:
        return None
    return compare(tasks[0], tasks[1], {"random.yaml": texts[0]}, {"random.yaml": texts[1]})


def lists(data: Any) -> Iterator[list[Any]]:
    """Iterate over the lists of steps of a task."""
    if isinstance(data, dict):
        for key, value in data.items():
            if key in LISTS and isinstance(value, list):
                yield value
            yield from lists(value)
    elif isinstance(data, list):
        for one in data:
            yield from lists(one)


def shuffled(data: Any, dice: Random) -> Any:
    """Return the same with the keys of all mappings in another order; `set` runs in the order of its keys."""
    if isinstance(data, dict):
        items = list(data.items())
        dice.shuffle(items)
        return {key: value if key == "set" else shuffled(value, dice) for key, value in items}
    return [shuffled(one, dice) for one in data] if isinstance(data, list) else data


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_what_ships_does_not_differ_from_itself_laid_out_anew(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    other = "\n".join(f"  {line}  # said" if line.endswith(":") else f"  {line}" for line in text.split("\n"))
    done = format_text(other, path.name).text
    assert done is not None
    tasks = [load_task_text(t, path.name, catalogue=CATALOGUE, folder_=path.parent) for t in (text, done)]
    assert tasks[0].task is not None
    assert tasks[1].task is not None

    found = compare(tasks[0].task, tasks[1].task, tasks[0].sources, tasks[1].sources)

    assert found.changes == ()
    assert found.in_words() == "no change"


@settings(max_examples=some(10, 20), deadline=None)
@given(st.integers(0, 10_000))
def test_a_drawn_task_does_not_differ_from_itself_formatted_or_with_its_keys_in_another_order(seed: int) -> None:
    data, task = drawn(seed)
    text = json.dumps(data, indent=1)
    laid_out = format_text(text, "random.yaml").text
    assert laid_out is not None
    other = load(laid_out)
    assert other is not None

    assert compare(task, other, {"random.yaml": text}, {"random.yaml": laid_out}).changes == ()
    mixed = difference(data, shuffled(data, Random(seed)))
    assert mixed is not None
    assert mixed.changes == ()


@settings(max_examples=some(12, 25), deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_a_step_more_is_one_that_was_added_and_the_other_way_round_removed(seed: int, where: int) -> None:
    data, _ = drawn(seed)
    other = copy.deepcopy(data)
    places = list(lists(other))
    place = places[where % len(places)]
    place.insert(where % (len(place) + 1), {"notify": "the step that came"})

    for old, new, what in ((data, other, "added"), (other, data, "removed")):
        found = difference(old, new)
        if found is not None:
            assert [(c.what, c.kind) for c in found.changes] == [(what, "notify")]


@settings(max_examples=some(12, 25), deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 10_000), st.integers(0, 10_000))
def test_a_step_elsewhere_has_moved(seed: int, where: int, whither: int) -> None:
    data, _ = drawn(seed)
    other = copy.deepcopy(data)
    step = {"notify": "the step that moves"}
    for one, number in ((data, where), (other, whither)):
        places = [*lists(one.get("steps")), one["steps"]]  # in one body: a subtree has names of its own
        place = places[number % len(places)]
        place.insert(number % (len(place) + 1), dict(step))

    found = difference(data, other)

    if found is not None:
        swapped = [[("moved", c.kind)] for c in found.changes]  # two neighbours: either may be said to have moved
        here = json.dumps(data) == json.dumps(other)
        assert [(c.what, c.kind) for c in found.changes] in ([[]] if here else [[("moved", "notify")], *swapped])


@settings(max_examples=some(12, 25), deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_another_value_is_one_change_of_one_field(seed: int, where: int) -> None:
    data, _ = drawn(seed)
    other = copy.deepcopy(data)
    steps = [step for place in lists(other) for step in place if isinstance(step, dict)]
    steps[where % len(steps)]["note"] = "something else to know"

    for old, new in ((data, other), (other, data)):
        found = difference(old, new)
        if found is not None:
            assert [c.what for c in found.changes] == ["changed"]
            assert [one.field for one in found.changes[0].fields] == ["note"]


@settings(max_examples=some(12, 25), deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["one", "two", "ann", "n", "flag"]))
def test_another_name_is_a_rename(seed: int, name: str) -> None:
    data, task = drawn(seed)
    text = json.dumps({key: value for key, value in data.items() if key != "subtrees"})
    for around in ("{%s}", "{%s ", " %s}", " %s ", "(%s ", '"%s.', '"%s"', "${%s.", "{%s ", " %s.", "(%s.", "(%s)"):
        text = text.replace(around % name, around % f"{name}_anew")
    other = {**json.loads(text), **({"subtrees": data["subtrees"]} if "subtrees" in data else {})}
    other = json.loads(json.dumps(other).replace(f'"with": {{"{name}_anew"', f'"with": {{"{name}"'))

    found = difference(data, other)

    if found is not None and f"{name}_anew" in (*other["agents"], *other["vars"]):
        kinds = {c.what for c in found.changes}
        assert kinds == {"renamed"} or (name in ("n", "flag") and kinds <= {"renamed", "added", "removed", "changed"})
        assert task.name == "Random"


@settings(max_examples=some(10, 20), deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_any_two_tasks_are_compared_and_drawn_and_what_came_here_went_there(one: int, two: int) -> None:
    (old, _), (new, _) = drawn(one), drawn(two)

    there, back = difference(old, new), difference(new, old)

    assert there is not None
    assert back is not None
    for width in (40, 100):
        assert all(len(line.plain()) <= width for line in draw(there, width=width, ascii_only=True))
    assert (there.counts == {}) == (back.counts == {})
    assert there.counts.get("renamed", 0) == back.counts.get("renamed", 0)


@pytest.mark.parametrize("name", ["delivery", "watch_dog_sos"])
def test_each_single_fault_that_the_checker_lets_pass_is_one_change(name: str) -> None:
    path = ROOT / "trees" / f"{name}.yaml"
    data = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
    edits = (operators.dropped_step, operators.dropped_option, operators.other_unit, operators.tenfold)
    told: dict[str, int] = {}
    versions = [data, *(new for edit in edits for _, _, new in edit(data))]
    first, *others = (
        load_task_text(json.dumps(one, indent=1), path.name, catalogue=CATALOGUE, folder_=path.parent)
        for one in versions
    )
    assert first.task is not None
    for other in others:
        if other.task is not None:
            found = compare(first.task, other.task, first.sources, other.sources)
            assert len(found.changes) == 1, found.in_words()
            told[found.changes[0].what] = told.get(found.changes[0].what, 0) + 1

    assert told["changed"] > 2
    assert set(told) <= {"changed", "removed"}
