"""Agents as the paper's Fig. 5 has them: who is free, where they are and look, what is not known."""

from typing import Any

import pytest

from formiga_bt.base.geo import Frame, Position
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder, TaskAgents
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.services.mex import Mex, mex_of
from tests.unit.services.fakes import machine, order, task

FRAME = Frame(66.5, 25.7, 120.0)
HOME = Position(15.0, 40.0, 0.0)


def seen(agent: AgentRecord, *tasks: Any, orders: dict[str, StandingOrder] | None = None) -> Mex:
    """Return an agent of a state as the list has it."""
    state = EngineState()
    state.agents[agent.id] = agent
    state.tasks.update({one.id: one for one in tasks})
    state.orders.update(orders or {})
    (found,) = mex_of(state, FRAME)
    return found


def free(**fields: Any) -> AgentRecord:
    return machine("hwd_1", **{"task": "", "pool": "STANDBY", "landed": "grounded", **fields})


def test_one_that_does_something_tells_what_for_whom_and_where() -> None:
    up = free(
        pool="EXECUTING ACTION", task="PickUp-3", action="GoTo", position=Position(0.0, 0.0, 60.0), initial=HOME,
        heading_deg=0.0,
    )  # fmt: skip
    found = seen(up)
    assert (found.status, found.task_id, found.action_name, found.available) == (
        "EXECUTING ACTION",
        "PickUp-3",
        "GoTo",
        False,
    )
    assert found.pose is not None
    assert found.gps is not None
    assert found.initial_deployment is not None
    assert (found.gps.latitude, found.gps.longitude, found.gps.altitude) == (66.5, 25.7, 180.0)
    north = found.pose.pose.orientation
    assert (north.z, north.w) == pytest.approx((0.5**0.5, 0.5**0.5)), "a quarter turn from east"
    assert (found.initial_deployment.position.x, found.initial_deployment.position.y) == (15.0, 40.0)


def test_what_is_not_known_is_said_so() -> None:
    found = seen(free(battery=None))
    assert (found.pose, found.gps, found.battery, found.initial_deployment, found.task_id) == (
        None,
        None,
        None,
        None,
        "None",
    )
    assert found.available


@pytest.mark.parametrize(
    "fields",
    [
        {"pool": "QUARANTINED", "quarantine": "in_doubt"}, {"pool": "PARKED_AWAY"}, {"liveness": "SUSPECT"},
        {"control": "pilot"}, {"taken": True}, {"out": "rotor"}, {"refused": "unlisted"},
    ],
)  # fmt: skip
def test_one_that_cannot_be_given_to_a_task_is_not_available(fields: dict[str, Any]) -> None:
    found = seen(free(**fields))
    assert not found.available
    assert found.status == fields.get("pool", "STANDBY")


def test_nor_one_on_which_an_order_stands() -> None:
    assert not seen(free(), orders={"hwd_1": order("hwd_1", "hold")}).available


def test_a_person_has_the_task_that_asks_them() -> None:
    person = free(mobility="people", shared=True)
    asks = task("PickUp-3", agents=TaskAgents(roles={"user": ("hwd_1",)}, granted=("hwd_1",)))
    found = seen(person, asks)
    assert (found.status, found.task_id) == ("ASSIGNED", "PickUp-3")
