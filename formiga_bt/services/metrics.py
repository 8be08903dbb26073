"""The figures of a running engine for a monitoring system, in the OpenMetrics text format: `GET /metrics`.

Each scrape makes them anew of what the engine knows; nothing is counted beside it but durations. Labels are words of ours
(statuses, pools, lanes, codes), never names, texts or places of people, and never more than a few dozen each.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final, Protocol, get_args

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
    StateSetMetricFamily,
)

from formiga_bt.base.clock import SECOND
from formiga_bt.base.durations import DurationCounts
from formiga_bt.engine.drivers.inbox import LANES
from formiga_bt.engine.drivers.realtime import RealtimeDriver
from formiga_bt.engine.kernel.records import Liveness, Pool
from formiga_bt.services.kept.journaling import Journaling
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import EngineHealth

STATUSES: Final = ("ok", "overloaded", "draining", "deposed", "stopping", "failed")
JOURNALS: Final = ("ok", "slow", "full", "gone")
OPEN: Final = {"PENDING": 0, "ASSIGNED": 0, "ACTIVE": 0, "ENDING": 0}
"""Statuses of tasks that have not ended: a figure that is 0 is told, too."""
POOLS: Final = dict.fromkeys(get_args(Pool), 0)
HEARD: Final = dict.fromkeys(get_args(Liveness), 0)
PRE: Final = "formiga"


class Measured(Protocol):
    """What is measured."""

    driver: RealtimeDriver
    view: EngineView
    journaling: Journaling

    def health(self) -> EngineHealth:
        """Return how the engine is."""
        ...

    def crowds(self) -> dict[str, int]:
        """Return how many connections each door has."""
        ...


class Metrics:
    """Writes the figures of an engine. Called in any thread.

    Args:
        engine: whose they are.
    """

    def __init__(self, engine: Measured) -> None:
        self._engine = engine
        self._registry = CollectorRegistry()
        self._registry.register(self)
        ProcessCollector(registry=self._registry)

    def write(self, accept: str) -> tuple[bytes, str]:
        """Return the text and its media type, in the format that the caller takes."""
        encode, kind = choose_encoder(accept)
        return encode(self._registry), kind

    def describe(self) -> list[Metric]:
        """Return no names before there is an engine to ask; the registry wants to know."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Iterate over all figures."""
        health, load = self._engine.health(), self._engine.driver.statistics()
        about = {"site": health.site, "mode": health.mode, "version": health.version}
        yield InfoMetricFamily(f"{PRE}_engine", "What runs.", about)
        yield _states("engine_status", "How the engine is; see docs/operating.md.", STATUSES, health.status)
        yield _states("journal_status", "How the journal stands.", JOURNALS, health.journal)
        yield _gauge("engine_epoch", "Starts of the engine on this site.", health.epoch)
        yield _counter("engine_steps", "Steps of the engine since the journal began.", health.steps)
        yield _gauge("engine_speed", "Engine seconds per second.", health.speed)
        yield _gauge("engine_ahead_seconds", "Engine time less the wall clock.", health.ahead_us / SECOND)
        yield _gauge("lockdown", "Whether lockdown stands.", float(health.lockdown.on))
        yield _gauge("deadlines_late_seconds", "How late the earliest deadline is, engine time.", load.behind_s)
        yield _histogram("step_seconds", "How long steps take.", load.steps)
        yield _histogram("beat_late_seconds", "How late the clock's beats leave, which machines live by.", load.beats)
        yield _histogram(
            "journal_append_seconds", "How long steps take to be on disk.", self._engine.journaling.commit_times
        )
        yield _labeled(
            "inbox_waiting", "Inputs that wait.", "lane", {lane: load.inbox.waiting.get(lane, 0) for lane in LANES}
        )
        yield _gauge("inbox_most", "The most inputs that ever waited at once.", load.inbox.most)
        yield _counter(
            "statuses_replaced", "Statuses that a newer one replaced before they were read.", load.inbox.replaced
        )
        yield _labeled("connections", "Connections of callers.", "door", self._engine.crowds())
        yield from self._of_state()

    def _of_state(self) -> Iterator[Metric]:
        with self._engine.view.reading() as state:
            now = state.now
            tasks = Counter(task.status for task in state.tasks.values() if task.section != "done")
            held = sum(bool(task.hold.causes) for task in state.tasks.values() if task.section != "done")
            machines = [agent for agent in state.agents.values() if not agent.human]
            pools = Counter(agent.pool for agent in machines)
            heard = Counter(agent.liveness for agent in machines)
            people = sum(agent.human for agent in state.agents.values())
            goals = Counter(goal.state for goal in state.goals.values())
            asked = [question.asked_at for question in state.questions.values() if question.reply is None]
            alarms = Counter((one.code, one.severity, one.state) for one in state.alarms.values() if one.is_open)
        yield _labeled("tasks", "Tasks that have not ended.", "status", {**OPEN, **tasks})
        yield _gauge("tasks_held", "Tasks that wait for a person or for the end of a stop.", held)
        yield _labeled("machines", "Machines.", "pool", {**POOLS, **pools})
        yield _labeled(
            "machines_heard",
            "Machines, by whether they are heard of.",
            "liveness",
            {**HEARD, **heard},
        )
        yield _gauge("people", "People.", people)
        yield _labeled("goals", "Goals that have not ended.", "state", goals)
        yield _gauge("goals_unanswered", "Goals that left and that no machine has accepted yet.", goals["sent"])
        yield _gauge("questions", "Questions that nobody has answered.", len(asked))
        oldest = (now - min(asked)) / SECOND if asked else 0.0
        yield _gauge("questions_oldest_seconds", "How long the oldest of them waits, engine time.", oldest)
        family = GaugeMetricFamily(f"{PRE}_alarms", "Alarms that are open.", labels=("code", "severity", "state"))
        for labels, count in sorted(alarms.items()):
            family.add_metric(labels, count)
        yield family


def _gauge(name: str, about: str, value: float) -> Metric:
    return GaugeMetricFamily(f"{PRE}_{name}", about, value=value)


def _counter(name: str, about: str, value: float) -> Metric:
    return CounterMetricFamily(f"{PRE}_{name}", about, value=value)


def _labeled(name: str, about: str, label: str, values: Any) -> Metric:
    family = GaugeMetricFamily(f"{PRE}_{name}", about, labels=(label,))
    for word, value in sorted(values.items()):
        family.add_metric((word,), value)
    return family


def _states(name: str, about: str, words: tuple[str, ...], now: str) -> Metric:
    return StateSetMetricFamily(f"{PRE}_{name}", about, {word: word == now for word in words})


def _histogram(name: str, about: str, counts: DurationCounts) -> Metric:
    bounds = (*map(str, counts.bounds_s), "+Inf")
    return HistogramMetricFamily(
        f"{PRE}_{name}", about, list(zip(bounds, counts.within, strict=True)), sum_value=counts.sum_s
    )
