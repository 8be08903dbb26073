"""What a site's tasks need and when: whom a task waits for, and the next thing that happens to it and cannot be taken back.

An `UrgencyIndex` is made once per look at the site, so that thousands of tasks are sorted in milliseconds.
"""

from collections.abc import Iterator
from typing import Final, assert_never

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.causes import (
    ClearanceHold,
    LockdownHold,
    OperatorHold,
    ResumeHold,
    TakeOverHold,
    in_words,
)
from formiga_bt.engine.kernel.records import PRIORITIES, AgentRecord, AgentRequest, GoalRecord, Question, TaskRecord
from formiga_bt.engine.kernel.timers import ClearanceDue, LiveDue, OrderDue, TaskDue, TaskTime
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.history.notes import goal_words, hold_words
from formiga_bt.show.lapse import lapses_at
from formiga_bt.show.why.words import REASONS, say, span

NEVER: Final = 1 << 62
RANK: Final = {"ENDING": 0, "ACTIVE": 1, "ASSIGNED": 2, "PENDING": 3}
"""Of tasks to which nothing is about to happen: what flies first."""
LIMITS: Final[tuple[tuple[TaskTime, str], ...]] = (
    ("timeout", "timeout"),
    ("cleanup", "its cleanup is cut off"),
    ("wait", "it has waited for agents long enough"),
    ("expires", "it expires"),
    ("deadline", "its deadline"),
)
"""Deadlines of a task, and what they do."""
MOST: Final = 2
"""So many things that a task does are told."""


class UrgencyIndex:
    """The records of a ledger by task, looked at at engine time `now`; `speed`: engine seconds per wall second."""

    def __init__(self, ledger: Ledger, now: Micros, speed: float = 1.0) -> None:
        state = ledger.state
        self.ledger, self.state, self.now, self.speed = ledger, state, now, speed
        self.questions: dict[str, list[Question]] = {}
        for question in state.questions.values():
            if question.reply is None:
                self.questions.setdefault(question.task, []).append(question)
        self.agents: dict[str, list[AgentRecord]] = {}
        for agent in state.agents.values():
            if agent.task:
                self.agents.setdefault(agent.task, []).append(agent)
        self.goals: dict[str, list[GoalRecord]] = {}
        for goal in state.goals.values():
            if not goal.ended and goal.action != CONFIRM:
                self.goals.setdefault(goal.task, []).append(goal)
        self.requests: dict[str, AgentRequest] = {request.holder: request for request in state.requests.values()}

    # -- what comes --------------------------------------------------------------------------------------------------
    def urgent(self, task: TaskRecord) -> tuple[Micros, str] | None:
        """Return when the next thing happens to a task that cannot be taken back, and what it is."""
        return min(self._coming(task), default=None)

    def _coming(self, task: TaskRecord) -> Iterator[tuple[Micros, str]]:
        deadlines = self.state.deadlines
        for what, words in LIMITS:
            found = deadlines.get(TaskDue(task.id, what))
            if found is not None:
                yield found.at, words
        for question in self.questions.get(task.id, ()):
            lapse = lapses_at(self.state, question)
            if lapse is not None:
                yield lapse, f"{question.number} lapses"
        for agent in self.agents.get(task.id, ()):
            yield from self._coming_of(agent)

    def _coming_of(self, agent: AgentRecord) -> Iterator[tuple[Micros, str]]:
        deadlines, wall = self.state.deadlines, self.state.wall
        hold = deadlines.get(OrderDue(agent.id))
        if hold is not None:
            yield hold.at, f"{agent.id} returns by itself"
        word = deadlines.get(ClearanceDue(agent.id))
        if word is not None:
            yield word.at, f"nobody said that people stand clear of {agent.id}"
        if agent.liveness == "SUSPECT" and not agent.human:
            key = LiveDue(agent.id)
            after, since = wall.get(key), self.ledger.wall_set.get(key)
            if after is not None and since is not None:
                yield since + round(after * self.speed), f"{agent.id} counts as lost"

    def needs(self, task: TaskRecord) -> str:
        """Return the question that waits for a person, or another reason why one must act; "" if none."""
        questions = self.questions.get(task.id)
        if questions:
            return questions[0].number
        for cause in task.hold.causes:
            match cause:
                case TakeOverHold(agent):
                    record = self.state.agents.get(agent)
                    return f"hand {agent} back" if record is not None and record.control == "engine" else ""
                case OperatorHold() | ResumeHold():
                    return "continue or end it"
                case ClearanceHold() | LockdownHold():
                    pass
                case _:
                    assert_never(cause)
        return ""

    def rank(self, task: TaskRecord) -> tuple[int, Micros, int, Micros, int]:
        """Return the place of an open task in a list: who needs a person, then who works, then who only waits.

        Who waits stands as in the queue for agents; the others stand by what comes, by status and age.
        """
        if self.waits(task):
            request = self.requests.get(task.id)
            if request is not None:
                return 2, *request.rank(self.now)
            return 2, PRIORITIES[task.request.priority], 0, task.times.submitted_at, task.order
        coming = self.urgent(task)
        return (
            0 if self._calls(task) else 1,
            coming[0] if coming is not None else NEVER,
            RANK.get(task.status, 4),
            task.times.submitted_at,
            task.order,
        )

    def waits(self, task: TaskRecord) -> bool:
        """Return whether an open task has no agents yet, and needs nobody."""
        return task.status == "PENDING" and not self._calls(task)

    def _calls(self, task: TaskRecord) -> bool:
        return task.id in self.questions or bool(task.hold.causes and self.needs(task))

    # -- what is done ------------------------------------------------------------------------------------------------
    def doing(self, task: TaskRecord) -> str:
        """Return what a task does or waits for, in words."""
        if task.section == "done":
            return say(REASONS, task.outcome.code) if task.outcome.code else ""
        held = [
            cause for cause in task.hold.causes if not isinstance(cause, ClearanceHold)
        ]  # of that there is a question
        words = [f"held: {'; '.join(hold_words(in_words(cause)) for cause in held)}"] if held else []
        words += [
            f"{q.number} asks {', '.join(q.asked) or 'nobody'}, {span(self.now - q.asked_at)}"
            for q in self.questions.get(task.id, ())
        ]
        words += [_goal(goal) for goal in self.goals.get(task.id, ())]
        words += [f"{r.agent} is brought home" for r in task.agents.recovering if r.state in ("running", "waiting")]
        if task.id in self.requests and not words:
            words.append(_waits(self.requests[task.id], self.now))
        words += [f"{child} {self.state.tasks[child].status}" for child in task.family.children if self._is_open(child)]
        if not words and task.status in ("ACTIVE", "ENDING"):
            words.append("waits" if task.section == "steps" else task.section.replace("_", " "))
        more = f"; and {len(words) - MOST} more" if len(words) > MOST else ""
        return "; ".join(words[:MOST]) + more

    def _is_open(self, task_id: str) -> bool:
        task = self.state.tasks.get(task_id)
        return task is not None and task.section != "done"


def _waits(request: AgentRequest, now: Micros) -> str:
    """Return what a request waits for, in words."""
    if request.not_before is not None:
        return f"begins in {span(request.not_before - now)} at the earliest"
    return (
        f"begins after {', '.join(request.after)}" if request.after else f"waits for agents, {span(now - request.at)}"
    )


def _goal(goal: GoalRecord) -> str:
    agent, _, more = goal_words(goal).partition(" ")
    return f"{agent} {goal.action} {more}".rstrip() if goal.state != "gated" else f"{agent}.{goal.action} {more}"
