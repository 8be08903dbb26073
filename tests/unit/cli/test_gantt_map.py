"""`formiga gantt`, `formiga map`, the pictures of `formiga dryrun`: what they ask for, where they write, what they refuse."""

from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.cli.app import run
from formiga_bt.show.facts import Chart, Timeline
from tests.golden import Wording, having
from tests.unit.show.flown import PICKUP, SITE


class Asked:
    """A source that notes what it is asked for."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, ...]] = []

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        self.calls.append(tuple(tasks))
        if "No-1" in tasks:
            raise TaskError("unknown_task", "there is no task No-1")
        return PICKUP

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        self.calls.append(tuple(tasks))
        return SITE


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    source = Asked()
    monkeypatch.setattr("formiga_bt.cli.operator.gantt.source_of", lambda *_: source)
    monkeypatch.setattr("formiga_bt.cli.operator.map.source_of", lambda *_: source)
    monkeypatch.setattr("formiga_bt.cli.picture_out.source_of", lambda *_: source)
    return source


@pytest.mark.parametrize("verb", ["gantt", "map"])
def test_tasks_or_all(verb: str, asked: Asked, capsys: pytest.CaptureFixture[str]) -> None:
    """Each id is asked for once; --all asks for all; neither, or both, is refused."""
    assert run([verb, "PickUp-1", "PickUp-1", "--ascii", "--width", "60"]) == 0
    assert run([verb, "--all"]) == 0
    assert asked.calls == [("PickUp-1",), ()]
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 100

    assert run([verb]) == 2
    assert f"formiga {verb} --all" in capsys.readouterr().err
    assert run([verb, "PickUp-1", "--all"]) == 2


@pytest.mark.parametrize("verb", ["gantt", "map"])
def test_files_by_their_endings(
    verb: str, asked: Asked, tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    """A file is what its ending says, and is replaced; an unknown ending or a missing folder is refused before asking."""
    out = tmp_path / "p.svg"
    out.write_text("old")

    assert run([verb, "PickUp-1", "-o", str(out)]) == 0
    assert out.read_text().startswith("<?xml")
    assert capsys.readouterr().err == f"written: {out}\n"
    asked.calls.clear()
    assert run([verb, "PickUp-1", "-o", str(tmp_path / "p.pdf")]) == 2
    wording(capsys.readouterr().err)
    assert run([verb, "PickUp-1", "-o", str(tmp_path / "no" / "p.svg")]) == 2
    wording(capsys.readouterr().err)
    assert asked.calls == []


def test_json_is_what_it_is_drawn_from(asked: Asked, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["gantt", "PickUp-1", "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out, type=Timeline) == PICKUP
    assert run(["map", "PickUp-1", "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out, type=Chart) == SITE


def test_an_unknown_task_and_a_wrong_duration(
    asked: Asked, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert run(["gantt", "No-1"]) == 1
    wording(capsys.readouterr().err)
    assert run(["gantt", "PickUp-1", "--from", "soon"]) == 2
    wording(capsys.readouterr().err)


def test_dryrun_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    """Both pictures of a dry run: the chart in the terminal, the map as a file with the people who were asked."""
    out = tmp_path / "map.txt"

    code = run(
        ["dryrun", "PickUp", "-p", "target=north_field", "-p", "user=picker_1", "--gantt", "-", "--map", str(out)]
    )

    shown = capsys.readouterr().out
    assert code == 0
    wording(having(shown, "SUCCEEDED after"))
    assert "picker_1" in out.read_text(encoding="utf-8")
    assert "heights 0 60 0 60 0 m" in out.read_text(encoding="utf-8")


def test_dryrun_finds_out_before_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert run(["dryrun", "MoveTask", "--map", str(tmp_path / "m.gif")]) == 2
    assert run(["dryrun", "MoveTask", "--gantt", "-", "--json"]) == 2
    wording(capsys.readouterr().err)
