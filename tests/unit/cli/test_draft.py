"""`formiga draft` at a terminal."""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest

from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.cli.app import run
from formiga_bt.cli.printing import user
from formiga_bt.client import Client
from formiga_bt.show.facts import TaskLoaded, TaskRequested
from tests.golden import Wording, timeless
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

LOOK = "A light drone looks at the camp from 40 m for 30 seconds and comes home."
REAL = "pilots: [{id: ada, max_airborne: 3}]\n"
GOOD = tree(fly_to("camp"), {"wait": "30 s"}, home(), task="LookAtCamp")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def answers(monkeypatch: pytest.MonkeyPatch, *given: Any) -> Scripted:
    chat = Scripted(*given)
    monkeypatch.setattr("formiga_bt.llm.client.open_chat", lambda *_args, **_options: chat)
    return chat


def test_a_person_reads_what_it_would_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    answers(monkeypatch, GOOD)
    code = run(["draft", LOOK])
    said = capsys.readouterr().out

    assert code == 0
    wording(timeless(said))
    kept = here / ".formiga" / "rovaniemi" / "drafts" / "1"
    assert sorted(path.name for path in kept.iterdir()) == ["draft.json", "origin.json", "task.yaml"]
    origin = json.loads((kept / "origin.json").read_text())
    assert (origin["request"], origin["model"], origin["rounds"], origin["approved_by"]) == (LOOK, "none", 1, "")
    assert len(origin["prompt_sha256"]) == 64


def test_the_file_is_written_and_checks(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    answers(monkeypatch, GOOD)

    assert run(["draft", LOOK, "-o", "look.yaml"]) == 0
    assert run(["check", "look.yaml", "--strict", "--site", "demo"]) == 0
    assert run(["fmt", "--check", "look.yaml"]) == 0
    assert run(["draft", LOOK, "-o", "look.yaml"]) == 2


def test_pictures_of_the_dry_run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    answers(monkeypatch, GOOD)

    assert run(["draft", LOOK, "--map", "--gantt"]) == 0
    said = capsys.readouterr().out
    assert "rovaniemi: LookAtCamp" in said
    assert "lwd_3" in said


def test_json_for_programs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    answers(monkeypatch, tree(fly_to("xanadu")), GOOD)

    assert run(["draft", LOOK, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["kind"], told["task"], len(told["rounds"]), told["flight"]["status"]) == (
        "task", "LookAtCamp", 2, "SUCCEEDED",
    )  # fmt: skip
    assert told["values"][0] == {"name": "camp", "text": "camp", "words": "camp", "assumed": False}
    assert told["tokens"] == {"prompt": 2000, "completion": 200}


@pytest.mark.parametrize(
    "answer",
    [
        {"plan": "", "answer": {"question": "Where?"}},
        {"plan": "", "answer": {"impossible": "No drone paints.", "instead": ""}},
        tree(fly_to("xanadu")),
    ],
)
def test_what_is_no_task_exits_with_1(
    answer: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    answers(monkeypatch, answer)

    assert run(["draft", LOOK, "-o", "x.yaml"]) == 1
    wording(timeless(capsys.readouterr().out))
    assert not (here / "x.yaml").exists()


def test_a_follow_up_goes_on_with_the_newest_draft(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    chat = answers(monkeypatch, GOOD, tree(fly_to("camp", "60 m"), {"wait": "30 s"}, home(), task="LookAtCamp"))

    assert run(["draft", LOOK]) == 0
    assert run(["draft", "fly at 60 m", "--continue", "-o", "higher.yaml"]) == 0
    assert json.loads(chat.asked[1][2].text) == GOOD
    assert "default: 60 m" in (here / "higher.yaml").read_text()


@pytest.mark.parametrize(
    ("first", "then"),
    [("send a drone to have a look", "at the camp"), ("send 7 drones to the camp", "only one drone then")],
)
def test_a_follow_up_of_what_no_model_answered(
    first: str, then: str, monkeypatch: pytest.MonkeyPatch, here: Path
) -> None:
    answers(monkeypatch, tree(fly_to("camp"), home(), task="Look"))

    assert run(["draft", first]) == 1
    assert run(["draft", "--continue", then]) == 0
    origin = json.loads((here / ".formiga" / "rovaniemi" / "drafts" / "2" / "origin.json").read_text())
    assert origin["request"] == f"{first}\n{then}"


def test_a_follow_up_goes_on_with_what_a_person_wrote_into_the_draft(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    chat = answers(monkeypatch, GOOD)
    assert run(["draft", LOOK]) == 0
    file = here / ".formiga" / "rovaniemi" / "drafts" / "1" / "task.yaml"
    file.write_text(file.read_text().replace("default: 40 m", "default: 55 m"))

    assert run(["draft", "--continue", "wait for 20 s"]) in (0, 1)
    assert json.loads(chat.asked[1][2].text)["answer"]["tree"]["steps"][0]["height"] == "55 m"
    for each in here.glob(".formiga/*/drafts/*/task.yaml"):
        each.write_text("task: A\n")
    asked = len(chat.asked)
    capsys.readouterr()
    assert run(["draft", "--continue", "wait for 20 s"]) == 2
    wording(capsys.readouterr().err)
    assert len(chat.asked) == asked


@pytest.mark.parametrize(
    ("out", "options", "said"),
    [
        ("there.yaml", [], "there.yaml exists; to replace it say --force"),
        ("folder", ["--force"], "cannot write folder: it is a folder"),
        ("nowhere/x.yaml", [], "cannot write nowhere/x.yaml: there is no folder nowhere"),
    ],
)
def test_a_file_that_cannot_be_written_is_told_before_a_model_is_asked(
    out: str,
    options: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    here: Path,
) -> None:
    chat = answers(monkeypatch, GOOD)
    (here / "there.yaml").write_text("x")
    (here / "folder").mkdir()

    assert run(["draft", LOOK, "-o", out, *options]) == 2
    assert capsys.readouterr().err == f"formiga: {said}\n"
    assert chat.asked == []


def test_without_a_draft_there_is_nothing_to_go_on_with(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    answers(monkeypatch, GOOD)

    assert run(["draft", "higher", "--continue"]) == 2
    wording(capsys.readouterr().err)


def test_a_file_is_edited_in_words(monkeypatch: pytest.MonkeyPatch, here: Path) -> None:
    answers(monkeypatch, GOOD)
    assert run(["draft", LOOK, "-o", "look.yaml"]) == 0
    chat = answers(monkeypatch, tree(fly_to("camp", "25 m"), home(), task="LookAtCamp"))

    assert run(["draft", "fly at 25 m", "--edit", "look.yaml"]) == 0
    shown = json.loads(chat.asked[0][2].text)
    assert shown["answer"]["tree"]["steps"] == GOOD["answer"]["tree"]["steps"]


def test_nobody_is_asked_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    chat = answers(monkeypatch, GOOD)

    assert run(["draft", LOOK, "--run"]) == 2
    wording(capsys.readouterr().err)
    assert chat.asked == []


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("formiga_bt.cli.author.draft._is_terminal", lambda: True)


@pytest.mark.usefixtures("terminal")
def test_only_the_name_of_the_task_starts_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path
) -> None:
    answers(monkeypatch, GOOD)
    monkeypatch.setattr("typer.prompt", lambda *_args, **_options: "yes")

    assert run(["draft", LOOK, "--run"]) == 1
    assert capsys.readouterr().out.endswith("not started\n")
    assert not (here / "trees").exists()


@pytest.mark.usefixtures("terminal")
@pytest.mark.parametrize("what", ["folder", "bytes", "file"])
def test_whatever_stands_where_the_task_is_kept_the_draft_is_named(
    what: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    answers(monkeypatch, GOOD)
    monkeypatch.setattr("typer.prompt", lambda *_args, **_options: "LookAtCamp")
    if what == "file":
        (here / "trees").write_text("")
    else:
        (here / "trees").mkdir()
        file = here / "trees" / "look_at_camp.yaml"
        file.write_bytes(b"\xff") if what == "bytes" else file.mkdir()

    assert run(["draft", LOOK, "--run"]) == 2
    wording(capsys.readouterr().err)


@pytest.mark.usefixtures("terminal")
def test_a_real_site_wants_its_approver(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    from formiga_bt.base.packaged import folder

    text = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8")
    (here / "site.yaml").write_text(text.replace("mode: simulation", "mode: real") + REAL, encoding="utf-8")
    answers(monkeypatch, GOOD)

    assert run(["draft", LOOK, "--run"]) == 1
    told = capsys.readouterr()
    wording(timeless(told.out), told.err)
    assert (here / "trees" / "look_at_camp.yaml").exists()


@pytest.mark.usefixtures("terminal")
def test_the_engine_reads_the_file_and_starts_just_that(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], here: Path, wording: Wording
) -> None:
    answers(monkeypatch, GOOD)
    monkeypatch.setattr("typer.prompt", lambda *_args, **_options: "LookAtCamp")
    posted: list[Any] = []

    class Engine(Client):
        def send(self, path: str, body: Any = None, *, key: str = "", headers: Any = None) -> bytes:
            posted.append((path, body, bool(key)))
            if path == "/v1/tasks":
                return msgspec.json.encode(TaskRequested("LookAtCamp-1"))
            said = TaskLoaded(
                task="LookAtCamp", bundle="ab" * 32, version=1, what="new", text="LookAtCamp is served now", warnings=()
            )
            return msgspec.json.encode(said)

    address = EngineAddress("rovaniemi", 1, 1, "", "", folder=str(here / ".formiga" / "rovaniemi"))
    monkeypatch.setattr("formiga_bt.client.connect", lambda *_args: Engine(address))

    assert run(["draft", LOOK, "--run", "--by", "eve"]) == 0
    file = here / "trees" / "look_at_camp.yaml"
    (loaded, asked) = posted
    assert loaded[1] == {
        "file": "trees/look_at_camp.yaml",
        "texts": {"trees/look_at_camp.yaml": file.read_text()},
        "by": "eve",
        "drafted": {"by": ["eve"], "model": "scripted none", "also": [user()]},
    }
    assert asked[1:] == (
        {
            "task": "LookAtCamp",
            "params": {},
            "priority": None,
            "by": "eve",
            "bundle": "ab" * 32,
            "wait_s": None,
            "expires_s": None,
        },
        True,
    )
    assert run(["draft", LOOK, "--run", "--by", "eve"]) == 0  # the file is there as it is
    origin = json.loads((here / ".formiga" / "rovaniemi" / "drafts" / "2" / "origin.json").read_text())
    assert (origin["by"], origin["approved_by"], origin["bundle"]) == ("eve", "eve", "ab" * 32)
    file.write_text("# another\n", encoding="utf-8")
    assert run(["draft", LOOK, "--run", "--by", "eve"]) == 2
    wording(capsys.readouterr().err)
