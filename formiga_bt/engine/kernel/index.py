"""Indexes of the state: what belongs to whom, so that one step looks at what changed and not at all there is.

Kept beside the state by `Core.emit`, made anew from it at a start, never journaled. Each keeps the order in which the state
itself has its entries.
"""

import heapq
from collections.abc import Iterator, Mapping
from typing import Final, Generic, TypeVar

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.changes import DeadlineSet
from formiga_bt.engine.kernel.records import BUSY, GoalRecord, Question
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import Timer

Member = TypeVar("Member")

Names = dict[str, None]
"""An ordered set."""

ROUTES: Final = "!routes"
"""Stands for all that machines take up of the routes."""

SPARE: Final = 64
"""So many dead entries of a heap are never too many."""


class Groups(Generic[Member]):
    """Ordered sets by name; an empty one does not exist."""

    __slots__ = ("_sets",)

    def __init__(self) -> None:
        self._sets: dict[str, dict[Member, None]] = {}

    def add(self, name: str, member: Member) -> None:
        """Put a member into a set, at its end if it is new there."""
        found = self._sets.get(name)
        if found is None:
            self._sets[name] = {member: None}
        else:
            found[member] = None

    def discard(self, name: str, member: Member) -> None:
        """Take a member out, if it is there."""
        found = self._sets.get(name)
        if found is not None:
            found.pop(member, None)
            if not found:
                del self._sets[name]

    def of(self, name: str) -> tuple[Member, ...]:
        """Return the members of a set, in order."""
        found = self._sets.get(name)
        return tuple(found) if found else ()

    def count(self, name: str) -> int:
        """Return how many members a set has."""
        found = self._sets.get(name)
        return len(found) if found else 0

    def names(self) -> tuple[str, ...]:
        """Return the names of the sets that exist."""
        return tuple(self._sets)


class RouteUse:
    """Which machines take up which nodes and edges of the routes."""

    def __init__(self, used: Mapping[str, tuple[str, ...]]) -> None:
        self._by = Groups[str]()
        self._parts: dict[str, tuple[str, ...]] = {}
        self._members: tuple[str, ...] | None = None
        for agent, parts in used.items():
            self.put(agent, parts)

    def put(self, agent: str, parts: tuple[str, ...]) -> None:
        """A machine takes up these now."""
        old = self._parts.pop(agent, ())
        for part in old:
            if part not in parts:
                self._by.discard(part, agent)
        for part in parts:
            if part not in old:
                self._by.add(part, agent)
        if parts:
            self._parts[agent] = parts
        if bool(old) != bool(parts):
            self._members = None

    def of(self, part: str) -> tuple[str, ...]:
        """Return who takes up a node or an edge."""
        return self._by.of(part)

    def members(self) -> tuple[str, ...]:
        """Return all that take up any, by their ids."""
        if self._members is None:
            self._members = tuple(sorted(self._parts))
        return self._members


class StateIndex:
    """All indexes of one engine's state."""

    def __init__(self, state: EngineState) -> None:
        self._state = state
        self._goals = Groups[str]()
        self._deadlines = Groups[Timer]()
        self._shown = Groups[str]()
        self._asked = Groups[str]()
        self._questions = Groups[str]()
        self._held_up = Groups[str]()
        self.gated: Names = {}
        """Goals that wait at the gate,"""
        self.busy: Names = {}
        """and those of them that wait for another machine."""
        self._held_up_by: dict[str, tuple[str, ...]] = {}
        self.on_route = RouteUse({agent.id: agent.on_route for agent in state.agents.values()})
        """Who takes up which nodes and edges of the routes."""
        self.driving: dict[str, str] = {}
        """Machine -> its open goal that leads along the routes."""
        self.ended: Names = {}
        """Tasks that have ended and are not forgotten yet, in the order of their end."""
        self.free_people: Names = dict.fromkeys(state.agents)
        """People whose queue of questions must be looked at."""
        ended = [task for task in state.tasks.values() if task.section == "done"]
        for task in sorted(ended, key=lambda task: (task.times.ended_at or 0, task.order)):
            self.ended[task.id] = None
        for goal in state.goals.values():
            self.goal(goal)
        for timer, deadline in state.deadlines.items():
            self._deadlines.add(deadline.task, timer)
        for question in state.questions.values():
            self.question(question)

    # -- goals -------------------------------------------------------------------------------------------------------
    def goal(self, goal: GoalRecord) -> None:
        """A goal is now so."""
        self._goals.add(goal.agent, goal.id)
        if goal.owner == "!question":
            if not goal.ended:
                self._shown.add(goal.agent, goal.id)
            else:
                self._unshown(goal)
        if goal.state == "gated":
            self._gate(goal)
        elif goal.id in self.gated:
            self._ungate(goal.id)
        if goal.path and not goal.ended:
            self.driving[goal.agent] = goal.id
        elif self.driving.get(goal.agent) == goal.id:
            del self.driving[goal.agent]

    def drop_goal(self, goal_id: str) -> None:
        """A goal is about to be forgotten."""
        goal = self._state.goals.get(goal_id)
        if goal is None:
            return
        self._goals.discard(goal.agent, goal_id)
        if self.driving.get(goal.agent) == goal_id:
            del self.driving[goal.agent]
        if goal.owner == "!question":
            self._unshown(goal)
        if goal_id in self.gated:
            self._ungate(goal_id)

    def _unshown(self, goal: GoalRecord) -> None:
        self._shown.discard(goal.agent, goal.id)
        self.free_people[goal.agent] = None

    def _gate(self, goal: GoalRecord) -> None:
        self.gated[goal.id] = None
        waits = goal.code in BUSY
        names = (goal.agent, goal.text) if waits else (goal.agent,)
        if goal.code == "route_order":  # any machine that drives on may let it go
            names = (goal.agent, ROUTES)
        if waits:
            self.busy[goal.id] = None
        else:
            self.busy.pop(goal.id, None)
        old = self._held_up_by.get(goal.id, ())
        if old != names:
            for name in old:
                self._held_up.discard(name, goal.id)
            for name in names:
                self._held_up.add(name, goal.id)
            self._held_up_by[goal.id] = names

    def _ungate(self, goal_id: str) -> None:
        del self.gated[goal_id]
        self.busy.pop(goal_id, None)
        for name in self._held_up_by.pop(goal_id):
            self._held_up.discard(name, goal_id)

    def goals_of(self, agent: str) -> list[GoalRecord]:
        """Return the goals of an agent, oldest first."""
        goals = self._state.goals
        return [goals[goal_id] for goal_id in self._goals.of(agent)]

    def held_up_by(self, agent: str) -> tuple[str, ...]:
        """Return the waiting goals that may go, or wait for something else, when this agent changes."""
        return self._held_up.of(agent)

    # -- deadlines ---------------------------------------------------------------------------------------------------
    def deadline(self, change: DeadlineSet) -> None:
        """A deadline is about to be set, or forgotten."""
        timer, deadline = change.timer, change.deadline
        old = self._state.deadlines.get(timer)
        if old is not None and (deadline is None or deadline.task != old.task):
            self._deadlines.discard(old.task, timer)
        if deadline is not None:
            self._deadlines.add(deadline.task, timer)

    def deadlines_of(self, task: str) -> tuple[Timer, ...]:
        """Return the deadlines of a task, in the order of setting."""
        return self._deadlines.of(task)

    def deadline_count(self, task: str) -> int:
        """Return how many deadlines a task has."""
        return self._deadlines.count(task)

    # -- questions ---------------------------------------------------------------------------------------------------
    def question(self, question: Question) -> None:
        """A question is now so."""
        self._questions.add(question.task, question.id)
        for person in question.asked:
            self._asked.add(person, question.id)
            self.free_people[person] = None

    def drop_question(self, question_id: str) -> None:
        """A question is about to be forgotten."""
        question = self._state.questions.get(question_id)
        if question is None:
            return
        self._questions.discard(question.task, question_id)
        for person in question.asked:
            self._asked.discard(person, question_id)
            self.free_people[person] = None

    def questions_of(self, task: str) -> tuple[str, ...]:
        """Return the open questions of a task, oldest first."""
        return self._questions.of(task)

    def asked_of(self, person: str) -> tuple[str, ...]:
        """Return the questions that a person is asked."""
        return self._asked.of(person)

    def shown_to(self, person: str) -> int:
        """Return how many questions a person sees now."""
        return self._shown.count(person)


class DeadlineHeap:
    """The earliest of the state's deadlines; what was cleared or set anew is passed over when it comes up."""

    def __init__(self, state: EngineState) -> None:
        self._state = state
        self._heap: list[tuple[Micros, int, Timer]] = []
        self._first: tuple[Micros, Timer] | None = None
        self._is_known = False
        """`_first` is the earliest: nothing was set or cleared since it was looked for."""
        self._rebuild()

    def _rebuild(self) -> None:
        self._heap = [(d.at, d.seq, timer) for timer, d in self._state.deadlines.items()]
        heapq.heapify(self._heap)

    def forget(self) -> None:
        """A deadline is set or cleared: the earliest may be another."""
        self._is_known = False

    def push(self, at: Micros, seq: int, timer: Timer) -> None:
        """Add a deadline that the state has."""
        self._is_known = False
        heapq.heappush(self._heap, (at, seq, timer))
        if len(self._heap) > 2 * len(self._state.deadlines) + SPARE:
            self._rebuild()  # far-off ones that are set and cleared again and again must not pile up

    def first(self) -> tuple[Micros, Timer] | None:
        """Return the earliest deadline that stands, ties in the order of setting."""
        if not self._is_known:
            self._first, self._is_known = self._look(), True
        return self._first

    def _look(self) -> tuple[Micros, Timer] | None:
        heap, deadlines = self._heap, self._state.deadlines
        while heap:
            at, seq, timer = heap[0]
            live = deadlines.get(timer)
            if live is not None and live.seq == seq:
                return at, timer
            heapq.heappop(heap)
        return None


class Instants:
    """(task, node key) -> when its live condition next turns with `now`; from then on it is looked at in every step."""

    def __init__(self) -> None:
        self.at: dict[tuple[str, str], Micros] = {}
        """Empty: nobody waits for an instant."""
        self._heap: list[tuple[Micros, str, str]] = []
        self._passed: dict[tuple[str, str], None] = {}

    def set(self, task: str, key: str, at: Micros) -> None:
        """Look at a node from an instant on."""
        self.at[task, key] = at
        self._passed.pop((task, key), None)
        heapq.heappush(self._heap, (at, task, key))
        if len(self._heap) > 2 * len(self.at) + SPARE:
            self._heap = [(at, task, key) for (task, key), at in self.at.items()]
            heapq.heapify(self._heap)

    def drop(self, task: str, key: str) -> None:
        """Look at a node no more for this."""
        if self.at.pop((task, key), None) is not None:
            self._passed.pop((task, key), None)

    def until(self, now: Micros) -> Iterator[tuple[str, str]]:
        """Iterate over the nodes whose instant has come."""
        heap = self._heap
        while heap and heap[0][0] <= now:
            at, task, key = heapq.heappop(heap)
            if self.at.get((task, key)) == at:
                self._passed[task, key] = None
        return iter(tuple(self._passed))
