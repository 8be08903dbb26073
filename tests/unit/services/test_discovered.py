"""Actions that agents announce and no catalogue has, over HTTP, and what of them outlives a start."""

from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.transport.cards import CardAction, CardField
from tests.unit.services.conftest import Service, Start, make_real, secret_of

pytestmark = pytest.mark.network
ANN = {"Formiga-Secret": quote(secret_of("ann"))}
COUNT = CardAction(name="Count", result={"n": CardField(type="int")}, typical_s=5.0, help="Count berries.")
TASK = """\
formiga: 1
task: Counting
agents: {drone: {type: hwd}}
steps:
  - do: drone.Count
    save_as: found
  - check: found.n > 3
"""


def come(service: Service) -> None:
    """Let the heavy drone announce itself."""
    service.wire.add("hwd_1", "hwd", service.host.site.ports["p3"].at, besides=(COUNT,))
    service.wait(lambda: any(one["action"] == "Count" for one in service.get("/v1/catalogue")["discovered"]))


def discovered(service: Service) -> Any:
    (one,) = service.get("/v1/catalogue")["discovered"]
    return one


def load(service: Service) -> tuple[int, Any]:
    return service.call("POST", "/v1/library", {"file": "counting.yaml", "texts": {"counting.yaml": TASK}, "by": "eve"})


@pytest.mark.parametrize("keeps", [True, False], ids=["journal", "journal lost"])
def test_in_a_simulation_a_task_may_use_it_at_once_and_after_the_next_start(
    start: Start, tmp_path: Path, keeps: bool
) -> None:
    journal: dict[str, Any] = {"journal": JournalAt(durability="normal")} if keeps else {}
    with start(**journal) as service:
        assert load(service)[0] == 422
        come(service)
        assert discovered(service)["known"]
        assert "Count" in next(t["actions"] for t in service.get("/v1/catalogue")["types"] if t["name"] == "hwd")
        status, said = load(service)
        assert status == 200, said
        task_id = service.submit("Counting")
    with start(**journal) as service:
        assert any(one["task"] == "Counting" for one in service.get("/v1/library")["tasks"])
        if keeps:
            assert service.task(task_id)["status"] in ("PENDING", "ACTIVE")


def test_where_it_is_real_an_approver_says_so(start: Start, tmp_path: Path) -> None:
    make_real(tmp_path)
    with start() as service:
        come(service)
        assert not discovered(service)["known"]
        assert load(service)[0] == 422
        assert service.refused("POST", "/v1/catalogue/Count", {"by": "ann"})["code"] == "secret_missing"
        assert service.refused("POST", "/v1/catalogue/Count", {"by": "rita"}, ANN)["code"] == "not_approver"
        assert service.refused("POST", "/v1/catalogue/Fly", {"by": "ann"}, ANN)["code"] == "unknown_action"

        service.post("/v1/catalogue/Count", {"by": "ann"}, **ANN)

        assert discovered(service)["by"] == "ann"
        status, said = load(service)
        assert status == 200, said


def test_what_a_simulation_took_does_not_count_where_it_is_real(start: Start, tmp_path: Path) -> None:
    with start() as service:
        come(service)
        assert discovered(service)["known"]
    make_real(tmp_path)
    with start() as service:
        come(service)
        assert not discovered(service)["known"]
        assert load(service)[0] == 422
