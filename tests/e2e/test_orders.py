"""Stops, lockdown and hand-back by the commands alone: an engine process, agents that are processes, Zenoh between them."""

import json
import re
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.request import urlopen

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.test_service import Shell, new_site

pytestmark = pytest.mark.network

FAR = "66.5030,25.7030"
"""A place some 360 m away: time enough for a command while a drone is under way."""


class Field:
    """A running engine with its drones, and what its API says."""

    def __init__(self, shell: Shell, fleet: FleetProcesses, url: str) -> None:
        self.shell, self.fleet, self.url = shell, fleet, url

    def get(self, path: str) -> Any:
        with urlopen(f"{self.url}{path}", timeout=20) as answer:
            return json.loads(answer.read())

    def drone(self, name: str) -> Any:
        (found,) = [a for a in self.get("/v1/agents")["agents"] if a["id"] == name]
        return found

    def order(self, name: str) -> Any:
        """Return the order that stands on a machine; {}: none does."""
        return next((one for one in self.get("/v1/agents")["orders"] if one["agent"] == name), {})

    def task(self, task_id: str) -> Any:
        detail = self.get(f"/v1/tasks/{task_id}")
        return {**detail, **detail["task"]}

    def wait(self, is_met: Callable[[], object], what: str, within_s: float = 60.0) -> None:
        until = time.monotonic() + within_s
        while not is_met():
            assert time.monotonic() < until, (
                f"waited in vain: {what}\n{self.shell.run('agents')}{self.shell.run('tasks')}"
            )
            time.sleep(0.05)

    def fly(self) -> tuple[str, str]:
        """Request a flight and wait until its drone is under way; return the task and the drone."""
        task_id = self.shell.run("run", "Hello", "--param", f"target={FAR}").split()[0]
        self.wait(lambda: any(g["action"] == "GoTo" for g in self.task(task_id)["goals"]), "it is under way")
        (drone,) = self.task(task_id)["agents"]
        self.wait(lambda: (self.drone(drone)["at"] or {})["up_m"] > 20, "it is well up")
        return task_id, drone

    def hovers(self, drone: str) -> bool:
        """Return whether a drone has no goal and stays where it is, in the air."""
        first = self.drone(drone)
        time.sleep(0.5)
        second = self.drone(drone)
        return bool(first["at"] == second["at"] and second["landed"] == "airborne" and second["action"] == "")

    def is_home(self, drone: str) -> bool:
        found = self.drone(drone)
        return bool(found["landed"] == "grounded" and found["at"]["north_m"] == pytest.approx(40.0, abs=3.0))

    def ends(self, task_id: str) -> Any:
        self.wait(lambda: self.task(task_id)["ended_at"], f"{task_id} ends")
        return self.task(task_id)

    def taken(self) -> tuple[str, str]:
        """Let a pilot take a drone over on its way, and give it back; return its task and the drone."""
        task_id, drone = self.fly()
        self.fleet.take_over(drone)
        self.wait(lambda: self.drone(drone)["control"] == "pilot", "the pilot has it")
        assert self.task(task_id)["held"] == [f"take-over:{drone}"]
        assert "its pilot" in self.shell.run("handback", drone, "--end", code=1)
        self.fleet.hand_back(drone)
        self.wait(lambda: self.drone(drone)["control"] == "engine", "the pilot has given it back")
        assert self.task(task_id)["held"] == [f"take-over:{drone}"]  # its status alone hands nothing back
        assert f"formiga handback {drone} --continue|--return|--end" in self.shell.run("why", task_id)
        return task_id, drone


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    """One engine and its drones for all tests of the module."""
    folder = tmp_path_factory.mktemp("field")
    shell = new_site(folder)
    try:
        address = shell.up("--desk", "watcher_1", "--speed", "10")
        world = read_world((), shell.folder / "site.yaml")
        assert world.site is not None
        specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id.startswith("lwd")]
        with FleetProcesses(
            specs, site=world.site.name, connect=address.endpoint, state_dir=folder / "sim", referee=True
        ) as fleet:
            made = Field(shell, fleet, address.url)
            made.wait(lambda: sum(a["at"] is not None for a in made.get("/v1/agents")["agents"]) == 2, "all are there")
            yield made
            shell.run("down", "--yes")
            shell.ended()
    finally:
        shell.close()


@pytest.fixture
def field(running: Field) -> Iterator[Field]:
    """The field, free again after each test."""
    yield running
    assert running.fleet.verdict().is_clean
    for agent in running.get("/v1/agents")["agents"]:
        if agent.get("order"):
            running.shell.run("continue", agent["id"])


def test_a_flight_is_held_and_goes_on_and_another_one_is_sent_home(field: Field) -> None:
    task_id, drone = field.fly()

    said = field.shell.run("hold", task_id, "--by", "eve")

    assert f"{drone} hovers; it returns by itself in " in said
    assert f"next: formiga continue {task_id}    or: formiga abort {task_id}" in said
    field.wait(lambda: field.hovers(drone), "it hovers")
    assert "stands already" in field.shell.run("hold", task_id)
    why = field.shell.run("why", task_id)
    assert "HELD" in why
    assert f"{drone}.GoTo was interrupted" in why
    assert "ACTIVE HELD" in field.shell.run("tasks")
    assert re.search(r"HOLD by \S+ since \d+ s: hovers", field.shell.run("agents"))

    assert f"{task_id} goes on" in field.shell.run("continue", task_id)
    assert field.ends(task_id)["status"] == "SUCCEEDED"

    task_id, drone = field.fly()
    assert f"{drone} flies home to " in field.shell.run("return", drone)
    field.wait(lambda: field.order(drone).get("state") == "done", "it is home")
    assert field.is_home(drone)
    assert field.task(task_id)["held"] == [f"operator:{drone}"]
    assert f"formiga restart {task_id}" in field.shell.run("continue", task_id, code=1)
    field.shell.run("restart", task_id)
    end = field.ends(task_id)
    assert (end["status"], end["run"]) == ("SUCCEEDED", 2)


def test_lockdown_brings_all_home_and_its_release_lets_people_decide(field: Field) -> None:
    task_id, drone = field.fly()

    said = field.shell.run("lockdown", "--by", "eve")

    assert "LOCKDOWN: nothing starts, nothing goes on" in said
    assert f"{drone} flies home to " in said
    assert "locked down by eve" in field.shell.run("run", "Hello", code=1)
    assert field.shell.run("tasks").startswith("LOCKDOWN (return) by eve since ")
    assert "HELD: the site is locked down (return) by eve" in field.shell.run("why", task_id)
    assert "formiga lockdown release" in field.shell.run("continue", task_id, code=1)
    field.wait(lambda: field.is_home(drone), "it is home")

    said = field.shell.run("lockdown", "release")

    assert f"{task_id} was interrupted and waits for your word" in said
    assert field.task(task_id)["held"] == ["operator"]
    field.shell.run("abort", task_id)
    assert field.ends(task_id)["status"] == "CANCELED"
    assert field.shell.run("lockdown", "status").startswith("no lockdown stands")
    other, _ = field.fly()
    assert field.ends(other)["status"] == "SUCCEEDED"


def test_a_machine_is_handed_back_in_each_way(field: Field) -> None:
    task_id, drone = field.taken()
    assert f"{task_id} goes on" in field.shell.run("handback", drone, "--continue")
    assert field.ends(task_id)["status"] == "SUCCEEDED"

    task_id, drone = field.taken()
    assert f"next: formiga why {task_id}" in field.shell.run("handback", drone, "--return")
    field.wait(lambda: field.is_home(drone), "it is home")
    assert field.task(task_id)["held"] == [f"operator:{drone}"]
    field.shell.run("abort", task_id)
    assert field.ends(task_id)["status"] == "CANCELED"

    task_id, drone = field.taken()
    assert "its interrupted step fails (taken_over)" in field.shell.run("handback", drone, "--end")
    end = field.ends(task_id)
    assert (end["status"], end["code"]) == ("FAILED", "taken_over")
    field.wait(lambda: field.is_home(drone), "it is home")


def test_preflight_and_a_cut_that_no_drone_announces(field: Field) -> None:
    field.wait(lambda: field.get("/v1/agents/lwd_1/preflight")["ok"], "it is ready, and has the site message")
    said = field.shell.run("preflight", "lwd_1")
    assert said.startswith("AGENT  CHECK")
    assert "lwd_1" in said
    refused = field.shell.run("cut", "lwd_1", "--yes-cut", "lwd_1", code=1)
    assert "announces no action that cuts its motors" in refused
    assert "confirm it with --yes-cut lwd_1" in field.shell.run("cut", "lwd_1", code=2)
