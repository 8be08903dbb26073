"""The life cycles of the engine as tables, and which of their transitions a run has taken.

A row is (machine, from, to); "-" is before the first record, and after the last. `LIFE` holds every transition that may happen.
One that is in no table is a violation; one that no run ever takes is a row that is wrong, or a case that nobody plays.

    python -m tests.simulation.lifecycle FILE.json ...     what long runs (`benchmarks/soak_simulation.py`) never took
"""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.records import AgentRecord, AgentRequest, GoalRecord, Question, StandingOrder, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.restart.journal_backpressure import JOURNAL, LEVELS
from formiga_bt.show.why.causes import CAUSES

Row = tuple[str, str, str]
NONE: Final = "-"
FIRST: Final = {"journal": "ok"}
"""How a machine stands of which nothing was said yet."""

Point = tuple[str, str, str]
"""Machine, whose, and how it stands now."""


class Recorder:
    """Which transitions were taken, from the changes of each step."""

    def __init__(self) -> None:
        self.seen: dict[Row, int] = {}
        """Row -> the step that took it first."""
        self._now: dict[tuple[str, str], str] = {}
        self._parts: dict[tuple[str, str], dict[str, str]] = {}
        """What a task's record holds of several at once: causes of HELD, cleanups, ways home."""

    def load(self, state: EngineState) -> None:
        """Go on from a state that was loaded: what a killed engine had not kept never was."""
        self._now.clear()
        self._parts.clear()
        for point in _points_of(state):
            self._now[point[0], point[1]] = point[2]
        for task in state.tasks.values():
            for machine, parts in _parts_of(task):
                self._parts[machine, task.id] = parts

    def look(self, step: EngineStep) -> tuple[Row, ...]:
        """Take a step; return the transitions in it that no table has."""
        strange = []
        for change in step.changes:
            for row in self._rows(change):
                if row not in self.seen:
                    self.seen[row] = step.seq
                if row not in LIFE:
                    strange.append(row)
        return tuple(strange)

    def _rows(self, change: ch.Change) -> Iterator[Row]:
        for machine, whose, now in _points(change):
            was = self._now.get((machine, whose), FIRST.get(machine, NONE))
            if was == now:
                continue
            if now == NONE:
                del self._now[machine, whose]
            else:
                self._now[machine, whose] = now
            yield machine, was, now
        if isinstance(change, ch.TaskPut):
            yield from self._task_parts(change.task)

    def _task_parts(self, task: TaskRecord) -> Iterator[Row]:
        for machine, parts in _parts_of(task):
            old = self._parts.get((machine, task.id), {})
            if old == parts:
                continue
            self._parts[machine, task.id] = parts
            for name in {**old, **parts}:
                was, now = old.get(name, NONE), parts.get(name, NONE)
                if was != now:
                    yield (f"held.{name.partition(':')[0]}" if machine == "held" else machine), was, now


def unseen(*runs: Iterable[Row]) -> tuple[Row, ...]:
    """Return the transitions that none of these runs has taken, table by table."""
    taken = {row for run in runs for row in run}
    return tuple(sorted(LIFE - taken))


def main() -> int:
    """Tell what long runs never took."""
    runs = [json.loads(Path(name).read_text()) for name in sys.argv[1:]]
    left = unseen(*([(str(a), str(b), str(c)) for a, b, c in run["transitions"]] for run in runs))
    print(
        f"{len(LIFE) - len(left)} of {len(LIFE)} transitions taken; never:",
        *(" ".join(row) for row in left),
        sep="\n  ",
    )
    causes = sorted(set(CAUSES) - {cause for run in runs for cause in run["causes"]})
    print(f"{len(CAUSES) - len(causes)} of {len(CAUSES)} causes of a wait seen; never:", *causes, sep="\n  ")
    return bool(left or causes)


# -- how things stand --------------------------------------------------------------------------------------------------
def _points(change: ch.Change) -> Iterator[Point]:
    match change:
        case ch.TaskPut(task):
            yield from _task(task)
        case ch.AgentPut(agent):
            yield from _agent(agent)
        case ch.GoalPut(goal):
            yield _goal(goal)
        case ch.GoalDrop(goal_id):
            yield ("shown" if "~" in goal_id else "goal"), goal_id, NONE
        case ch.QuestionPut(question):
            yield _question(question)
        case ch.QuestionDrop(question_id):
            yield "question", question_id, NONE
        case ch.ClearancePut(agent_id, record):
            yield "clearance", agent_id, NONE if record is None else record.state
        case ch.OrderPut(agent_id, order):
            yield _order(agent_id, order)
        case ch.RequestPut(task_id, request):
            yield _request(task_id, request)
        case ch.LockdownPut(lockdown):
            yield "lockdown", "", NONE if lockdown is None else lockdown.how
        case ch.ResumePut(resume):
            yield "resume", "", NONE if resume is None else resume.phase
        case ch.CounterSet(name, value) if name == JOURNAL:
            yield "journal", "", _level(value)


def _points_of(state: EngineState) -> Iterator[Point]:
    for task in state.tasks.values():
        yield from _task(task)
    for agent in state.agents.values():
        yield from _agent(agent)
    yield from map(_goal, state.goals.values())
    yield from map(_question, state.questions.values())
    for agent_id, record in state.clearances.items():
        yield "clearance", agent_id, record.state
    for agent_id, order in state.orders.items():
        yield _order(agent_id, order)
    for task_id, request in state.requests.items():
        yield _request(task_id, request)
    if state.lockdown is not None:
        yield "lockdown", "", state.lockdown.how
    if state.resume is not None:
        yield "resume", "", state.resume.phase
    if JOURNAL in state.counters:
        yield "journal", "", _level(state.counters[JOURNAL])


def _task(task: TaskRecord) -> Iterator[Point]:
    yield "task", task.id, task.status
    yield "section", task.id, task.section or "waits"
    yield "again", task.id, task.restart.why or "no"


def _parts_of(task: TaskRecord) -> Iterator[tuple[str, dict[str, str]]]:
    yield "held", dict.fromkeys(task.hold.words, "on")
    yield "finally", {cleanup.id: cleanup.state for cleanup in task.ending.cleanups}
    yield "way home", {f"{one.agent}#{task.run}": one.state for one in task.agents.recovering}


def _agent(agent: AgentRecord) -> Iterator[Point]:
    kind = "person" if agent.human else "machine"
    yield f"{kind} liveness", agent.id, agent.liveness
    yield f"{kind} pool", agent.id, agent.pool
    if not agent.human:
        yield "quarantine", agent.id, agent.quarantine if agent.pool == "QUARANTINED" else "no"
        yield "taken over", agent.id, "yes" if agent.taken else "no"


def _goal(goal: GoalRecord) -> Point:
    return ("shown" if goal.owner == "!question" else "goal"), goal.id, goal.state


def _question(question: Question) -> Point:
    return "question", question.id, _phase(question)


def _phase(question: Question) -> str:
    return "answered" if question.reply is not None else "escalated" if question.tier else "open"


def _order(agent_id: str, order: StandingOrder | None) -> Point:
    return "order", agent_id, NONE if order is None else f"{order.stop} {order.state}"


def _request(task_id: str, request: AgentRequest | None) -> Point:
    kind = "block's request" if "|" in task_id else "task's request"
    return kind, task_id, NONE if request is None else "others step aside" if request.preempting else "waits"


def _level(value: int) -> str:
    return next(name for name, level in LEVELS.items() if level == value)


TABLES: Final[Mapping[str, Mapping[str, tuple[str, ...]]]] = MappingProxyType({
    "again": {
        "-": ("no",),
        "agent_lost": ("no",),
        "no": ("agent_lost", "preempted", "restart"),
        "preempted": ("no",),
        "restart": ("no",),
    },
    "block's request": {
        "-": ("waits",),
        "others step aside": ("-", "waits"),
        "waits": ("-", "others step aside"),
    },
    "clearance": {
        "-": ("asked", "given"),
        "asked": ("-", "waiting"),
        "given": ("-", "asked"),
        "waiting": ("-", "asked"),
    },
    "finally": {
        "-": ("running", "waiting"),
        "ended": ("-",),
        "running": ("-", "ended", "stopping"),
        "stopping": ("-", "ended"),
        "waiting": ("-", "ended", "running"),
    },
    "goal": {
        "-": ("canceling", "gated"),
        "accepted": (
            "again", "canceled", "canceling", "failed", "in_doubt", "interrupted",
            "lost", "running", "succeeded", "superseded", "taken_over",
        ),
        "again": ("-",),
        "canceled": ("-",),
        "canceling": (
            "canceled", "failed", "in_doubt", "interrupted",
            "lost", "rejected", "succeeded", "superseded", "taken_over",
        ),
        "failed": ("-",),
        "gate_refused": ("-",),
        "gated": ("-", "again", "canceled", "gate_refused", "lost", "sent"),
        "in_doubt": ("-",),
        "interrupted": ("-", "again", "canceled", "lost", "succeeded", "taken_over"),
        "lost": ("-",),
        "rejected": ("-",),
        "running": (
            "again", "canceled", "canceling", "failed", "in_doubt", "interrupted",
            "lost", "succeeded", "superseded", "taken_over",
        ),
        "sent": (
            "-", "accepted", "again", "canceled", "canceling", "failed", "gated", "in_doubt", "interrupted",
            "lost", "rejected", "running", "succeeded", "superseded", "taken_over",
        ),
        "succeeded": ("-",),
        "superseded": ("-",),
        "taken_over": ("-",),
    },
    "held.clearance": {
        "-": ("on",),
        "on": ("-",),
    },
    "held.lockdown": {
        "-": ("on",),
        "on": ("-",),
    },
    "held.operator": {
        "-": ("on",),
        "on": ("-",),
    },
    "held.resume": {
        "-": ("on",),
        "on": ("-",),
    },
    "held.take-over": {
        "-": ("on",),
        "on": ("-",),
    },
    "journal": {
        "full": ("gone", "ok", "slow"),
        "gone": ("full", "ok", "slow"),
        "ok": ("full", "gone", "slow"),
        "slow": ("full", "gone", "ok"),
    },
    "lockdown": {
        "-": ("hold", "land", "return"),
        "hold": ("-", "land", "return"),
        "land": ("-", "hold", "return"),
        "return": ("-", "hold", "land"),
    },
    "machine liveness": {
        "-": ("ALIVE",),
        "ALIVE": ("SUSPECT",),
        "LOST": ("ALIVE",),
        "SUSPECT": ("ALIVE", "LOST"),
    },
    "machine pool": {
        "-": ("STANDBY",),
        "ASSIGNED": ("EXECUTING ACTION", "QUARANTINED", "STANDBY"),
        "EXECUTING ACTION": ("ASSIGNED", "QUARANTINED", "STANDBY"),
        "PARKED_AWAY": ("ASSIGNED", "EXECUTING ACTION", "QUARANTINED", "STANDBY"),
        "QUARANTINED": ("STANDBY",),
        "STANDBY": ("ASSIGNED", "EXECUTING ACTION", "PARKED_AWAY", "QUARANTINED"),
    },
    "order": {
        "-": ("cut open", "hold open", "land open", "return open"),
        "cut failed": ("-",),
        "cut open": ("-", "cut failed"),
        "hold done": ("-",),
        "hold open": ("-", "hold done"),
        "land done": ("-",),
        "land failed": ("-",),
        "land open": ("-", "land done", "land failed"),
        "return done": ("-",),
        "return failed": ("-",),
        "return open": ("-", "return done", "return failed"),
    },
    "person liveness": {
        "-": ("ALIVE",),
        "ALIVE": ("SUSPECT",),
        "SUSPECT": ("ALIVE",),
    },
    "person pool": {
        "-": ("STANDBY",),
    },
    "quarantine": {
        "-": ("no",),
        "abandoned": ("asked",),
        "asked": ("lost", "no"),
        "bad_status": ("asked",),
        "cancel_unconfirmed": ("asked",),
        "cut": ("asked",),
        "lost": ("asked",),
        "no": ("abandoned", "bad_status", "cancel_unconfirmed", "cut", "lost", "recover_failed"),
        "recover_failed": ("asked",),
    },
    "question": {
        "-": ("open",),
        "answered": ("-",),
        "escalated": ("-", "answered"),
        "open": ("-", "answered", "escalated"),
    },
    "resume": {
        "-": ("asking",),
        "asking": ("overdue",),
        "overdue": ("asking", "watching"),
        "watching": ("-", "asking"),
    },
    "section": {
        "-": ("finally", "waits"),
        "finally": ("recover",),
        "on_abort": ("finally", "recover"),
        "on_failure": ("finally", "recover"),
        "recover": ("done", "finally", "waits"),
        "steps": ("finally", "on_abort", "on_failure", "recover"),
        "waits": ("done", "steps"),
    },
    "shown": {
        "-": ("sent",),
        "accepted": ("-", "canceled", "failed", "in_doubt", "succeeded"),
        "canceled": ("-",),
        "failed": ("-",),
        "gated": ("-", "sent"),
        "in_doubt": ("-",),
        "rejected": ("-",),
        "sent": ("-", "accepted", "canceled", "failed", "gated", "in_doubt", "rejected", "succeeded"),
        "succeeded": ("-",),
    },
    "taken over": {
        "-": ("no",),
        "no": ("yes",),
        "yes": ("no",),
    },
    "task": {
        "-": ("ACTIVE", "PENDING"),
        "ACTIVE": ("ENDING",),
        "ASSIGNED": ("ACTIVE",),
        "ENDING": ("CANCELED", "FAILED", "PENDING", "SUCCEEDED"),
        "PENDING": ("ASSIGNED", "CANCELED", "FAILED"),
    },
    "task's request": {
        "-": ("waits",),
        "others step aside": ("-", "waits"),
        "waits": ("-", "others step aside"),
    },
    "way home": {
        "-": ("running",),
        "done": ("-", "running"),
        "failed": ("-", "running"),
        "running": ("done", "failed", "waiting"),
        "waiting": ("done", "failed", "running"),
    },
})  # fmt: skip
"""Machine -> from -> to."""

LIFE: Final[frozenset[Row]] = frozenset(
    (machine, was, now) for machine, table in TABLES.items() for was, nexts in table.items() for now in nexts
)
"""Every transition that may happen."""


if __name__ == "__main__":
    sys.exit(main())
