"""`formiga handover`: nothing that the next shift must know is missing, and each thing is said once."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.operator.handover import handover
from formiga_bt.client import Client, connect
from tests.unit.services.conftest import Service, Start, make_real, secret_of

pytestmark = pytest.mark.network


def test_all_that_is_open_is_told(service: Service, capsys: pytest.CaptureFixture[str]) -> None:
    client = Client(service.host.address)
    empty = handover(client)
    assert (empty.runs, empty.waits, empty.held, empty.questions, empty.orders) == ((), (), (), (), ())
    service.post("/v1/agents/lwd_1/orders", {"order": "hold"})
    ask, hello = service.submit("Ask"), service.submit("Hello")  # it waits for the machine on which an order stands
    service.wait(lambda: client.questions().questions)
    note = handover(client)
    assert [one.id for one in note.runs] == [ask]
    assert [one.id for one in note.waits] == [hello]
    assert [one.task for one in note.questions] == [ask]
    service.post("/v1/lockdown", {"how": "hold", "by": "ann"})
    service.wait(lambda: handover(client).lockdown.on)
    note = handover(client)
    assert {one.id for one in note.held} == {ask, hello}
    assert (note.runs, note.waits) == ((), ())
    assert note.causes == ("lockdown",)
    assert "lockdown" in [one.code for one in note.alarms]

    assert run(["handover", "--url", service.url]) == 0
    text = capsys.readouterr().out
    assert all(word in text for word in (ask, hello, "Q1", "watcher_1", "ON DUTY   none"))
    assert run(["handover", "--url", service.url, "--json"]) == 0
    assert [one["task"] for one in json.loads(capsys.readouterr().out)["questions"]] == [ask]


def test_machines_that_are_not_ready_at_their_places_are_told_with_the_reason(service: Service) -> None:
    client = Client(service.host.address)
    assert [one.agent for one in handover(client).machines_out] == []
    service.wire.gone("lwd_1")
    service.wait(lambda: handover(client).machines_out)
    (out,) = handover(client).machines_out
    assert (out.agent, "not heard of" in out.why) == ("lwd_1", True)


def test_who_is_on_duty_is_told(start: Start, tmp_path: Path) -> None:
    make_real(tmp_path)
    with start(speed=1.0) as service:
        client = connect(tmp_path / "site.yaml")
        assert handover(client).on_duty == ()
        service.post("/v1/pilots/pia/duty", {"on": True})
        service.wait(lambda: [one.pilot for one in handover(client).on_duty] == ["pia"])
        assert secret_of("pia") not in repr(handover(client))
