"""50 rovers on a graph of 150 nodes: nobody touches another, nobody waits for ever, every drive comes to its end.

An hour of it, and 200 rovers on 500 nodes: `python benchmarks/bench_routes.py`.
"""

from formiga_bt.base.clock import SECOND
from tests.missions.route_traffic import Traffic, traffic

MINUTES = 2
STUCK_S = 300.0
"""So long at most no rover at all may come to its end."""


def owned_once(world: Traffic) -> bool:
    taken = [part for agent in world.engine.state.agents.values() for part in agent.on_route]
    return len(taken) == len(set(taken))


def test_fifty_rovers_on_150_nodes_never_touch_and_never_lock_up() -> None:
    world = traffic(8, 10, 70, 50, seed=1)
    assert world.engine.core.route_graph is not None
    assert len(world.engine.core.route_graph.nodes) == 150
    world.begin()
    for _ in range(MINUTES):
        world.run_judged(60.0)
        assert owned_once(world)

    assert world.referee.verdict(world.now).crashes == ()
    assert world.failed == []
    assert world.done > 5 * MINUTES


def test_rovers_that_fill_nearly_all_bays_of_two_way_lanes_still_all_come_through() -> None:
    """12 bays, 9 rovers, lanes driven both ways: who is in the way steps aside, and nobody is forgotten."""
    world = traffic(4, 4, 12, 9, seed=3, one_way=False)
    world.begin()
    seen: set[str] = set()
    last, since = 0, world.now
    for _ in range(30):
        seen |= set(world.tasks)
        world.run_judged(30.0)
        if world.done > last:
            last, since = world.done, world.now
        assert (world.now - since) / SECOND < STUCK_S, "no rover has come to its end for five minutes"
    old = [task for task in world.tasks if world.now - world.task(task).times.submitted_at > 600 * SECOND]

    assert owned_once(world)
    assert world.referee.verdict(world.now).crashes == ()
    assert (world.failed, old) == ([], [])
