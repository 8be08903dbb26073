"""One cell of the comparison: so many instances of one tree in one engine, and what they cost. Times are of the processor."""

import gc
import os
import resource
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.peers.protocol import Fleet, Peer
from benchmarks.peers.trees import ACTIONS_IN_TURN, TREES

WAKES = 200
"""A round of wakes has so many, however few the instances are."""
VISITS = 1000
"""A round of idling ticks so many trees, however few the instances are."""
RESULTS = len(ACTIONS_IN_TURN) - 1
"""A mission serves so many rounds of results: the last one would end it. Then the next missions are taken."""
BURST = 100
"""Ten bursts a second of so many are 1,000 wakes a second."""


def rss_bytes() -> int:
    """Return the memory that this process has now."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def cpu_us(deed: Callable[[], object]) -> float:
    """Return the processor time of this process, all its threads, for something."""
    began = time.process_time_ns()
    deed()
    return (time.process_time_ns() - began) / 1000


@dataclass
class Cell:
    """One engine with its instances.

    Attributes:
        built: build_us (processor time of building and starting one instance more), bytes (resident memory, an instance).
    """

    peer: Peer
    tree: str
    count: int
    fleet: Fleet = field(init=False)
    built: dict[str, float] = field(default_factory=dict)
    turn: int = 0
    done: int = 0
    """Results of the mission given already."""

    def __post_init__(self) -> None:
        shape = TREES[self.tree]
        one_us = 0.0
        for _ in range(2):  # the first one pays for imports, caches, first pages
            one_us = cpu_us(lambda: self.peer.build(shape, self.tree, 1).close())
        gc.collect()
        before = rss_bytes()

        def build() -> None:
            self.fleet = self.peer.build(shape, self.tree, self.count)

        us = cpu_us(build) - one_us
        gc.collect()
        self.built = {
            "build_us": max(0.0, us) / max(1, self.count - 1),
            "bytes": max(0, rss_bytes() - before) / self.count,
        }
        gc.freeze()  # what stands is not looked at by the collector again; it stays on for what comes

    def _some(self, count: int) -> list[int]:
        chosen = [(self.turn + i) % self.count for i in range(count)]
        self.turn += count
        return chosen

    def idle(self) -> float:
        """Return the cost of one round in which nobody has news, all instances."""
        rounds = 1 if self.peer.most < 100 else max(1, VISITS // self.count)

        def deed() -> None:
            for _ in range(rounds):
                self.fleet.idle_round()

        return cpu_us(deed) / rounds

    def news(self) -> float:
        """Return the cost of one wake that ends nothing, that instance only."""
        chosen = self._some(WAKES)
        return cpu_us(lambda: self.fleet.news(chosen)) / WAKES

    def burst(self) -> float:
        """Return the cost of one wake of a burst, when nobody knows which instances have news."""
        chosen = self._some(min(BURST, self.count))
        return cpu_us(lambda: self.fleet.burst(chosen)) / len(chosen)

    def result(self) -> float:
        """Return the cost of one action's end and the next one's start, in the mission only; each round the next."""
        block, action = divmod(self.done, RESULTS)
        self.done += 1
        first = block * WAKES
        chosen = range(first, min(first + WAKES, self.count))
        assert len(chosen) > 0, "no missions are left"
        return cpu_us(lambda: self.fleet.results(chosen, ACTIONS_IN_TURN[action])) / len(chosen)

    def measure(self, what: str) -> float:
        """Return one measure by name."""
        one: Callable[[], float] = getattr(self, what)
        return one()

    def close(self) -> None:
        """Let go of it."""
        gc.unfreeze()
        self.fleet.close()


def compare(ours: Any, theirs: Any, measure: str, rounds: int) -> dict[str, float]:
    """Return medians of both and of their ratio, taken in turns; both are cells, here or in processes of their own."""
    pairs = [(ours.measure(measure), theirs.measure(measure)) for _ in range(rounds)]
    return {
        "ours_us": statistics.median(a for a, _ in pairs),
        "peer_us": statistics.median(b for _, b in pairs),
        "ratio": statistics.median(b / max(a, 0.001) for a, b in pairs),
    }


def pin() -> int | None:
    """Keep this process and its children on one core; return which, or None if that cannot be."""
    try:
        core = max(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {core})
    except (AttributeError, OSError):
        return None
    return core
