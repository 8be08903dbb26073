"""What the policies of the allocator cost, and what they gain: `closest` beside `optimal` on the same instances.

    python benchmarks/bench_allocator.py

Tasks that wait for one machine each, and machines that stand by, are strewn over a square of 2 km; all have one priority. It
prints the sum of the costs of the grants, how many are served, and how long one look takes, the median of five.
"""

import random
import statistics
import time
from collections.abc import Callable
from typing import Any

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.policy import POLICIES, Decision
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest

SIZES = ((5, 10), (20, 20), (64, 100), (200, 200), (1000, 20), (1000, 1000))
"""Tasks that wait, machines that stand by."""


def instance(tasks: int, machines: int, seed: int) -> tuple[list[AgentRequest], Roster]:
    """Return tasks and machines strewn by a seed; every third machine can winch, every sixth task needs that."""
    draw = random.Random(seed)
    requests = []
    for number in range(tasks):
        actions = ("GoTo", "Winch") if number % 6 == 0 else ("GoTo",)
        at = (Place(draw.uniform(0.0, 2000.0), draw.uniform(0.0, 2000.0)),)
        role = RoleRequest(role="drone", types=("lwd",), shared=False, near=at, actions=actions)
        requests.append(AgentRequest(holder=f"T-{number}", priority="medium", order=number, at=0, roles=(role,)))
    agents = [
        Candidate(
            id=f"d{number}", type="lwd", order=number, shared=False, mobility="air",
            actions=("GoTo", "Winch") if number % 3 == 0 else ("GoTo",), refused="", pool="STANDBY", liveness="ALIVE",
            control="engine", task="", goal="", word="STANDBY", landed="grounded", at_port=True,
            battery=draw.uniform(60.0, 100.0), position=Position(draw.uniform(0.0, 2000.0), draw.uniform(0.0, 2000.0), 0.0),
        )
        for number in range(machines)
    ]  # fmt: skip
    return requests, Roster(agents)


def look(policy: Callable[..., Any], requests: list[AgentRequest], agents: Roster) -> tuple[Decision, float]:
    """Return what a policy decides, and how long that takes, seconds."""
    agents.begin()
    began = time.perf_counter()
    decision = policy(requests, agents)
    return decision, time.perf_counter() - began


def main() -> None:
    """Print the table."""
    print("| tasks, machines | policy | served | cost in all | one look |\n|---|---|---|---|---|")
    for tasks, machines in SIZES:
        for name, policy in POLICIES.items():
            costs, took, served = [], [], []
            for seed in range(5):
                decision, seconds = look(policy, *instance(tasks, machines, seed))
                chosen = [v.cost or 0.0 for seen in decision.verdicts.values() for v in seen if v.code == "chosen"]
                costs.append(sum(chosen))
                served.append(len(decision.grants))
                took.append(seconds)
            print(
                f"| {tasks}, {machines} | {name} | {statistics.mean(served):.1f} | {statistics.mean(costs) / 1000:.1f} km "
                f"| {statistics.median(took) * 1000:.1f} ms |"
            )


if __name__ == "__main__":
    main()
