"""A drawing says what the file says, and can be cut; its paths are those that runs are known by."""

from pathlib import Path

import pytest

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.lang.places import steps_with_paths
from formiga_bt.show.facts import Box, Drawing
from formiga_bt.show.tree.drawing import cut, drawing_of, is_step, names_of, text_of, walk
from formiga_bt.show.tree.phrases import param_label
from tests.golden import Wording

TREES = sorted((Path(__file__).parents[3] / "trees").rglob("*.yaml"))
TASKS = [p for p in TREES if "\ntask:" in p.read_text(encoding="utf-8") and ".test" not in p.suffixes]

TEXT = """
formiga: 1
task: Look
description: Look twice.
params: {n: int}
agents: {drone: {type: lwd}, ann: {type: watcher}}
steps:
  - if: n > 1
    name: many
    then: [{wait: 1 s}]
    else: [{wait: 2 s}]
  - sequence:
      - call: Twice
        with: {who: "${ann}"}
        when: n > 2
    finally: [{wait: 3 s}]
  - switch: n
    cases:
      1: [{wait: 4 s}]
    default: [{wait: 5 s}]
finally:
  - notify: over
    to: [ann]
subtrees:
  Twice:
    params: {who: {type: agent, of: [watcher]}}
    steps:
      - {notify: one, to: [who], ignore_failure: true}
      - repeat: 2
        steps: [{wait: 1 s}]
"""


@pytest.fixture
def drawing(tmp_path: Path) -> Drawing:
    file = tmp_path / "look.yaml"
    file.write_text(TEXT, encoding="utf-8")
    read = read_task(file, read_world())
    assert read.task is not None, read.diagnostics
    return drawing_of(read.task, sources=read.sources)


def of(drawing: Drawing, path: str) -> Box:
    return next(box for box in walk(drawing.sections) if box.path == path)


@pytest.mark.parametrize("path", TASKS, ids=lambda p: p.stem)
def test_every_step_is_a_box_with_the_path_that_a_run_knows_it_by(path: Path) -> None:
    read = read_task(path, read_world())
    assert read.task is not None
    boxes = [box.path for box in walk(drawing_of(read.task).sections) if is_step(box)]
    assert sorted(boxes) == sorted(path for path, _ in steps_with_paths(read.task))


def test_branches_have_no_path_and_their_steps_have(drawing: Drawing) -> None:
    many = of(drawing, "steps/steps[0]")
    assert [(text_of(one), one.kind, one.path) for one in many.children] == [
        ("then", "branch", ""),
        ("else", "branch", ""),
    ]
    assert [one.path for one in walk(many.children) if one.path] == ["steps/steps[0].then[0]", "steps/steps[0].else[0]"]
    block = of(drawing, "steps/steps[1]")
    assert [text_of(one) for one in block.children] == ["call Twice(who: ann)", "finally"]


def test_a_box_says_role_guard_place_and_modifiers(drawing: Drawing, wording: Wording) -> None:
    call = of(drawing, "steps/steps[1].sequence[0]")
    assert call.guard == "n > 2"
    wording(call.modifiers)
    assert call.spot is not None
    assert (call.spot.line, Path(call.spot.file).name) == (13, "look.yaml")
    told = call.children[0]
    assert (told.kind, told.role, told.modifiers) == ("notify", "who", ("failure ignored",))
    assert of(drawing, "steps/steps[0]").guard == "n > 1"


def test_sources_are_those_of_its_steps_only(drawing: Drawing) -> None:
    assert [Path(file).name for file in drawing.sources] == ["look.yaml"]
    assert list(drawing.sources.values()) == [TEXT]


def test_a_depth_keeps_so_many_levels_of_steps_and_counts_the_rest(drawing: Drawing) -> None:
    top = cut(drawing, depth=1)
    assert [(box.path, box.hidden) for box in walk(top.sections) if box.hidden] == [
        ("steps/steps[0]", 2),
        ("steps/steps[1]", 5),
        ("steps/steps[2]", 2),
    ]
    second = cut(drawing, depth=2)
    assert [box.path for box in walk(second.sections) if box.hidden] == ["steps/steps[1].sequence[0]"]
    assert cut(drawing, depth=4) == drawing


@pytest.mark.parametrize(
    ("name", "path", "hidden"),
    [
        ("Twice", "steps/steps[1].sequence[0]", 3),
        ("many", "steps/steps[0]", 2),
        ("steps/steps[2]", "steps/steps[2]", 2),
        ("finally", "finally/", 1),
    ],
)
def test_what_is_collapsed_counts_its_steps(drawing: Drawing, name: str, path: str, hidden: int) -> None:
    assert [(b.path, b.hidden) for b in walk(cut(drawing, collapse=[name]).sections) if b.hidden] == [(path, hidden)]


def test_a_cut_of_a_cut_counts_all(drawing: Drawing) -> None:
    twice = cut(cut(drawing, collapse=["Twice"]), depth=1)
    assert of(twice, "steps/steps[1]").hidden == 5


def test_a_step_is_named_by_its_path_its_name_or_what_it_calls(drawing: Drawing) -> None:
    assert names_of(of(drawing, "steps/steps[0]")) == ("steps/steps[0]", "many")
    assert names_of(of(drawing, "steps/steps[1].sequence[0]")) == ("steps/steps[1].sequence[0]", "Twice")


def test_a_step_in_a_subtree_says_which_role_of_the_task_it_is_of(drawing: Drawing) -> None:
    told = of(drawing, "steps/steps[1].sequence[0]").children[0]
    assert (told.role, told.task_role) == ("who", "ann")


def test_defaults_that_are_lists_or_points_are_said(tmp_path: Path, wording: Wording) -> None:
    text = (
        "formiga: 1\ntask: Round\nparams:\n"
        "  fields: {type: {list: place}, default: [north_field, 'camp']}\n"
        "  pauses: {type: {list: duration}, default: [1 s, '${2 s + 1 s}']}\n"
        "  at: {type: place, default: {east: 10 m, north: -4 m}}\n"
        "  names: {type: {list: text}, default: ['a, b', c d, '']}\n"
        "  word: {type: text, default: ''}\n"
        "steps:\n  - notify: ${fields} ${pauses} ${at} ${names} ${word}\n"
    )
    path = tmp_path / "round.yaml"
    path.write_text(text)
    task = read_task(path, read_world()).task
    assert task is not None
    said = ["".join(span.text for span in param_label(one)) for one in task.params.values()]

    wording(said)
