"""The paper's services as apps call them: in its words, for whom, once for each key, and written down."""

import json
from collections.abc import Callable
from typing import Any, get_args

import msgspec
import pytest

from formiga_bt.base.accounts import ACCOUNTS, Account
from formiga_bt.base.roles import MAY, Role, roles_that_may
from formiga_bt.engine.kernel.records import Priority, TaskStatus
from formiga_bt.services.http.audit import read_audit
from formiga_bt.services.paper import PRIORITY, STATUS
from formiga_bt.transport.base import AgentTransport
from formiga_bt.transport.calls import AnswersCalls, Call, CallError
from tests.unit.services.conftest import Service
from tests.unit.services.test_access import let_in

pytestmark = pytest.mark.network

ADD, ABORT = "formiga/add_task", "task_manager/abort_task"
LIST, ASSIGN, UNASSIGN = (f"fleet_manager_front/{one}" for one in ("get_mex_list", "assign_task", "unassign_task"))
Ask = Callable[..., Any]


class App:
    """An app beside a service, without a wire."""

    def __init__(self, service: Service) -> None:
        self.caller = service.host.calls

    def raw(self, service: str, payload: bytes, who: str = "") -> Any:
        """Return an answer, or a refusal."""
        found = self.caller.answer(Call(who, service, payload))
        return found if isinstance(found, CallError) else json.loads(found)

    def call(self, service: str, who: str = "", **request: Any) -> Any:
        return self.raw(service, json.dumps(request).encode(), who)

    def code(self, service: str, who: str = "", **request: Any) -> str:
        found = self.call(service, who, **request)
        assert isinstance(found, CallError), found
        return found.code


@pytest.fixture
def app(service: Service) -> App:
    return App(service)


def test_every_status_and_priority_has_its_word() -> None:
    assert set(STATUS) == set(get_args(TaskStatus))
    assert set(STATUS.values()) == {"PENDING", "ASSIGNED", "ACTIVE", "COMPLETED", "ABORTED"}
    assert set(PRIORITY.values()) == set(get_args(Priority))


def test_a_task_is_requested_ended_and_an_agent_is_shown_with_it(service: Service, app: App) -> None:
    added = app.call(ADD, keyword="Hello", priority="HIGH", arguments={"height": "30 m"}, by="eve")
    assert added == {"task_id": "Hello-1", "status": "PENDING", "text": ""}
    service.wait(lambda: service.task("Hello-1")["status"] == "ACTIVE")
    assert (service.task("Hello-1")["priority"], service.task("Hello-1")["by"]) == ("high", "eve")

    machine, person = app.call(LIST)["mex"]

    assert (machine["id"], machine["task_id"]) == ("lwd_1", "Hello-1")
    assert machine["status"] in ("ASSIGNED", "EXECUTING ACTION")
    assert not machine["available"]
    assert (person["id"], person["task_id"], person["status"]) == ("watcher_1", "None", "STANDBY")
    fig_5 = {"status", "battery", "pose", "gps", "id", "task_id", "type", "action_name", "initial_deployment"}
    assert fig_5 | {"available"} == set(machine) == set(person)
    assert set(machine["gps"]) == {"latitude", "longitude", "altitude"}
    ended = app.call(ABORT, task_id="Hello-1")
    assert (ended["task_id"], ended["status"] in ("ACTIVE", "ABORTED")) == ("Hello-1", True)
    service.ends("Hello-1")
    again = app.call(ABORT, task_id="Hello-1")
    assert again.code == "already_ended"


def test_a_task_that_waits_is_aborted_at_once(service: Service, app: App) -> None:
    service.post("/v1/orders", {"order": "hold"})
    task = app.call(ADD, keyword="Hello")["task_id"]
    assert app.call(ABORT, task_id=task)["status"] == "ABORTED"


def test_an_agent_is_given_and_taken_back(service: Service, app: App) -> None:
    service.post("/v1/orders", {"order": "hold"})
    task = app.call(ADD, keyword="Hello")["task_id"]
    no = app.call(ASSIGN, task_id=task, mex_id="lwd_1")
    assert (no.code, no.help) == ("ordered", "formiga continue lwd_1")
    service.post("/v1/orders", {"order": "continue"})
    service.wait(lambda: service.task(task)["status"] == "ACTIVE")
    back = app.call(UNASSIGN, mex_id="lwd_1")
    assert back["mex_id"] == "lwd_1"
    service.wait(lambda: app.call(LIST)["mex"][0]["status"] == "STANDBY")
    given = app.call(ASSIGN, task_id=task, mex_id="lwd_1", key="a1")
    assert (given["task_id"], given["status"] in ("ASSIGNED", "EXECUTING ACTION")) == (task, True)
    assert app.call(ASSIGN, task_id=task, mex_id="lwd_1", key="a1") == given


def test_the_same_key_twice_is_one_task_and_one_answer(service: Service, app: App) -> None:
    first = app.call(ADD, keyword="Stay", key="k")
    assert app.call(ADD, keyword="Stay", key="k") == first
    assert app.code(ADD, keyword="Hello", key="k") == "idempotency_conflict"
    assert service.get("/v1/tasks")["total"] == 1
    let_in(service, ann=Account((Role.REQUESTER,)))
    assert app.call(ADD, "ann", keyword="Stay", key="k")["task_id"] == "Stay-2", "another's keys are no matter"
    ended = app.call(ABORT, task_id="Stay-1", key="e")
    assert app.call(ABORT, task_id="Stay-1", key="e") == ended
    assert app.code(ABORT, task_id="Stay-2", key="e") == "idempotency_conflict"


@pytest.mark.parametrize("role", list(Role))
def test_each_service_is_open_to_the_roles_of_the_table_and_to_no_other(service: Service, app: App, role: Role) -> None:
    let_in(service, somebody=Account((role,)))
    for name, one in app.caller._paper.table.items():
        found = app.call(name, "somebody")
        refused = isinstance(found, CallError) and found.code == "no_role"
        assert refused == (one.may not in MAY[role]), (name, found)
        if refused:
            assert any(needed in found.text for needed in roles_that_may(one.may))


def test_who_has_no_account_is_told_which_role_it_takes(service: Service, app: App) -> None:
    let_in(service, eve=Account((Role.ADMIN,), disabled=True), shop=Account((Role.REQUESTER,), tasks=("Hello",)))
    for nobody in ("ann", "eve", "local", "../x", "a" * 5000, "ä\n"):
        found = app.call(ADD, nobody, keyword="Hello")
        assert (found.code, "requester" in found.text, len(found.text) < 300) == ("no_account", True, True)
    assert app.code(ADD, "shop", keyword="Stay") == "not_listed"
    mine = app.call(ADD, "shop", keyword="Hello", by="eve")["task_id"]
    assert service.task(mine)["by"] == "shop"
    other = app.call(ADD, keyword="Stay")["task_id"]
    assert app.code(ABORT, "shop", task_id=other) == "no_role"
    assert app.call(ABORT, "shop", task_id=mine)["task_id"] == mine
    (service.host.runtime_folder / ACCOUNTS).write_text("{")
    assert app.code(ADD, "shop", keyword="Hello") == "no_account"


def test_what_changes_something_and_what_is_refused_is_written_down(service: Service, app: App) -> None:
    let_in(service, vic=Account((Role.VIEWER,)))
    app.call(LIST, "vic")
    app.call(ADD, "vic", keyword="Stay", arguments={"word": "hush"})
    app.call(ADD, "x" * 900, keyword="Stay")
    app.call(ADD, keyword="Stay")
    lines = [*read_audit(service.host.runtime_folder)]
    said = [(one["who"], one["from"], one["asked"], one["status"]) for one in lines]
    asked = f"CALL {ADD}"
    assert said == [("vic", "wire", asked, 403), ("x" * 64, "wire", asked, 403), ("local", "wire", asked, 200)]
    assert "hush" not in json.dumps(lines)


@pytest.mark.parametrize(
    "payload",
    [b"[]", b"{", b"\xff", b'{"keyword": 3}', b'{"keyword": "Hello", "x": 1}', b'{"priority": "CRITICAL", "keyword": "Hello"}',
     b'{"keyword": "Hello", "arguments": ' + b"[" * 100_000 + b"]" * 100_000 + b"}", b"", b"null"],
)  # fmt: skip
def test_what_is_no_request_is_refused_and_starts_nothing(service: Service, app: App, payload: bytes) -> None:
    assert app.raw(ADD, payload).code == "bad_request"
    assert service.get("/v1/tasks")["total"] == 0


def test_the_reasons_of_the_engine_come_through(app: App) -> None:
    assert app.call(ADD, keyword="Helo").near == ("Hello",)
    bad = app.call(ADD, keyword="Hello", arguments={"height": "3 kg"})
    assert (bad.code, len(bad.problems)) == ("bad_params", 1)
    assert app.code(ABORT, task_id="No-1") == "unknown_task"
    assert app.code(ASSIGN, task_id="No-1", mex_id="lwd_1") == "unknown_task"
    assert app.code(UNASSIGN, mex_id="nobody") == "unknown_agent"


class Carrier:
    """A wire that can carry calls."""

    name = "carrier"

    def __init__(self, endpoint: str, *, binds_names: bool) -> None:
        self.endpoint, self.binds_names = endpoint, binds_names
        self.served: list[bool] = []

    def serve_calls(self, desk: AnswersCalls, *, bare: bool) -> None:
        assert len(desk.services) == 5
        self.served.append(bare)


@pytest.mark.parametrize(
    ("mode", "endpoint", "binds_names", "served"),
    [
        ("simulation", "tcp/127.0.0.1:7447", False, [True]),
        ("simulation", "tcp/0.0.0.0:7447", False, []),
        ("simulation", "tls/10.0.0.5:7447", False, []),
        ("simulation", "tls/10.0.0.5:7447", True, [False]),
        ("real", "tcp/127.0.0.1:7447", False, []),
        ("real", "tls/127.0.0.1:7447", False, []),
        ("real", "tls/10.0.0.5:7447", True, [False]),
    ],
)  # fmt: skip
def test_only_a_wire_that_binds_names_serves_beyond_a_simulation_on_the_loopback(
    service: Service, app: App, mode: str, endpoint: str, binds_names: bool, served: list[bool]
) -> None:
    wire: Any = Carrier(endpoint, binds_names=binds_names)
    site = msgspec.structs.replace(service.host.site, mode=mode)
    wires: list[AgentTransport] = [wire]
    app.caller.serve(site, wires)
    assert wire.served == served


def test_an_account_is_held_to_its_limits_here_too(service: Service, app: App) -> None:
    let_in(service, shop=Account((Role.REQUESTER,), requests=4, open_tasks=1))
    task = app.call(ADD, "shop", keyword="Stay", key="one")["task_id"]
    assert app.call(ADD, "shop", keyword="Stay", key="one")["task_id"] == task
    assert app.code(ADD, "shop", keyword="Stay") == "too_many_open"
    assert len(app.call(LIST, "shop")["mex"]) == 2
    assert app.code(LIST, "shop") == "too_many_requests"
    assert app.call(ABORT, "shop", task_id=task)["task_id"] == task
