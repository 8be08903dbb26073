"""Standing rules over HTTP: listed, explained, started and dismissed by a word, approved, and there again after a start."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.client import Client
from formiga_bt.client.calls import ApiError
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Service, Start, make_real

pytestmark = pytest.mark.network
RULES = (
    "formiga_rules: 1\nrules:\n  help: {on: picker.sos, request: Sos}\n  other: {on: picker.geofence, request: Sos}\n"
)
DESK = {"picker_1": "picker"}


@pytest.fixture
def ruled(tmp_path: Path, start: Start) -> Start:
    """Start a service whose site has two rules, with a picker at its desk."""
    (tmp_path / "rules").mkdir()
    (tmp_path / "rules" / "pickers.yaml").write_text(RULES, encoding="utf-8")
    (tmp_path / "trees").mkdir()
    text = "formiga: 1\ntask: Sos\nagents: {picker: {type: picker}}\nsteps: [{wait_for: picker.sos, timeout: 1 h}]\n"
    (tmp_path / "trees" / "sos.yaml").write_text(text, encoding="utf-8")
    return start


def press(service: Service, event: str = "sos") -> None:
    service.post("/v1/agents/picker_1/events", {"event": event, "fields": {}})


def rule(service: Service, name: str = "help") -> dict[str, Any]:
    return next(one for one in service.get("/v1/rules")["rules"] if one["name"] == name)


def fired(service: Service, times: int, name: str = "help") -> dict[str, Any]:
    service.wait(lambda: rule(service, name)["fired"] == times)
    return rule(service, name)


def test_an_event_starts_its_task_and_both_are_explained(ruled: Start) -> None:
    with ruled(desk=DESK) as service:
        press(service)
        (task_id,) = fired(service, 1)["running"]
        assert service.task(str(task_id))["by"] == "rule:help"
        assert "rule" in service.codes(str(task_id))
        why = service.get("/v1/rules/help/why")
        assert (why["of"], why["status"]) == ("rule:help", "RUNS")
        assert {line["code"] for line in why["because"]} >= {"on", "started"}
        assert service.get("/v1/rules/other/why")["status"] == "WATCHES"


def test_what_happens_in_lockdown_waits_for_a_word(ruled: Start) -> None:
    with ruled(desk=DESK) as service:
        client = Client(service.host.address)
        service.post("/v1/lockdown", {"how": "return"})
        press(service)
        (waits,) = fired(service, 1)["waits"]
        assert (waits["agent"], waits["code"]) == ("picker_1", "lockdown")
        assert client.explanation("rule:help").status == "WAITS"
        assert service.refused("POST", "/v1/rules/help/start")["code"] == "lockdown"
        service.post("/v1/lockdown", {"how": "release"})
        assert "Sos-" in client.rule_word("help", "start", by="eve")
        assert rule(service)["waits"] == []
        assert service.refused("POST", "/v1/rules/help/dismiss")["code"] == "not_waiting"
        assert service.refused("GET", "/v1/rules/hlep/why")["near"] == ["help"]
        with pytest.raises(ApiError, match="no rule"):
            client.explanation("rule:hlep")


def test_what_waits_is_there_after_a_start_and_can_be_dismissed(ruled: Start, tmp_path: Path) -> None:
    kept = JournalAt(str(tmp_path / "journal.db"))
    with ruled(desk=DESK, journal=kept) as service:
        service.post("/v1/lockdown", {"how": "return"})
        press(service)
        fired(service, 1)
    with ruled(desk=DESK, journal=kept) as service:
        assert fired(service, 1)["waits"]
        assert "dismissed" in service.post("/v1/rules/help/dismiss", {"agent": "picker_1", "by": "eve"})["text"]
        found = rule(service)
        assert (found["waits"], found["last"][-1]["by"]) == ([], "eve")


def test_rules_are_approved_with_their_digest(ruled: Start, tmp_path: Path) -> None:
    make_real(tmp_path)
    with ruled(desk=DESK) as service:
        assert rule(service)["approved"] is False
        press(service)
        assert fired(service, 1)["waits"][0]["code"] == "not_approved"
        for task in ("rules", "Sos"):
            (digest,) = [one["digest"] for one in service.get("/v1/approvals")["tasks"] if one["task"] == task]
            body = {"task": task, "by": "ann", "digest": digest, "typed": digest[:8]}
            wrong = {**body, "typed": "12345678"}
            assert service.refused("POST", "/v1/approvals", wrong)["code"] == "not_confirmed"
            service.post("/v1/approvals", body)
        assert rule(service)["approved"] is True
        press(service)
        assert fired(service, 2)["running"]
        service.post("/v1/approvals", {**body, "task": "rules", "digest": "", "revoke": True})
        assert rule(service)["approved"] is False
