"""`formiga sim`: a scenario in virtual time, and what is said when it cannot be played. Processes are in tests/e2e."""

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import FormigaError, SiteError
from formiga_bt.cli.app import run
from formiga_bt.cli.integrator import sim_live
from formiga_bt.cli.integrator.sim_fleet import SILENT_S, Heard
from formiga_bt.client import NoEngine, UnknownId
from formiga_bt.lang.scenario import ScenarioOrder, ScenarioTask
from formiga_bt.services.simulated import _take, check_unsimulated
from formiga_bt.show.facts import OrderReply, TaskDetail, TaskFact, TaskList, TaskRequested
from formiga_bt.transport.messages import ClockBeat
from tests.golden import Wording, having
from tests.unit.cli.paper import PaperClient, reply, tasks

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


def test_faults_and_failures_are_told_and_the_exit_code_says_no(capsys: Capture, wording: Wording) -> None:
    assert run(["sim", "one-killed", "--virtual"]) == 1
    text = capsys.readouterr().out
    assert "FAILED: agent_lost" in text
    wording(having(text, "fault:", "crashes:"))


def test_orders_and_what_happened_are_told(capsys: Capture, wording: Wording) -> None:
    assert run(["sim", "bad-day", "--virtual"]) == 1
    text = capsys.readouterr().out
    assert "pressed lockdown (return)" in text
    wording(having(text, " order: ", " fault: ", "what happened at", "crashes:"))


class Api(PaperClient):
    """Takes what would go to the engine's API."""

    def __init__(self, refuses: str = "") -> None:
        super().__init__()
        self.posted: list[tuple[str, dict[str, Any]]] = []
        self.refuses = refuses

    def look(self, path: str, query: Mapping[str, Any]) -> TaskList:
        assert (path, query) == ("/v1/tasks", {"status": "open", "limit": 10_000})
        return tasks(*(TaskFact(id=f"PickUp-{n}", name="PickUp", status="ACTIVE") for n in (2, 9)))

    def take(self, path: str, body: dict[str, Any]) -> OrderReply:
        if self.refuses:
            raise FormigaError(self.refuses)
        self.posted.append((path, body))
        return reply()


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
        (ScenarioOrder(0, "removed", "hwd_1", "agent", by="ann"), "/v1/agents/hwd_1/removed", {"confirmed": "hwd_1"}),
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


def test_an_order_beside_a_running_engine_may_be_refused(wording: Wording) -> None:
    order = ScenarioOrder(0, "hold", "hwd_1", "agent")
    wording(sim_live.give(Api("agent_lost\n  hwd_1 is lost"), order))  # type: ignore[arg-type]
    wording(sim_live.give(Api(), ScenarioOrder(0, "hold", "Gone", "task")))  # type: ignore[arg-type]
    wording(sim_live.give(None, order))


def detail(task: TaskFact) -> TaskDetail:
    return TaskDetail(
        at=0, task=task, bundle="", run=1, outcome="", roles={}, granted=(), active_at=None, failure=None, notes=(),
        running=(), goals=(), questions=(), actions=(), lines=(),
    )  # fmt: skip


class Dying(PaperClient):
    """An API of engines that die: at each call named by `dies` one does, before or after it did as it was told."""

    def __init__(self, *dies: str) -> None:
        super().__init__()
        self.dies = list(dies)
        self.known = [TaskFact(id="Hover-1", name="Hover", by="scenario", status="FAILED")]
        self.orders: list[str] = []

    def call(self, what: str, do: Callable[[], Any]) -> Any:
        dies = self.dies[0] if self.dies else ""
        if dies == f"before {what}":
            del self.dies[0]
            raise NoEngine("gone")
        done = do()
        if dies == f"after {what}":
            del self.dies[0]
            raise NoEngine("gone")
        return done

    def look(self, path: str, query: Mapping[str, Any]) -> Any:
        if path == "/v1/tasks":
            return self.call("list", lambda: tasks(*self.known[::-1]))
        return self.call("look", lambda: detail(next(task for task in self.known if task.id in path)))

    def take(self, path: str, body: dict[str, Any]) -> Any:
        if path == "/v1/orders":
            self.call("order", lambda: self.orders.append(body["order"]))
            return reply()
        made = TaskFact(id=f"{body['task']}-{len(self.known) + 1}", name=body["task"], by=body["by"], status="ACTIVE")
        self.call("post", lambda: self.known.append(made))
        return TaskRequested(made.id)


@pytest.mark.parametrize("dies", ["before list", "before post", "after post"])
def test_a_scenario_goes_on_with_the_next_engine_and_asks_once(dies: str, wording: Wording) -> None:
    engine, told = Dying(dies, "before list"), list[str]()
    api = sim_live.Api(lambda: engine, told.append, "tcp/here:1")  # type: ignore[arg-type, return-value]
    requests = sim_live.LiveRequests(api, told.append)
    requests.ask(ScenarioTask(0, "Hover", {}, "medium"))
    requests.ask(ScenarioOrder(0, "hold"))
    assert not requests.are_over
    assert engine.orders == []  # each in its turn
    requests.go_on()
    requests.go_on()
    assert [task.id for task in engine.known] == ["Hover-1", "Hover-2"]
    assert engine.orders == ["hold"]
    requests.look()
    engine.known[1] = replace(engine.known[1], status="SUCCEEDED")
    engine.dies = ["before look"]
    requests.look()
    assert not requests.are_over
    requests.look()
    assert requests.are_over
    wording(told)


def test_a_task_that_the_next_engine_does_not_know_has_failed(wording: Wording) -> None:
    class Forgetful(Dying):
        def look(self, path: str, query: Mapping[str, Any]) -> Any:
            if path == "/v1/tasks":
                return tasks()
            raise UnknownId("unknown_task", "there is no task 'Hover-2' (any more)")

    told = list[str]()
    api = sim_live.Api(Forgetful, told.append)  # type: ignore[arg-type]
    requests = sim_live.LiveRequests(api, told.append)
    requests.ask(ScenarioTask(0, "Hover", {}, "medium"))
    requests.look()
    assert requests.are_over
    wording(told[-1])


def test_engines_that_come_and_go_are_told_once_each(wording: Wording) -> None:
    heard = Heard()

    def beat(epoch: int, now: float) -> str:
        return heard.beat(ClockBeat(wall_us=0, engine_us=0, speed=5.0, epoch=epoch, beat=1), now)

    assert heard.look(100.0) == ""
    wording(beat(1, 0.0))
    assert (beat(1, 1.0), heard.look(1.0 + SILENT_S - 0.1)) == ("", "")
    wording(heard.look(1.0 + SILENT_S))
    assert heard.look(60.0) == ""
    wording(beat(2, 61.0), beat(3, 62.0))  # killed, and back within a moment


def test_a_fleet_says_what_it_cannot_do(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["sim"]) == 2
    wording(capsys.readouterr().err)
    assert run(["init"]) == 0
    assert run(["sim", "--virtual"]) == 2
    wording(capsys.readouterr().err)
    assert run(["sim", "demo", "--without", "hwd_1"]) == 2
    wording(capsys.readouterr().err)
    assert run(["sim", "--without", "hwd_9"]) == 2
    wording(capsys.readouterr().err)
    site = tmp_path / "site.yaml"
    text = site.read_text(encoding="utf-8")
    site.write_text(text.replace(":7447", ":0"), encoding="utf-8")
    assert run(["sim"]) == 2
    wording(capsys.readouterr().err)
    everybody = [
        word for agent in ("lwd_1", "lwd_2", "hwd_1", "picker_1", "watcher_1") for word in ("--without", agent)
    ]
    assert run(["sim", "--connect", "tcp/127.0.0.1:9", *everybody]) == 1
    wording(capsys.readouterr().err)


def test_the_agents_of_a_site_are_simulated_once(tmp_path: Path, wording: Wording) -> None:
    with _take(tmp_path / "meadow"), pytest.raises(SiteError) as refused:
        check_unsimulated(tmp_path / "meadow")
    wording(refused.value)
    check_unsimulated(tmp_path / "meadow")


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


def test_a_scenario_with_errors_is_told_with_all_of_them(tmp_path: Path, capsys: Capture, wording: Wording) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(
        "scenario: bad\nsite: demo-site.yaml\nagents: [{id: hwd_1, at: p55}]\nfaults: [{at: 3, agent: hwd_1}]\n"
    )
    assert run(["sim", str(file), "--virtual"]) == 1
    said = capsys.readouterr().err
    wording(said)
    assert "needs 'kind'" in said
    assert "cannot be played" in said


def test_what_is_not_there_is_named(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    assert run(["sim", "demmo", "--virtual"]) == 2
    wording(capsys.readouterr().err)
    assert run(["sim", "none.yaml", "--virtual"]) == 2
    assert "cannot read none.yaml" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert run(["sim", "demo"]) == 1
    assert "no engine runs" in capsys.readouterr().err
