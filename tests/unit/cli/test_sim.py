"""`formiga sim`: a scenario in virtual time, and what is said when it cannot be played. Processes are in tests/e2e."""

import json
import time
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli import sim_live
from formiga_bt.cli.app import run
from formiga_bt.errors import FormigaError
from formiga_bt.lang.scenario import ScenarioOrder

Capture = pytest.CaptureFixture[str]


def test_all_five_missions_succeed_in_virtual_time(capsys: Capture) -> None:
    assert run(["sim", "demo", "--virtual", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [(task["task"], task["status"]) for task in report["tasks"]] == [
        ("MoveTask-1", "SUCCEEDED"),
        ("ExploreRegion-2", "SUCCEEDED"),
        ("PickUp-3", "SUCCEEDED"),
        ("WatchDogSOS-4", "SUCCEEDED"),
        ("WatchDogRequest-5", "SUCCEEDED"),
    ]
    assert (report["crashes"], report["unsafe_starts"], report["low_flights"], report["refused"]) == (0, 0, 0, [])
    finder = [row["state"] for row in report["actions"] if row["action"] == "MiniFinder"]
    assert len(finder) > 1  # the picker was lost: the first answer was not the last
    assert set(finder) == {"succeeded"}


def test_faults_and_failures_are_told_and_the_exit_code_says_no(capsys: Capture) -> None:
    assert run(["sim", "one-killed", "--virtual"]) == 1
    text = capsys.readouterr().out
    assert "35.0 s  fault: hwd_1: kill\n" in text
    assert "FAILED: agent_lost" in text
    assert "crashes: 0, starts near people without clearance: 0" in text


def test_orders_and_what_happened_are_told(capsys: Capture) -> None:
    assert run(["sim", "bad-day", "--virtual"]) == 1
    text = capsys.readouterr().out
    assert "60.0 s  order: watcher_1: handback hwd_1 continue\n" in text
    assert "50.0 s  fault: lwd_1: link_loss\n" in text
    assert "what happened at  who" in text
    assert "pressed lockdown (return)" in text
    assert "crashes: 0, starts near people without clearance: 0, low flights: 0" in text


class Api:
    """Takes what would go to the engine's API."""

    def __init__(self, refuses: str = "") -> None:
        self.posted: list[tuple[str, dict[str, Any]]] = []
        self.refuses = refuses

    def get(self, path: str, **query: str) -> dict[str, Any]:
        assert (path, query) == ("/v1/tasks", {"status": "open"})
        return {"tasks": [{"id": "PickUp-9", "task": "PickUp"}, {"id": "PickUp-2", "task": "PickUp"}]}

    def post(self, path: str, body: dict[str, Any]) -> dict[str, Any]:
        if self.refuses:
            raise FormigaError(self.refuses)
        self.posted.append((path, body))
        return {}


@pytest.mark.parametrize(
    ("order", "path", "body"),
    [
        (ScenarioOrder(0, "hold", "hwd_1", "agent", by="ann"), "/v1/agents/hwd_1/orders", {"order": "hold"}),
        (ScenarioOrder(0, "cut", "hwd_1", "agent", by="ann"), "/v1/agents/hwd_1/orders",
         {"order": "cut", "confirmed": "hwd_1"}),
        (ScenarioOrder(0, "continue", "PickUp", "task", by="ann"), "/v1/tasks/PickUp-9/orders", {"order": "continue"}),
        (ScenarioOrder(0, "land", by="ann"), "/v1/orders", {"order": "land"}),
        (ScenarioOrder(0, "handback", "hwd_1", "agent", "end", "ann"), "/v1/agents/hwd_1/handback", {"how": "end"}),
        (ScenarioOrder(0, "clear", "hwd_1", "agent", by="ann"), "/v1/agents/hwd_1/clear", {}),
        (ScenarioOrder(0, "lockdown", "", "site", "hold", "ann"), "/v1/lockdown", {"how": "hold"}),
        (ScenarioOrder(0, "abort", "PickUp", "task", "now", "ann"), "/v1/tasks/PickUp-9/abort",
         {"how": "now", "confirmed": False}),
    ],
)  # fmt: skip
def test_an_order_beside_a_running_engine_goes_to_its_api(
    order: ScenarioOrder, path: str, body: dict[str, Any]
) -> None:
    api = Api()
    assert sim_live.give(api, order) == ""  # type: ignore[arg-type]
    assert api.posted == [(path, {**body, "by": "ann"})]


def test_an_order_beside_a_running_engine_may_be_refused() -> None:
    order = ScenarioOrder(0, "hold", "hwd_1", "agent")
    assert sim_live.give(Api("agent_lost\n  hwd_1 is lost"), order) == ": refused, agent_lost hwd_1 is lost"  # type: ignore[arg-type]
    assert sim_live.give(Api(), ScenarioOrder(0, "hold", "Gone", "task")) == ": refused, no task 'Gone' is open"  # type: ignore[arg-type]
    assert sim_live.give(None, order) == " is due: no API of this engine is known here, give it yourself"


def test_a_speed_lets_people_watch(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "short.yaml"
    file.write_text(
        "scenario: short\nsite: demo-site.yaml\nagents: [{id: lwd_1}, {id: watcher_1, at: camp}]\n"
        "tasks: [{task: MoveTask, params: {robot: lwd_1}}]\n"
    )
    began = time.monotonic()
    assert run(["sim", str(file), "--virtual", "--speed", "200"]) == 0
    assert 0.2 < time.monotonic() - began < 5.0  # a minute of engine time
    assert "MoveTask-1  lwd_1" in capsys.readouterr().out


def test_a_scenario_with_errors_is_told_with_all_of_them(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(
        "scenario: bad\nsite: demo-site.yaml\nagents: [{id: hwd_1, at: p55}]\nfaults: [{at: 3, agent: hwd_1}]\n"
    )
    assert run(["sim", str(file), "--virtual"]) == 1
    said = capsys.readouterr().err
    assert "bad.yaml:3:26: E010: no port or place is called 'p55'; did you mean 'p5'?" in said
    assert "E017: 'at' needs a unit: 3 s?" in said
    assert "needs 'kind'" in said
    assert "cannot be played" in said


def test_what_is_not_there_is_named(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(["sim", "demmo", "--virtual"]) == 2
    assert "no scenario is called 'demmo'; did you mean 'demo'?" in capsys.readouterr().err
    assert run(["sim", "none.yaml", "--virtual"]) == 2
    assert "cannot read none.yaml" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert run(["sim", "demo"]) == 1
    assert "no engine runs" in capsys.readouterr().err
