"""The public client against a running engine: the page on it does what it says, and its answers are typed."""

import re
from pathlib import Path

import msgspec
import pytest

from formiga_bt.client import ApiError, Client, UnknownId, connect
from formiga_bt.services.http.openapi import shapes
from formiga_bt.show import facts as f
from tests.golden import Wording
from tests.unit.services.conftest import Service

pytestmark = pytest.mark.network
PAGE = Path(__file__).parents[3] / "docs" / "operating.md"


@pytest.fixture
def client(service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Client:
    monkeypatch.chdir(tmp_path)
    return connect()


@pytest.mark.usefixtures("client")
def test_the_example_of_the_page_flies_a_task(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"### From Python\n.*?```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(code, str(PAGE), "exec"), {})
    first, *agents = capsys.readouterr().out.splitlines()
    assert first == "SUCCEEDED [('lwd_1', 'TakeOff'), ('lwd_1', 'GoTo'), ('lwd_1', 'GoTo'), ('lwd_1', 'LandIn')]"
    assert [line.split()[0] for line in agents] == ["lwd_1", "watcher_1"]


def test_each_answer_is_a_fact(client: Client) -> None:
    task = client.request("Stay", by="eve")
    assert isinstance(client.health(), f.EngineHealth)
    assert [one.id for one in client.tasks("open").tasks] == [task]
    assert client.detail(task).task == client.task(task).task
    assert client.now().agents == client.agents().agents or client.agents().agents[0].lat is not None
    assert client.library().tasks[0].task == "Ask"
    assert client.questions().questions == ()
    assert not client.lockdown().on
    assert client.preflight("lwd_1").agent == "lwd_1"
    assert client.why(task)[0].startswith(task)
    assert client.order("hold", task, by="eve").target == task  # no machine is called so
    assert client.order("continue", task).order == "continue"
    assert client.abort(task, by="eve").startswith(f"{task} ends")


def test_a_refusal_has_fields(client: Client, wording: Wording) -> None:
    task = client.request("Stay", by="eve")
    with pytest.raises(UnknownId) as refused:
        client.detail(f"{task}1")
    assert (refused.value.code, refused.value.near, refused.value.status) == ("unknown_task", (task,), 404)
    wording(refused.value.text, str(refused.value))
    with pytest.raises(ApiError) as bad:
        client.request("Hallo")
    assert (bad.value.code, bad.value.near) == ("unknown_task", ("Hello",))


def test_what_a_newer_engine_adds_is_passed_over(monkeypatch: pytest.MonkeyPatch, client: Client) -> None:
    said = {"on": True, "how": "hold", "since_when": "today", "levels": [1]}
    monkeypatch.setattr(client, "read", lambda *_: msgspec.json.encode(said))
    assert client.lockdown() == f.LockdownFact(on=True, how="hold")


def test_openapi_names_summaries_and_what_fields_mean(service: Service, wording: Wording) -> None:
    document = service.get("/v1/openapi.json")
    operations = {f"{verb} {path}": one for path, ways in document["paths"].items() for verb, one in ways.items()}
    assert not [name for name, one in operations.items() if not one["summary"] or one["summary"] == "Submit"]
    wording(operations["get /v1/agents"]["summary"])
    answer = operations["get /v1/agents"]["responses"]["200"]["content"]["application/json"]["schema"]
    assert answer == {"$ref": "#/components/schemas/AgentList"}
    found = document["components"]["schemas"]
    refs = set(re.findall(r'"#/components/schemas/([^"]+)"', msgspec.json.encode(document).decode()))
    assert refs <= set(found)
    assert found["AgentFact"]["properties"]["battery"]["description"] == "Percent, 0..100."
    assert found["SubmitBody"]["properties"]["by"]["description"] == "Who requests it."


def test_facts_of_facts_are_described(wording: Wording) -> None:
    found = shapes({f.TaskList})
    wording(found["TaskList"]["properties"]["total"]["description"])
    assert found["LockdownFact"]["type"] == "object"
    assert found["TaskFact"]["properties"]["urgent"]["description"].startswith("What that is")
