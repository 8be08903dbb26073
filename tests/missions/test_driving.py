"""Machines that drive, and doors that stand: what the gate, stops, lockdown, breaches and recover do with them."""

from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.kernel.inputs import Abort, LockdownOrder, Operator
from formiga_bt.lang.compose import compose
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, alarms, task_of

YARD = """
formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
actions: [base, ground, building, own.yaml]
stations:
  s1: {at: {east: 0 m, north: 0 m}, charges: true}
  s2: {at: {east: 0 m, north: 20 m}}
  s3: {at: {east: 20 m, north: -30 m}, kinds: [tug]}
fence: [{east: -50 m, north: -50 m}, {east: 100 m, north: -50 m}, {east: 100 m, north: 50 m}, {east: -50 m, north: 50 m}]
no_go:
  - [{east: 40 m, north: -5 m}, {east: 50 m, north: -5 m}, {east: 50 m, north: 5 m}, {east: 40 m, north: 5 m}]
agents:
  rover_1: {type: rover, home: s1}
  rover_2: {type: rover, home: s2}
  tug_1: {type: tug, at: {east: 0 m, north: -30 m}}
  door_1: {type: door, at: {east: 10 m, north: 10 m}}
  eve: {type: watcher}
"""
OWN = """
types:
  tug: {extends: rover, rest: docked, label: tug}
"""
TASK = """
params: {to: place}
agents: {rover: {type: %s}}
steps:
  - do: rover.Drive
    with: {to: "${to}"%s}
  - notify: there
"""
THERE = Place(30.0, 0.0)


@pytest.fixture
def made(tmp_path: Any) -> tuple[Site, Catalogue]:
    (tmp_path / "site.yaml").write_text(YARD)
    (tmp_path / "own.yaml").write_text(OWN)
    found = compose(tmp_path / "site.yaml")
    assert [str(one) for one in found.diagnostics] == []
    assert found.site is not None
    return found.site, found.catalogue


def bench(made: tuple[Site, Catalogue], kind: str = "rover", more: str = "") -> Bench:
    site, catalogue = made
    return Bench(site, catalogue, [task_of(TASK % (kind, more), site, catalogue, "Go")])


def drive(rig: Bench, to: Place = THERE) -> str:
    task = rig.submit("Go", {"to": to})
    rig.run_for(1.0)
    return task


def waits(rig: Bench, task: str) -> list[tuple[str, str]]:
    return [(goal.code, goal.text) for goal in rig.engine.state.goals.values() if goal.task == task]


def order(rig: Bench, word: Any, target: str = "rover_1") -> None:
    rig.ask(Operator(word, target, "eve"))
    rig.run_for(1.0)


def away(agent: ScriptedAgent, spot: Place) -> float:
    return horizontal_m(agent.side.status.position, spot)  # type: ignore[arg-type]


def test_it_drives_without_port_layer_and_flight_state_and_stays_where_it_is(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    task = drive(rig)
    assert rover.done == ["Drive"]
    rover.succeed()
    rig.run_for(2.0)

    record = rig.record("rover_1")
    assert rig.task(task).status == "SUCCEEDED"
    assert (record.pool, record.landed, record.layer_m) == ("STANDBY", "grounded", None)
    assert rover.done == ["Drive"], "a parked machine stays where its task ends"
    rig.check()


@pytest.mark.parametrize(
    ("to", "code"),
    [(Place(80.0, 0.0), "envelope.keep_out"), (Place(30.0, 80.0), "envelope.keep_in")],
)
def test_it_enters_no_region_and_leaves_no_fence(made: tuple[Site, Catalogue], to: Place, code: str) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    task = drive(rig, to)

    assert rover.done == []
    assert rig.task(task).outcome.code == code
    rig.check()


def test_no_goal_is_faster_than_max_speed(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made, more=', speed: "${3 m/s + distance(base, to) / 1000 s}"')
    rover = rig.agent("rover_1", "rover")

    assert rig.task(drive(rig)).outcome.code == "envelope.max_speed"
    assert rover.done == []


def test_its_charge_must_do_for_the_way_and_on_to_a_charging_station(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    rover.say(battery=15.2)
    rig.run_for(1.0)

    assert rig.task(drive(rig)).outcome.code == "envelope.reserve"


def test_two_tasks_share_no_way(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    one, other = rig.agent("rover_1", "rover"), rig.agent("rover_2", "rover")
    first = drive(rig)
    second = drive(rig, Place(15.0, -20.0))

    assert (one.done, other.done) == (["Drive"], [])
    assert waits(rig, second) == [("leg_busy", "rover_1")]
    one.succeed()
    rig.run_for(2.0)
    assert rig.task(first).status == "SUCCEEDED"
    assert other.done == ["Drive"]
    other.succeed()
    rig.run_for(1.0)
    assert rig.task(second).status == "SUCCEEDED"
    rig.check()


@pytest.mark.parametrize("stop", ["hold", "land"])
def test_hold_and_land_make_it_stand_until_a_person_decides(made: tuple[Site, Catalogue], stop: str) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    task = drive(rig)
    order(rig, stop)
    rover.say(battery=5.0, position=Position(10.0, 0.0, 0.0))
    rig.run_for(3600.0)

    assert rover.cancels
    assert rover.done == ["Drive"], "a held ground machine stays, at reserve too"
    assert rig.engine.state.orders["rover_1"].stop == "hold"
    rover.say(battery=90.0)
    rig.run_for(1.0)
    order(rig, "continue")
    assert rover.done == ["Drive", "Drive"]
    rover.succeed()
    rig.run_for(1.0)
    assert rig.task(task).status == "SUCCEEDED"
    rig.check()


def test_return_drives_it_to_its_station(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    task = drive(rig)
    rover.say(position=Position(20.0, 0.0, 0.0))
    order(rig, "return")
    assert rover.done == ["Drive", "Drive"]
    rover.succeed()
    rig.run_for(2.0)

    assert away(rover, Place(0.0, 0.0)) == 0.0
    assert rig.engine.state.orders["rover_1"].state == "done"
    rig.ask(Abort(task, "eve"))
    rig.run_for(2.0)
    rig.check()


@pytest.mark.parametrize("how", ["hold", "land", "return"])
def test_lockdown_stops_what_drives(made: tuple[Site, Catalogue], how: Any) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    rig.agent("rover_2", "rover")
    drive(rig)
    rover.say(position=Position(20.0, 0.0, 0.0))
    rig.ask(LockdownOrder(how, "eve"))
    rig.run_for(2.0)

    assert rover.cancels
    assert rover.done == (["Drive", "Drive"] if how == "return" else ["Drive"])
    assert list(rig.engine.state.orders) == ["rover_1"], "who stands needs no order"


def test_at_reserve_the_task_ends_and_it_drives_to_a_station(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    task = drive(rig)
    rover.say(position=Position(20.0, 0.0, 0.0), battery=14.0)
    rig.run_for(3.0)

    assert "envelope.reserve" in alarms(rig)
    assert rover.done == ["Drive", "Drive"]
    rover.succeed()
    rig.run_for(3.0)
    assert rig.task(task).outcome.code == "envelope.reserve"
    assert away(rover, Place(0.0, 0.0)) == 0.0
    rig.check()


def test_in_a_no_go_region_the_task_ends_and_it_stands_until_a_person_decides(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    drive(rig)
    rover.say(position=Position(45.0, 0.0, 0.0))
    rig.run_for(600.0)

    assert "envelope.keep_out" in alarms(rig)
    assert rover.done == ["Drive"]
    order(rig, "continue")
    rig.run_for(3.0)
    assert rover.done == ["Drive", "Drive"], "its way out"
    rover.succeed()
    rig.run_for(3.0)
    rig.check()


@pytest.mark.parametrize(("north", "avoids", "off"), [(2.9, False, False), (4.0, False, True), (4.0, True, False)])
def test_who_leaves_the_way_that_it_was_given_stands_until_a_person_decides(
    made: tuple[Site, Catalogue], north: float, avoids: bool, off: bool
) -> None:
    """Others were let go because it keeps to its way; who keeps away from obstacles by itself may drive round one."""
    rig = bench(made)
    rover = rig.agent("rover_1", "rover")
    rover.link.publish_card(replace(rover.side.card, avoids=avoids))
    rig.run_for(1.0)
    task = drive(rig)
    rover.say(position=Position(10.0, north, 0.0))
    rig.run_for(60.0)

    assert ("envelope.way" in alarms(rig)) == off
    assert len(rover.cancels) == off
    assert rig.task(task).outcome.code == ("envelope.way" if off else "")
    if off:
        assert rig.task(task).outcome.reason.startswith("rover_1: it is 4 m off the way that it was given, at most 3 m")
        assert rover.done == ["Drive"]
    rig.check()


def test_who_belongs_at_a_station_is_brought_there_when_its_task_ends(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made, "tug")
    tug = rig.agent("tug_1", "tug", at=Place(20.0, -30.0))
    task = drive(rig, Place(20.0, 0.0))
    tug.succeed()
    rig.run_for(2.0)
    assert tug.done == ["Drive", "Drive"]
    assert rig.task(task).section == "recover"
    tug.succeed()
    rig.run_for(2.0)
    assert (rig.task(task).status, away(tug, Place(20.0, -30.0))) == ("SUCCEEDED", 0.0)
    assert rig.record("tug_1").pool == "STANDBY"
    rig.check()


def test_who_stands_elsewhere_than_at_its_station_is_granted_to_nobody(made: tuple[Site, Catalogue]) -> None:
    rig = bench(made, "tug")
    tug = rig.agent("tug_1", "tug")
    assert rig.record("tug_1").pool == "PARKED_AWAY"
    task = drive(rig)
    assert rig.task(task).status == "PENDING"
    order(rig, "return", "tug_1")
    tug.succeed()
    rig.run_for(2.0)
    order(rig, "continue", "tug_1")
    assert rig.task(task).status == "ACTIVE"


def test_a_door_finishes_its_motion_and_gets_no_new_goal(made: tuple[Site, Catalogue]) -> None:
    site, catalogue = made
    text = """
agents: {door: {type: door}}
steps:
  - do: door.Open
  - do: door.Close
"""
    rig = Bench(site, catalogue, [task_of(text, site, catalogue, "Pass")])
    door = rig.agent("door_1", "door")
    task = rig.submit("Pass")
    rig.run_for(1.0)
    order(rig, "return", "door_1")
    assert door.cancels == []
    assert rig.engine.state.orders["door_1"].stop == "hold"
    door.succeed()
    rig.run_for(5.0)
    assert door.done == ["Open"]
    order(rig, "continue", "door_1")
    assert door.done == ["Open", "Close"]
    door.succeed()
    rig.run_for(1.0)
    assert rig.task(task).status == "SUCCEEDED"
    rig.check()
