"""`formiga load` and `formiga run FILE`: what is sent of a file, what is said, and what is not sent. The engine is of paper."""

import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.cli import loading
from formiga_bt.cli.app import run
from formiga_bt.cli.loading import is_file_word
from formiga_bt.client import ApiError
from formiga_bt.services.http import door
from tests.golden import Wording
from tests.unit.cli.paper import PaperClient

Capture = pytest.CaptureFixture[str]
LOOK = """\
formiga: 1
task: Look
imports: [lib/flying.yaml, lib/own.yaml]
agents: {drone: {type: lwd}}
steps:
  - call: Up
    with: {drone: "${drone}"}
  - call: GoHome
    with: {drone: "${drone}"}
"""
OWN = """\
formiga: 1
imports: [lib/flying.yaml]
subtrees:
  Up:
    params: {drone: {type: agent, of: [lwd]}}
    steps:
      - call: FlyTo
        with: {drone: "${drone}", to: "${drone.home}", height: 30 m}
"""
ASKS = "formiga: 1\ntask: Asks\nsteps: [{request: Look}, {request: Circle}]\n"


REQUEST = {
    "task": "Look", "params": {}, "priority": None, "by": "eve", "bundle": "", "wait_s": None, "expires_s": None,
}  # fmt: skip


class Paper(PaperClient):
    """A client that keeps what is sent."""

    def __init__(self, folder: Path, what: str = "new") -> None:
        super().__init__()
        self.address = EngineAddress("field", 1, 1, "", "", folder=str(folder / ".formiga" / "field"))
        self.sent: list[tuple[str, Any]] = []
        self.what = what
        self.refusal: ApiError | None = None
        self.refused: dict[str, ApiError] = {}
        """Of the files that an engine does not take."""

    def take(self, path: str, body: Any) -> Any:
        self.sent.append((path, body))
        if path == "/v1/tasks":
            if self.refusal is not None:
                raise self.refusal
            return {"id": "Look-1"}
        if body["file"] in self.refused:
            raise self.refused[body["file"]]
        name = Path(body["file"]).stem.title()
        return {
            "task": name,
            "bundle": "ab",
            "version": 2,
            "what": self.what,
            "text": f"{name} it is",
            "warnings": ["W1"],
        }


@pytest.fixture
def paper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Paper:
    monkeypatch.chdir(tmp_path)
    for name, text in (("look", LOOK), ("asks", ASKS), ("lib/own", OWN)):
        file = tmp_path / "trees" / f"{name}.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    made = Paper(tmp_path)
    monkeypatch.setattr("formiga_bt.cli.operator.load.connect", lambda *_args: made)
    monkeypatch.setattr("formiga_bt.cli.operator.run.connect", lambda *_args: made)
    return made


def test_a_file_is_sent_with_its_imports_but_not_with_what_ships(
    paper: Paper, capsys: Capture, wording: Wording
) -> None:
    assert run(["load", "trees/look.yaml", "--by", "eve"]) == 0

    texts = {"trees/look.yaml": LOOK, "trees/lib/own.yaml": OWN}
    assert paper.sent == [("/v1/library", {"file": "trees/look.yaml", "texts": texts, "by": "eve"})]
    told = capsys.readouterr()
    assert told.out == ""
    wording(told.err)


def test_the_sites_own_tasks_that_it_requests_go_first(paper: Paper) -> None:
    assert run(["load", "trees/asks.yaml"]) == 0
    assert [body["file"] for _, body in paper.sent] == ["trees/look.yaml", "trees/asks.yaml"]


def test_a_folder_means_its_tasks(paper: Paper, capsys: Capture) -> None:
    paper.what = "same"
    assert run(["load", "trees", "--json"]) == 0
    assert [one["task"] for one in json.loads(capsys.readouterr().out)] == ["Asks", "Look"]
    assert "trees/lib/own.yaml" not in [body["file"] for _, body in paper.sent]


@pytest.mark.parametrize("as_json", [False, True])
def test_one_that_is_refused_keeps_no_other_from_being_read(
    paper: Paper, capsys: Capture, as_json: bool, wording: Wording
) -> None:
    paper.refused["trees/look.yaml"] = ApiError("bad_task", "trees/look.yaml:2:1: E001: no", status=400)
    for name in ("a_first", "z_last"):
        Path(f"trees/{name}.yaml").write_text("formiga: 1\ntask: It\nsteps: [{wait: 1 s}]\n", encoding="utf-8")

    assert run(["load", "trees", *(["--json"] if as_json else [])]) == 1

    told = capsys.readouterr()
    bad = "formiga: trees/look.yaml:2:1: E001: no\n\n"
    assert told.err.count(bad) == 2  # of the task that requests it, too
    assert [body["file"] for _, body in paper.sent][0::3] == ["trees/a_first.yaml", "trees/z_last.yaml"]
    if as_json:
        first, asks, look, last = json.loads(told.out)
        assert (first["what"], last["what"]) == ("new", "new")
        assert asks == {"file": "trees/asks.yaml", "what": "refused", "code": "bad_task", "text": bad[9:-2]}
        assert look == {**asks, "file": "trees/look.yaml"}
    else:
        wording(told.err)


def test_what_says_nothing_of_a_file_ends_it_at_once(paper: Paper, capsys: Capture, wording: Wording) -> None:
    paper.refused["trees/look.yaml"] = ApiError("unauthorized", "it wants a token", status=401)
    assert run(["load", "trees"]) == 1
    assert len(paper.sent) == 1
    wording(capsys.readouterr().err)


def test_one_that_is_too_large_is_named(paper: Paper, capsys: Capture, wording: Wording) -> None:
    paper.refused["trees/look.yaml"] = ApiError("too_large", "the body is larger than 1,000,000 bytes", status=413)
    assert run(["load", "trees/look.yaml"]) == 1
    wording(capsys.readouterr().err)


def test_the_bound_that_is_told_is_that_of_the_engine() -> None:
    assert loading.BODY_LIMIT == door.BODY_LIMIT


def test_a_served_file_is_said_to_be_so(paper: Paper, capsys: Capture, wording: Wording) -> None:
    paper.what = "same"
    assert run(["load", "trees/look.yaml"]) == 0
    wording(capsys.readouterr().err)


def test_run_reads_the_file_and_requests_just_that_version(paper: Paper, capsys: Capture) -> None:
    assert run(["run", "trees/look.yaml", "-p", "n=1", "--by", "eve"]) == 0
    assert capsys.readouterr().out == "Look-1\n"
    body = {**REQUEST, "params": {"n": "1"}, "bundle": "ab"}
    assert paper.sent[1:] == [("/v1/tasks", body)]


def test_run_of_a_name_sends_no_file(paper: Paper) -> None:
    assert run(["run", "Look", "--by", "eve"]) == 0
    assert paper.sent == [("/v1/tasks", REQUEST)]


def test_one_that_is_not_approved_tells_how_to_approve_the_file(
    paper: Paper, capsys: Capture, wording: Wording
) -> None:
    paper.refusal = ApiError("not_approved", "Look is not approved as it is now", status=403)
    assert run(["run", "trees/look.yaml"]) == 1
    wording(capsys.readouterr().err)


@pytest.mark.parametrize("where", ["../look.yaml", ".hidden/look.yaml"])
def test_only_files_of_the_sites_folder_are_sent(
    paper: Paper, capsys: Capture, tmp_path: Path, where: str, wording: Wording
) -> None:
    paper.address = EngineAddress("field", 1, 1, "", "", folder=str(tmp_path / "site" / ".formiga" / "field"))
    file = tmp_path / "site" / where
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(LOOK.replace(", lib/own.yaml", "").replace("Up", "GoHome"), encoding="utf-8")
    assert run(["load", str(file)]) == 2
    said = capsys.readouterr().err
    wording(said)
    assert f"help: cp {file.resolve()}" in said
    assert paper.sent == []


def test_a_file_with_errors_is_sent_and_the_engine_judges(paper: Paper, tmp_path: Path) -> None:
    (tmp_path / "trees" / "bad.yaml").write_text("formiga: 1\ntask: Bad\nsteps: [{do: nobody.Flies}]\n")
    assert run(["load", "trees/bad.yaml"]) == 0
    assert paper.sent[0][1]["file"] == "trees/bad.yaml"


def test_a_file_that_is_not_there(paper: Paper, capsys: Capture, wording: Wording) -> None:
    assert run(["run", "trees/none.yaml"]) == 2
    wording(capsys.readouterr().err)


def test_which_words_are_files() -> None:
    assert [is_file_word(word) for word in ("look.yaml", "trees/look", "Look", "PickUp.yml")] == [
        True,
        True,
        False,
        True,
    ]
