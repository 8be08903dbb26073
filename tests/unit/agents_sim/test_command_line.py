"""The command line of one agent's process says what the spec says."""

import os
from pathlib import Path

import pytest

from agents_sim.__main__ import parse, read_spec
from agents_sim.kinds import Kind, Outcome, SimAction
from agents_sim.launch import FleetProcesses, command
from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, Position


@pytest.mark.parametrize(
    "spec",
    [
        AgentSpec(
            id="d", type="hwd", at=Place(-3.5, 20.0), battery=55.5, home=Place(-1.0, -2.0), limits={"climb_m_s": 2.0}
        ),
        AgentSpec(id="d", type="lwd", at=Position(0.0, -1.0, 40.0), home=Place(0.0, -1.0)),
        AgentSpec(
            id="x",
            type="medic",
            kind="person",
            home=Place(0.0, 0.0),
            script=({"match": "a b", "options": ["ä"]},),
            walk=(Place(-1.0, 2.0), Place(3.0, -4.5)),
            base=(66.5, -25.7),
        ),
        AgentSpec(
            id="d",
            type="hwd",
            home=Place(0.0, 0.0),
            wind=(-3.0, 1.5),
            payload_kg=1.5,
            cut=True,
            on_link_loss="land",
            limits={"climb_drain_pct_s": 0.1},
        ),
        AgentSpec(
            id="r",
            type="rover",
            does=Kind(
                mobility="ground",
                actions={"Drive": SimAction(moves_to="to"), "Look": SimAction(typical_us=3, result={"seen": ["ä b"]})},
                limits={"speed_m_s": 2.0},
                body="rover",
            ),
            outcomes=(
                Outcome(action="Look", nth=2, give={"seen": []}, delay_s=1.5),
                Outcome(action="Drive", fail="stuck"),
            ),
            seed=7,
            chargers=(Place(-1.0, 2.0), Place(3.0, -4.0)),
        ),
    ],
)
def test_a_spec_passes_through_the_command_line(spec: AgentSpec, tmp_path: Path) -> None:
    words = command(spec, site="farm", connect="tcp/127.0.0.1:1", state_dir=tmp_path)
    options = parse(words[2:])
    assert read_spec(options) == spec
    assert (options.site, options.connect, options.state_dir) == ("farm", "tcp/127.0.0.1:1", tmp_path)
    assert options.exit_with_parent == os.getpid()


def test_a_fleet_refuses_wrong_specs_before_it_starts_any(tmp_path: Path) -> None:
    for specs in (
        [AgentSpec(id="d", type="boat")],
        [AgentSpec(id="d", type="lwd"), AgentSpec(id="d", type="lwd")],
        [AgentSpec(id="d", type="lwd", limits={"wings": 2.0})],
    ):
        with pytest.raises(ValueError, match=r"boat|two agents|wings"):
            FleetProcesses(specs, site="s", connect="tcp/127.0.0.1:1", state_dir=tmp_path)
