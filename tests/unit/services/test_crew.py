"""Approvals and pilots over HTTP and on disk: a real engine of a site in mode real."""

import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.site_folder import APPROVALS
from formiga_bt.services.crew import keep, standing, taken_back
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.transport.messages import PreflightCheck
from tests.golden import Wording
from tests.unit.services.conftest import Service, Start, make_real

pytestmark = pytest.mark.network


@pytest.fixture
def real(tmp_path: Path, start: Start) -> Start:
    """Start a service whose site is in mode real."""
    make_real(tmp_path)
    return start


def digest(service: Service, task: str) -> str:
    (found,) = [t for t in service.get("/v1/approvals")["tasks"] if t["task"] == task]
    return str(found["digest"])


def body(service: Service, task: str = "Hello", by: str = "ann", **more: Any) -> dict[str, Any]:
    whole = digest(service, task)
    return {"task": task, "by": by, "digest": whole, "typed": whole[:8], **more}


def ready(service: Service) -> None:
    machine = service.wire.machines["lwd_1"]
    machine.checks = (PreflightCheck("gnss", True, "14 satellites"),)
    service.wire.say("lwd_1")


def test_from_refused_to_flown_and_logged(real: Start, tmp_path: Path, wording: Wording) -> None:
    with real() as service:
        refused = service.refused("POST", "/v1/tasks", {"task": "Hello", "by": "rita"})
        assert (refused["status"], refused["code"]) == (403, "not_approved")
        wording(refused["text"])

        said = service.post("/v1/approvals", body(service))["text"]
        wording(said)
        task_id = service.submit("Hello")
        service.wait(lambda: "no_pilot" in service.codes(task_id))
        (line,) = [b for b in service.get(f"/v1/tasks/{task_id}/why")["because"] if b["code"] == "no_pilot"]
        wording(line["text"], line["hint"], service.post("/v1/pilots/pia/duty", {"on": True})["text"])
        service.wait(lambda: "no_checks" in service.codes(task_id))
        ready(service)
        assert service.ends(task_id)["status"] == "SUCCEEDED"
    (flight,) = [json.loads(line) for line in (tmp_path / ".formiga/meadow/flights.jsonl").read_text().splitlines()]
    assert (flight["agent"], flight["pilot"], flight["task"], flight["mode"]) == ("lwd_1", "pia", task_id, "real")
    assert (flight["landed_by"], flight["requester"]) == ("task", "http")


@pytest.mark.parametrize(
    ("change", "status", "code"),
    [
        ({"typed": ""}, 422, "not_confirmed"),
        ({"typed": "12345678"}, 422, "not_confirmed"),
        ({"digest": "0" * 64}, 409, "not_served"),
        ({"by": "rita"}, 403, "not_approver"),
        ({"task": "Nothing"}, 404, "unknown_task"),
        ({"revoke": True}, 403, "not_approved"),
    ],
)
def test_what_does_not_approve(real: Start, change: dict[str, Any], status: int, code: str) -> None:
    with real() as service:
        refused = service.refused("POST", "/v1/approvals", {**body(service), **change})
        assert (refused["status"], refused["code"]) == (status, code)
        assert service.get("/v1/approvals")["others"] == []
        assert all(not t["approval"] for t in service.get("/v1/approvals")["tasks"])


def test_an_approval_outlives_the_engine_until_it_is_taken_back_and_duty_does_not(real: Start, tmp_path: Path) -> None:
    folder = tmp_path / ".formiga/meadow"
    with real() as service:
        service.post("/v1/approvals", body(service))
        service.post("/v1/pilots/pia/duty", {"on": True})
        given = service.get("/v1/approvals")["tasks"]
    with real() as service:
        assert service.get("/v1/approvals")["tasks"] == given
        assert not service.get("/v1/pilots")["pilots"][0]["since"]
        assert len((folder / APPROVALS).read_text().splitlines()) == 1
        said = service.post("/v1/approvals", body(service, by="bob", revoke=True))["text"]
        assert said.endswith("is taken back")
    with real() as service:
        assert service.refused("POST", "/v1/tasks", {"task": "Hello"})["code"] == "not_approved"
    assert [line.get("by") for line in map(json.loads, (folder / APPROVALS).read_text().splitlines())] == ["ann", "bob"]
    assert standing(folder) == []


def test_what_was_taken_back_right_before_a_kill_stands_no_more(real: Start, tmp_path: Path) -> None:
    with real(journal=JournalAt(durability="normal")) as service:
        service.post("/v1/approvals", body(service))
        whole = digest(service, "Hello")
    # The line was written, and the engine was killed before the step was in the journal; who said so approves no more. As if it
    # had been taken back while no engine ran, whose clock need not be that of the engine.
    keep(tmp_path / ".formiga/meadow", digest=whole, task="Hello", by="gone", at=1, revoke=True)
    with real(journal=JournalAt(durability="normal")) as service:
        assert service.refused("POST", "/v1/tasks", {"task": "Hello", "by": "rita"})["code"] == "not_approved"
        service.post("/v1/approvals", body(service))
    with real(journal=JournalAt(durability="normal")) as service:
        assert [t["approval"]["by"] for t in service.get("/v1/approvals")["tasks"] if t["task"] == "Hello"] == ["ann"]


def test_the_last_word_about_an_approval_counts(tmp_path: Path) -> None:
    assert taken_back(tmp_path, ("ab", "cd")) == ()
    keep(tmp_path, digest="ab", task="Hello", by="ann", at=5)
    assert taken_back(tmp_path, ("ab", "cd")) == ()
    keep(tmp_path, digest="ab", task="Hello", by="ann", at=4, revoke=True)
    assert taken_back(tmp_path, ("ab", "cd")) == ("ab",)
    keep(tmp_path, digest="ab", task="Hello", by="ann", at=3)
    assert taken_back(tmp_path, ("ab", "cd")) == ()


def test_an_approval_of_another_version_is_listed_and_does_not_count(real: Start, tmp_path: Path) -> None:
    keep(tmp_path / ".formiga/meadow", digest="ab" * 32, task="Hello", by="ann", at=1_800_000_000_000_000)
    with real() as service:
        (other,) = service.get("/v1/approvals")["others"]
        assert other == {"task": "Hello", "digest": "ab" * 32, "by": "ann", "at": 1_800_000_000_000_000}
        assert service.refused("POST", "/v1/tasks", {"task": "Hello"})["code"] == "not_approved"


def test_pilots_and_what_flies_under_their_names(real: Start, wording: Wording) -> None:
    with real(auto=False) as service:
        ready(service)
        service.post("/v1/approvals", body(service))
        service.post("/v1/pilots/pia/duty", {"on": True})
        task_id = service.submit("Hello")
        service.wait(lambda: service.task(task_id)["goals"])

        (pia,) = service.get("/v1/pilots")["pilots"]
        assert (pia["pilot"], pia["since"] is None, pia["max_airborne"], pia["machines"]) == (
            "pia",
            False,
            1,
            ["lwd_1"],
        )
        said = service.post("/v1/pilots/pia/duty", {"on": False})["text"]
        wording(said)
        assert service.refused("POST", "/v1/pilots/ann/duty", {"on": True})["code"] == "unknown_pilot"
