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


def test_an_order_beside_a_running_engine_may_be_refused() -> None:
    order = ScenarioOrder(0, "hold", "hwd_1", "agent")
    assert sim_live.give(Api("agent_lost\n  hwd_1 is lost"), order) == ": refused, agent_lost hwd_1 is lost"  # type: ignore[arg-type]
    assert sim_live.give(Api(), ScenarioOrder(0, "hold", "Gone", "task")) == ": refused, no task 'Gone' is open"  # type: ignore[arg-type]
    assert sim_live.give(None, order) == " is due: no API of this engine is known here, give it yourself"


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
def test_a_scenario_goes_on_with_the_next_engine_and_asks_once(dies: str) -> None:
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
    assert told == [
        "no engine answers: the agents live on, and look for the next one at tcp/here:1",
        "an engine answers again",
        "Hover-2 requested",
        "order: operator: hold all",
        "Hover-2 ACTIVE",
        "no engine answers: the agents live on, and look for the next one at tcp/here:1",
        "an engine answers again",
        "Hover-2 SUCCEEDED",
    ]


def test_a_task_that_the_next_engine_does_not_know_has_failed() -> None:
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
    assert told[-1] == "Hover-2 FAILED: unknown_task the engine that is there now knows nothing of it"


def test_engines_that_come_and_go_are_told_once_each() -> None:
    heard = Heard()

    def beat(epoch: int, now: float) -> str:
        return heard.beat(ClockBeat(wall_us=0, engine_us=0, speed=5.0, epoch=epoch, beat=1), now)

    assert heard.look(100.0) == ""
    assert beat(1, 0.0) == "an engine is there (start 1), its clock runs at 5x"
    assert (beat(1, 1.0), heard.look(1.0 + SILENT_S - 0.1)) == ("", "")
    assert heard.look(1.0 + SILENT_S) == (
        "no engine is heard: the agents go on with what they do, and look for the next one"
    )
    assert heard.look(60.0) == ""
    assert beat(2, 61.0) == "an engine is there (start 2), its clock runs at 5x"
    assert beat(3, 62.0) == "an engine is there (start 3), its clock runs at 5x"  # killed, and back within a moment


def test_a_fleet_says_what_it_cannot_do(tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["sim"]) == 2
    assert "there is no site.yaml\n  help: make a site with `formiga init`" in capsys.readouterr().err
    assert run(["init"]) == 0
    assert run(["sim", "--virtual"]) == 2
    assert "--virtual is for scenarios: name one, for example formiga sim demo --virtual" in capsys.readouterr().err
    assert run(["sim", "demo", "--without", "hwd_1"]) == 2
    assert "--site and --without are for the agents of a site" in capsys.readouterr().err
    assert run(["sim", "--without", "hwd_9"]) == 2
    assert "--without hwd_9: the site lists lwd_1, lwd_2, hwd_1, picker_1, watcher_1" in capsys.readouterr().err
    site = tmp_path / "site.yaml"
    text = site.read_text(encoding="utf-8")
    site.write_text(text.replace(":7447", ":0"), encoding="utf-8")
    assert run(["sim"]) == 2
    assert "the site lets each engine take a free port (tcp/127.0.0.1:0)" in capsys.readouterr().err
    everybody = [
        word for agent in ("lwd_1", "lwd_2", "hwd_1", "picker_1", "watcher_1") for word in ("--without", agent)
    ]
    assert run(["sim", "--connect", "tcp/127.0.0.1:9", *everybody]) == 1
    assert "nobody is left to simulate" in capsys.readouterr().err


def test_the_agents_of_a_site_are_simulated_once(tmp_path: Path) -> None:
    with _take(tmp_path / "meadow"), pytest.raises(SiteError, match=r"'meadow' are simulated already \(process \d+\)"):
        check_unsimulated(tmp_path / "meadow")
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
