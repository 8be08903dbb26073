"""What agents do to an engine: die, stand still, come back, talk nonsense. Real processes, real Zenoh."""

import json
import time
from collections.abc import Callable

import pytest
import zenoh

from formiga_bt.base.errors import TransportError
from tests.e2e.rig import Rig, children

pytestmark = pytest.mark.network

Fly = Callable[..., Rig]
DRONES = ["lwd_1", "lwd_2", "hwd_1", "hwd_2"]


def test_a_drone_killed_in_flight_is_quarantined_and_flown_home_when_it_is_back(fly: Fly) -> None:
    rig = fly(short=True)
    assert rig.fleet is not None
    task = rig.pick_up()
    other = rig.move("lwd_1")
    rig.wait(lambda: (goal := rig.flying(task)) is not None and rig.far(goal.agent, 80.0), what="on its way")
    goal = rig.flying(task)
    assert goal is not None
    boot = rig.agent(goal.agent).boot_id
    rig.fleet.kill(goal.agent)
    killed = time.monotonic()
    rig.wait(lambda: rig.ended([task]), within_s=12.0, what="the task ended within lost_after + 10 s")
    assert time.monotonic() - killed > 1.0  # not before it was lost
    assert (rig.task(task).status, rig.task(task).outcome.code) == ("FAILED", "agent_lost")
    assert (rig.agent(goal.agent).pool, rig.agent(goal.agent).quarantine) == ("QUARANTINED", "lost")
    assert rig.texts("may be airborne and is out of control: lost")
    rig.wait(lambda: rig.ended([other]), what="the other task goes on")
    assert rig.task(other).status == "SUCCEEDED"
    assert rig.at_rest([d for d in DRONES if d != goal.agent])

    rig.fleet.start(goal.agent)
    rig.wait(lambda: rig.agent(goal.agent).boot_id != boot, what="it is back")
    rig.wait(lambda: "Recover-3" in rig.log.state.tasks, what="the system brings it home")
    assert rig.agent(goal.agent).landed == "airborne"
    assert rig.high(goal.agent, 40.0)
    rig.wait(lambda: rig.ended(["Recover-3"]), what="home")
    assert rig.task("Recover-3").status == "SUCCEEDED"
    assert rig.task("Recover-3").system.agent == goal.agent
    assert rig.at_rest(DRONES)
    assert rig.verdict().is_clean


def test_a_drone_that_stands_still_for_less_than_lost_after_finishes_its_mission(fly: Fly) -> None:
    rig = fly()
    assert rig.fleet is not None
    task = rig.pick_up("east_field", "picker_2")
    rig.wait(lambda: (goal := rig.flying(task)) is not None and rig.high(goal.agent), what="on its way")
    goal = rig.flying(task)
    assert goal is not None
    rig.fleet.freeze(goal.agent)
    rig.wait(lambda: rig.agent(goal.agent).liveness == "SUSPECT", what="missed")
    rig.fleet.thaw(goal.agent)
    rig.wait(lambda: rig.agent(goal.agent).liveness == "ALIVE", what="heard again")
    rig.wait(lambda: rig.ended([task]), within_s=30.0, what="the mission went on")
    assert rig.task(task).status == "SUCCEEDED"
    assert not [row for row in rig.log.rows_of([task]) if row.state not in ("succeeded", "answered", "withdrawn")]
    assert rig.verdict().is_clean


def test_a_drone_restarted_before_it_is_lost_fails_its_task_in_doubt_and_is_recovered_by_it(fly: Fly) -> None:
    rig = fly()
    assert rig.fleet is not None
    task = rig.pick_up()
    rig.wait(lambda: (goal := rig.flying(task)) is not None and rig.far(goal.agent, 80.0), what="on its way")
    goal = rig.flying(task)
    assert goal is not None
    boot = rig.agent(goal.agent).boot_id
    rig.fleet.restart(goal.agent)
    rig.wait(lambda: rig.agent(goal.agent).boot_id != boot, what="it is back")
    rig.wait(lambda: rig.ended([task]), what="the task brought it home")
    assert (rig.task(task).status, rig.task(task).outcome.code) == ("FAILED", "in_doubt")
    assert rig.agent(goal.agent).quarantine == ""
    assert rig.at_rest(DRONES)
    assert list(rig.log.state.tasks) == [task]  # no system task was needed
    assert rig.verdict().is_clean


def test_nonsense_on_a_status_key_is_counted_and_the_engine_goes_on(fly: Fly) -> None:
    rig = fly()
    session = _stranger(rig)
    try:
        for junk in (b"\xff\x00 garbage", b"{}", b"[1, 2", json.dumps({"id": "lwd_1", "type": "hwd"}).encode()):
            session.put("lwd/lwd_2/status", junk)
        rig.wait(lambda: _bad_messages(rig, "lwd_2") >= 4, what="all four are counted")
        session.put("hwd/nobody/status", b"garbage")
        session.put("lwd/hwd_1/status", b"garbage")  # another type under a known id
        task = rig.move("lwd_1")
        rig.wait(lambda: rig.ended([task]), what="a mission flies all the same")
    finally:
        session.close()
    assert rig.task(task).status == "SUCCEEDED"
    assert rig.agent("lwd_2").pool == "STANDBY"
    assert "nobody" not in rig.log.state.agents
    assert rig.agent("hwd_1").type == "hwd"


def _bad_messages(rig: Rig, agent: str) -> int:
    from formiga_bt.engine.kernel.inputs import BadStatusInput

    return sum(isinstance(s.input, BadStatusInput) and s.input.agent == agent for s in list(rig.steps))


def _stranger(rig: Rig) -> zenoh.Session:
    config = {
        "mode": "client",
        "namespace": rig.site.name,
        "connect": {"endpoints": [rig.endpoint]},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def test_a_second_engine_on_the_port_is_told_so_and_leaves_nothing(fly: Fly) -> None:
    import os

    rig = fly()
    before = children(os.getpid())
    with pytest.raises(TransportError, match="cannot open Zenoh at tcp"):
        fly(listen=rig.endpoint)
    assert children(os.getpid()) == before
    assert not rig.missing()
