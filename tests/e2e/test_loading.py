"""From words to a flight, by the commands alone and without starting the engine anew: draft, approve, load, run."""

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.terminal import at_terminal
from tests.e2e.test_real_site import SECRET, approve, set_secrets
from tests.e2e.test_real_site import field as field
from tests.e2e.test_service import Shell, wait_for_agents
from tests.e2e.test_service import shell as shell
from tests.unit.llm.fake_endpoint import FakeEndpoint
from tests.unit.llm.scripted import fly_to, home, tree

pytestmark = pytest.mark.network
WORDS = "A light drone flies to the lake shore at 40 m, waits there for 30 seconds and comes home."
ANSWER = json.dumps(tree(fly_to("lake_shore"), {"wait": "30 s"}, home(), task="LookAtShore"))
FILE = "trees/look_at_shore.yaml"


@pytest.fixture
def endpoint() -> Iterator[FakeEndpoint]:
    with FakeEndpoint([ANSWER] * 8) as made:
        yield made


def drafted(shell: Shell, endpoint: FakeEndpoint, types: str) -> tuple[int, str]:
    """Draft and run at a terminal, where a person types the task's name."""
    return at_terminal(
        shell.folder, "draft", WORDS, "--base-url", endpoint.base_url, "--model", "fake", "--run", "--by", "eve",
        until=r"Type the task's name: $", types=lambda _shown: types,
    )  # fmt: skip


def agents(shell: Shell, endpoint: str, state: Path) -> FleetProcesses:
    world = read_world((), shell.folder / "site.yaml")
    assert world.site is not None
    specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id != "watcher_1"]
    return FleetProcesses(specs, site=world.site.name, connect=endpoint, state_dir=state)


def why(shell: Shell, task: str, status: str, within_s: float = 60.0) -> str:
    """Wait until a task has a status; return what `formiga why` says then."""
    until = time.monotonic() + within_s
    while f"{task} {status}" not in (said := shell.run("why", task)):
        assert time.monotonic() < until, said
        time.sleep(0.2)
    return said


def test_words_become_a_flight_of_the_engine_that_runs(shell: Shell, endpoint: FakeEndpoint, tmp_path: Path) -> None:
    address = shell.up("--desk", "watcher_1")
    with agents(shell, address.endpoint, tmp_path / "sim"):
        wait_for_agents(shell, 5)
        code, shown = drafted(shell, endpoint, "LookAtShore")
        assert code == 0, shown
        assert "LookAtShore is served now\n" in shown
        assert "\nLookAtShore-1\n" in shown
        (origin_file,) = shell.folder.glob(".formiga/*/drafts/1/origin.json")
        origin = json.loads(origin_file.read_text(encoding="utf-8"))
        (served,) = [t for t in shell.json("tasks", "--library")["tasks"] if t["task"] == "LookAtShore"]
        assert (origin["approved_by"], origin["bundle"]) == ("eve", served["bundle"])

        file = shell.folder / FILE  # while it flies, its file is changed: the next request gets that
        file.write_text(file.read_text(encoding="utf-8").replace("30 s", "1 s"), encoding="utf-8")
        said = shell.run("run", FILE, "--follow")
        assert "LookAtShore is served in version 2: new requests get it" in said
        assert re.search(r"^LookAtShore-2 SUCCEEDED", said, re.MULTILINE), said
        said = why(shell, "LookAtShore-1", "SUCCEEDED")
        assert "it runs version 1 of LookAtShore to its end" in said
        assert "version 1, newest 2" in shell.run("tasks")
        assert "version 1, newest 2" in shell.run("show", "LookAtShore-1")
    shell.run("down", "--yes")


def test_on_a_real_site_an_approver_comes_between(field: Shell, endpoint: FakeEndpoint, tmp_path: Path) -> None:
    address = field.up("--desk", "watcher_1")
    with agents(field, address.endpoint, tmp_path / "sim"):
        wait_for_agents(field, 5)
        code, shown = drafted(field, endpoint, "")
        assert code == 1, shown
        assert f"next: formiga load {FILE}, then: formiga approve {FILE} --by ann, then: formiga run {FILE}" in shown

        said = field.run("run", FILE, code=1)
        assert "LookAtShore is served now" in said
        assert "is not approved as it is now" in said
        assert f"next: formiga approve {FILE} --by NAME" in said
        set_secrets(field, "ann", "pia")
        assert "is approved by ann" in approve(field, FILE, "ann")
        field.environment["FORMIGA_SECRET"] = SECRET
        field.run("duty", "pia", "on")
        assert re.search(r"^LookAtShore-1 SUCCEEDED", field.run("run", FILE, "--follow"), re.MULTILINE)
    field.run("down", "--yes")
