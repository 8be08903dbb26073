"""`formiga show`: what its word means, formats and files, a running task, `--live`, and what it says of mistakes."""

import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.cli.app import run
from formiga_bt.cli.author.show_live import PERIOD_S, follow, window
from formiga_bt.cli.author.show_out import DrawingOptions
from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.client import NoEngine
from formiga_bt.show.facts import Now, StepFact, TaskFact, TaskPicture, Top
from formiga_bt.show.tree.drawing import drawing_of
from formiga_bt.show.tree.terminal import DrawnLine, LinePiece
from tests.golden import Wording, having

TEXT = """formiga: 1
task: Look
agents: {ann: {type: watcher}}
steps:
  - wait: 5 s
  - sequence:
      - notify: here
        to: [ann]
    name: Telling
  - wait: 6 s
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "look.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def picture(file: Path, *statuses: str, status: str = "ACTIVE", ended: int | None = None) -> TaskPicture:
    task = read_task(file, read_world()).task
    assert task is not None
    paths = ("steps/steps[0]", "steps/steps[1]", "steps/steps[1].sequence[0]", "steps/steps[2]")
    steps = tuple(StepFact(path=p, status=s) for p, s in zip(paths, statuses, strict=False))  # type: ignore[arg-type]
    fact = TaskFact(id="Look-7", name="Look", status=status, ended_at=ended, doing="" if ended else "waits 5 s")
    return TaskPicture(at=1, task=fact, drawing=drawing_of(task), steps=steps)


class Engine:
    """A source with one task."""

    def __init__(self, *pictures: TaskPicture) -> None:
        self.pictures = list(pictures)

    def task(self, task_id: str) -> TaskPicture:
        if task_id != "Look-7":
            raise TaskError("unknown_task", f"there is no task {task_id}")
        return self.pictures.pop(0) if len(self.pictures) > 1 else self.pictures[0]

    def now(self, **_: Any) -> Now:
        tasks = (self.pictures[0].task,)
        return Now(site="s", at=1, top=Top(), counts={}, tasks=tasks, total=1, agents=(), questions=())


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> Callable[[Engine | None], None]:
    def put(one: Engine | None) -> None:
        def connect_source(*_: Any) -> Engine:
            if one is None:
                raise NoEngine("no engine runs for /here, or a folder above it")
            return one

        monkeypatch.setattr("formiga_bt.cli.options.connect_source", connect_source)

    return put


def test_a_file_is_drawn_in_the_terminal(file: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["show", str(file), "--width", "60"]) == 0
    wording(capsys.readouterr().out.splitlines()[3:])


def test_a_name_means_a_task_that_ships(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["show", "Circle", "--depth", "1"]) == 0
    assert capsys.readouterr().out.startswith("Circle 1.0.0")


@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("t.txt", "Look  priority medium"),
        ("t.dot", "digraph Look {"),
        ("t.svg", "<svg xmlns="),
        ("t.mmd", '---\ntitle: "Look"'),
        ("t.HTML", "<!DOCTYPE html>"),
        ("t.json", '{\n  "formiga_tree": 1,'),
    ],
)
def test_the_ending_of_a_file_says_how_it_is_drawn(name: str, begins: str, file: Path, tmp_path: Path) -> None:
    assert run(["show", str(file), "-o", str(tmp_path / name)]) == 0
    assert (tmp_path / name).read_text(encoding="utf-8").startswith(begins)


def test_a_format_says_more_than_an_ending(file: Path, tmp_path: Path) -> None:
    assert run(["show", str(file), "--format", "json", "-o", str(tmp_path / "x.svg")]) == 0
    assert json.loads((tmp_path / "x.svg").read_text(encoding="utf-8"))["drawing"]["task"] == "Look"


def test_what_is_collapsed_is_counted(file: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["show", str(file), "--collapse", "Telling"]) == 0
    shown = capsys.readouterr().out
    wording(" ".join(line.split()) for line in having(shown, "Telling"))
    assert "notify" not in shown


@pytest.mark.parametrize(
    ("args", "code"),
    [
        (["FILE", "-o", "x.pdf"], 2),
        (["FILE", "-o", "/nowhere/x.dot"], 2),
        (["FILE", "--collapse", "Teling"], 1),
        (["FILE", "--live"], 2),
        (["nope.yaml"], 2),
        (["Circl"], 1),
        (["FILE", "--format", "gif"], 2),
    ],
)
def test_mistakes_are_told(
    args: Sequence[str], code: int, file: Path, engine: Any, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    engine(None)
    assert run(["show", *(str(file) if arg == "FILE" else arg for arg in args)]) == code
    wording(capsys.readouterr().err)


def test_a_task_of_an_engine_shows_how_its_steps_stand(
    file: Path, engine: Any, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    engine(Engine(picture(file, "success", "running", "failure")))
    assert run(["show", "Look-7", "--width", "50"]) == 0
    wording(capsys.readouterr().out.splitlines())


def test_an_id_that_nobody_knows_gets_those_that_are_near(
    file: Path, engine: Any, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    engine(Engine(picture(file)))
    assert run(["show", "Lok-7"]) == 1
    wording(capsys.readouterr().err)
    assert run(["show", "zzz"]) == 1
    wording(capsys.readouterr().err)


def test_the_page_of_a_running_task_has_the_source_if_the_file_here_says_the_same(
    file: Path, engine: Any, tmp_path: Path
) -> None:
    engine(Engine(picture(file)))
    assert run(["show", "Look-7", "-o", str(tmp_path / "a.html")]) == 0
    file.write_text(TEXT.replace("6 s", "7 s"), encoding="utf-8")
    assert run(["show", "Look-7", "-o", str(tmp_path / "b.html")]) == 0
    assert 'href="#f0-5"' in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "href" not in (tmp_path / "b.html").read_text(encoding="utf-8")


def canvas(**options: Any) -> DrawingOptions:
    given = {"form": "", "out": None, "depth": None, "collapse": (), "ascii_only": True, "width": 50, "colour": False}
    return DrawingOptions(**{**given, **options})


def followed(file: Path, in_place: bool) -> tuple[str, list[float]]:
    first = picture(file, "running")
    later = [first, replace(first, at=2), picture(file, "success", "running", "running")]
    pictures = [*later, picture(file, *["success"] * 4, status="SUCCEEDED", ended=9)]
    out, slept = io.StringIO(), []
    it = iter(pictures)
    follow(lambda: next(it), next(it), canvas(), out=out, in_place=in_place, sleep=slept.append)
    return out.getvalue(), slept


def test_live_prints_a_tree_at_each_change_until_the_end(file: Path, wording: Wording) -> None:
    text, slept = followed(file, in_place=False)
    wording([tree.splitlines()[0] for tree in text.split("\n\n")])
    assert slept == [PERIOD_S] * 3
    assert "\x1b" not in text


def test_live_draws_over_the_last_tree_on_a_terminal(file: Path) -> None:
    text, _ = followed(file, in_place=True)
    assert text.count("\x1b[6F\x1b[J") == 2
    assert text.count("SUCCEEDED") == 1


def test_live_writes_a_file_anew(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "t.mmd"
    ended = picture(file, *["success"] * 4, status="SUCCEEDED", ended=9)
    follow(lambda: ended, picture(file, "running"), canvas(out=out), out=io.StringIO(), sleep=lambda _: None)
    assert '"Look-7 SUCCEEDED"' in out.read_text(encoding="utf-8")


@pytest.mark.parametrize("running", [2, 12, 19])
def test_a_tree_longer_than_the_terminal_shows_where_it_runs(running: int, wording: Wording) -> None:
    lines = [DrawnLine((LinePiece(str(n), "running" if n == running else "plain"),)) for n in range(20)]
    wording([line.plain() for line in window(lines, 8)])
    assert window(lines, 20) == lines


@pytest.mark.parametrize(("env", "colour"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)])
def test_colours_are_for_terminals_that_want_them(
    env: dict[str, str], colour: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from formiga_bt.cli.author.show import coloured

    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    assert not coloured()
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert coloured() is colour
