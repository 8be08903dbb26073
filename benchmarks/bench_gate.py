"""What the gate costs: microseconds to judge one goal, with 10, 50 and 200 machines in the air.

    python benchmarks/bench_gate.py [--rounds 2000] [--limit 30]

The whole way of a goal: what the gate sees of it, who commands, the envelope (fence, no-fly region, ground, charge), spots
and ports, clearance, and the ways of the other machines, of which one has moved since the last goal. Prints JSON. Exit status
1 if a limit is given and a goal takes longer (median) with 10 or 50 machines in the air.
"""

import argparse
import json
import random
import statistics
import sys
import time
from typing import Any

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, TaskRecord, TaskRequest
from formiga_bt.lang.model import Port
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from formiga_bt.safety.gate import Go, Verdict

FIELD_M = 1000.0
LAYERS_M = (60.0, 75.0, 90.0)


def engine_of(count: int, dice: random.Random) -> Engine:
    """Return an engine with so many machines in the air, each on a leg of its own for a task of its own."""
    site, catalogue = packaged_world()
    spots = [
        Place(round(dice.uniform(-FIELD_M, FIELD_M), 3), round(dice.uniform(-FIELD_M, FIELD_M), 3))
        for _ in range(count)
    ]
    side = 1.2 * FIELD_M
    fence = Region((Place(-side, -side), Place(side, -side), Place(side, side), Place(-side, side)))
    no_fly = Region((Place(1100.0, 1100.0), Place(1150.0, 1100.0), Place(1150.0, 1150.0)))
    ports = {f"q{i}": Port(f"q{i}", spot) for i, spot in enumerate(spots)}
    engine = Engine(
        replace(site, ports=ports, fence=fence, no_fly=(no_fly,)), catalogue, {"MoveTask": packaged_task("move_task")}
    )
    core = engine.core
    core.begin(1_000_000 * SECOND)
    for i, spot in enumerate(spots):
        task, agent, goal = f"MoveTask-{i}", f"d{i}", f"MoveTask-{i}/1/steps/steps[0]"
        here = Position(spot.east_m, spot.north_m, LAYERS_M[i % 3])
        there = near(here, dice)
        core.emit(
            ch.TaskPut(
                TaskRecord(
                    id=task, name="MoveTask", order=i, request=TaskRequest(bundle=""), status="ACTIVE", section="steps"
                )
            )
        )
        core.emit(ch.GoalPut(GoalRecord(id=goal, agent=agent, action="GoTo", task=task, section="steps", state="running",
                                        fields={"to": there}, leg=(here, there), order=i)))  # fmt: skip
        core.emit(ch.AgentPut(AgentRecord(
            id=agent, type="hwd", actions=("TakeOff", "GoTo", "LandIn"), present=True, liveness="ALIVE",
            pool="EXECUTING ACTION",
            task=task, goal=goal, home=f"q{i}", layer_m=here.up_m, battery=90.0, position=here, landed="airborne",
            control="engine", order=i,
        )))  # fmt: skip
    return engine


def near(here: Position, dice: random.Random) -> Position:
    """Return a target some hundred metres away at the same height."""
    east, north = here.east_m + dice.uniform(-300, 300), here.north_m + dice.uniform(-300, 300)
    most = FIELD_M
    return Position(round(min(most, max(-most, east)), 3), round(min(most, max(-most, north)), 3), here.up_m)


def judged(engine: Engine, rounds: int, dice: random.Random) -> dict[str, Any]:
    """Judge a goal of one machine after the other; each has moved a little since its last."""
    core, gate = engine.core, engine.gatekeeper
    agents = list(core.state.agents)
    took: list[int] = []
    outcomes = {"go": 0, "wait": 0}
    for turn in range(rounds):
        agent = core.state.agents[agents[turn % len(agents)]]
        here = agent.position
        assert here is not None
        core.put_agent(agent.id, goal="", position=Position(here.east_m, here.north_m, round(here.up_m + 0.001, 3)))
        goal = GoalRecord(
            id=f"{agent.task}/1/steps/steps[1]", agent=agent.id, action="GoTo", task=agent.task, section="steps",
            fields={"to": near(here, dice)}, order=turn,
        )  # fmt: skip
        core.changes.clear()
        begun = time.perf_counter_ns()
        verdict: Verdict = gate.verdict(goal)
        took.append(time.perf_counter_ns() - begun)
        outcomes["go" if isinstance(verdict, Go) else "wait"] += 1
    micros = sorted(t / 1000 for t in took)
    return {
        "median_us": round(statistics.median(micros), 1),
        "p99_us": round(micros[int(0.99 * len(micros))], 1),
        **outcomes,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=2000)
    parser.add_argument("--limit", type=float, default=0.0, help="microseconds; 0: no limit")
    options = parser.parse_args()
    found = {}
    for count in (10, 50, 200):
        dice = random.Random(count)
        engine = engine_of(count, dice)
        judged(engine, 200, dice)
        found[str(count)] = judged(engine, options.rounds, dice)
    print(json.dumps({"machines_in_the_air": found, "limit_us": options.limit or None}, indent=2))
    return int(options.limit > 0.0 and any(found[n]["median_us"] > options.limit for n in ("10", "50")))


if __name__ == "__main__":
    sys.exit(main())
