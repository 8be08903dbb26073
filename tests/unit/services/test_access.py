"""Who may do what: each route with a token of each role, tokens that are wrong, and what is written down of it."""

import json
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fastapi.routing import APIRoute

from formiga_bt.base.accounts import ACCOUNTS, Account, Register, Token, new_token, write_register
from formiga_bt.base.roles import MAY, Deed, Role
from formiga_bt.services.http import api
from formiga_bt.services.http.audit import Audit, read_audit
from tests.unit.services.conftest import Service, Start, make_real

pytestmark = pytest.mark.network

FILL = {
    "agent": "lwd_1",
    "task_id": "No-1",
    "number": "Q1",
    "pilot": "pia",
    "rule": "r",
    "name": "f",
    "action": "Fly",
    "alarm": "A1",
    "zone": "z",
    "channel": "room",
}
ENDS = ("/v1/admin/drain", "/v1/admin/stop", "/v1/events")
"""Routes that end the engine, or do not end themselves."""


def let_in(service: Service, **people: Account) -> dict[str, dict[str, str]]:
    """Give a site accounts; return the headers with which each calls."""
    now = int(time.time())
    made = {name: new_token(name, now, now + 600) for name in people}
    write_register(service.host.runtime_folder, Register(people, tuple(token for _, token in made.values())))
    return {name: {"Authorization": f"Bearer {text}"} for name, (text, _) in made.items()}


def routes(service: Service) -> Iterator[tuple[str, str, Deed | None]]:
    app = api.application(service.host)
    for route in app.routes:
        if isinstance(route, APIRoute) and route.path != "/v1/openapi.json":
            for method in sorted(route.methods - {"HEAD"}):
                yield method, route.path, app.state.deeds.get((method, route.path))


@pytest.mark.parametrize("role", list(Role))
def test_each_route_is_open_to_the_roles_of_the_table_and_to_no_other(service: Service, role: Role) -> None:
    headers = let_in(service, somebody=Account((role,), agent="watcher_1"))["somebody"]
    seen = 0
    for method, path, deed in routes(service):
        assert deed is not None, f"{method} {path} says not whom it is for"
        if path in ENDS and deed in MAY[role]:
            continue
        filled = path.format(**FILL, sha256="0" * 64)
        made, found = service.call(method, filled, None if method == "GET" else {}, headers)
        assert (made == 403 and found["code"] == "no_role") == (deed not in MAY[role]), (method, path, made, found)
        seen += 1
    assert seen > 30


def test_orders_that_are_no_stops_take_more(service: Service) -> None:
    admin, pilot, responder, operator = let_in(
        service,
        adam=Account((Role.ADMIN,)),
        pia=Account((Role.PILOT,)),
        rea=Account((Role.RESPONDER,)),
        ola=Account((Role.OPERATOR,)),
    ).values()
    assert service.refused("POST", "/v1/agents/lwd_1/orders", {"order": "hold"}, admin)["code"] == "no_role"
    assert service.call("POST", "/v1/agents/lwd_1/orders", {"order": "hold"}, pilot)[0] == 200
    assert service.call("POST", "/v1/agents/lwd_1/orders", {"order": "continue"}, operator)[0] == 200
    assert service.call("POST", "/v1/lockdown", {"how": "hold"}, responder)[0] == 200
    assert service.refused("POST", "/v1/lockdown", {"how": "release"}, responder)["code"] == "no_role"
    assert service.call("POST", "/v1/lockdown", {"how": "release"}, operator)[0] == 200


def test_the_word_of_an_account_is_its_own(service: Service) -> None:
    ann, app = let_in(
        service, ann=Account((Role.OPERATOR,)), app=Account((Role.REQUESTER,), tasks=("Stay", "Hello"))
    ).values()
    body = {"task": "Stay"}
    by_ann = service.post("/v1/tasks", {**body, "by": "bob"}, **ann)["id"]
    by_app = service.post("/v1/tasks", body, **app)["id"]
    assert (service.task(by_ann)["by"], service.task(by_app)["by"]) == ("ann", "app")
    assert service.refused("POST", "/v1/tasks", {"task": "Ask"}, app)["code"] == "not_listed"

    assert service.refused("POST", f"/v1/tasks/{by_ann}/abort", {}, app)["code"] == "no_role"
    assert service.call("DELETE", f"/v1/tasks/{by_app}", None, app)[0] == 200
    assert service.call("POST", f"/v1/tasks/{by_ann}/abort", {}, ann)[0] == 200


def test_an_account_sends_so_many_requests_a_minute_and_stops_get_through(service: Service) -> None:
    slow, other = let_in(service, slow=Account((Role.OPERATOR,), requests=5), ann=Account((Role.OPERATOR,))).values()
    answers = [service.call("GET", "/v1/tasks", None, slow)[0] for _ in range(8)]
    assert answers == [200] * 5 + [429] * 3
    assert service.refused("POST", "/v1/tasks", {"task": "Hello"}, slow)["code"] == "too_many_requests"
    assert service.call("GET", "/v1/tasks", None, other)[0] == 200
    assert service.call("GET", "/v1/tasks")[0] == 200
    assert service.call("POST", "/v1/orders", {"order": "hold"}, slow)[0] == 200


def test_an_account_has_so_many_tasks_under_way_however_fast_it_asks(service: Service) -> None:
    (shop,) = let_in(service, shop=Account((Role.REQUESTER,), open_tasks=3)).values()
    first = service.post("/v1/tasks", {"task": "Stay"}, **shop, **{"Idempotency-Key": "one"})["id"]
    with ThreadPoolExecutor(8) as many:
        asked = list(many.map(lambda _: service.call("POST", "/v1/tasks", {"task": "Stay"}, shop), range(8)))
    assert sorted(status for status, _ in asked) == [201] * 2 + [429] * 6
    assert {answer["code"] for status, answer in asked if status == 429} == {"too_many_open"}
    again = {**shop, "Idempotency-Key": "one"}
    assert service.call("POST", "/v1/tasks", {"task": "Stay"}, again)[1]["id"] == first
    assert service.call("POST", "/v1/tasks", {"task": "Stay"})[0] == 201

    assert service.call("DELETE", f"/v1/tasks/{first}", None, shop)[0] == 200
    service.ends(first)
    assert service.call("POST", "/v1/tasks", {"task": "Stay"}, shop)[0] == 201


def test_who_is_asked_is_who_answers(service: Service) -> None:
    watcher, other, nobody = let_in(
        service,
        wes=Account((Role.RESPONDER,), agent="watcher_1"),
        pat=Account((Role.PICKER,), agent="picker_1"),
        ann=Account((Role.OPERATOR,)),
    ).values()
    task = service.submit("Ask")
    service.wait(lambda: service.get("/v1/inbox")["questions"])
    (question,) = service.get("/v1/inbox")["questions"]
    path, yes = f"/v1/inbox/{question['number']}/answer", {"option": "yes_it_is", "by": "watcher_1"}

    assert service.refused("POST", path, yes, other)["code"] == "not_you"
    assert service.refused("POST", path, yes, nobody)["code"] == "no_agent"
    assert service.call("GET", "/v1/inbox?person=watcher_1", None, other)[1]["code"] == "not_you"
    assert service.call("GET", "/v1/inbox", None, other)[1]["questions"] == []
    assert service.call("POST", path, {**yes, "by": "watcher_1"}, watcher)[0] == 200
    assert service.ends(task)["status"] == "SUCCEEDED"


def test_a_token_that_is_wrong_expired_taken_back_or_of_who_is_shut_out_lets_nobody_in(service: Service) -> None:
    now = int(time.time())
    good, kept = new_token("ann", now, now + 600)
    past, old = new_token("ann", now - 600, now - 1)
    off, shut = new_token("eve", now, now + 600)
    lost, orphan = new_token("gone", now, now + 600)
    people = {"ann": Account((Role.VIEWER,)), "eve": Account((Role.ADMIN,), disabled=True)}
    folder = service.host.runtime_folder
    write_register(folder, Register(people, (kept, old, shut, orphan)))
    forged = good[:-1] + ("A" if good[-1] != "A" else "B")

    def status(text: str) -> int:
        return service.call("GET", "/v1/whoami", None, {"Authorization": f"Bearer {text}"})[0]

    assert [status(one) for one in (good, past, off, lost, forged, good.upper(), kept.hash)] == [200, *[401] * 6]
    assert good not in (folder / ACCOUNTS).read_text()
    write_register(folder, Register(people, ()))
    assert status(good) == 401
    write_register(folder, Register(people, (kept,)))
    assert status(good) == 200
    (folder / ACCOUNTS).write_text("{")
    assert status(good) == 401
    assert service.get("/v1/whoami")["name"] == "local", "on the engine's own machine, in mode simulation"


def test_what_changes_something_and_what_is_refused_is_written_down_without_secrets(service: Service) -> None:
    viewer = let_in(service, vic=Account((Role.VIEWER,)))["vic"]
    service.call("GET", "/v1/tasks", None, viewer)
    service.call("POST", "/v1/tasks", {"task": "Stay", "params": {"word": "hush"}}, viewer)
    service.call("GET", "/v1/tasks?x=hush", None, {"Authorization": "Bearer hush"})
    service.submit("Stay")

    lines = [*read_audit(service.host.runtime_folder)]
    said = [(one["who"], one["asked"], one["status"]) for one in lines]
    assert said == [("vic", "POST /v1/tasks", 403), ("", "GET /v1/tasks", 401), ("local", "POST /v1/tasks", 201)]
    assert "hush" not in json.dumps(lines)


def test_the_audit_has_two_generations_and_holds_up_nobody(service: Service) -> None:
    folder = service.host.runtime_folder / "small"
    folder.mkdir()
    audit = Audit(folder, most_bytes=1000)
    for number in range(60):
        audit.note("ann", "local", "POST", f"/v1/{number}", 200)
    asked = [one["asked"] for one in read_audit(folder)]
    assert asked == [f"POST /v1/{number}" for number in range(60 - len(asked), 60)]
    assert sum(file.stat().st_size for file in folder.iterdir()) <= 2 * 1200
    audit.close()
    (folder / "audit.jsonl").unlink()
    (folder / "audit.jsonl").mkdir()
    audit.note("ann", "local", "POST", "/v1/last", 200)  # nobody hears of it but the log


def test_in_mode_real_a_token_of_an_account_is_enough_for_its_roles(start: Start, tmp_path: Path) -> None:
    make_real(tmp_path)
    with start() as service:
        ann, ape = let_in(service, ann=Account((Role.OPERATOR,)), ape=Account((Role.APPROVER,))).values()
        assert service.call("GET", "/v1/tasks", None, ann)[0] == 200
        assert (
            service.refused("POST", "/v1/library", {"file": "x.yaml", "texts": {"x.yaml": ""}}, ann)["code"]
            == "no_role"
        )
        (hello,) = [one for one in service.get("/v1/approvals")["tasks"] if one["task"] == "Hello"]
        body = {"task": "Hello", "digest": hello["digest"], "typed": hello["digest"][:8], "by": "ann"}
        refused = service.refused("POST", "/v1/approvals", body, ape)
        assert (refused["code"], "ape" in refused["text"]) == ("not_approver", True), refused
        assert service.refused("GET", "/v1/tasks", None, {"Authorization": ""})["code"] == "unauthorized"


def test_a_token_has_no_other_form() -> None:
    text, token = new_token("ann", 0, 1)
    assert isinstance(token, Token)
    assert text.startswith("fbt_")
    assert len(text) == len("fbt_") + 8 + 1 + 43
