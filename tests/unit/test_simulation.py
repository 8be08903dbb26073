"""Scenarios in virtual time: what they ship with ends as it says, faults come on time, equal seeds give equal runs."""

import pytest

from agents_sim.referee import Verdict
from agents_sim.world import grid_fleet
from formiga_bt.clock import SECOND
from formiga_bt.geo import horizontal_m
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.scenario import Scenario, ScenarioFault, load_scenario
from formiga_bt.packaged import files, folder
from formiga_bt.simulation import VirtualRun, describe, fleet_site, specs_of


def shipped(name: str) -> Scenario:
    catalogue, _, _ = load_catalogue(files("actions"))
    loaded = load_scenario(folder("trees") / "scenarios" / f"{name}.yaml", catalogue=catalogue)
    assert loaded.scenario is not None, loaded.diagnostics
    return loaded.scenario


def run(name: str) -> tuple[VirtualRun, dict[str, str], Verdict]:
    virtual = VirtualRun(shipped(name))
    assert virtual.run()
    tasks = virtual.rehearsal.engine.state.tasks
    verdict = virtual.verdict()
    virtual.close()
    return virtual, {task.id: task.status for task in tasks.values()}, verdict


@pytest.mark.parametrize("name", ["demo", "frozen-and-back", "nonsense"])
def test_what_ships_succeeds_without_a_crash(name: str) -> None:
    virtual, statuses, verdict = run(name)
    assert set(statuses.values()) == {"SUCCEEDED"}
    assert len(statuses) == len(virtual.scenario.requests)
    assert not virtual.played.refused
    assert verdict.is_clean


def test_the_one_that_is_killed_is_found_and_brought_home() -> None:
    virtual, statuses, verdict = run("one-killed")
    assert statuses["PickUp-1"] == "FAILED"
    assert statuses["PickUp-2"] == "SUCCEEDED"
    assert [status for task, status in statuses.items() if task.startswith("Recover")] == ["SUCCEEDED"]
    drone = virtual.rehearsal.sim["hwd_1"].drone
    assert not drone.is_airborne
    assert drone.home is not None
    assert horizontal_m(drone.position(), drone.home) < 1.0
    assert verdict.is_clean


def test_faults_come_at_their_time() -> None:
    virtual, _, _ = run("nonsense")
    at = [(round((when - virtual.began) / SECOND, 3), fault.kind) for when, fault in virtual.played.faults]
    assert at == [(2.0, "nan"), (10.0, "nan"), (12.0, "wrong_id"), (20.0, "lose_result")]


def test_equal_seeds_give_equal_runs() -> None:
    first, second = run("demo")[0], run("demo")[0]
    assert first.steps == second.steps


def test_a_fault_in_words() -> None:
    assert describe(ScenarioFault(0, "hwd_1", "wrong_id", 2, as_id="x")) == "hwd_1: wrong_id x x2"
    assert describe(ScenarioFault(0, "hwd_1", "slow", delay_s=2.0)) == "hwd_1: slow 2 s"


def test_a_grid_of_any_size_has_room_for_everyone() -> None:
    specs = grid_fleet(60, 40, 10, 2)
    site = fleet_site(specs)
    assert len({spec.id for spec in specs}) == 112
    ports = [port.at for port in site.ports.values()]
    assert len(ports) == 100
    assert min(horizontal_m(a, b) for i, a in enumerate(ports) for b in ports[:i]) >= 20.0
    assert {agent.home for agent in site.agents.values() if agent.home} == set(site.ports)
    assert site.people["watchers"] == ("watcher_1", "watcher_2")


def test_agents_of_a_scenario_know_the_base_only_if_asked() -> None:
    assert {spec.base for spec in specs_of(shipped("demo"))} == {None}
    assert {spec.base for spec in specs_of(shipped("demo"), with_base=True)} == {(66.5, 25.7)}
