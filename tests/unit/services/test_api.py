"""The HTTP API over a real socket, with a real engine behind it."""

import json
import re
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from formiga_bt.engine.kernel.inputs import WallDue
from formiga_bt.engine.kernel.timers import LiveDue
from formiga_bt.engine.tasks import intake
from formiga_bt.services.http import api
from tests.golden import Wording
from tests.unit.services.conftest import Service, Start

pytestmark = pytest.mark.network


def test_a_task_flies_to_its_end(service: Service) -> None:
    task_id = service.submit("Hello", target="lake_shore", height="30 m")

    end = service.ends(task_id)

    assert (end["status"], end["agents"], end["outcome"]) == ("SUCCEEDED", ["lwd_1"], "SUCCEEDED")
    assert [a["action"] for a in end["actions"]] == ["TakeOff", "GoTo", "GoTo", "LandIn"]
    assert {a["state"] for a in end["actions"]} == {"succeeded"}
    assert service.get("/v1/tasks")["tasks"][0]["id"] == task_id
    assert service.get("/v1/tasks?status=open")["total"] == 0
    assert service.codes(task_id)[0] == "succeeded"


def test_parameters_are_texts_or_json(service: Service) -> None:
    service.wire.auto = False
    texts = service.submit("Hello", target="66.501,25.701", height="25 m")
    service.wait(lambda: service.wire.machines["lwd_1"].goal)
    assert service.wire.machines["lwd_1"].goal is not None
    assert service.call("DELETE", f"/v1/tasks/{texts}")[0] == 200

    json_ = service.submit("Hello", target={"east": "50 m", "north": "60 m"}, height=None)

    assert (texts, json_) == ("Hello-1", "Hello-2")


def test_aliases_of_tasks_and_parameters_are_understood_and_listed(service: Service, wording: Wording) -> None:
    service.wire.auto = False
    task_id = service.submit("AskTask", saying="well")
    degrees = service.submit("Hello", lat=66.501, lng="25.701")

    (ask,) = [one for one in service.get("/v1/library")["tasks"] if one["task"] == "Ask"]
    assert (task_id, degrees) == ("Ask-1", "Hello-2")
    assert (ask["aliases"], ask["params"][0]["aliases"]) == (["AskTask"], ["saying"])
    refused = service.refused("POST", "/v1/tasks", {"task": "AskTask", "params": {"say": "well"}})
    wording(refused["text"])


def test_a_running_task_shows_what_it_does(start: Start) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        service.wait(lambda: service.task(task_id)["goals"])

        task = service.task(task_id)

        assert task["roles"] == {"drone": ["lwd_1"]}
        assert (task["status"], task["section"], task["held"]) == ("ACTIVE", "steps", [])
        (node,) = task["running"]
        assert node["title"] == "drone.TakeOff"
        assert node["place"].endswith("hello.yaml:19")
        assert [(g["agent"], g["action"]) for g in task["goals"]] == [("lwd_1", "TakeOff")]
        service.wire.finish("lwd_1")
        service.wait(lambda: [n["title"] for n in service.task(task_id)["running"]] == ["drone.GoTo"])


@pytest.mark.parametrize(
    ("body", "status", "code", "says"),
    [
        ({"task": "Hallo"}, 404, "unknown_task", '"near": ["Hello"]'),
        ({"task": "Hello", "params": {"hight": "3 m"}}, 422, "bad_params", "no parameter 'hight'"),
        ({"task": "Hello", "params": {"height": "30"}}, 422, "bad_params", "needs a unit"),
        ({"task": "Hello", "params": {"height": "30 kg"}}, 422, "bad_params", "kg"),
        ({"task": "Hello", "params": {"height": "500 m"}}, 422, "bad_params", "at most 120 m"),
        ({"task": "Hello", "params": {"target": "[1, {"}}, 422, "bad_params", ""),
        (
            {"task": "Hello", "params_from": [{"file": "target.csv", "text": "lat,lng\n66.5,\n"}]},
            422,
            "bad_params",
            "lng is due a number",
        ),
        ({"task": "Hello", "priority": "urgent"}, 422, "bad_request", "priority"),
        ({"task": "Hello", "wait_s": -1}, 422, "bad_request", "wait_s"),
        ({"task": "Hello", "expires_s": "soon"}, 422, "bad_request", "expires_s"),
        ({"task": "Hello", "prams": {}}, 422, "bad_request", "prams"),
        ({}, 422, "bad_request", "task"),
        (b'{"task": ', 400, "bad_json", "not JSON"),
        (b"\xff\xfe", 400, "bad_json", ""),
    ],
)
def test_a_bad_request_is_explained_and_the_engine_goes_on(
    service: Service, body: object, status: int, code: str, says: str
) -> None:
    problem = service.refused("POST", "/v1/tasks", body)

    assert (problem["status"], problem["code"]) == (status, code)
    assert says in json.dumps(problem, ensure_ascii=False)
    assert service.get("/v1/health")["status"] == "ok"
    assert service.ends(service.submit("Hello"))["status"] == "SUCCEEDED"


def test_all_problems_of_parameters_come_at_once(service: Service) -> None:
    problem = service.refused("POST", "/v1/tasks", {"task": "Hello", "params": {"height": "3", "nope": "1"}})

    assert len(problem["problems"]) == 2


def test_a_request_says_how_long_it_may_be_pending(start: Start) -> None:
    with start(auto=False) as service:
        first = service.submit("Hello")
        service.wait(lambda: service.task(first)["goals"])

        given = [{"task": "Hello", key: 0.2} for key in ("wait_s", "expires_s")]
        waits = [str(service.post("/v1/tasks", body)["id"]) for body in given]

        assert [service.ends(one)["code"] for one in waits] == ["no_agent", "task_expired"]


def test_a_request_says_when_it_is_served_and_is_told_what_it_waits_for(start: Start) -> None:
    with start(auto=False) as service:
        first = service.submit("Hello")
        begins = (datetime.now(UTC) + timedelta(days=1)).isoformat(timespec="minutes")
        body = {"task": "Hello", "after": [first], "not_before": begins}
        mine = str(service.post("/v1/tasks", body)["id"])

        codes = [line["code"] for line in service.get(f"/v1/tasks/{mine}/why")["because"]]
        assert {"not_before", "after"} <= set(codes)
        service.post(f"/v1/tasks/{first}/abort", {})

        assert service.ends(mine)["code"] == "after_failed"


@pytest.mark.parametrize(
    ("when", "code"),
    [
        ({"not_before": "soon"}, "bad_time"),
        ({"not_before": "2001-01-01T14:00"}, "bad_time"),
        ({"not_before": "2199-01-01"}, "bad_time"),
        ({"deadline": "9999-12-31T23:59-23:59"}, "bad_time"),
        ({"after": ["Nobody-9"]}, "unknown_task"),
        ({"if_late": "perhaps"}, "bad_request"),
    ],
)
def test_a_time_that_cannot_be_kept_is_refused(service: Service, when: dict[str, object], code: str) -> None:
    assert service.refused("POST", "/v1/tasks", {"task": "Hello", **when})["code"] == code
    assert service.get("/v1/tasks")["tasks"] == []


def test_an_idempotency_key_starts_one_task(service: Service) -> None:
    body = {"task": "Stay"}

    def send(_: int) -> str:
        return str(service.post("/v1/tasks", body, **{"Idempotency-Key": "k1"})["id"])

    with ThreadPoolExecutor(8) as pool:
        ids = set(pool.map(send, range(16)))

    assert ids == {"Stay-1"}
    other = service.refused("POST", "/v1/tasks", {"task": "Hello"}, {"Idempotency-Key": "k1"})
    assert (other["status"], other["code"]) == (409, "idempotency_conflict")
    assert service.post("/v1/tasks", body, **{"Idempotency-Key": "k2"})["id"] == "Stay-2"


def test_a_full_queue_is_busy(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intake, "MAX_QUEUED", 0)
    problem = service.refused("POST", "/v1/tasks", {"task": "Stay"})
    assert (problem["status"], problem["code"]) == (429, "busy")
    monkeypatch.undo()
    service.submit("Stay")


@pytest.mark.parametrize("declared", [True, False])
def test_a_large_body_is_refused(service: Service, declared: bool) -> None:
    body = json.dumps({"task": "Hello", "params": {"target": "x" * 1_100_000}}).encode()
    headers = {} if declared else {"Transfer-Encoding": "chunked"}
    if not declared:
        body = b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body)
    problem = service.refused("POST", "/v1/tasks", body, headers)
    assert (problem["status"], problem["code"]) == (413, "too_large")


def test_unknown_things_are_not_found(service: Service) -> None:
    assert service.refused("GET", "/v1/tasks/Nope-1")["code"] == "unknown_task"
    assert service.refused("GET", "/v1/tasks/Nope-1/why")["code"] == "unknown_task"
    assert service.refused("POST", "/v1/tasks/Nope-1/abort")["code"] == "unknown_task"
    assert service.refused("POST", "/v1/agents/nope/clear")["code"] == "unknown_agent"
    assert service.refused("POST", "/v1/inbox/Q99/answer", {"option": "a"})["code"] == "unknown_question"
    assert service.refused("GET", "/v2/tasks")["code"] == "no_such_route"
    assert service.refused("PUT", "/v1/tasks")["status"] == 405


# -- ending a task -----------------------------------------------------------------------------------------------------
def test_abort_brings_the_drone_home(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        service.wait(lambda: service.wire.machines["lwd_1"].goal)
        service.wire.finish("lwd_1")
        service.wait(lambda: [g["action"] for g in service.task(task_id)["goals"]] == ["GoTo"])
        service.wire.auto = True

        reply = service.post(f"/v1/tasks/{task_id}/abort", {"by": "eve"})

        wording(reply["text"])
        end = service.ends(task_id)
        assert (end["status"], end["code"], end["reason"]) == ("CANCELED", "aborted", "by eve")
        assert service.wire.machines["lwd_1"].landed == "grounded"
        again = service.refused("POST", f"/v1/tasks/{task_id}/abort")
        assert (again["status"], again["code"]) == (409, "already_ended")


def test_abandon_must_be_confirmed_and_leaves_a_machine_for_a_person_to_clear(start: Start) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        service.wait(lambda: service.wire.machines["lwd_1"].goal)
        path = f"/v1/tasks/{task_id}/abort"
        assert service.refused("POST", path, {"how": "abandon"})["code"] == "not_confirmed"
        assert service.task(task_id)["status"] == "ACTIVE"
        assert service.refused("POST", "/v1/agents/lwd_1/clear")["code"] == "not_quarantined"

        service.post(path, {"how": "abandon", "confirmed": True})

        service.wait(lambda: service.get("/v1/agents")["agents"][0]["pool"] == "QUARANTINED")
        service.ends(task_id)
        service.post("/v1/agents/lwd_1/clear", {"by": "eve"})
        service.wait(lambda: service.get("/v1/agents")["agents"][0]["pool"] == "STANDBY")


def test_a_machine_that_a_pilot_took_is_handed_back(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        machine = service.wire.machines["lwd_1"]
        service.wait(lambda: machine.goal)
        machine.control = "pilot"
        service.wire.finish("lwd_1", "taken_over")
        service.wait(lambda: service.task(task_id)["held"] == ["take-over:lwd_1"])
        why = service.get(f"/v1/tasks/{task_id}/why")
        assert "held.take-over" in [b["code"] for b in why["because"]]
        assert why["waits"] == ["held.take-over", "goal.interrupted"]
        early = service.refused("POST", "/v1/agents/lwd_1/handback")
        assert (early["status"], early["code"]) == (409, "not_in_command")

        machine.control = "engine"
        service.wire.say("lwd_1")
        service.wait(lambda: service.get("/v1/agents")["agents"][0]["control"] == "engine")
        service.wire.auto = True
        service.post("/v1/agents/lwd_1/handback", {"how": "end"})

        assert service.ends(task_id)["code"] == "taken_over"
        first = service.get(f"/v1/tasks/{task_id}/why")["because"][0]["text"]
        wording(first)


# -- why -----------------------------------------------------------------------------------------------------------------
def test_a_machine_that_no_pilot_took_is_not_handed_back(service: Service, wording: Wording) -> None:
    said = service.refused("POST", "/v1/agents/lwd_1/handback")
    assert said["code"] == "not_taken_over"
    wording(said["text"])


def test_why_tells_whom_a_task_waits_for(service: Service, wording: Wording) -> None:
    wire = service.wire
    wire.add("hwd_1", "hwd", service.host.site.ports["p3"].at, control="pilot")
    service.wait(lambda: len(service.get("/v1/agents")["agents"]) == 3)
    task_id = service.submit("Heavy")
    service.wait(lambda: "control" in service.codes(task_id))

    why = service.get(f"/v1/tasks/{task_id}/why")

    assert (why["status"], [b["code"] for b in why["because"]][:1]) == ("PENDING", ["pending"])
    assert why["waits"] == ["agents"]
    (line,) = [b for b in why["because"] if b["code"] == "control"]
    wording(line["text"])
    assert (line["agent"], line["role"]) == ("hwd_1", "drone")
    service.submit("Heavy")
    assert "queue" in service.codes("Heavy-2")
    assert service.call("DELETE", f"/v1/tasks/{task_id}")[0] == 200
    assert service.codes(task_id)[0] == "aborted"


def test_why_tells_of_a_machine_that_is_not_heard_of(start: Start) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        service.wait(lambda: service.wire.machines["lwd_1"].goal)
        assert "suspect" not in service.codes(task_id)
        service.wire.gone("lwd_1")
        service.wait(lambda: "suspect" in service.codes(task_id))
        (line,) = [b for b in service.get(f"/v1/tasks/{task_id}/why")["because"] if b["code"] == "suspect"]
        assert re.fullmatch(r"lwd_1 has not been heard of for \d s; it counts as lost after 30 s", line["text"]), line[
            "text"
        ]


def test_a_machine_that_was_removed_must_be_lost_and_named_twice(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        path = "/v1/agents/lwd_1/removed"
        refused = service.refused("POST", path, {"by": "eve"})
        assert refused["code"] == "not_confirmed"
        wording(refused["help"])
        word = {"by": "eve", "confirmed": "lwd_1"}
        assert service.refused("POST", path, word)["code"] == "still_heard"

        service.wire.gone("lwd_1")
        service.wait(lambda: service.get("/v1/agents")["agents"][0]["liveness"] == "SUSPECT")
        service.host.driver.ask(WallDue(LiveDue("lwd_1"), time.monotonic_ns() // 1000 + 3600 * SECOND))
        service.wait(lambda: service.get("/v1/agents")["agents"][0]["liveness"] == "LOST")

        wording(service.post(path, word)["text"])
        (found,) = [one for one in service.get("/v1/agents")["agents"] if one["id"] == "lwd_1"]
        assert (found["quarantine"], found["at"]) == ("removed", None)


def test_why_tells_where_a_task_failed(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = service.submit("Hello")
        service.wait(lambda: service.wire.machines["lwd_1"].goal)
        service.wire.auto = True
        service.wire.finish("lwd_1", "failed", "motor")

        end = service.ends(task_id)
        why = service.get(f"/v1/tasks/{task_id}/why")["because"]

        assert (end["status"], end["code"]) == ("FAILED", "failed:motor")
        assert end["failure"]["agent"] == "lwd_1"
        assert why[0]["code"] == "failed:motor"
        wording(why[1]["text"])
        assert why[1]["text"].endswith("hello.yaml:19 with lwd_1")


# -- people --------------------------------------------------------------------------------------------------------------
def test_a_question_is_answered_at_the_desk(service: Service) -> None:
    task_id = service.submit("Ask")
    service.wait(lambda: [q["shown"] for q in service.get("/v1/inbox")["questions"]] == [["watcher_1"]])

    (question,) = service.get("/v1/inbox")["questions"]

    assert (question["number"], question["here"], question["options"]) == (
        "Q1", ["watcher_1"], ["yes_it_is", "no_not_yet"]
    )  # fmt: skip
    assert "question" in service.codes(task_id)
    path = "/v1/inbox/Q1/answer"
    wrong = service.refused("POST", path, {"option": "maybe"})
    assert (wrong["status"], wrong["code"]) == (422, "bad_option")
    assert service.refused("POST", path, {"option": "yes_it_is", "by": "picker_1"})["code"] == "not_asked"
    service.post("/v1/inbox/q1/answer", {"option": "yes_it_is"})
    assert service.ends(task_id)["status"] == "SUCCEEDED"
    late = service.refused("POST", path, {"option": "yes_it_is"})
    assert (late["status"], late["code"]) == (409, "answer_late")
    assert service.get("/v1/inbox")["questions"] == []


def test_a_form_is_filled_in_at_the_desk_with_what_fits(service: Service) -> None:
    task_id = service.submit("Count")
    service.wait(lambda: [q["shown"] for q in service.get("/v1/inbox")["questions"]] == [["watcher_1"]])
    (question,) = service.get("/v1/inbox")["questions"]
    assert [one["name"] for one in question["form"]] == ["many", "spot"]
    path = "/v1/inbox/Q1/answer"
    for fields in ({}, {"many": 7}, {"many": -1, "spot": "camp"}, {"many": "much", "spot": "camp"},
                   {"many": 7, "spot": "nowhere"}, {"many": 7, "spot": "camp", "more": 1}):  # fmt: skip
        wrong = service.refused("POST", path, {"option": "done", "fields": fields})
        assert (wrong["status"], wrong["code"]) == (422, "bad_fields"), fields
    service.post(path, {"option": "done", "fields": {"many": 7, "spot": "camp"}})
    assert service.ends(task_id)["status"] == "SUCCEEDED"


def test_one_question_at_a_time_is_shown(service: Service) -> None:
    service.submit("Ask")
    service.submit("Ask")
    service.wait(lambda: len(service.get("/v1/inbox")["questions"]) == 2)

    problem = service.refused("POST", "/v1/inbox/Q2/answer", {"option": "yes_it_is"})

    assert (problem["code"], problem["help"]) == ("not_shown", "answer Q1 first")


def test_a_question_to_somebody_elsewhere_says_who_answers(start: Start, wording: Wording) -> None:
    with start(auto=False, desk={"picker_1": "picker"}) as service:
        service.wire.add("watcher_1", "watcher", service.host.site.places["camp"], mobility="people")
        service.submit("Ask")
        service.wait(lambda: [q["shown"] for q in service.get("/v1/inbox")["questions"]] == [["watcher_1"]])

        problem = service.refused("POST", "/v1/inbox/Q1/answer", {"option": "yes_it_is"})

        assert (problem["status"], problem["code"]) == (409, "not_here")
        wording(problem["text"])
        assert service.get("/v1/inbox")["questions"][0]["here"] == []
        assert service.get("/v1/inbox?person=picker_1")["questions"] == []


# -- events --------------------------------------------------------------------------------------------------------------
def read_events(
    service: Service, query: str, enough: int, headers: dict[str, str] | None = None
) -> list[dict[str, str]]:
    from urllib.request import Request

    found: list[dict[str, str]] = []
    event: dict[str, str] = {}
    with urlopen(Request(f"{service.url}/v1/events{query}", headers=headers or {}), timeout=10) as stream:
        for line in stream:
            name, _, value = line.decode().rstrip("\n").partition(":")
            if not line.strip():
                if "event" in event:
                    found.append(event)
                event = {}
                if len(found) >= enough:
                    break
            elif name:
                event[name] = value.strip()
    return found


def test_events_tell_the_life_of_a_task_and_go_on_after_an_id(service: Service) -> None:
    task_id = service.submit("Hello")
    service.ends(task_id)

    everything = read_events(service, f"?after=1.0&task={task_id}", 10)
    assert json.loads(everything[0]["data"])["text"] == f"{task_id} PENDING"
    assert {"task", "goal", "agent"} <= {e["event"] for e in everything}

    rest = read_events(service, f"?task={task_id}", 3, {"Last-Event-ID": everything[4]["id"]})
    assert [e["id"] for e in rest] == [e["id"] for e in everything[5:8]]


def test_a_reader_of_a_former_start_is_told_of_the_gap(start: Start, tmp_path: Path) -> None:
    with start():
        pass
    with start() as service:
        assert service.host.epoch == 2
        first = read_events(service, "", 1, {"Last-Event-ID": "1.17"})[0]
        assert first["event"] == "gap"
    assert (tmp_path / ".formiga" / "meadow" / "epoch").read_text() == "2\n"


# -- the engine ------------------------------------------------------------------------------------------------------------
def test_health_and_library(service: Service) -> None:
    health = service.get("/v1/health")
    assert (health["status"], health["site"], health["epoch"]) == ("ok", "meadow", 1)
    assert health["agents"] == {"people": 1, "STANDBY": 1}
    assert health["load"]["behind_s"] == 0.0
    assert health["load"]["most_waiting"] >= 1
    assert set(health["load"]["waiting"]) <= {
        "orders",
        "news of HIGH tasks",
        "news",
        "HIGH requests",
        "requests",
        "telemetry",
    }
    library = service.get("/v1/library")
    tasks = {one["task"]: one for one in library["tasks"]}
    assert list(tasks) == ["Ask", "Count", "Heavy", "Hello", "Sos", "Stay"]
    assert [p["name"] for p in tasks["Hello"]["params"]] == ["target", "height"]


def test_openapi_describes_all_routes(service: Service) -> None:
    document = service.get("/v1/openapi.json")
    assert {"/v1/tasks", "/v1/tasks/{task_id}/why", "/v1/inbox/{number}/answer", "/v1/events"} <= set(document["paths"])


@pytest.mark.parametrize("needs_token", [False, True])
def test_openapi_says_of_each_route_whether_it_wants_the_token(service: Service, *, needs_token: bool) -> None:
    service.host.needs_token = needs_token
    app: Any = api.application(service.host)
    document = json.loads(next(one for one in app.routes if one.path == "/v1/openapi.json").endpoint().body)

    scheme = document["components"]["securitySchemes"]["token"]
    assert (scheme["type"], scheme["scheme"]) == ("http", "bearer")
    routes = {f"{verb} {path}": one for path, ways in document["paths"].items() for verb, one in ways.items()}
    assert {"post /v1/tasks", "get /v1/events", "post /v1/admin/stop"} <= set(routes)
    wants = [{"token": []}] if needs_token else [{}, {"token": []}]
    assert {name for name, one in routes.items() if one.get("security") != wants} == set()


def test_the_openapi_document_of_a_simulation_on_the_loopback_lets_a_caller_in_without_a_token(
    service: Service,
) -> None:
    assert service.get("/v1/openapi.json")["paths"]["/v1/tasks"]["post"]["security"] == [{}, {"token": []}]


def test_drain_admits_nothing_more_and_ends_with_the_last_task(service: Service) -> None:
    task_id = service.submit("Stay")
    service.post("/v1/admin/drain")
    assert service.get("/v1/health")["status"] == "draining"
    assert not service.host.is_over()
    closed = service.refused("POST", "/v1/tasks", {"task": "Stay"})
    assert (closed["status"], closed["code"]) == (503, "closed")
    service.call("DELETE", f"/v1/tasks/{task_id}")
    service.ends(task_id)
    assert service.host.is_over()


def test_stop_is_asked_for(service: Service, wording: Wording) -> None:
    service.submit("Stay")
    wording(service.post("/v1/admin/stop")["text"])
    assert service.host.is_over()


def test_a_bug_that_stops_the_engine_is_told(service: Service) -> None:
    def broken(*_: object) -> None:
        raise AssertionError("planted")

    service.host.driver.engine.handle = broken  # type: ignore[method-assign,assignment]
    problem = service.refused("POST", "/v1/tasks", {"task": "Stay"})
    assert (problem["status"], problem["code"]) == (503, "stopped")
    assert service.get("/v1/health")["status"] == "failed"
    assert service.host.is_over()


def test_ids_go_on_after_a_restart(start: Start) -> None:
    with start() as service:
        assert service.submit("Stay") == "Stay-1"
        time_before = service.get("/v1/health")["at"]
    with start() as service:
        assert service.submit("Stay") == "Stay-2"
        assert service.get("/v1/health")["at"] >= time_before


def test_a_deposed_engine_says_so_and_its_next_start_has_an_epoch_that_its_agents_accept(service: Service) -> None:
    own = service.host.epoch
    service.wire.machines["lwd_1"].epoch = own + 500
    service.wait(lambda: service.get("/v1/health")["status"] == "deposed")
    assert "formiga down" in service.get("/v1/health")["text"]
    file = service.host._folder.path / "epoch"
    service.wait(lambda: int(file.read_text()) + 1 == own + 501)


def test_tasks_under_way_are_listed_before_all_others(start: Start) -> None:
    with start(auto=False) as service:
        fly = {"target": "lake_shore", "height": "30 m"}
        first = service.submit("Hello", **fly)
        service.wait(lambda: service.task(first)["status"] == "ACTIVE")
        waiting = [service.submit("Hello", **fly) for _ in range(3)]  # there is one machine
        assert [one["id"] for one in service.get("/v1/tasks")["tasks"]] == [first, *reversed(waiting)]
        assert [one["id"] for one in service.get("/v1/tasks?limit=1")["tasks"]] == [first]


def test_agents_are_listed_by_name_and_one_at_a_port_by_the_ports_name(service: Service) -> None:
    site = service.host.site
    port = next(port for port in site.ports.values() if port.name != "p1")
    for name in ("lwd_10", "lwd_9"):
        service.wire.add(name, "lwd", port.at if name == "lwd_9" else Place(0.0, 300.0))
    service.wait(lambda: len([a for a in service.get("/v1/agents")["agents"] if a["at"]]) >= 3)

    machines = [a for a in service.get("/v1/agents")["agents"] if a["mobility"] != "people"]
    assert [a["id"] for a in machines] == ["lwd_1", "lwd_9", "lwd_10"]
    assert [a["port"] for a in machines][1:] == [port.name, ""]
