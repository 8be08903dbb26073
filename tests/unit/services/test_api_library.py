"""Loading over a real socket into a real engine: versions side by side, refusals, a start anew, a site in mode real."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.safety.approval import TYPED
from formiga_bt.services.not_served import NotServed
from tests.golden import Wording, timeless
from tests.unit.services.conftest import Service, Start
from tests.unit.services.test_crew import real as real

pytestmark = pytest.mark.network
STAY = "formiga: 1\ntask: Stay\nagents: {watcher: {type: watcher}}\nsteps: [{wait: 2 h}]\n"
SHORT = STAY.replace("2 h", "1 s")


def load(service: Service, text: str, file: str = "trees/stay.yaml") -> Any:
    return service.post("/v1/library", {"file": file, "texts": {file: text}, "by": "eve"})


def test_two_versions_run_side_by_side(start: Start, wording: Wording) -> None:
    with start() as service:
        old = service.submit("Stay")
        said = load(service, SHORT)
        new = service.submit("Stay")
        assert service.ends(new)["status"] == "SUCCEEDED"

        assert (said["what"], said["version"]) == ("changed", 2)
        wording(said["text"])
        (one, two) = (service.task(old), service.task(new))
        assert (one["status"], one["version"], one["newest"]) == ("ACTIVE", 1, 2)
        assert (two["version"], two["newest"], two["bundle"]) == (2, 2, said["bundle"])
        assert one["running"][0]["place"].endswith("stay.yaml:4")
        (line,) = [b["text"] for b in service.get(f"/v1/tasks/{old}/why")["because"] if b["code"] == "version"]
        wording(line)
        assert "version" not in service.codes(new)
        (shown,) = [t for t in service.get("/v1/library")["tasks"] if t["task"] == "Stay"]
        assert [(v["version"], v["tasks"]) for v in shown["versions"]] == [(1, [old]), (2, [])]
        third = service.post("/v1/tasks", {"task": "Stay", "bundle": one["bundle"]})["id"]
        assert service.task(third)["version"] == 1


def test_a_task_whose_file_was_refused_at_the_start_is_told_with_its_error_until_it_is_loaded(
    start: Start, wording: Wording
) -> None:
    bad = NotServed(
        "trees/bad.yaml:6:5: E031: 'd' can still be airborne when the task ends (and 1 more)",
        "formiga check trees/bad.yaml --site site.yaml", ("Bad", "Poor"), "formiga load trees/bad.yaml",
    )  # fmt: skip
    with start(refused=[bad]) as service:
        for name in ("Bad", "Poor"):
            said = service.refused("POST", "/v1/tasks", {"task": name})
            assert (said["status"], said["code"]) == (409, "not_served")
            wording(said["text"], said["help"])
        assert service.refused("POST", "/v1/tasks", {"task": "Worse"})["code"] == "unknown_task"
        assert service.get("/v1/library")["refused"] == [bad.text]
        load(service, STAY.replace("Stay", "Bad"), "trees/bad.yaml")
        assert service.submit("Bad") == "Bad-1"
        assert service.get("/v1/library")["refused"] == []


def test_a_file_that_was_written_after_the_start_is_told_of_to_whoever_asks_for_its_task(
    start: Start, tmp_path: Path, wording: Wording
) -> None:
    with start() as service:
        (tmp_path / "trees").mkdir()
        (tmp_path / "trees" / "late.yaml").write_text(STAY.replace("Stay", "Late"), encoding="utf-8")
        (tmp_path / "trees" / "odd.yaml").write_bytes(b"\xff\xfe")
        said = service.refused("POST", "/v1/tasks", {"task": "Late"})
        other = service.refused("POST", "/v1/tasks", {"task": "Later"})

    assert (said["status"], said["code"]) == (other["status"], other["code"]) == (404, "unknown_task")
    wording(said["text"])
    assert said["help"] == f"formiga load {tmp_path}/trees/late.yaml"
    assert "load" not in other["help"]


def test_what_is_refused(start: Start) -> None:
    with start() as service:
        bad = service.refused("POST", "/v1/library", {"file": "a.yaml", "texts": {"a.yaml": "formiga: 1\ntask: A\n"}})
        assert (bad["status"], bad["code"]) == (422, "bad_task")
        assert bad["problems"][0].startswith("a.yaml:")
        path = service.refused("POST", "/v1/library", {"file": "../a.yaml", "texts": {"../a.yaml": STAY}})
        assert (path["status"], path["code"]) == (422, "bad_bundle")
        assert service.refused("POST", "/v1/library", {"file": "a.yaml", "texts": {}})["code"] == "bad_request"
        large = {"file": "a.yaml", "texts": {"a.yaml": STAY + "#" * 1_000_000}}
        assert service.refused("POST", "/v1/library", large)["code"] == "too_large"
        none = service.refused("POST", "/v1/tasks", {"task": "Stay", "bundle": "ab" * 32})
        assert (none["status"], none["code"]) == (409, "not_served")
        assert "/v1/library" in service.get("/v1/openapi.json")["paths"]


def test_a_new_start_serves_it_again_with_a_notice(start: Start, tmp_path: Path, wording: Wording) -> None:
    with start() as service:
        load(service, SHORT.replace("Stay", "Brief"), "drafts/brief.yaml")
        assert service.host.restored == []
    with start() as service:
        assert service.ends(service.submit("Brief"))["status"] == "SUCCEEDED"
        (told,) = service.host.restored
    wording(timeless(told))
    assert f"rm {tmp_path}/.formiga/meadow/bundles/" in told


def test_on_a_real_site_what_is_loaded_flies_once_it_is_approved(real: Start) -> None:
    with real() as service:
        said = load(service, SHORT)
        body = {"task": "Stay", "by": "rita", "bundle": said["bundle"]}
        assert service.refused("POST", "/v1/tasks", body)["code"] == "not_approved"
        (stay,) = [t for t in service.get("/v1/approvals")["tasks"] if t["task"] == "Stay"]
        digest = stay["digest"]
        service.post("/v1/approvals", {"task": "Stay", "by": "ann", "digest": digest, "typed": digest[:TYPED]})
        assert service.ends(service.post("/v1/tasks", body)["id"])["status"] == "SUCCEEDED"
        load(service, STAY)
        assert service.refused("POST", "/v1/tasks", {"task": "Stay"})["code"] == "not_approved"
        assert service.ends(service.post("/v1/tasks", body)["id"])["status"] == "SUCCEEDED"  # the approved version
