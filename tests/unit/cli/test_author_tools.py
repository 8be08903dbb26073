"""The tools of an author on the command line: reports of `check`, `fmt`, `fix`, `explain`, `schema`."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.author.rewriting import rewrite
from formiga_bt.lang.pages import messages
from tests.golden import Wording, having

BAD = "formiga: 1\ntask: Example\nsteps:\n  - sleep: 5 s\n  - wait: 15\n"
LOOSE = "formiga:   1\ntask: Example   # odd: 3 %, a,b\nsteps:\n- wait:   5 s\n"


@pytest.fixture(autouse=True)
def somewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_text(BAD, encoding="utf-8")
    Path("loose.yaml").write_text(LOOSE, encoding="utf-8")


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = run(words)
    out, err = capsys.readouterr()
    return code, out, err


def test_sarif_has_rules_places_and_fixes(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = said(capsys, "check", "--sarif", "bad.yaml")
    log: Any = json.loads(out)
    (work,) = log["runs"]
    first, second = work["results"]

    assert code == 1
    assert log["version"] == "2.1.0"
    assert [rule["id"] for rule in work["tool"]["driver"]["rules"]] == ["E006", "E017"]
    assert work["tool"]["driver"]["rules"][second["ruleIndex"]]["shortDescription"]["text"].startswith("a unit")
    place = first["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "bad.yaml"}
    assert place["region"] == {"startLine": 4, "startColumn": 5, "endLine": 4, "endColumn": 10}
    (change,) = first["fixes"][0]["artifactChanges"]
    assert change["replacements"][0]["insertedContent"] == {"text": "wait"}
    assert "fixes" not in second


def test_github_gets_one_line_for_each_problem(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    Path("a,b%.yaml").write_text(BAD, encoding="utf-8")
    code, out, _ = said(capsys, "check", "--github", "a,b%.yaml")

    assert code == 1
    wording(out.splitlines())


@pytest.mark.parametrize("form", ["--json", "--sarif", "--github"])
def test_the_exit_code_does_not_depend_on_the_form(form: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("good.yaml").write_text("formiga: 1\ntask: Example\nsteps:\n  - wait: 5 s\n", encoding="utf-8")

    assert said(capsys, "check", form, "good.yaml")[0] == 0
    assert said(capsys, "check", form, "bad.yaml")[0] == 1
    assert said(capsys, "check", form, "gone.yaml")[0] == 2


def test_two_forms_at_once_are_refused(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    code, text = said(capsys, "check", "--json", "--sarif", "bad.yaml")[::2]
    assert code == 2
    wording(text)


def test_a_plain_check_does_without_the_command_line_library() -> None:
    import subprocess

    code = (
        "import sys; from formiga_bt.cli.app import run; code = run(['check', 'bad.yaml', '--strict'])\n"
        "assert code == 1 and 'typer' not in sys.modules and 'pydantic' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL).returncode == 0


def test_fmt_writes_the_canonical_layout_and_keeps_the_comment(
    capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    code, text = said(capsys, "fmt", "loose.yaml")[:2]
    assert code == 0
    wording(text)
    assert Path("loose.yaml").read_text() == "formiga: 1\ntask: Example   # odd: 3 %, a,b\nsteps:\n  - wait: 5 s\n"
    code, text = said(capsys, "fmt", "--check", "loose.yaml")[:2]
    assert code == 0
    wording(text)


@pytest.mark.parametrize("option", ["--check", "--diff"])
def test_fmt_only_looks_if_asked_to(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = said(capsys, "fmt", option, "loose.yaml")

    assert code == 1
    assert ("+formiga: 1\n" in out) == (option == "--diff")
    assert Path("loose.yaml").read_text() == LOOSE


def test_fmt_refuses_what_it_cannot_parse_and_does_the_rest(capsys: pytest.CaptureFixture[str]) -> None:
    Path("torn.yaml").write_text("formiga: 1\ntask: [\n", encoding="utf-8")
    code, out, err = said(capsys, "fmt", ".")

    assert code == 1
    assert "torn.yaml:" in err
    assert "changed loose.yaml" in out
    assert Path("torn.yaml").read_text() == "formiga: 1\ntask: [\n"


def test_fix_shows_the_change_and_writes_only_if_told(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    code, out, _ = said(capsys, "fix", "--diff", "bad.yaml")
    assert code == 1
    wording(out)
    assert Path("bad.yaml").read_text() == BAD

    code, out, _ = said(capsys, "fix", "--write", "bad.yaml")
    assert code == 0
    assert Path("bad.yaml").read_text() == BAD.replace("sleep", "wait")
    wording(out)


def test_fix_without_a_terminal_asks_for_a_word(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    code, _, err = said(capsys, "fix", "bad.yaml")

    assert code == 2
    wording(err)
    assert Path("bad.yaml").read_text() == BAD


def test_a_rewritten_file_keeps_its_mode() -> None:
    path = Path("loose.yaml")
    path.chmod(0o640)
    rewrite(path, "new\n")

    assert path.stat().st_mode & 0o777 == 0o640
    assert [p.name for p in Path().iterdir() if p.name.endswith(".new")] == []


def test_explain_prints_the_page(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    code, out, _ = said(capsys, "explain", "e031")

    assert code == 0
    assert out.startswith("E031: the task")
    page, _, said_of = out.partition("Messages of E031")
    wording(page)
    assert len(messages()["E031"]) > 5
    assert all(one.text in said_of and one.helps in said_of for one in messages()["E031"])


def test_explain_knows_reasons_and_lists_everything(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    wording(said(capsys, "explain", "no_agent")[1])
    listed = said(capsys, "explain", "--list")[1]
    assert "envelope.reserve" in listed
    wording(having(listed, "E001"))
    code, _, err = said(capsys, "explain", "no_agnt")
    assert code == 2
    wording(err)


def test_schemas_are_printed_with_the_actions_of_the_catalogue(capsys: pytest.CaptureFixture[str]) -> None:
    Path("crane.yaml").write_text(
        "types: {crane: {extends: drone, actions: [Lift]}}\nactions: {Lift: {}}\n", encoding="utf-8"
    )
    editor = json.loads(said(capsys, "schema", "--editor", "--actions", "crane.yaml")[1])
    model = json.loads(said(capsys, "schema", "--llm", "--actions", "crane.yaml")[1])

    assert "crane.Lift" in editor["definitions"]["step"]["properties"]["do"]["examples"]
    assert "do_Lift" in model["$defs"]
    assert said(capsys, "schema")[0] == 2
