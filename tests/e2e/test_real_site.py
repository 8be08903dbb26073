"""A site in mode real by the commands alone: approve at a terminal, a pilot on duty, fly, kill the engine in flight, export."""

import csv
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal import fleet_of
from tests.e2e.terminal import at_terminal
from tests.e2e.test_service import Shell, wait_for_agents

pytestmark = pytest.mark.network
REAL = "people: {watchers: [watcher_1], approvers: [ann, bob]}\npilots: [{id: pia, max_airborne: 1}]\n"


FAST = (
    "from formiga_bt.cli import main, up; up.gaps = lambda site, speed: []\n"
    "from formiga_bt.services import beginning; beginning.follows_wall = lambda site: False\n"
    "main()"
)
"""`formiga`, but a real site may have a clock of another speed: the drones of this test are simulated."""


@pytest.fixture
def field(tmp_path: Path) -> Iterator[Shell]:
    made = Shell(tmp_path)
    made.run("init", "field")
    made.folder = tmp_path / "field"
    made.program = ("-c", FAST)
    file = made.folder / "site.yaml"
    text = file.read_text(encoding="utf-8").replace(":7447", ":0").replace("mode: simulation", "mode: real")
    assert "people: {watchers: [watcher_1]}\n" in text
    file.write_text(text.replace("people: {watchers: [watcher_1]}\n", REAL), encoding="utf-8")
    yield made
    made.close()


def wait(is_met: Callable[[], object], within_s: float = 40.0) -> None:
    until = time.monotonic() + within_s
    while not is_met():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.2)


def approve(field: Shell, task: str, by: str) -> str:
    code, shown = at_terminal(
        field.folder, "approve", task, "--by", by,
        until=r"digest.*: $", types=lambda shown: shown.split("digest  ")[1][:8],
    )  # fmt: skip
    assert code == 0, shown
    return shown


def test_from_not_approved_to_a_flight_in_the_log(field: Shell, tmp_path: Path) -> None:
    address = field.up("--desk", "watcher_1")
    world = read_world((), field.folder / "site.yaml")
    assert world.site is not None
    specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id != "watcher_1"]
    with FleetProcesses(specs, site=world.site.name, connect=address.endpoint, state_dir=tmp_path / "sim"):
        wait_for_agents(field, 5)
        said = field.run("run", "Hello", code=1)
        assert "is not approved as it is now; an approver (ann, bob) must: formiga approve Hello --by NAME" in said
        assert "is approved by ann" in approve(field, "Hello", "ann")
        assert "Hello" in field.run("approve", "--list")

        field.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: "nobody of pia is on duty" in field.run("why", "Hello-1"))
        assert "pia is on duty" in field.run("duty", "pia", "on")
        wait(lambda: "1 of 1" in field.run("duty", "--list"))
        assert "Hello-1 SUCCEEDED" in field.run("run", "Hello", "--follow").replace("Hello-2", "Hello-1")

        (first, second) = csv.DictReader(field.run("log", "export").splitlines())
        assert (first["task"], second["task"]) == ("Hello-1", "Hello-2")
        assert (first["pilot"], first["mode"], first["landed_by"]) == ("pia", "real", "task")
        assert float(first["battery_used_percent"]) > 1.0

        field.run("run", "Hello")  # and now the engine dies while it flies
        flying = field.folder / ".formiga/field/flying.json"
        wait(lambda: json.loads(flying.read_text(encoding="utf-8")))
        os.kill(field.engines[-1].pid, signal.SIGKILL)
        field.engines[-1].wait()
        lines = field.run("log", "export").splitlines()
        assert len(lines) == 4
        (under_way,) = [row for row in csv.DictReader(lines) if not row["landing_utc"]]
        assert (under_way["task"], under_way["pilot"]) == ("Hello-3", "pia")

        field.up()
        assert "ann" in field.run("approve", "--list")
        said = field.run("duty", "--list")
        assert "pia    on" in said  # the engine was away for a moment only, and what flew is still watched
        assert "the engine ends" in field.run("down", "--yes")
