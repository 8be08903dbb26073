"""Figures for a monitoring system, and whether the engine works, for whoever starts it anew."""

import json
from collections.abc import Iterator
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families as parse

from formiga_bt.base.accounts import Account
from formiga_bt.base.durations import Durations
from formiga_bt.base.roles import Role
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.services import host
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Service, Start, make_real
from tests.unit.services.test_access import let_in

pytestmark = pytest.mark.network
OPEN_METRICS = {"Accept": "application/openmetrics-text; version=1.0.0"}


def figures(service: Service, **headers: str) -> dict[tuple[str, ...], float]:
    """Return each figure by its name and labels, as a monitoring system reads it."""
    status, text = service.call("GET", "/metrics", None, {**OPEN_METRICS, **headers})
    assert status == 200
    assert isinstance(text, str)
    assert text.endswith("# EOF\n")
    return {
        (sample.name, *map(str, sample.labels.values())): sample.value
        for family in parse(text)
        for sample in family.samples
    }


def healthz(service: Service) -> tuple[int, dict[str, object]]:
    """Ask without a token, as an orchestrator does."""
    try:
        with urlopen(Request(f"{service.url}/healthz"), timeout=20) as answer:
            return answer.status, json.loads(answer.read())
    except HTTPError as error:
        with error:
            return error.code, json.loads(error.read())


@pytest.fixture
def kept(start: Start) -> Iterator[Service]:
    with start(journal=JournalAt(durability="normal")) as running:
        yield running


def test_the_figures_are_those_of_the_engine(kept: Service) -> None:
    before = figures(kept)
    kept.submit("Stay")
    kept.submit("Ask")
    kept.wait(lambda: kept.get("/v1/inbox")["questions"] or figures(kept)["formiga_tasks", "PENDING"] == 1)
    now = figures(kept)
    assert sum(now["formiga_tasks", one] for one in ("PENDING", "ASSIGNED", "ACTIVE", "ENDING")) == 2
    assert before["formiga_tasks", "ACTIVE"] == before["formiga_questions",] == 0
    assert now["formiga_questions",] == len(kept.get("/v1/inbox")["questions"])
    assert now["formiga_engine_status", "ok"] == now["formiga_journal_status", "ok"] == 1
    assert now["formiga_engine_steps_total",] > before["formiga_engine_steps_total",] > 0
    for name in ("formiga_step_seconds", "formiga_journal_append_seconds"):
        assert now[f"{name}_count",] == now[f"{name}_bucket", "+Inf"] > 0
    machines = [one for one in kept.get("/v1/agents")["agents"] if one["mobility"] != "people"]
    assert sum(value for (name, *_), value in now.items() if name == "formiga_machines") == len(machines)
    kept.post("/v1/lockdown", {"how": "hold"})
    kept.wait(lambda: figures(kept)["formiga_lockdown",] == 1)


def test_they_name_nobody(service: Service) -> None:
    service.submit("Ask", word="secret word")
    service.wait(lambda: service.get("/v1/inbox")["questions"])
    _, text = service.call("GET", "/metrics")
    for word in ("watcher_1", "picker_1", "lwd_1", "Ask", "secret"):
        assert word not in text


def test_who_reads_them_needs_a_role_and_a_token_where_one_is_asked_for(start: Start, tmp_path: Path) -> None:
    make_real(tmp_path)
    with start(speed=1.0) as service:
        people = let_in(service, vera=Account((Role.VIEWER,)), pat=Account((Role.PICKER,), agent="picker_1"))
        assert service.call("GET", "/metrics", None, people["vera"])[0] == 200
        assert service.refused("GET", "/metrics", None, people["pat"])["code"] == "no_role"
        assert service.refused("GET", "/metrics", None, {"Authorization": ""})["code"] == "unauthorized"
        assert healthz(service)[1]["status"] == "ok"


@pytest.mark.parametrize(("metrics", "status"), [(False, 403), (True, 200)])
def test_beyond_this_machine_they_are_off_unless_somebody_says_so(
    start: Start, tmp_path: Path, metrics: bool, status: int
) -> None:
    make_real(tmp_path)
    with start(speed=1.0, http="0.0.0.0:0", metrics=metrics) as service:
        found, said = service.call("GET", "/metrics")
        assert found == status
        assert metrics or said["code"] == "metrics_off"
        assert healthz(service)[0] == 200


def test_what_is_wrong_is_named_and_only_an_engine_that_does_not_work_is_to_be_started_anew(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.post("/v1/lockdown", {"how": "hold"})
    service.wait(lambda: healthz(service)[1]["causes"] == ["lockdown"])
    assert healthz(service)[0] == 200
    assert service.get("/v1/health")["causes"] == ["lockdown"]
    with monkeypatch.context() as patch:
        patch.setattr(host, "STANDS_S", -1.0)
        assert healthz(service) == (503, {"alive": False, "status": "ok", "causes": ["stands_still", "lockdown"]})
    with monkeypatch.context() as patch:
        patch.setattr(service.host.driver, "error", ValueError("a bug"))
        status, told = healthz(service)
        assert (status, told["alive"], told["status"]) == (503, False, "failed")
        assert "a bug" not in json.dumps(told)


def test_whoever_reads_a_large_page_makes_nobody_take_the_engine_for_dead(service: Service) -> None:
    with service.host.view.reading():
        assert healthz(service)[0] == 200


def test_an_engine_that_stands_still_says_for_how_long(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    driver = service.host.driver
    assert driver.statistics().stands_s < 5
    later = RealtimeDriver._wall_now() + 40_000_000
    monkeypatch.setattr(driver, "_wall_now", lambda: later)
    assert driver.statistics().stands_s > 30


def test_durations_are_counted_up_to_each_bound() -> None:
    counted = Durations((0.1, 1.0))
    for seconds in (-0.5, 0.1, 0.11, 5.0):
        counted.add(seconds)
    found = counted.statistics()
    assert found.within == (2, 3, 4)
    assert found.sum_s == pytest.approx(5.21)
