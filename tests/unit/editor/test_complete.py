"""What is proposed at a position, also while the text around it is no YAML."""

import re
from pathlib import Path

import pytest

from formiga_bt.editor.complete import Item, complete
from formiga_bt.editor.project import Document
from formiga_bt.lang.kinds import KINDS, MODIFIERS
from formiga_bt.lang.text.document import parse
from tests.golden import Wording
from tests.unit.editor.conftest import TASK, Editor


def at(editor: Editor, old: str, new: str = "") -> list[Item]:
    line, col = editor.cursor(old, new)
    return complete(editor.project, editor.document, line, col)


def labels(editor: Editor, old: str, new: str = "") -> list[str]:
    return [item.label for item in at(editor, old, new)]


GOTO = "do: drone.GoTo"


@pytest.mark.parametrize(
    ("old", "new", "first"),
    [
        (GOTO, "do: |", ["robot", "drone"]),
        (GOTO, "do: drone.|", ["TakeOff", "GoTo", "LandIn", "Explore"]),
        (GOTO, "do: drone.Go|", ["TakeOff", "GoTo", "LandIn", "Explore"]),
        ('with: {to: "${spot}"}', "with: {|}", ["to", "speed"]),
        ('with: {to: "${spot}"}', "with:\n          |", ["to", "speed"]),
        ('with: {to: "${spot}"}', "with:\n          to: ${spot}\n          |", ["speed"]),
        ("      height: ${height}\n", "      |\n", ["height"]),
        ("call: ReturnHome", "call: |", ["ReturnHome", "FlyOver", "FlyTo"]),
        ("save_as: reply", "policy: |", ["any", "all"]),
        ("timeout: 5 min", "timeout: 5|", ["ms", "s", "min", "h", "d"]),
        ("timeout: 5 min", "timeout: 5 |", ["ms", "s", "min", "h", "d"]),
        ("'yes'", "'|", ["yes", "no"]),
        ("result.answer", "result.|", ["answer", "by", "at"]),
        ("drone.id", "drone.|", ["id", "type", "position", "home", "battery", "status"]),
        ("[watchers]", "[|]", ["robot", "drone", "watchers"]),
        ("      drone: ${drone}\n", "      drone: |\n", ["robot", "drone"]),
        ("      to: ${target}\n", "      to: |\n", ["camp"]),
        ("type: lwd", "type: |", ["drone", "lwd", "hwd", "person", "picker", "watcher"]),
        ("target: place", "target: |", ["number", "int", "text", "bool", "percent", "distance"]),
        ("imports: [lib/flying.yaml]", "imports: [|]", ["lib/driving.yaml", "lib/flying.yaml"]),
        ("vars:\n", "priority: |\nvars:\n", ["low", "medium", "high"]),
        ("vars:\n", "preemptible: |\nvars:\n", ["true", "false"]),
        ("  - call: ReturnHome", "  - set:\n      |\n  - call: ReturnHome", ["spots", "rounds"]),
    ],
)
def test_the_likeliest_come_first(old: str, new: str, first: list[str], editor: Editor) -> None:
    assert labels(editor, old, new)[: len(first)] == first


def test_a_new_step_may_be_of_any_kind_and_have_any_modifier(editor: Editor) -> None:
    found = labels(editor, "  - call: ReturnHome", "  - |\n  - call: ReturnHome")
    assert found == [*KINDS, *(option.name for option in MODIFIERS)]


def test_a_step_offers_the_options_of_its_kind_that_it_has_not(editor: Editor) -> None:
    found = labels(editor, "    expect: result", "    |\n    expect: result")
    assert found[:6] == ["options", "form", "policy", "escalate_after", "clears", "if_no_answer"]
    assert not {"of", "timeout", "save_as", "expect"} & set(found)


def test_names_are_those_of_the_place(editor: Editor) -> None:
    inside = labels(editor, "${spot}", "${|}")
    assert "spot" in inside
    assert "reply" in inside
    before = labels(editor, "drone: ${drone}", "drone: ${|}")
    assert "spot" not in before
    assert "reply" not in before
    assert {"target", "height", "drone", "above", "is_set", "base"} <= set(before)


def test_a_step_that_is_new_sees_what_the_one_above_saved(editor: Editor) -> None:
    found = labels(editor, "  - for:\n", "  - check: |\n  - for:\n")
    assert "reply" in found


def test_a_step_behind_a_loop_does_not_see_its_names(editor: Editor) -> None:
    found = labels(editor, "  - call: ReturnHome", "  - check: |\n  - call: ReturnHome")
    assert "reply" in found
    assert "spot" not in found


def test_a_text_that_cannot_be_read_keeps_the_names_of_the_last_check(editor: Editor) -> None:
    editor.cursor("  - ask:", "  - [broken: {\n  - ask:")
    editor.recheck()
    assert "reply" in labels(editor, "${spot}", "${|}")


def test_a_helper_comes_with_its_signature(editor: Editor, wording: Wording) -> None:
    item = next(one for one in at(editor, "${spot}", "${ab|}") if one.label == "above")
    assert (item.insert, item.detail) == ("above($0)", "above(place, height)")
    wording(item.doc)


def test_the_site_gives_its_names(editor: Editor) -> None:
    assert {"camp"} <= set(labels(editor, "to: ${target}", "to: ${site.places.|}"))


def test_nothing_is_proposed_in_a_comment(editor: Editor) -> None:
    assert labels(editor, "type: lwd", "type: lwd    # it is |") == []


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("typed", ["  - |", "  |"])
def test_what_a_kind_inserts_is_yaml(kind: str, typed: str, editor: Editor) -> None:
    item = next(
        one for one in at(editor, "  - call: ReturnHome", f"{typed}\n  - call: ReturnHome") if one.label == kind
    )
    line, _ = editor.cursor("  - call: ReturnHome")
    place = line - 1
    lines = list(editor.document.lines)
    indent = len(lines[place]) - len(lines[place].lstrip())
    text = filled(item.insert).replace("\n", "\n" + " " * indent)
    lines[place] = lines[place][: item.start] + text + lines[place][item.end :]
    root, problems = parse("\n".join(lines), "x.yaml")
    assert problems == []
    assert root is not None


def filled(snippet: str) -> str:
    """Return a snippet with each place filled with what it suggests."""
    text = re.sub(r"\$\{\d+:([^}\\]*(?:\\.[^}\\]*)*)\}", r"\1", snippet)
    text = re.sub(r"\$\{\d+\|([^,|]*)[^}]*\}", r"\1", text)
    return re.sub(r"\$\d+", "x", text).replace("\\$", "$").replace("\\}", "}")


def test_a_key_that_has_its_colon_gets_no_second(editor: Editor) -> None:
    item = next(one for one in at(editor, "timeout: 5", "time|out: 5") if one.label == "timeout")
    assert (item.insert, item.snippet) == ("timeout", False)


def test_with_comes_with_the_fields_that_an_action_needs(editor: Editor) -> None:
    found = at(editor, 'with: {to: "${spot}"}', "|")
    assert next(one.insert for one in found if one.label == "with") == "with:\n  to: $1"


def test_a_library_an_empty_file_and_a_site_have_their_own_keys(tmp_path: Path) -> None:
    library = Editor(
        "formiga: 1\nsubtrees:\n  Up:\n    params: {drone: agent}\n    steps:\n      - do: drone.TakeOff\n", tmp_path
    )
    assert labels(library, "    steps:", "    |\n    steps:") == ["returns"]
    assert labels(library, "formiga: 1\n", "formiga: 1\n|\n") == ["imports", "records"]
    assert labels(Editor("x", tmp_path), "x", "|")[:3] == ["formiga", "task", "steps"]
    site = Editor("formiga_site: 1\nname: north\nbase: {lat: 60, lng: 22}\n", tmp_path)
    assert "ports" in labels(site, "name: north\n", "name: north\n|\n")


def test_the_task_of_the_tests_has_no_problem(editor: Editor) -> None:
    assert [one for one in editor.document.diagnostics if one.severity == "error"] == []
    assert TASK.startswith("formiga: 1")


def test_the_events_of_an_agents_type_are_offered(tmp_path: Path) -> None:
    text = "formiga: 1\ntask: T\nagents:\n  user: {type: picker}\nsteps:\n  - wait_for: user.sos\n    timeout: 1 min\n"
    found = labels(Editor(text, tmp_path), "user.sos", "user.|")
    assert "sos" in found


NEIGHBOUR = """\
formiga: 1
task: Look
params:
  spot: {type: place, help: What to look at.}
  high: {type: distance, default: 60 m}
steps: [{notify: "${spot} ${high}"}]
"""
TOUR = """\
formiga: 1
task: Tour
steps:
  - request: Look
    with: {spot: {east: 5 m, north: 5 m}}
"""


@pytest.fixture
def tour(tmp_path: Path) -> Editor:
    """Return a task that requests one whose file stands beside it."""
    (tmp_path / "look.yaml").write_text(NEIGHBOUR, encoding="utf-8")
    return Editor(TOUR, tmp_path, "tour.yaml")


def test_tasks_of_the_folder_and_shipped_ones_may_be_requested(tour: Editor) -> None:
    found = labels(tour, "request: Look", "request: |")
    assert {"Look", "PickUp", "MoveTask"} <= set(found)
    assert "Tour" not in found


def test_the_params_of_a_requested_task_are_offered_and_typed(tour: Editor) -> None:
    assert labels(tour, "with: {spot: {east: 5 m, north: 5 m}}", "with: {|}") == ["spot", "high"]


def test_the_unit_of_a_requested_tasks_param_is_known(tour: Editor) -> None:
    assert labels(tour, "north: 5 m}}", "north: 5 m}, high: 6|}") == ["m", "km"]


def test_a_requested_task_that_is_open_is_read_as_it_is_typed(tour: Editor, tmp_path: Path) -> None:
    text = NEIGHBOUR.replace("  high:", "  far: {type: distance, default: 1 m}\n  high:")
    tour.project.open[tmp_path / "look.yaml"] = Document(tmp_path / "look.yaml", text, 7)
    assert "far" in labels(tour, "with: {spot: {east: 5 m, north: 5 m}}", "with:\n      |")


@pytest.mark.parametrize(
    ("name", "text", "old", "new", "wanted"),
    [
        (
            "day.yaml",
            "scenario: day\nsite: demo-site.yaml\nagents:\n  - id: a\n",
            "  - id: a\n",
            "  - id: a\n    |\n",
            "battery",
        ),
        ("day.yaml", "scenario: day\nsite: demo-site.yaml\nfaults: [{at: 1 s}]\n", "at: 1 s", "at: 1 s, |", "kind"),
        (
            "t.test.yaml",
            "formiga_test: 1\ntask: t.yaml\ncases:\n  - name: x\n",
            "  - name: x\n",
            "  - name: x\n    |\n",
            "expect",
        ),
        ("own.yaml", "types:\n  crane:\n    label: x\n", "    label: x\n", "    label: x\n    |\n", "extends"),
        ("own.yaml", "types:\n  crane:\n    actions: [x]\n", "[x]", "[|]", "TakeOff"),
    ],
)
def test_other_files_have_their_own_keys(name: str, text: str, old: str, new: str, wanted: str, tmp_path: Path) -> None:
    assert wanted in labels(Editor(text, tmp_path, name), old, new)
