"""Faults played by simulated agents that are processes, a picker who sees drones, and their referee."""

import time
from itertools import count
from pathlib import Path

import pytest

from agents_sim.faults import Order
from agents_sim.launch import FleetProcesses
from agents_sim.ledger import BodyFile
from agents_sim.motion import BodyState
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position
from formiga_bt.transport.messages import AgentGone, AgentSeen, BadMessage
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


def test_a_process_without_a_link_comes_home_by_itself_and_tells_when_it_is_back(
    engine: Engine, tmp_path: Path
) -> None:
    spec = AgentSpec(id="hwd_1", type="hwd", at=Position(60.0, 0.0, 30.0), home=Place(0.0, 0.0))
    with FleetProcesses([spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        engine.order("leg", "GoTo", link_silence_s=2.0, to={"east_m": 900.0, "north_m": 0.0, "up_m": 30.0})
        engine.wait(lambda: engine.has_ended("leg", "running"))
        fleet.order("hwd_1", Order(kind="link_loss"))
        engine.wait(lambda: any(isinstance(event, AgentGone) for event in engine.heard))

        end = time.monotonic() + 12.0
        body = BodyFile(tmp_path, "hwd_1")
        while not (
            (saved := body.load()) is not None and isinstance(saved.body, BodyState) and saved.body.kind == "rest"
        ):
            assert time.monotonic() < end, f"it did not come home: {saved}"
            engine.step()
            time.sleep(0.02)
        assert saved.body.segment.p1 == Position(0.0, 0.0, 0.0)
        assert saved.body.control == "failsafe"  # it hears nobody
        assert not engine.has_ended("leg", "taken_over")

        fleet.order("hwd_1", Order(kind="link_loss", on=False))
        engine.wait(lambda: engine.has_ended("leg", "taken_over"))
        engine.wait(lambda: (s := engine.status()) is not None and s.control == "engine")
        last = engine.status()
        assert last is not None
        assert (last.landed, last.last_goal, last.last_goal_state) == ("grounded", "leg", "taken_over")
        assert fleet.verdict().is_clean


def test_wind_charge_and_checks_reach_a_process(engine: Engine, tmp_path: Path) -> None:
    spec = AgentSpec(
        id="hwd_1", type="hwd", at=Place(0.0, 0.0), home=Place(0.0, 0.0), wind=(2.0, -1.0), payload_kg=1.5, cut=True
    )
    with FleetProcesses([spec], site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        seen = next(event.card for event in engine.heard if isinstance(event, AgentSeen))
        first = engine.status()
        assert first is not None
        assert "CutMotors" in seen.actions
        assert (first.wind_east_m_s, first.wind_north_m_s, first.payload_kg) == (2.0, -1.0, 1.5)
        fleet.order("hwd_1", Order(kind="battery", percent=31.0))
        fleet.order("hwd_1", Order(kind="preflight", check="storage", text="full"))
        fleet.order("hwd_1", Order(kind="wind", east=-4.0))
        engine.wait(lambda: (s := engine.status()) is not None and s.wind_east_m_s == -4.0)
        status = engine.status()
        assert status is not None
        assert status.battery == 31.0
        assert [(check.check, check.text) for check in status.checks if not check.ok] == [("storage", "full")]


def test_a_picker_in_another_process_follows_the_drone_that_guides_them(engine: Engine, tmp_path: Path) -> None:
    limits = {"reaction_s": 0.0, "walk_m_s": 10.0, "fix_error_m": 0.0}
    specs = [
        AgentSpec(id="hwd_1", type="hwd", at=Position(240.0, 0.0, 60.0)),
        AgentSpec(id="picker_1", type="picker", at=Place(200.0, 0.0), limits=limits),
    ]
    base = {"east_m": 160.0, "north_m": 0.0}
    with FleetProcesses(specs, site="sim-test", connect=engine.wire.endpoint, state_dir=tmp_path) as fleet:
        engine.wait(lambda: len(set(engine.boots())) == 2)
        engine.wait(lambda: (s := engine.status()) is not None and s.beat > 0)
        engine.order("far", "MiniFinder", agent="picker_1", base=base)
        engine.wait(lambda: engine.has_ended("far"))
        assert engine.events("far")[-1].result == {"in_range": False, "go_to": base}
        engine.order("leg", "GoTo", to={**base, "up_m": 60.0})
        engine.wait(lambda: engine.has_ended("leg"))

        numbers = count()

        def arrived() -> bool:
            asked = f"near-{next(numbers)}"
            engine.order(asked, "MiniFinder", agent="picker_1", base=base)
            engine.wait(lambda: engine.has_ended(asked))
            return bool(engine.events(asked)[-1].result["in_range"])

        engine.wait(arrived)
    assert set(fleet.ended().values()) == {0}
