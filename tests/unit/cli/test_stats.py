"""`formiga stats` as it is typed, over facts made by hand."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run as main
from formiga_bt.show.facts import Spread, Stats
from tests.golden import Wording

PICK_UP = Spread(name="PickUp", n=2, least_s=10, q1_s=12, median_s=15, q3_s=18, most_s=20)


class Engine:
    """Answers what it is asked for, and remembers it."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, float]] = []

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        self.asked.append((task, hours))
        return Stats(since=0, at=60_000_000, tasks=(PICK_UP,) if task in ("", "PickUp") else ())


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Engine:
    engine = Engine()
    monkeypatch.setattr("formiga_bt.cli.options.connect_source", lambda *_: engine)
    monkeypatch.chdir(tmp_path)
    return engine


def test_the_tables(engine: Engine, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert main(["stats", "PickUp", "--hours", "8", "--ascii", "--width", "70"]) == 0
    assert engine.asked == [("PickUp", 8.0)]
    wording(capsys.readouterr().out.splitlines())


def test_json_and_csv(engine: Engine, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["stats", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tasks"][0]["median_s"] == 15

    assert main(["stats", "-o", "day.csv"]) == 0
    assert capsys.readouterr() == ("", "written: day.csv\n")
    assert (tmp_path / "day.csv").read_text().splitlines()[1] == "tasks,PickUp,,2,0,10,12,15,18,20"


def test_an_unknown_name_is_told_with_those_that_ran(
    engine: Engine, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert main(["stats", "Pickup"]) == 1
    wording(capsys.readouterr().err)


def test_another_ending_is_refused_before_the_engine_is_asked(
    engine: Engine, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert main(["stats", "-o", "day.xlsx"]) == 2
    assert engine.asked == []
    wording(capsys.readouterr().err)
