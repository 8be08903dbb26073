"""The verbs of orders: what they send, what they print, what they ask, and their exit codes. The engine is of paper."""

import io
import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.cli.app import run
from formiga_bt.cli.operator.down import losses
from formiga_bt.cli.operator.why import suggestions
from formiga_bt.client import ApiError, UnknownId
from formiga_bt.show.facts import (
    AgentFact,
    CheckFact,
    LockdownFact,
    OrderDone,
    OrderedFact,
    OrderFact,
    OrderReply,
    Point,
    PreflightFact,
    SkippedFact,
    TaskFact,
)
from tests.golden import Wording
from tests.unit.cli.paper import NO_LOCKDOWN, PaperClient, agents, reply, tasks

Capture = pytest.CaptureFixture[str]
VERBS = (
    "orders.hold",
    "orders.return_",
    "orders.land",
    "orders.continue_",
    "orders.cut",
    "orders.restart",
    "orders.lockdown",
    "orders.handback",
    "orders.preflight",
    "operator.agents",
    "operator.tasks",
    "orders.hurry",
)
LOCKDOWN = LockdownFact(on=True, how="return", by="eve", since=1, text="LOCKDOWN (return) by eve")
HOVERS = "hwd_1 hovers; it returns by itself in 11 min"
NOTE = "HOLD by eve since 2 min: hovers; it returns by itself in 11 min"


class Paper(PaperClient):
    """A client that keeps what is sent and answers as it is told; hwd_1 is the only machine."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[tuple[str, dict[str, Any]]] = []
        self.answers: dict[str, Any] = {"/v1/agents": agents(agent("hwd_1"), person())}
        self.reply: Any = stopped(OrderedFact("hwd_1", HOVERS))

    def look(self, path: str, query: Mapping[str, Any]) -> Any:
        return self.answers[path]

    def take(self, path: str, body: Any) -> Any:
        if path.startswith("/v1/agents/") and path.split("/")[3] != "hwd_1":
            raise UnknownId("unknown_agent", "there is none")
        self.sent.append((path, body))
        if isinstance(self.reply, ApiError):
            raise self.reply
        return self.reply


def stopped(*ordered: OrderedFact, **more: Any) -> OrderReply:
    ways = ("formiga continue PickUp-3", "formiga abort PickUp-3")
    return reply(*ordered, **{"target": "hwd_1", "text": "hold is ordered for 1 machine", "next": ways, **more})


def agent(name: str, **more: Any) -> AgentFact:
    given = {
        "id": name, "type": "hwd", "pool": "ASSIGNED", "liveness": "ALIVE", "control": "engine", "landed": "airborne",
        "battery": 61.4, "task": "PickUp-3", "role": "drone", "home": "p3", **more,
    }  # fmt: skip
    return AgentFact(**given)


def person() -> AgentFact:
    return agent("picker_1", mobility="people", type="picker", task="")


def order(name: str = "hwd_1", *following: str, **more: Any) -> OrderFact:
    given = {
        "stop": "hold", "by": "eve", "scope": "agent", "why": "", "state": "open", "task": "", "since": 0, "text": HOVERS,
        "note": NOTE, **more,
    }  # fmt: skip
    return OrderFact(agent=name, next=following, **given)


def task(name: str, **more: Any) -> TaskFact:
    return TaskFact(
        **{"id": name, "name": "PickUp", "status": "ACTIVE", "section": "steps", "agents": ("hwd_1",), **more}
    )


@pytest.fixture
def paper(monkeypatch: pytest.MonkeyPatch) -> Paper:
    made = Paper()
    for name in VERBS:
        monkeypatch.setattr(import_module(f"formiga_bt.cli.{name}"), "connect", lambda *_: made)
    monkeypatch.setenv("USER", "eve")
    return made


# -- stops, continue -------------------------------------------------------------------------------------------------------
def test_a_stop_says_what_happens_now_and_what_to_say_next(paper: Paper, capsys: Capture, wording: Wording) -> None:
    assert run(["hold", "hwd_1", "--by", "adam"]) == 0

    said = capsys.readouterr()
    assert paper.sent == [("/v1/agents/hwd_1/orders", {"order": "hold", "by": "adam"})]
    wording(said.out.splitlines(), said.err)


@pytest.mark.parametrize(
    ("words", "path", "order"),
    [
        (["return", "PickUp-3"], "/v1/tasks/PickUp-3/orders", "return"),
        (["land", "--all"], "/v1/orders", "land"),
        (["continue", "PickUp-3"], "/v1/tasks/PickUp-3/orders", "continue"),
        (["continue", "--all"], "/v1/orders", "continue"),
        (["restart", "PickUp-3"], "/v1/tasks/PickUp-3/orders", "restart"),
    ],
)
def test_each_verb_gives_its_order_without_asking_back(paper: Paper, words: list[str], path: str, order: str) -> None:
    assert run(words) == 0
    ((sent_to, body),) = paper.sent
    assert (sent_to, body["order"]) == (path, order)
    assert body["by"].startswith("eve@")


@pytest.mark.parametrize("words", [["hold"], ["land", "hwd_1", "--all"]])
def test_a_stop_wants_one_target(paper: Paper, words: list[str], capsys: Capture, wording: Wording) -> None:
    assert run(words) == 2
    wording(capsys.readouterr().err)
    assert paper.sent == []


def test_continue_without_a_target_names_what_is_held(paper: Paper, capsys: Capture, wording: Wording) -> None:
    for number in (1, 5):
        paper.answers["/v1/tasks"] = tasks(*(task(f"T-{n}", held=("resume",)) for n in range(number)))
        assert run(["continue"]) == 2
        wording(capsys.readouterr().err)
    paper.answers["/v1/tasks"] = tasks()
    assert run(["continue"]) == 2
    wording(capsys.readouterr().err)
    assert paper.sent == []


def test_a_stop_of_all_tells_who_did_not_get_it_and_exits_with_no(
    paper: Paper, capsys: Capture, wording: Wording
) -> None:
    lost = SkippedFact(who="hwd_2", code="agent_lost", text="hwd_2 is not heard of", hint="find it")
    paper.reply = stopped(skipped=(replace(lost, may_be_airborne=True),))
    assert run(["return", "--all"]) == 1
    wording(capsys.readouterr().out.splitlines()[1:])
    paper.reply = stopped(skipped=(lost,))
    assert run(["return", "--all"]) == 0


def test_a_refusal_is_told_with_what_helps(paper: Paper, capsys: Capture, wording: Wording) -> None:
    paper.reply = ApiError("cannot_continue", "Explore may not be done twice", help="formiga restart T-1")
    assert run(["continue", "T-1"]) == 1
    wording(capsys.readouterr().err)


def test_an_order_as_json_is_the_answer_itself(paper: Paper, capsys: Capture) -> None:
    assert run(["hold", "hwd_1", "--json"]) == 0
    assert '"who": "hwd_1"' in capsys.readouterr().out


# -- cut -----------------------------------------------------------------------------------------------------------------------
def test_a_cut_without_a_terminal_must_be_confirmed_by_the_name(
    paper: Paper, capsys: Capture, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    assert run(["cut", "hwd_1"]) == 2
    wording(capsys.readouterr().err)
    assert run(["cut", "hwd_1", "--yes-cut", "hwd_2"]) == 2
    wording(capsys.readouterr().err)
    assert paper.sent == []
    assert run(["cut", "hwd_1", "--yes-cut", "hwd_1"]) == 0
    assert paper.sent[0][1]["confirmed"] == "hwd_1"


@pytest.mark.parametrize(("typed", "code", "sent"), [("hwd_1", 0, 1), ("yes", 1, 0), ("", 1, 0)])
def test_a_cut_at_a_terminal_asks_for_the_name(
    paper: Paper, capsys: Capture, monkeypatch: pytest.MonkeyPatch, typed: str, code: int, sent: int, wording: Wording
) -> None:
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stdin", terminal)
    asked: list[str] = []

    def answer(text: str, **_: Any) -> str:
        asked.append(text)
        return typed

    monkeypatch.setattr("typer.prompt", answer)
    assert run(["cut", "hwd_1"]) == code
    wording(asked)
    assert len(paper.sent) == sent
    wording(capsys.readouterr().err)


# -- removed -------------------------------------------------------------------------------------------------------------------
def test_a_machine_that_was_removed_is_named_twice(
    paper: Paper, capsys: Capture, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    paper.reply = OrderDone("hwd_1 counts as removed")
    assert run(["agents", "removed", "hwd_1"]) == 2
    wording(capsys.readouterr().err)
    assert run(["agents", "removed", "hwd_1", "--yes-removed", "hwd_2"]) == 2
    wording(capsys.readouterr().err)
    assert run(["agents", "clear", "hwd_1", "--yes-removed", "hwd_1"]) == 2
    assert run(["agents", "removed"]) == 2
    assert paper.sent == []

    assert run(["agents", "removed", "hwd_1", "--yes-removed", "hwd_1"]) == 0
    ((path, body),) = paper.sent
    assert (path, body["confirmed"]) == ("/v1/agents/hwd_1/removed", "hwd_1")
    assert body["by"].startswith("eve@")
    wording(capsys.readouterr().out)


@pytest.mark.parametrize(("typed", "code", "sent"), [("hwd_1", 0, 1), ("yes", 1, 0)])
def test_at_a_terminal_the_name_of_what_was_removed_is_asked_for(
    paper: Paper, capsys: Capture, monkeypatch: pytest.MonkeyPatch, typed: str, code: int, sent: int, wording: Wording
) -> None:
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stdin", terminal)
    monkeypatch.setattr("typer.prompt", lambda _, **__: typed)
    paper.reply = OrderDone("hwd_1 counts as removed")
    assert run(["agents", "removed", "hwd_1"]) == code
    assert len(paper.sent) == sent
    wording(capsys.readouterr().err)


# -- lockdown, handback, preflight -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("words", "how"),
    [([], "return"), (["--hold"], "hold"), (["--return"], "return"), (["--land"], "land"), (["release"], "release")],
)
def test_lockdown_returns_unless_said_otherwise(paper: Paper, words: list[str], how: str) -> None:
    assert run(["lockdown", *words]) == 0
    ((path, body),) = paper.sent
    assert (path, body["how"]) == ("/v1/lockdown", how)


@pytest.mark.parametrize("words", [["relase"], ["release", "--hold"], ["--hold", "--land"]])
def test_a_lockdown_that_is_not_clear_does_nothing(paper: Paper, words: list[str]) -> None:
    assert run(["lockdown", *words]) == 2
    assert paper.sent == []


def test_lockdown_status_only_asks(paper: Paper, capsys: Capture) -> None:
    paper.answers["/v1/lockdown"] = NO_LOCKDOWN
    assert run(["lockdown", "status"]) == 0
    assert capsys.readouterr().out == "no lockdown stands\n"
    assert paper.sent == []


@pytest.mark.parametrize("how", ["continue", "return", "end"])
def test_a_handback_says_what_becomes_of_the_task(paper: Paper, how: str) -> None:
    assert run(["handback", "hwd_1", f"--{how}"]) == 0
    ((path, body),) = paper.sent
    assert (path, body["how"]) == ("/v1/agents/hwd_1/handback", how)


@pytest.mark.parametrize("words", [[], ["--continue", "--end"]])
def test_a_handback_wants_exactly_one_way(paper: Paper, words: list[str], capsys: Capture, wording: Wording) -> None:
    assert run(["handback", "hwd_1", *words]) == 2
    wording(capsys.readouterr().err)
    assert paper.sent == []


def test_the_former_word_for_handback_still_ends_the_step(paper: Paper) -> None:
    assert run(["agents", "handback", "hwd_1"]) == 0
    assert paper.sent[0][0] == "/v1/agents/hwd_1/handback"


def test_preflight_is_a_table_and_says_no_if_one_is_not_ready(paper: Paper, capsys: Capture, wording: Wording) -> None:
    checks = (CheckFact("armable", True, ""), CheckFact("gnss", False, "4 satellites"))
    found = PreflightFact(agent="hwd_1", ok=False, required=True, checks=checks, text="")
    paper.answers["/v1/agents/hwd_1/preflight"] = found
    assert run(["preflight"]) == 1  # people are left out
    wording(capsys.readouterr().out.splitlines())
    paper.answers["/v1/agents/hwd_1/preflight"] = replace(found, ok=True, checks=checks[:1])
    assert run(["preflight", "hwd_1"]) == 0


# -- tables ------------------------------------------------------------------------------------------------------------------
def test_agents_propose_what_would_not_be_refused(paper: Paper, capsys: Capture, wording: Wording) -> None:
    """Of a task that may not be continued: restart. Two machines of one task are told once, one on its way not at all."""
    ways = ("formiga restart PickUp-3", "formiga abort PickUp-3")
    orders = (
        order("hwd_1", *ways),
        order("hwd_2", *ways),
        order("hwd_3", "formiga agents"),
        order("hwd_4", "formiga continue hwd_4"),
        order("hwd_5", "formiga why PickUp-3", scope="engine"),
    )
    paper.answers["/v1/agents"] = agents(*(agent(one.agent, order=NOTE) for one in orders), orders=orders)
    assert run(["agents"]) == 0
    wording(capsys.readouterr().err)


def test_one_that_is_there_twice_is_not_to_be_cleared(paper: Paper, capsys: Capture, wording: Wording) -> None:
    twice = agent("hwd_1", pool="QUARANTINED", quarantine="double")
    paper.answers["/v1/agents"] = agents(twice)
    assert run(["agents"]) == 0
    said = capsys.readouterr()
    assert "double" in said.out.splitlines()[1]
    wording(said.err)


def test_agents_show_lockdown_orders_take_overs_and_breaches(paper: Paper, capsys: Capture, wording: Wording) -> None:
    found = (
        agent("hwd_1", order=NOTE, breach="reserve"),
        agent("hwd_2", taken=True),
        agent("hwd_3", control="pilot"),
    )
    stands = order("hwd_1", "formiga lockdown release")
    paper.answers["/v1/agents"] = agents(*found, orders=(stands,), lockdown=LOCKDOWN)
    assert run(["agents"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    wording(lines[0], lines[2])
    assert lines[3].endswith("waits for handback")
    assert lines[4].endswith("control: pilot")
    wording(said.err)


def test_tasks_show_lockdown_and_what_held_tasks_wait_for(paper: Paper, capsys: Capture, wording: Wording) -> None:
    held = task("PickUp-3", held=("operator:hwd_1",))
    paper.answers["/v1/tasks"] = tasks(task("Move-4", agents=()), held, orders=(order(),), lockdown=LOCKDOWN)
    assert run(["tasks"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    wording(lines[0])
    assert "ACTIVE HELD" in lines[3]
    assert lines[3].endswith(f" hwd_1: {NOTE}")
    wording(said.err)


def test_tasks_show_who_requested_whom(paper: Paper, capsys: Capture, wording: Wording) -> None:
    tour = task("Tour-1", agents=(), children=("Move-2", "Move-3"))
    move = task("Move-2", parent="Tour-1", held=("operator",))
    paper.answers["/v1/tasks"] = tasks(tour, move)
    assert run(["tasks"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].endswith("  requested Move-2 Move-3")
    wording(lines[2])


# -- down ------------------------------------------------------------------------------------------------------------------
def test_down_names_what_is_left_in_the_air_and_forgotten(wording: Wording) -> None:
    found = (agent("hwd_1", order=NOTE, action="GoTo"), agent("lwd_1", landed="grounded"), person())

    wording(losses(agents(*found, orders=(order(),), lockdown=LOCKDOWN)))
    assert losses(agents(agent("lwd_1", landed="grounded"), person())) == []


def test_down_does_nothing_unconfirmed(
    paper: Paper, capsys: Capture, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("formiga_bt.cli.operator.down.connect", lambda site: paper)
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))

    assert run(["down"]) == 2
    assert paper.sent == []
    wording(capsys.readouterr().err)


def test_what_comes_next_is_said_once_and_no_command_that_the_answer_proposes(
    paper: Paper, capsys: Capture, wording: Wording
) -> None:
    hint = "formiga agents clear hwd_1"
    waits = tuple(SkippedFact(who=f"PickUp-{n}", code="held", text=f"PickUp-{n} waits", hint=hint) for n in range(3))
    ways = (*(one.hint for one in waits), "formiga tasks", "formiga tasks", "a", "b", "c")
    paper.reply = stopped(skipped=waits, next=ways)
    assert run(["hold", "--all"]) == 0
    said = capsys.readouterr()
    wording(said.out, said.err)
    paper.reply = stopped(skipped=waits[:1], next=(hint,))
    assert run(["hold", "--all"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("headline", "says"),
    [
        ("PickUp-3 ACTIVE", ["formiga abort PickUp-3"]),
        ("PickUp-3 PENDING HELD", ["formiga abort PickUp-3"]),
        ("PickUp-3 ENDING", ["formiga tasks"]),
        ("PickUp-3 ENDING HELD", ["formiga tasks"]),
        ("PickUp-3 FAILED", ["formiga tasks"]),
    ],
)
def test_what_is_ending_already_is_not_to_be_aborted(headline: str, says: list[str]) -> None:
    assert suggestions(headline, []) == says


def test_times_of_tasks_are_said_in_units_that_fit(paper: Paper, capsys: Capture) -> None:
    now = 3 * 86_400 * SECOND
    fresh, old = task("Move-4", submitted_at=now - 720 * SECOND), task("Move-1", submitted_at=0)
    paper.answers["/v1/tasks"] = tasks(fresh, old, at=now)
    assert run(["tasks"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "  12 min  " in lines[1]
    assert "  3.0 days  " in lines[2]
    assert "1970-01-01" in lines[2]


def test_where_a_machine_stands_is_the_name_of_the_port(paper: Paper, capsys: Capture, wording: Wording) -> None:
    at = Point(0.0, 20.0)
    paper.answers["/v1/agents"] = agents(agent("hwd_1", at=at, port="north"), agent("hwd_2", at=at))
    assert run(["agents"]) == 0
    first, second = capsys.readouterr().out.splitlines()[1:3]
    assert " north " in first
    wording(second)
