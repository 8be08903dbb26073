"""Rovers on a graph of routes in virtual time: how many drives end, beside no reservation and straight ways; cost of a grant.

    python benchmarks/bench_routes.py                          200 rovers on 500 nodes, 10 virtual minutes each way
    python benchmarks/bench_routes.py --small --minutes 60     50 rovers on 150 nodes, an hour

Of runs without reservation and on straight ways without any check the referee's collisions are counted. Exit status 1 if the
run with reservation has one, a drive failed, or none ended in five minutes.
"""

import argparse
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # tests/ is no part of the installed package

from formiga_bt.engine.goals.routing import Routing
from formiga_bt.safety import driving
from tests.missions.route_traffic import Traffic, traffic

SMALL, LARGE = (8, 10, 70, 50), (16, 16, 244, 200)
STUCK_MIN = 5


class Grants:
    """How long it took to say whether an edge may be granted."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.seconds: list[float] = []
        may_go = Routing.may_go

        def timed(routing: Routing, hop: object) -> object:
            began = time.perf_counter()
            found = may_go(routing, hop)  # type: ignore[arg-type]
            self.seconds.append(time.perf_counter() - began)
            return found

        patch.setattr(Routing, "may_go", timed)


def run(world: Traffic, minutes: int) -> tuple[int, int, float, int]:
    """Return drives that ended, collisions, processor seconds, and the longest time without an end, minutes."""
    began, last, since, worst = time.process_time(), 0, 0, 0
    world.begin()
    for minute in range(1, minutes + 1):
        world.run_judged(60.0)
        if world.done > last:
            last, since = world.done, minute
        worst = max(worst, minute - since)
    return world.done, len(world.referee.verdict(world.now).crashes), time.process_time() - began, worst


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--minutes", type=int, default=10)
    parser.add_argument("--only", action="store_true", help="with reservation only")
    options = parser.parse_args()
    size = SMALL if options.small else LARGE
    with pytest.MonkeyPatch.context() as patch:
        grants = Grants(patch)
        world = traffic(*size, seed=1)
        graph = world.engine.core.route_graph
        assert graph is not None
        print(f"{size[3]} rovers, {len(graph.nodes)} nodes, {len(graph.edges)} edges, {options.minutes} min")
        done, crashes, cpu, worst = run(world, options.minutes)
        bad = bool(crashes or world.failed or worst >= STUCK_MIN)
        _tell("with reservation", options.minutes, done, crashes, cpu, len(world.failed))
        found = sorted(grants.seconds)
        middle, high = found[len(found) // 2], found[int(len(found) * 0.99)]
        print(f"  a look at a grant: median {middle * 1e3:.2f} ms, 99 % {high * 1e3:.1f} ms, {len(found)} looks")
        print(f"  longest time without any end: {worst} min")
    if options.only:
        return int(bad)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Routing, "may_go", lambda *_: None)
        patch.setattr(driving, "in_the_way", lambda *_, **__: "")
        world = traffic(*size, seed=1)
        done, crashes, cpu, _ = run(world, options.minutes)
        _tell("without reservation", options.minutes, done, crashes, cpu, len(world.failed))
    world = traffic(*size, seed=1, straight=True)
    done, crashes, cpu, _ = run(world, options.minutes)
    _tell("straight ways, corridors kept", options.minutes, done, crashes, cpu, len(world.failed))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(driving, "in_the_way", lambda *_, **__: "")
        world = traffic(*size, seed=1, straight=True)
        done, crashes, cpu, _ = run(world, options.minutes)
        _tell("straight ways, nothing kept", options.minutes, done, crashes, cpu, len(world.failed))
    return int(bad)


def _tell(what: str, minutes: int, done: int, crashes: int, cpu: float, failed: int) -> None:
    rate = done * 60 / minutes
    print(
        f"{what}: {done} drives ({rate:.0f} an hour), {crashes} collisions, {failed} failed, {cpu:.1f} s of processor",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
