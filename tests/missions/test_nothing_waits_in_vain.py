"""No goal waits at the gate that could go: what the gatekeeper does not look at again would get the same answer."""

from collections import Counter

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Position
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.goals.gatekeeper import Gatekeeper
from formiga_bt.engine.kernel.inputs import EngineStep, Operator
from formiga_bt.engine.kernel.records import GoalRecord
from formiga_bt.safety.gate import Go, Verdict
from tests.missions.conftest import Fly
from tests.missions.test_shipped import SITE, pick_up
from tests.missions.test_storms import Storm


def judged_anew(engine: Engine, goal: GoalRecord) -> Verdict:
    """Return the verdict of a gatekeeper that knows nothing of before."""
    core = engine.core
    moved, core.moved = core.moved, dict.fromkeys(core.state.agents)
    found = Gatekeeper(core, engine.clearances).verdict(replace(goal, code="", text=""))
    core.moved = moved
    return found


@pytest.mark.parametrize("seed", [0, 3, 5])
def test_no_goal_waits_that_could_go(fly: Fly, seed: int) -> None:
    field = SITE.places["north_field"]
    rehearsal = fly(change={"lwd_1": {"at": Position(field.east_m, field.north_m, 60.0)}})
    rehearsal.ask(Operator("hold", "lwd_1"))  # it hovers in the way of the first
    waited: Counter[str] = Counter()

    def look(step: EngineStep) -> None:
        if not step.changes:
            return
        engine = rehearsal.engine
        for goal_id in list(engine.core.index.gated):
            goal = engine.state.goals[goal_id]
            waited[goal.code] += 1
            assert not isinstance(judged_anew(engine, goal), Go), (step.seq, goal)

    rehearsal.driver.listeners.append(look)
    for number, where in enumerate(("north_field", "east_field", "west_field", "south_field")):
        pick_up(rehearsal, where, f"picker_{1 + number % 2}")
    rehearsal.run_for(200)
    rehearsal.ask(Operator("continue", "lwd_1"))
    storm = Storm(rehearsal, seed)
    for _ in range(8 if seed else 0):
        rehearsal.run_for(25)
        storm.act()
    storm.calm()
    rehearsal.run_for(600)

    assert waited["leg_busy"] > 10
