"""Who is admitted: each card is judged, and what the site no longer lists stays ours until it rests."""

from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.inputs import Abort, Alarm, LockdownOrder, Operator, QueryGoal
from formiga_bt.engine.kernel.replies import Done
from formiga_bt.lang.model import Site
from formiga_bt.nodes.memory import NODE_STATE_VERSION
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, alarms, effects, packaged_world, task_of
from formiga_bt.transport.messages import AgentCard
from tests.golden import Wording
from tests.missions.crashing import Crashing

SITE, CATALOGUE = packaged_world()
FLY = task_of(
    """
agents: {drone: {type: hwd}}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${at_height(base, 75 m)}"}
  - do: drone.GoTo
    with: {to: "${at_height(drone.home, 60 m)}"}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
""",
    SITE,
    CATALOGUE,
)
STANDING_PORTS = ("p1", "p2", "p3", "p6")
"""Ports of the site that other machines have as their home."""


def unlisted(site: Site) -> Site:
    return replace(site, mode="real", agents={name: one for name, one in site.agents.items() if name != "hwd_1"})


def without_port(site: Site) -> Site:
    ports = {name: port for name, port in site.ports.items() if name in STANDING_PORTS}
    return replace(site, ports=ports, agents={name: one for name, one in site.agents.items() if name != "hwd_1"})


def bench() -> tuple[Bench, ScriptedAgent]:
    made = Bench(SITE, CATALOGUE, [FLY])
    drone = made.agent("hwd_1", "hwd")
    made.run_for(2)
    return made, drone


def aloft(change: Callable[[Site], Site] | None = None) -> tuple[Bench, ScriptedAgent, str]:
    """Let hwd_1 fly for a task, and, with `change`, another engine go on with another site file."""
    made, drone = bench()
    task = made.submit("Try", {})
    made.run_for(10)
    drone.succeed()
    made.run_for(2)
    assert drone.goal.action == "GoTo"
    if change is not None:
        crashing = Crashing(made)
        crashing.die()
        made.engine.core.site = change(SITE)
        crashing.resume(3, node_state=NODE_STATE_VERSION)
        made.run_for(5)
    return made, drone, task


def announce(drone: ScriptedAgent, **fields: Any) -> None:
    """Publish another card of the same process."""
    card = drone.side.card
    old = {name: getattr(card, name) for name in AgentCard.__struct_fields__}
    drone.link.publish_card(AgentCard(**{**old, **fields}))


# -- what the site file says no more --------------------------------------------------------------------------------------
@pytest.mark.parametrize(("change", "why"), [(unlisted, "unlisted"), (without_port, "no_port")])
def test_what_flies_and_is_not_in_the_site_file_any_more_goes_on_and_is_told_of(
    change: Callable[[Site], Site], why: str
) -> None:
    made, drone, task = aloft(change)

    record = made.record("hwd_1")
    assert (record.refused, record.refused_at_rest, record.liveness) == ("", why, "ALIVE")
    told = [e.text for e in effects(made, Alarm) if e.code == "not_admitted"]
    text = f"hwd_1 is in use and not admitted any more: {why}; it can be stopped and comes home, but gets no new task"
    assert told == [text]
    assert made.task(task).status == "ACTIVE"
    drone.say(battery=80.0)
    made.run_for(1)
    assert made.record("hwd_1").battery == 80.0


@pytest.mark.parametrize("order", ["hold", "return", "land", "cut"])
@pytest.mark.parametrize("change", [unlisted, without_port])
def test_each_stop_reaches_it(change: Callable[[Site], Site], order: Any) -> None:
    made, drone, _ = aloft(change)
    before = len(drone.cancels)

    assert made.ask(Operator(order, "hwd_1", "eve")) == Done()
    made.run_for(2)

    assert len(drone.cancels) > before or drone.goal.action == "CutMotors"
    found = made.engine.state.orders["hwd_1"].stop
    assert found == ("land" if change is without_port and order == "return" else order)


@pytest.mark.parametrize("how", ["hold", "return", "land"])
@pytest.mark.parametrize("change", [unlisted, without_port])
def test_lockdown_and_an_order_for_all_reach_it(change: Callable[[Site], Site], how: Any) -> None:
    for given in (LockdownOrder(how, "eve"), Operator(how, "", "eve")):
        made, _, _ = aloft(change)
        made.ask(given)
        found = made.engine.state.orders["hwd_1"].stop
        assert found == ("land" if change is without_port and how == "return" else how)


def test_without_a_port_of_its_own_it_lands_where_it_is() -> None:
    made, drone, _ = aloft(without_port)
    made.ask(Operator("return", "hwd_1", "eve"))
    made.run_for(3)

    assert alarms(made)[-1] == "no_way_home"
    assert drone.goal.action == "LandIn"
    made.run_for(20)
    drone.succeed()
    made.run_for(3)
    assert (made.record("hwd_1").landed, made.engine.state.orders["hwd_1"].state) == ("grounded", "done")


@pytest.mark.parametrize(("change", "why"), [(unlisted, "unlisted"), (without_port, "no_port")])
def test_an_abort_brings_it_down_and_then_it_is_no_longer_ours(
    change: Callable[[Site], Site], why: str, wording: Wording
) -> None:
    made, drone, task = aloft(change)
    made.ask(Abort(task, by="eve"))
    for _ in range(20):
        made.run_for(1)
        if drone.side.active:
            made.run_for(20)  # none of its ways is a jump
            drone.succeed()
    made.run_for(5)

    assert made.task(task).status == "CANCELED"
    record = made.record("hwd_1")
    assert (record.landed, record.task, record.refused, record.refused_at_rest) == ("grounded", "", why, "")
    if made.engine.core.site.mode == "simulation":  # else a person approves it first
        again = made.submit("Try", {})
        made.run_for(5)
        assert made.task(again).status == "PENDING"
    with pytest.raises(TaskError) as refused:
        made.ask(Operator("hold", "hwd_1", "eve"))
    wording(refused.value)


def test_one_that_stands_and_does_nothing_is_not_admitted_at_once() -> None:
    made, _ = bench()
    crashing = Crashing(made)
    crashing.die()
    made.engine.core.site = unlisted(SITE)
    crashing.resume(3)

    assert (made.record("hwd_1").refused, made.record("hwd_1").refused_at_rest) == ("unlisted", "")


def test_a_machine_of_a_type_that_the_catalogue_has_no_more_is_quarantined_and_the_engine_goes_on() -> None:
    made, drone, task = aloft()
    crashing = Crashing(made)
    crashing.die()
    types = {name: one for name, one in CATALOGUE.types.items() if name != "hwd"}
    made.engine.core.catalogue = replace(CATALOGUE, types=types)
    crashing.resume(3)
    made.run_for(15)

    record = made.record("hwd_1")
    assert (record.refused, record.pool, record.quarantine) == ("unknown_type", "QUARANTINED", "unknown_type")
    assert "quarantined_airborne" in alarms(made)
    assert made.task(task).status == "FAILED"
    assert drone.cancels == [f"{task}/1/steps/steps[1]"]


# -- what a card says -----------------------------------------------------------------------------------------------------
def test_a_card_that_is_wrong_now_refuses_a_machine_that_stands(wording: Wording) -> None:
    made, drone = bench()
    announce(drone, datum="msl")
    made.run_for(1)

    assert (made.record("hwd_1").refused, made.record("hwd_1").pool) == ("datum", "STANDBY")
    wording([e.text for e in effects(made, Alarm)])
    task = made.submit("Try", {})
    made.run_for(5)
    assert made.task(task).status == "PENDING"


def test_a_mended_card_is_admitted() -> None:
    made, drone = bench()
    for datum, refused in (("msl", "datum"), ("local", ""), ("ellipsoid", "datum"), ("local", "")):
        announce(drone, datum=datum)
        made.run_for(2)
        assert made.record("hwd_1").refused == refused
    task = made.submit("Try", {})
    made.run_for(5)
    assert made.task(task).status == "ACTIVE"


def test_a_machine_whose_heights_count_from_elsewhere_now_leaves_its_task_and_what_it_does_is_called_off() -> None:
    made, drone, task = aloft()
    goal = drone.goal.goal_id
    announce(drone, datum="msl")
    made.run_for(1)

    record = made.record("hwd_1")
    assert (record.refused, record.pool, record.quarantine, record.task) == ("datum", "QUARANTINED", "datum", "")
    assert (made.task(task).status, made.task(task).outcome.code) == ("FAILED", "agent_lost")
    assert [e.code for e in effects(made, Alarm)] == ["not_admitted", "quarantined_airborne"]
    assert effects(made, QueryGoal)
    assert drone.cancels == [goal]
    made.run_for(60)
    assert not drone.side.active, "nobody steers it"
    assert made.record("hwd_1").liveness == "ALIVE", "but it is listened to"


def test_of_a_machine_that_was_turned_away_in_the_air_only_what_needs_no_height_is_asked(wording: Wording) -> None:
    made, drone, _ = aloft()
    announce(drone, datum="msl")
    made.run_for(1)
    for order in ("return", "land"):
        with pytest.raises(TaskError) as refused:
            made.ask(Operator(order, "hwd_1", "eve"))
        wording(refused.value)
    with pytest.raises(TaskError) as refused:
        made.ask(Operator("clear", "hwd_1", "eve"))
    wording(refused.value)
    assert made.ask(Operator("hold", "hwd_1", "eve")) == Done()
    assert made.ask(Operator("cut", "hwd_1", "eve")) == Done()
    made.run_for(1)
    assert drone.goal.action == "CutMotors"


def test_once_its_card_is_mended_it_comes_home() -> None:
    made, drone, _ = aloft()
    announce(drone, datum="msl")
    made.run_for(5)
    drone.say(position=Position(0.0, 0.0, 180.0))  # over another ground: not believed
    made.run_for(1)
    up = made.record("hwd_1").position
    assert up is not None
    assert up.up_m < 100.0
    drone.say(position=up)

    announce(drone, datum="local")
    made.run_for(10)

    assert (made.record("hwd_1").refused, made.record("hwd_1").pool) == ("", "EXECUTING ACTION")
    assert made.record("hwd_1").task.startswith("Recover-")


def test_a_type_that_was_mended_counts() -> None:
    made = Bench(SITE, CATALOGUE, [FLY])
    drone = made.agent("hwd_1", "hwd")
    drone.kill()
    made.run_for(1)
    drone.kind = "lwd"
    drone.boot()
    made.run_for(2)
    assert (made.record("hwd_1").refused, made.record("hwd_1").type) == ("", "lwd")

    drone.kind = "hwd"
    drone.boot()
    made.run_for(2)
    task = made.submit("Try", {})
    made.run_for(2)
    assert made.task(task).status == "ACTIVE"


def test_another_type_under_the_id_of_one_in_the_air_is_turned_away() -> None:
    made, drone, task = aloft()
    drone.kill()
    drone.kind = "lwd"
    drone.boot()
    made.run_for(2)

    record = made.record("hwd_1")
    assert (record.refused, record.type, record.pool) == ("other_type", "hwd", "QUARANTINED")
    assert made.task(task).status == "FAILED"
