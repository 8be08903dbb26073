"""Orders over HTTP to a real engine: stops, continue, restart, lockdown, hand-back, preflight, and how refusals read."""

from typing import Any

import pytest

from tests.golden import Wording
from tests.unit.services.conftest import Service, Start

pytestmark = pytest.mark.network


def fly(service: Service) -> str:
    """Let a drone fly until it is on its way, in the air."""
    task_id = service.submit("Hello")
    machine = service.wire.machines["lwd_1"]
    service.wait(lambda: machine.goal is not None and machine.goal.action == "TakeOff")
    service.wire.finish("lwd_1")
    service.wait(lambda: machine.goal is not None and machine.goal.action == "GoTo")
    return task_id


def drone(service: Service) -> Any:
    (found,) = [a for a in service.get("/v1/agents")["agents"] if a["id"] == "lwd_1"]
    return found


def standing(service: Service) -> Any:
    """Return the order that stands on the drone; {}: none does."""
    return next((one for one in service.get("/v1/agents")["orders"] if one["agent"] == "lwd_1"), {})


def order(service: Service, path: str, name: str, **more: str) -> Any:
    return service.post(f"/v1/{path}", {"order": name, "by": "eve", **more})


def test_a_machine_holds_and_goes_on(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = fly(service)

        reply = order(service, "agents/lwd_1/orders", "hold")

        assert [one["who"] for one in reply["ordered"]] == ["lwd_1"]
        wording(reply["ordered"][0]["text"])
        assert reply["next"] == [f"formiga continue {task_id}", f"formiga abort {task_id}"]
        service.wait(lambda: service.task(task_id)["held"] == ["operator:lwd_1"])
        assert standing(service)["stop"] == "hold"
        assert standing(service)["next"] == reply["next"]
        assert service.get("/v1/tasks")["orders"][0]["by"] == "eve"
        assert {"held.operator", "interrupted"} <= set(service.codes(task_id))
        assert order(service, "agents/lwd_1/orders", "hold")["stands_already"]

        service.wire.auto = True
        reply = order(service, f"tasks/{task_id}/orders", "continue")

        wording(reply["text"])
        assert service.ends(task_id)["status"] == "SUCCEEDED"
        assert (drone(service)["order"], standing(service)) == ("", {})


def test_a_task_returns_and_can_only_be_restarted_then(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = fly(service)
        service.wire.auto = True

        reply = order(service, f"tasks/{task_id}/orders", "return")

        assert reply["ordered"][0]["text"].startswith("lwd_1 ")
        service.wait(lambda: standing(service).get("state") == "done")
        assert service.wire.machines["lwd_1"].landed == "grounded"
        assert service.task(task_id)["held"] == ["operator"]
        refused = service.refused("POST", f"/v1/tasks/{task_id}/orders", {"order": "continue"})
        assert (refused["status"], refused["code"]) == (409, "cannot_continue")
        wording(refused["text"])
        assert standing(service)["next"] == [f"formiga restart {task_id}", f"formiga abort {task_id}"]

        order(service, f"tasks/{task_id}/orders", "restart")

        end = service.ends(task_id)
        assert (end["status"], end["run"]) == ("SUCCEEDED", 2)


def test_everything_lands_and_people_are_left_alone(start: Start) -> None:
    with start(auto=False) as service:
        fly(service)
        service.wire.auto = True

        reply = order(service, "orders", "land")

        assert [one["who"] for one in reply["ordered"]] == ["lwd_1"]
        assert reply["next"][-1] == "formiga tasks"
        service.wait(lambda: service.wire.machines["lwd_1"].landed == "grounded")


def test_lockdown_stops_admission_and_flights_until_its_release(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = fly(service)
        service.wire.auto = True
        assert not service.get("/v1/lockdown")["on"]

        reply = service.post("/v1/lockdown", {"how": "return", "by": "eve"})

        wording(reply["text"])
        assert [one["who"] for one in reply["ordered"]] == ["lwd_1"]
        assert service.post("/v1/lockdown")["stands_already"]  # nothing said means return
        shown = service.get("/v1/lockdown")
        assert (shown["on"], shown["how"], shown["by"]) == (True, "return", "eve")
        assert service.get("/v1/tasks")["lockdown"]["on"]
        assert service.get("/v1/health")["lockdown"]["on"]
        assert service.task(task_id)["held"] == ["lockdown"]
        closed = service.refused("POST", "/v1/tasks", {"task": "Stay"})
        assert (closed["status"], closed["code"], closed["help"]) == (409, "lockdown", "formiga lockdown release")
        assert service.refused("POST", f"/v1/tasks/{task_id}/orders", {"order": "continue"})["code"] == "lockdown"
        assert service.post("/v1/lockdown", {"how": "return"})["stands_already"]
        service.wait(lambda: service.wire.machines["lwd_1"].landed == "grounded")

        reply = service.post("/v1/lockdown", {"how": "release"})

        assert [one["who"] for one in reply["skipped"]] == [task_id]
        assert not service.get("/v1/lockdown")["on"]
        assert service.task(task_id)["held"] == ["operator"]
        service.submit("Stay")


def taken(service: Service) -> str:
    """Let a pilot take the drone over in the air, and give it back."""
    task_id = fly(service)
    machine = service.wire.machines["lwd_1"]
    machine.control = "pilot"
    service.wire.finish("lwd_1", "taken_over")
    service.wait(lambda: service.task(task_id)["held"] == ["take-over:lwd_1"])
    assert drone(service)["taken"]
    machine.control = "engine"
    service.wire.say("lwd_1")
    service.wait(lambda: drone(service)["control"] == "engine")
    assert service.task(task_id)["held"] == ["take-over:lwd_1"]
    service.wire.auto = True
    return task_id


def test_handback_continue_sends_the_interrupted_step_again(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        task_id = taken(service)
        reply = service.post("/v1/agents/lwd_1/handback", {"how": "continue", "by": "eve"})
        wording(reply["text"])
        assert service.ends(task_id)["status"] == "SUCCEEDED"
        events, _ = service.host.feed.after(0)
        assert [event.data["taken"] for event in events if "taken" in event.data] == [True, False]


def test_handback_return_brings_the_machine_home_and_leaves_its_task_held(start: Start) -> None:
    with start(auto=False) as service:
        task_id = taken(service)
        reply = service.post("/v1/agents/lwd_1/handback", {"how": "return"})
        assert reply["next"][-1] == f"formiga abort {task_id}"
        service.wait(lambda: service.wire.machines["lwd_1"].landed == "grounded")
        assert service.task(task_id)["held"] == ["operator:lwd_1"]
        assert service.call("DELETE", f"/v1/tasks/{task_id}")[0] == 200
        assert service.ends(task_id)["status"] == "CANCELED"


def test_handback_end_fails_the_interrupted_step(start: Start) -> None:
    with start(auto=False) as service:
        task_id = taken(service)
        service.post("/v1/agents/lwd_1/handback", {"how": "end"})
        assert service.ends(task_id)["code"] == "taken_over"


@pytest.mark.parametrize(
    ("path", "body", "status", "code"),
    [
        ("agents/nobody/orders", {"order": "hold"}, 404, "unknown_agent"),
        ("agents/watcher_1/orders", {"order": "hold"}, 409, "human"),
        ("agents/lwd_1/orders", {"order": "cut"}, 422, "not_confirmed"),
        ("agents/lwd_1/orders", {"order": "cut", "confirmed": "lwd_1"}, 409, "not_announced"),
        ("agents/lwd_1/orders", {"order": "restart"}, 422, "bad_request"),
        ("agents/lwd_1/orders", {"order": "continue"}, 409, "not_held"),
        ("tasks/None-1/orders", {"order": "hold"}, 404, "unknown_target"),
        ("tasks/lwd_1/orders", {"order": "hold"}, 404, "unknown_task"),
        ("orders", {"order": "cut"}, 422, "bad_request"),
        ("orders", {"order": "hold", "target": "lwd_1"}, 422, "bad_request"),
        ("lockdown", {"how": "cut"}, 422, "bad_request"),
        ("agents/lwd_1/handback", {"how": "continue"}, 409, "not_taken_over"),
    ],
)
def test_a_refused_order_has_a_code_and_what_helps(
    service: Service, path: str, body: dict[str, str], status: int, code: str
) -> None:
    refused = service.refused("POST", f"/v1/{path}", body)
    assert (refused["status"], refused["code"]) == (status, code)
    assert refused["help"]


def test_orders_for_tasks_that_wait_or_have_ended_are_refused(service: Service) -> None:
    service.wire.add("hwd_1", "hwd", service.host.site.ports["p3"].at, control="pilot")
    waiting = service.submit("Heavy")
    refused = service.refused("POST", f"/v1/tasks/{waiting}/orders", {"order": "hold"})
    assert (refused["code"], refused["help"]) == ("not_started", f"formiga abort {waiting}")
    service.call("DELETE", f"/v1/tasks/{waiting}")
    refused = service.refused("POST", f"/v1/tasks/{waiting}/orders", {"order": "hold"})
    assert (refused["code"], refused["help"]) == ("already_ended", f"formiga why {waiting} shows how")


def test_a_machine_that_has_told_no_checks_is_not_ready(service: Service, wording: Wording) -> None:
    found = service.get("/v1/agents/lwd_1/preflight")
    assert (found["ok"], found["checks"], found["required"]) == (False, [], False)
    wording(found["text"])


def test_events_tell_of_orders_and_lockdown(start: Start, wording: Wording) -> None:
    with start(auto=False) as service:
        fly(service)
        service.wire.auto = True
        order(service, "agents/lwd_1/orders", "hold")
        service.post("/v1/lockdown", {"how": "hold", "by": "eve"})
        service.post("/v1/lockdown", {"how": "release"})
        events, _ = service.host.feed.after(0)
        told = [(event.type, event.text) for event in events if event.type in ("order", "lockdown")]
        assert told[0][0] == "order"
        wording(told[0][1], [text for kind, text in told if kind == "lockdown"])


def test_openapi_describes_the_orders(service: Service) -> None:
    document = service.get("/v1/openapi.json")
    assert {
        "/v1/agents/{agent}/orders", "/v1/tasks/{task_id}/orders", "/v1/orders", "/v1/lockdown",
        "/v1/agents/{agent}/handback", "/v1/agents/{agent}/preflight",
    } <= set(document["paths"])  # fmt: skip
    assert set(document["paths"]["/v1/lockdown"]) == {"get", "post"}
