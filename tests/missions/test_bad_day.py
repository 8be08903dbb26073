"""The scenario `bad-day`: a take-over, a lost link, a lost charge, a silent picker, a lockdown; nothing falls from the sky."""

from collections.abc import Iterator

import pytest

from agents_sim.drone import Drone
from formiga_bt.base.geo import horizontal_m
from formiga_bt.base.packaged import files, folder
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.scenario import load_scenario
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.show.history.runlog import RunLog
from tests.golden import Wording


@pytest.fixture(scope="module")
def day() -> Iterator[VirtualRun]:
    catalogue, _, _ = load_catalogue(files("actions"))
    loaded = load_scenario(folder("trees") / "scenarios" / "bad-day.yaml", catalogue=catalogue)
    assert loaded.scenario is not None, loaded.diagnostics
    run = VirtualRun(loaded.scenario)
    assert run.run()
    yield run
    run.close()


@pytest.fixture(scope="module")
def log(day: VirtualRun) -> RunLog:
    log = RunLog()
    for step in day.steps:
        log.feed(step)
    return log


def test_every_drone_stands_at_home_and_nothing_crashed(day: VirtualRun) -> None:
    drones = [agent.body for agent in day.rehearsal.sim.agents.values() if isinstance(agent.body, Drone)]
    assert len(drones) == 6
    assert all(drone.landed() == "grounded" for drone in drones)
    assert all(drone.home is not None and horizontal_m(drone.position(), drone.home) < 1.0 for drone in drones)
    assert day.verdict().is_clean


def test_every_task_ended_for_the_reason_it_was_given(day: VirtualRun) -> None:
    ended = {
        task.id: (task.status, task.outcome.code)
        for task in day.rehearsal.engine.state.tasks.values()
        if not task.system.agent
    }
    assert ended == {
        "PickUp-1": ("SUCCEEDED", ""),  # taken over, handed back, continued
        "PickUp-2": ("FAILED", "no_clearance"),
        "ExploreRegion-3": ("FAILED", "taken_over"),  # by its own failsafe
        "ExploreRegion-4": ("FAILED", "envelope.reserve"),
        "ExploreRegion-6": ("CANCELED", "aborted"),
    }


def test_no_order_was_refused_and_none_stands(day: VirtualRun) -> None:
    assert [why for _, _, why in day.played.orders] == [""] * 5
    state = day.rehearsal.engine.state
    assert (state.orders, state.lockdown) == ({}, None)
    assert [agent.id for agent in state.agents.values() if agent.taken or agent.quarantine] == []


def test_the_summary_tells_each_event_once(day: VirtualRun, log: RunLog, wording: Wording) -> None:
    zero = day.began
    assert [(round((row.at - zero) / 1e6), row.who) for row in log.happened.rows] == [
        (30, "hwd_1"),
        (47, "hwd_2"),
        (53, "lwd_1"),
        (70, "lwd_2"),
        (185, "watcher_1"),
    ]
    wording([row.what for row in log.happened.rows])
    rows = {row.who: (row.did, row.ended.split(" after ")[0]) for row in log.happened.rows}
    assert rows == {
        "hwd_1": ("PickUp-1 waits", "handed back by watcher_1 (continue)"),
        "hwd_2": ("did not LandIn", "no_clearance"),
        "lwd_1": ("ExploreRegion-3 waits", "handed back by watcher_1 (end)"),
        "lwd_2": ("return, ExploreRegion-4 ends", "on the ground"),
        "watcher_1": ("no task starts or goes on; lwd_3: return", "released by watcher_1"),
    }
    assert all(row.is_over for row in log.happened.rows)


def test_the_drone_without_a_link_was_alone_on_its_way(day: VirtualRun, log: RunLog) -> None:
    """The engine sent it nothing between the silence and the word of a person."""
    silent = next(row for row in log.happened.rows if row.who == "lwd_1")
    assert [a.action for a in log.actions if a.agent == "lwd_1" and a.start > silent.at] == []
