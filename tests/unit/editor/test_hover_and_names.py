"""What hovers say, where definitions are, what a rename changes and what it refuses, the outline, what is shown of problems."""

from pathlib import Path

import pytest

from formiga_bt.editor import navigate
from formiga_bt.editor.hover import hover, signatures
from formiga_bt.editor.navigate import CannotRename
from formiga_bt.editor.project import Document
from formiga_bt.editor.report import shown
from tests.golden import Wording
from tests.unit.editor.conftest import TASK, Editor


def said(editor: Editor, old: str, new: str = "") -> str:
    line, col = editor.cursor(old, new)
    found = hover(editor.project, editor.document, line, col)
    return found.text if found is not None else ""


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("ask: Is", "as|k: Is", "**ask**: text\n\nPut a question to people"),
        (
            "timeout: 5 min",
            "time|out: 5 min",
            "**timeout**: duration\n\nBound of the whole step, its retries included.",
        ),
        ("timeout: 5 min", "timeout: |5 min", "**timeout**: duration (ms, s, min, h, d)"),
        ("to: ${target}", "t|o: ${target}", "**to**: place\n\n\n\n*of FlyTo*"),
        ('{to: "${spot}"}', '{t|o: "${spot}"}', "**to**: position\n\nWhere to hover.\n\n*of GoTo*"),
        ("${spot}", "${sp|ot}", "**spot**: position\n\n*loop name*"),
        ("height: ${height}", "height: ${he|ight}", "**height**: distance (m, km)\n\n*param*"),
        ("${circle(", "${cir|cle(", "circle(center: point, radius: distance, points: int = 24"),
        ("drone.id", "drone.i|d", "**drone.id**: text"),
        ("drone.id", "dro|ne.id", "**drone**: lwd agent\n\n*role*"),
        ("result.answer", "result.ans|wer", "**result.answer**: one of yes, no"),
        ("do: drone.GoTo", "do: drone.Go|To", "**GoTo**\n\nFly the straight leg to a position and hover there."),
        ("do: drone.GoTo", "do: dro|ne.GoTo", "**drone**: lwd agent\n\n*role*"),
        ("call: FlyTo", "call: Fly|To", "**FlyTo**: subtree of flying.yaml\n- `drone`: agent"),
        ("type: lwd", "type: lw|d", "**lwd**: agent type, extends drone"),
        ("near: ${target}", "ne|ar: ${target}", "**near**: place\n\nThe nearest fit one to this place.\n\n*of a role*"),
        ("save_as: reply", "save_as: re|ply", "*saved name*"),
        ("reply.by", "rep|ly.by", "**reply**: record of answer, by, at\n\n*saved name*"),
        ("target: place", "tar|get: place", "**target**: place\n\n*param*"),
    ],
)
def test_a_hover_says_what_it_is(old: str, new: str, text: str, editor: Editor) -> None:
    assert text in said(editor, old, new)


def test_a_hover_answers_while_the_text_is_no_yaml(editor: Editor, wording: Wording) -> None:
    editor.cursor("  - ask:", "  - {\n  - ask:")
    wording(said(editor, "${spot}", "${sp|ot}"))


def test_a_call_of_a_helper_shows_its_arguments(editor: Editor) -> None:
    line, col = editor.cursor("height), 5 m", "height), |5 m")
    found = signatures(editor.project, editor.document, line, col)
    assert found is not None
    assert ([form.name for form in found.forms], found.argument) == (["circle"], 1)


@pytest.mark.parametrize(
    ("old", "new", "there"),
    [
        ("${spot}", "${sp|ot}", "      spot: ${spots}"),
        ("reply.by", "rep|ly.by", "    save_as: reply"),
        ("do: drone", "do: dro|ne", "  drone:"),
        ("height: ${height}", "height: ${he|ight}", "  height: {type: distance"),
        ("circle(above(target", "circle(above(tar|get", "  target: place"),
    ],
)
def test_a_name_leads_to_its_definition(old: str, new: str, there: str, editor: Editor) -> None:
    line, col = editor.cursor(old, new)
    found = navigate.definition(editor.project, editor.document, line, col)
    assert found is not None
    assert editor.document.lines[found.line].startswith(there)


@pytest.mark.parametrize(
    ("old", "new", "file", "text"),
    [
        ("call: FlyTo", "call: Fly|To", "flying.yaml", "  FlyTo:"),
        ("lib/flying.yaml", "lib/fl|ying.yaml", "flying.yaml", "formiga: 1"),
        ("drone.GoTo", "drone.Go|To", "base.yaml", "  GoTo:"),
        ("type: lwd", "type: lw|d", "base.yaml", "  lwd:"),
        ("      to: ${target}", "      t|o: ${target}", "flying.yaml", "      to: place"),
    ],
)
def test_what_others_define_is_found_in_their_files(old: str, new: str, file: str, text: str, editor: Editor) -> None:
    line, col = editor.cursor(old, new)
    found = navigate.definition(editor.project, editor.document, line, col)
    assert found is not None
    assert found.path.name == file
    assert found.path.read_text(encoding="utf-8").splitlines()[found.line].startswith(text)


def words(editor: Editor, places: list[navigate.LineColumns]) -> list[str]:
    return [editor.document.lines[at.line].strip() for at in places]


def test_references_are_found_in_expressions_too(editor: Editor, wording: Wording) -> None:
    line, col = editor.cursor("target: place", "tar|get: place")
    wording(words(editor, navigate.references(editor.document, line, col)))
    assert len(navigate.references(editor.document, line, col, with_definition=False)) == 4


def test_a_units_and_a_fields_letters_are_no_names(tmp_path: Path) -> None:
    task = "formiga: 1\ntask: T\nparams:\n  m: distance\n  battery: percent\nagents:\n  drone: {type: lwd}\nsteps:\n"
    task += "  - check: drone.battery > battery and m < 5 m and max(m, 3 m) > 1 m\n"
    one = Document(tmp_path / "t.yaml", task, 1)
    assert [(at.line, at.start) for at in navigate.rename(one, 3, 2, "x")] == [(3, 2), (8, 39), (8, 55)]
    assert [(at.line, at.start) for at in navigate.rename(one, 4, 2, "x")] == [(4, 2), (8, 27)]


def test_a_param_of_a_subtree_is_renamed_in_its_calls(tmp_path: Path) -> None:
    text = (
        "formiga: 1\ntask: T\nagents:\n  drone: {type: lwd}\nsteps:\n  - call: Up\n    with: {who: '${drone}'}\n"
        "subtrees:\n  Up:\n    params: {who: agent}\n    steps:\n      - do: who.TakeOff\n"
    )
    one = Document(tmp_path / "t.yaml", text, 1)
    assert [(at.line, at.start) for at in navigate.rename(one, 9, 13, "x")] == [(6, 11), (9, 13), (11, 12)]
    assert [(at.line, at.start) for at in navigate.rename(one, 5, 12, "Climb")] == [(5, 10), (8, 2)]


@pytest.mark.parametrize(
    ("old", "new", "name", "why"),
    [
        ("expect: result", "expect: res|ult", "x", "'result' is built in"),
        ("${circle", "${cir|cle", "x", "'circle' is a helper of the language"),
        ("call: FlyTo", "call: Fly|To", "x", "no subtree 'FlyTo' is defined in this file"),
        ("timeout: 5", "time|out: 5", "x", "'timeout' is not a name that this file defines"),
        ("do: drone", "do: dro|ne", "2", "'2' cannot be a name: a letter, then letters, digits and _"),
        ("do: drone", "do: dro|ne", "base", "'base' is a built-in name"),
        ("do: drone", "do: dro|ne", "line", "'line' is a helper; a name of your own would hide it"),
        ("do: drone", "do: dro|ne", "target", "'target' is defined in this file already"),
        ("do: drone", "[{ do: dro|ne", "x", "this file cannot be read at the moment: fix it first"),
    ],
)
def test_a_rename_that_cannot_be_is_refused_in_words(old: str, new: str, name: str, why: str, editor: Editor) -> None:
    line, col = editor.cursor(old, new)
    with pytest.raises(CannotRename) as caught:
        navigate.rename(editor.document, line, col, name)
    assert str(caught.value) == why


def test_the_outline_is_the_tree(editor: Editor) -> None:
    index = editor.document.index()
    assert index is not None
    found = {one.name: one for one in index.symbols()}
    assert [one.name for one in found["agents"].children] == ["drone"]
    steps = found["steps"].children
    names = ["call: FlyTo", "ask: Is ${target} clear?", "for", "call: ReturnHome"]
    assert [one.name for one in steps] == names
    assert [one.name for one in steps[2].children] == ["do: drone.GoTo"]
    assert (steps[2].mark.line, steps[2].mark.end_line) == (27, 32)


def test_unsaved_imports_and_sites_count(tmp_path: Path) -> None:
    library = tmp_path / "own.yaml"
    library.write_text("formiga: 1\nsubtrees:\n  Old:\n    steps: [{wait: 1 s}]\n", encoding="utf-8")
    (tmp_path / "site.yaml").write_text("formiga_site: 1\nname: x\nbase: {lat: 60, lng: 22}\n", encoding="utf-8")
    editor = Editor("formiga: 1\ntask: T\nimports: [own.yaml]\nsteps:\n  - call: New\n", tmp_path)
    assert [one.code for one in editor.document.diagnostics] == ["E050"]
    new = library.read_text(encoding="utf-8").replace("Old", "New")
    editor.project.open[library] = Document(library, new, 1)
    editor.recheck()
    assert editor.document.diagnostics == ()
    site = editor.project.site_of(editor.document.path)
    assert site is not None
    assert site.name == "x"


def test_a_problem_shows_its_mend_and_what_it_speaks_of(editor: Editor, wording: Wording) -> None:
    editor.type(TASK.replace("when: reply.by", "when: replyy.by").replace("  rounds: 2\n", "  target: 2\n"))
    editor.recheck()
    found = {one.code: one for one in shown(editor.project, editor.document, editor.document.diagnostics)}
    assert found["E010"].fix is not None
    assert found["E010"].fix.text == "reply"
    wording(found["E010"].message)
    assert [(span.line, span.start) for span, _ in found["E018"].related] == [(4, 2)]


def test_a_problem_of_an_import_is_shown_at_the_import(tmp_path: Path, wording: Wording) -> None:
    library = tmp_path / "own.yaml"
    library.write_text("formiga: 1\nsubtrees:\n  Up:\n    steps: [{waitt: 1 s}]\n", encoding="utf-8")
    editor = Editor("formiga: 1\ntask: T\nimports: [own.yaml]\nsteps:\n  - call: Up\n", tmp_path)
    (one,) = shown(editor.project, editor.document, editor.document.diagnostics)
    assert (one.code, one.span.line, one.span.start, one.span.end) == ("E006", 2, 10, 18)
    wording(one.message)
    assert [(span.path, span.line, span.start) for span, _ in one.related] == [(library, 3, 13)]


def test_other_yaml_files_are_left_alone(tmp_path: Path) -> None:
    assert Editor("services:\n  web: {image: x}\n  bad: [\n", tmp_path, "compose.yaml").document.diagnostics == ()
    assert Editor("", tmp_path).document.diagnostics == ()
    broken = Editor("formiga: 1\ntask: T\nsteps: [\n", tmp_path)
    assert [one.code for one in broken.document.diagnostics] == ["E001"]


def test_a_requested_task_is_explained_and_found(tmp_path: Path, wording: Wording) -> None:
    look = tmp_path / "look.yaml"
    look.write_text("formiga: 1\ntask: Look\nparams: {n: int}\nsteps: [{wait: 1 s}]\n", encoding="utf-8")
    editor = Editor("formiga: 1\ntask: Tour\nsteps: [{request: Look, with: {n: 1}}]\n", tmp_path, "tour.yaml")
    at = editor.cursor("Look", "Lo|ok")

    told, place = hover(editor.project, editor.document, *at), navigate.definition(editor.project, editor.document, *at)

    assert told is not None
    wording(told.text)
    assert place == navigate.LineColumns(look, 1, 6, 10)
