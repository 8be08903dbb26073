"""Faults played by simulated agents that are processes, a picker's tracker that hears drones, and their referee."""

from pathlib import Path

import pytest

from agents_sim.faults import Order
from agents_sim.launch import FleetProcesses
from agents_sim.world import AgentSpec
from formiga_bt.geo import Place, Position
from formiga_bt.transport.messages import BadMessage
from tests.e2e.test_sim_process import Engine, engine

__all__ = ["engine"]
pytestmark = pytest.mark.network


def test_a_process_plays_the_faults_it_is_ordered(engine: Engine, tmp_path: Path) -> None:
    spec = AgentSpec(id="hwd_1", type="hwd", at=Position(0.0, 0.0, 60.0), base=(66.5, 25.7))
    with FleetProcesses(
        [spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path, referee=True
    ) as fleet:
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        first = engine.status()
        assert first is not None
        assert first.lat == pytest.approx(66.5)

        fleet.order("hwd_1", Order(kind="refuse", code="not_today"))
        fleet.order("hwd_1", Order(kind="lose_result"))
        fleet.order("hwd_1", Order(kind="nan"))
        fleet.order("hwd_1", Order(kind="wrong_id", as_id="hwd_2"))
        engine.wait(lambda: len([event for event in engine.heard if isinstance(event, BadMessage)]) == 2)

        engine.order("no", "LandIn", at={"east_m": 0.0, "north_m": 0.0})  # all orders are heard by now
        engine.wait(lambda: engine.has_ended("no", "rejected"))
        assert engine.events("no")[-1].code == "not_today"

        engine.order("leg", "GoTo", to={"east_m": 20.0, "north_m": 0.0, "up_m": 60.0})
        engine.wait(lambda: (s := engine.status()) is not None and s.last_goal == "leg")
        assert not engine.has_ended("leg")  # the result was lost, the status tells

        fleet.order("hwd_1", Order(kind="slow", delay_s=30.0))
        engine.order("mute", "GoTo", to={"east_m": 0.0, "north_m": 0.0, "up_m": 60.0})
        engine.wait(lambda: engine.has_ended("mute", "accepted"))  # its answers are not late, its news is
        assert fleet.verdict().is_clean


def test_a_tracker_in_another_process_knows_which_drone_is_near(engine: Engine, tmp_path: Path) -> None:
    specs = [
        AgentSpec(id="hwd_1", type="hwd", at=Position(0.0, 0.0, 60.0)),
        AgentSpec(id="picker_1", type="picker", at=Place(200.0, 0.0)),
    ]
    with FleetProcesses(specs, site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: len(set(engine.boots())) == 2)
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        engine.order("far", "MiniFinder", agent="picker_1", base={"east_m": 0.0, "north_m": 0.0})
        engine.wait(lambda: engine.has_ended("far"))
        answer = engine.events("far")[-1].result
        assert answer["in_range"] is False
        engine.order("leg", "GoTo", to={"east_m": 190.0, "north_m": 0.0, "up_m": 60.0})
        engine.wait(lambda: engine.has_ended("leg"))
        engine.order("near", "MiniFinder", agent="picker_1", base={"east_m": 0.0, "north_m": 0.0})
        engine.wait(lambda: engine.has_ended("near"))
        assert engine.events("near")[-1].result["in_range"] is True
    assert set(fleet.ended().values()) == {0}
