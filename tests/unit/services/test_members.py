"""Agents that people add to the fleet over HTTP, and what of it outlives a start: a real engine of a site in mode real."""

import json
import shutil
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from formiga_bt.base.site_folder import FLEET
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Service, Start, make_real, secret_of

pytestmark = pytest.mark.network
ANN = {"Formiga-Secret": quote(secret_of("ann"))}


SPARE = "p2"
"""A port that belongs to nobody."""


@pytest.fixture
def spare(tmp_path: Path, start: Start) -> Start:
    """Start a service whose site has a port that belongs to nobody."""
    file = tmp_path / "site.yaml"
    text = file.read_text(encoding="utf-8")
    assert "  lwd_2: {type: lwd, home: p2}\n" in text
    file.write_text(text.replace("  lwd_2: {type: lwd, home: p2}\n", ""), encoding="utf-8")
    return start


@pytest.fixture
def real(tmp_path: Path, spare: Start) -> Start:
    """Start such a service in mode real."""
    make_real(tmp_path)
    return spare


def agent(service: Service, name: str) -> Any:
    return next((one for one in service.get("/v1/agents")["agents"] if one["id"] == name), None)


def come(service: Service, name: str = "lwd_9") -> None:
    """Let a machine that nobody lists announce itself."""
    service.wire.add(name, "lwd", service.host.site.ports["p1"].at)
    service.wait(lambda: agent(service, name))


def add(service: Service, name: str = "lwd_9", **more: Any) -> Any:
    body = {"home": SPARE, "by": "ann", **more}
    status, found = service.call("POST", f"/v1/agents/{name}/member", body, ANN)
    assert status == 200, found
    return found


def test_who_is_not_listed_waits_until_an_approver_adds_it(real: Start) -> None:
    with real() as service:
        come(service)
        assert agent(service, "lwd_9")["refused"] == "unlisted"

        add(service)

        assert agent(service, "lwd_9")["refused"] == ""


@pytest.mark.parametrize(
    ("by", "headers", "code"),
    [
        ("ann", {}, "secret_missing"),
        ("ann", {"Formiga-Secret": "guessed"}, "secret_wrong"),
        ("rita", ANN, "not_approver"),
    ],
)
def test_only_an_approver_adds_and_removes(real: Start, by: str, headers: dict[str, str], code: str) -> None:
    with real() as service:
        come(service)
        for path in ("member", "member/remove"):
            assert service.refused("POST", f"/v1/agents/lwd_9/{path}", {"by": by}, headers)["code"] == code
        assert agent(service, "lwd_9")["refused"] == "unlisted"


@pytest.mark.parametrize("keeps", [True, False], ids=["journal", "journal lost"])
def test_the_fleet_outlives_a_start_and_so_does_a_removal(real: Start, tmp_path: Path, keeps: bool) -> None:
    def journal() -> dict[str, Any]:
        if not keeps:
            for file in (tmp_path / ".formiga/meadow").glob("journal.db*"):
                file.unlink()
        return {"journal": JournalAt(durability="normal")} if keeps else {}

    with real(**journal()) as service:
        add(service, kind_of := "lwd_9", type="lwd")
        add(service, "lwd_8", type="picker", home="")
        service.post("/v1/agents/lwd_8/member/remove", {"by": "ann"}, **ANN)
    with real(**journal()) as service:
        come(service, kind_of)
        service.wait(lambda: agent(service, kind_of)["home"] == SPARE)
        assert agent(service, kind_of)["refused"] == ""
        come(service, "lwd_8")
        assert agent(service, "lwd_8")["refused"] == "unlisted"
    lines = [json.loads(line) for line in (tmp_path / ".formiga/meadow" / FLEET).read_text().splitlines()]
    assert [(line["agent"], bool(line.get("remove"))) for line in lines] == [
        ("lwd_9", False), ("lwd_8", False), ("lwd_8", True),
    ]  # fmt: skip


def test_a_fleet_is_saved_and_loaded_by_name(real: Start, tmp_path: Path) -> None:
    with real() as service:
        add(service, type="lwd")
        saved = service.post("/v1/fleets/summer", {"by": "ann"})
        assert [one["agent"] for one in saved["agents"]] == ["lwd_9"]
    (tmp_path / ".formiga/meadow" / FLEET).unlink()
    shutil.rmtree(tmp_path / ".formiga/meadow/bundles", ignore_errors=True)
    with real() as service:
        assert service.refused("POST", "/v1/fleets/winter/load", {"by": "ann"}, ANN)["code"] == "unknown_fleet"
        assert service.refused("POST", "/v1/fleets/summer/load", {"by": "ann"})["code"] == "secret_missing"
        loaded = service.post("/v1/fleets/summer/load", {"by": "ann"}, **ANN)
        assert (loaded["added"], loaded["skipped"]) == (["lwd_9"], [])
        come(service)
        assert agent(service, "lwd_9")["refused"] == ""
        assert [one["name"] for one in service.get("/v1/fleets")["fleets"]] == ["summer"]


def test_in_simulation_anybody_adds_one(spare: Start) -> None:
    with spare() as service:
        said = service.post("/v1/agents/hwd_7/member", {"type": "hwd", "home": SPARE})
        assert "hwd_7" in said["text"]
        assert service.refused("POST", "/v1/agents/lwd_1/member/remove")["code"] == "in_site_file"


def test_a_task_for_a_member_is_served_where_the_site_file_lists_none(real: Start) -> None:
    text = "formiga: 1\ntask: Pair\nagents: {drones: {type: hwd, count: 2}}\nsteps: [{wait: 1 s}]\n"
    body = {"file": "pair.yaml", "texts": {"pair.yaml": text}, "by": "eve"}
    with real() as service:
        assert service.call("POST", "/v1/library", body)[0] == 422
        add(service, "hwd_7", type="hwd")
        assert service.call("POST", "/v1/library", body)[0] == 200
    with real() as service:
        assert "Pair" in [one["task"] for one in service.get("/v1/library")["tasks"]]
