"""Alarms over HTTP and by command: listed, acknowledged by whom their role lets, and there again after a start."""

import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.accounts import Account
from formiga_bt.base.roles import Role
from formiga_bt.cli.app import run
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Service, Start
from tests.unit.services.test_access import let_in

pytestmark = pytest.mark.network


def alarms(service: Service, *, cleared: bool = False) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = service.get(f"/v1/alarms?cleared={str(cleared).lower()}")["alarms"]
    return found


def test_an_alarm_is_acknowledged_and_its_owner_is_the_account(service: Service) -> None:
    ann, vera = let_in(service, ann=Account((Role.RESPONDER,)), vera=Account((Role.VIEWER,))).values()
    service.post("/v1/lockdown", {"how": "hold"})
    (alarm,) = alarms(service)
    assert (alarm["code"], alarm["state"]) == ("lockdown", "raised")

    assert service.refused("POST", "/v1/alarms/A1/ack", {}, vera)["code"] == "no_role"
    service.post("/v1/alarms/a1/ack", {"by": "somebody else", "note": "the mast fell"}, **ann)
    (alarm,) = alarms(service)
    assert (alarm["state"], alarm["owner"], alarm["history"][-1]["note"]) == ("acknowledged", "ann", "the mast fell")
    assert service.refused("POST", "/v1/alarms/A1/ack")["code"] == "already_acknowledged"
    assert service.refused("POST", "/v1/alarms/A7/ack")["code"] == "unknown_alarm"
    assert service.refused("POST", "/v1/alarms/A1/ack", {"note": "x" * 501})["code"] == "bad_request"

    service.post("/v1/lockdown", {"how": "release"})
    assert alarms(service) == []
    assert [turn["what"] for turn in alarms(service, cleared=True)[0]["history"]] == [
        "raised",
        "acknowledged",
        "cleared",
    ]
    told = [event.text for event in service.host.feed.after(0)[0] if event.text.startswith("A1")]
    assert [text.split(" is ")[1] for text in told] == ["acknowledged by ann", "cleared"]


def test_alarms_are_there_after_a_start(start: Start, tmp_path: Path) -> None:
    kept = JournalAt(str(tmp_path / "journal.db"))
    with start(journal=kept) as service:
        service.post("/v1/lockdown", {"how": "hold"})
        service.post("/v1/alarms/A1/ack", {"by": "ann"})
    with start(journal=kept) as service:
        (alarm,) = alarms(service)
        assert (alarm["id"], alarm["state"], alarm["owner"]) == ("A1", "acknowledged", "ann")
        service.post("/v1/lockdown", {"how": "release"})
        assert alarms(service) == []


def test_the_house_is_an_alarm_like_any_other(start: Start, tmp_path: Path) -> None:
    (tmp_path / ".formiga" / "meadow").mkdir(parents=True)
    (tmp_path / ".formiga" / "meadow" / "marks.json").write_text("no JSON", encoding="utf-8")
    with start() as service:
        service.wait(lambda: alarms(service))
        (alarm,) = alarms(service)
        assert (alarm["code"], alarm["about"], alarm["severity"]) == ("set_aside", "marks.json", "alarm")


def test_the_command_lists_and_acknowledges(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["alarms"]) == 0
    service.post("/v1/lockdown", {"how": "hold"})
    capsys.readouterr()
    assert run(["alarms"]) == 0
    assert "A1" in capsys.readouterr().out
    assert run(["alarms", "ack", "A1", "--note", "on my way"]) == 0
    capsys.readouterr()
    assert run(["alarms", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["total"], found["alarms"][0]["state"]) == (1, "acknowledged")
    assert run(["alarms", "ack"]) != 0
