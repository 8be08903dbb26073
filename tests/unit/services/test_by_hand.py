"""Agents given by hand over HTTP: what is answered, refused with its reason and hint, by whom, and twice."""

import re
import shlex
from pathlib import Path

import pytest

from formiga_bt.base.accounts import Account
from formiga_bt.base.roles import Role
from formiga_bt.cli.app import run
from tests.unit.services.conftest import Service
from tests.unit.services.test_access import let_in

pytestmark = pytest.mark.network
PAGE = Path(__file__).parents[3] / "docs" / "operating.md"


def waiting(service: Service, *names: str) -> list[str]:
    """Let tasks wait for the machine lwd_1, on which an order stands."""
    service.post("/v1/orders", {"order": "hold"})
    return [service.submit(name) for name in names]


def free(service: Service) -> None:
    service.post("/v1/orders", {"order": "continue"})


def test_a_machine_is_refused_with_the_filter_that_refuses_it_and_what_helps(service: Service) -> None:
    (mine,) = waiting(service, "Hello")
    no = service.refused("POST", f"/v1/tasks/{mine}/assign", {"agent": "lwd_1"})
    assert (no["code"], no["help"]) == ("ordered", "formiga continue lwd_1")
    near = service.refused("POST", f"/v1/tasks/{mine}/assign", {"agent": "lwd_2"})
    assert (near["code"], near["status"], near["near"]) == ("unknown_agent", 404, ["lwd_1"])
    assert service.refused("POST", "/v1/tasks/No-1/assign", {"agent": "lwd_1"})["status"] == 404
    assert service.refused("POST", f"/v1/tasks/{mine}/assign", {"agent": "watcher_1"})["code"] == "wrong_type"


def test_what_is_granted_is_told_and_taken_back(service: Service) -> None:
    mine = service.submit("Hello")
    service.wait(lambda: service.task(mine)["status"] == "ACTIVE")
    assert service.post(f"/v1/tasks/{mine}/assign", {"agent": "lwd_1"})["granted"], "it has it already"
    back = service.post("/v1/agents/lwd_1/unassign", {"by": "eve"})
    assert (back["task"], back["agent"]) == (mine, "lwd_1")
    service.wait(lambda: service.task(mine)["status"] == "PENDING" and service.task(mine)["run"] == 2)
    assert "taken_back" in service.codes(mine)
    service.wait(lambda: service.get("/v1/agents")["agents"][0]["pool"] == "STANDBY")
    found = service.post(f"/v1/tasks/{mine}/assign", {"agent": "lwd_1"})
    assert (found["granted"], found["role"]) == (True, "drone")


def test_the_priority_of_what_waits_is_changed(service: Service) -> None:
    first, second = waiting(service, "Hello", "Hello")
    service.post(f"/v1/tasks/{second}/priority", {"priority": "high"})
    assert service.task(second)["priority"] == "high"
    free(service)
    service.wait(lambda: service.task(second)["status"] == "ACTIVE")
    assert service.task(first)["status"] == "PENDING"
    assert service.refused("POST", f"/v1/tasks/{second}/priority", {"priority": "low"})["code"] == "already_started"


def test_it_takes_an_operator_and_the_name_is_the_accounts(service: Service) -> None:
    pilot, operator = let_in(service, pia=Account((Role.PILOT,)), ola=Account((Role.OPERATOR,))).values()
    mine = service.submit("Hello")
    service.wait(lambda: service.task(mine)["status"] == "ACTIVE")
    no = service.refused("POST", "/v1/agents/lwd_1/unassign", {}, pilot)
    assert no["code"] == "no_role"
    assert "operator" in no["text"]
    service.post("/v1/agents/lwd_1/unassign", {"by": "eve"}, **operator)
    service.wait(lambda: service.task(mine)["run"] == 2)
    assert "ola" in " ".join(b["text"] for b in service.get(f"/v1/tasks/{mine}/why")["because"])


def test_the_commands_of_the_page_do_as_it_says(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = PAGE.read_text(encoding="utf-8")
    section = re.search(r"### Agents by hand\n.*?```\n(.*?)```", text, re.DOTALL)
    assert section is not None
    give, back = [line.partition("#")[0].split()[1:] for line in section[1].splitlines()]
    first = re.findall(r"`formiga (priority [^`]*)`", text)
    assert [give[0], back[0], len(first)] == ["assign", "unassign", 2]
    monkeypatch.chdir(tmp_path)
    service.post("/v1/orders", {"order": "hold"})
    mine = service.submit("Hello")
    named = {"PickUp-3": mine, "Survey-4": mine, "hwd_2": "lwd_1"}

    def said(words: list[str]) -> int:
        return run([named.get(word, word) for word in words])

    assert [said(words.split()) for words in first] == [0, 0]
    assert said(give) == 1
    assert "formiga continue lwd_1" in capsys.readouterr().err
    service.post("/v1/agents/lwd_1/orders", {"order": "continue"})
    service.wait(lambda: said(give) == 0)
    assert said(back) == 0
    assert "begins anew without it" in capsys.readouterr().out


def test_a_machine_is_taken_out_of_service_and_back(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    section = re.search(r"### Out of service\n.*?```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert section is not None
    out, back = [[w.replace("hwd_1", "lwd_1") for w in shlex.split(line)[1:]] for line in section[1].splitlines()]
    monkeypatch.chdir(tmp_path)
    assert run([*out, "--by", "eve"]) == 0
    assert run(["agents"]) == 0
    assert "out of service: rotor 2 shakes (eve)" in capsys.readouterr().out
    mine = service.submit("Hello")
    service.wait(lambda: "out" in service.codes(mine))
    assert run(["agents", "out", "lwd_1"]) == 2
    assert service.refused("POST", "/v1/agents/lwd_1/out", {"reason": ""})["status"] == 422
    assert run(back) == 0
    service.wait(lambda: service.task(mine)["status"] != "PENDING")
