"""What happened, folded from the engine's steps: a copy of its state, and the history that people look at.

`feed` the steps in order, from the first one, or from a state that they go on from. The copy is folded with the engine's own
`apply`, so a driver, a dry run and a stored journal lead to the same ledger. Bounded: ended tasks beyond a number are forgotten
with all that is kept of them; of each task and agent the newest is kept. Feed and read from one thread, or under one lock.
"""

from collections import deque
from collections.abc import Callable
from typing import Any, Final, Literal

from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ClearanceHold, in_words
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, TaskRecord
from formiga_bt.engine.kernel.state import EngineState, apply
from formiga_bt.engine.kernel.timers import WallTimer
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.show.facts import LineFact, MapMark, MapShape, Point
from formiga_bt.show.history.notes import gate_words, hold_words
from formiga_bt.show.history.progress import Progress
from formiga_bt.show.history.rows import ActionRow, WaitRow, row_of
from formiga_bt.show.history.searches import product_of
from formiga_bt.show.history.tracks import POINTS, AgentTrack
from formiga_bt.show.lines import LineMaker, of_question, of_refusal

WaitKind = Literal["pending", "question", "gate", "held"]
Before = Callable[[Micros, ch.Change, EngineState], None]
"""Takes each change before it is applied."""


class Bounds(Struct, frozen=True, kw_only=True):
    """How much is kept; None = all."""

    ended: int | None = 2000
    """Tasks that ended."""
    rows: int | None = 500
    """Actions of one task, and waits of one task."""
    lines_of_task: int | None = 50
    lines: int | None = 2000
    marks: int | None = 1000
    points: int = POINTS
    """Of the way of one agent."""


ALL: Final = Bounds(ended=None, rows=None, lines_of_task=None, lines=None, marks=None)
"""For runs that end."""


class LedgerEvent(Struct, frozen=True):
    """Something that happened somewhere."""

    at: Micros
    task: str
    mark: MapMark


class LedgerSearch(Struct, frozen=True):
    """A region that was searched."""

    at: Micros
    task: str
    shape: MapShape


class TaskStory:
    """What is kept of one task besides the engine's record."""

    __slots__ = ("lines", "names", "progress", "rows", "waits")

    def __init__(self, bounds: Bounds, run: int) -> None:
        self.rows: deque[ActionRow] = deque(maxlen=bounds.rows)
        self.waits: deque[WaitRow] = deque(maxlen=bounds.rows)
        """Those that are over; `Ledger.waiting` has the others."""
        self.lines: deque[LineFact] = deque(maxlen=bounds.lines_of_task)
        self.progress = Progress(run)
        self.names: dict[str, Any] = {}
        """The task's own names when its run ended."""


COMES_BACK: Final = frozenset({"", "lost", "bad_status", "asked"})
"""Quarantines that end by themselves when the machine is heard of again; of others a person says so."""


def needs_person(agent: AgentRecord) -> bool:
    """Return whether a machine waits for a person: to be looked at, or handed back."""
    away = agent.quarantine == "removed" and agent.liveness == "LOST"
    return (agent.quarantine not in COMES_BACK and not away) or (agent.taken and agent.control == "engine")


class _NoBoard(Blackboard):
    """Nobody reads this copy's blackboard."""

    def put(self, key: str, value: Any) -> bool:  # noqa: ARG002
        return False

    def touch(self, key: str) -> None:
        pass


class Ledger:
    """The fold. `state` is the engine's, read only.

    Args:
        bounds: how much is kept.
        state: to go on from; by default the steps begin with the engine's first.
    """

    def __init__(self, bounds: Bounds | None = None, state: EngineState | None = None) -> None:
        self.state = state if state is not None else EngineState()
        self.began_at: Micros = self.state.now
        """What was before is not known here."""
        self.bounds = bounds or Bounds()
        self.stories: dict[str, TaskStory] = {}
        self.ways: dict[str, AgentTrack] = {}
        self.lines: deque[LineFact] = deque(maxlen=self.bounds.lines)
        self.alarms: deque[LineFact] = deque(maxlen=self.bounds.marks)
        self.events: deque[LedgerEvent] = deque(maxlen=self.bounds.marks)
        self.searches: deque[LedgerSearch] = deque(maxlen=self.bounds.marks)
        self.waiting: dict[tuple[str, str], WaitRow] = {}
        """(kind, of what) -> the wait that lasts."""
        self.stuck: dict[str, Micros] = {}
        """Machine that a person must look at or hand back -> since when."""
        self.wall_set: dict[WallTimer, Micros] = {}
        """Key of a wall-time deadline -> when it was set."""
        self.started_at: Micros | None = None
        self.before: list[Before] = []
        self._open: dict[str, ActionRow] = {}
        """Goal -> its row, until it ends."""
        self._ended: deque[str] = deque()
        self._lines = LineMaker({})
        self._board = _NoBoard()
        self._takes: dict[type, Callable[[Micros, Any], None]] = {
            ch.TaskPut: self._task,
            ch.AgentPut: self._agent,
            ch.GoalPut: self._goal,
            ch.GoalDrop: self._goal_dropped,
            ch.QuestionPut: self._question,
            ch.QuestionDrop: self._question_dropped,
            ch.NodeMem: self._memory,
            ch.NodesEnded: self._nodes_ended,
            ch.TaskForget: self._memory_dropped,
            ch.TaskGone: lambda _at, _change: None,  # it keeps as many as its own bounds say
            ch.WallTimerSet: self._wall,
        }
        for task in self.state.tasks.values():
            story = self.story(task.id)
            for key in self.state.memory.get(task.id, ()):
                story.progress.began(key, self.state.now)
            if task.section != "done":
                self._waits_of(self.state.now, task)
        self.stuck.update((agent.id, self.state.now) for agent in self.state.agents.values() if needs_person(agent))

    # -- folding -----------------------------------------------------------------------------------------------------
    def feed(self, step: EngineStep) -> None:
        """Take one step."""
        state, at, takes = self.state, step.at, self._takes
        if self.started_at is None:
            self.started_at = at
        state.now, state.seq = at, step.seq
        if step.reply:
            refused = of_refusal(step)
            if refused is not None:
                self.tell(refused)
        for change in step.changes:
            for look in self.before:
                look(at, change, state)
            take = takes.get(type(change))
            if take is None:
                apply(state, self._board, change)
            else:
                take(at, change)
        for effect in step.effects:
            line = self._lines.of_effect(at, effect, state)
            if line is not None:
                self.tell(line)

    def tell(self, line: LineFact) -> None:
        """Take a line."""
        self.lines.append(line)
        if line.task and line.task in self.state.tasks:
            self.story(line.task).lines.append(line)
        if line.severity == "alarm":
            self.alarms.append(line)
            self._event(line.at, line.agent, line.text, line.task)

    def row_began(self, row: ActionRow) -> None:
        """Take the row of an action that was sent."""
        if row.task in self.state.tasks:
            self.story(row.task).rows.append(row)

    def story(self, task_id: str) -> TaskStory:
        """Return what is kept of a task."""
        found = self.stories.get(task_id)
        if found is None:
            task = self.state.tasks.get(task_id)
            found = self.stories[task_id] = TaskStory(self.bounds, task.run if task is not None else 1)
        return found

    def adopt(self, whole: "Ledger", task_id: str) -> None:
        """Take the story of a task from a ledger that saw it from its beginning to this very step, in place of what is here."""
        story, mine, theirs = TaskStory(self.bounds, 1), self.story(task_id), whole.story(task_id)
        story.rows.extend(theirs.rows)
        story.waits.extend(theirs.waits)
        story.lines.extend(theirs.lines)
        story.progress, story.names = theirs.progress, theirs.names or mine.names
        self.stories[task_id] = story
        self._open = {goal: row for goal, row in self._open.items() if row.task != task_id}
        self._open |= {goal: row for goal, row in whole._open.items() if row.task == task_id}
        self.waiting = {of: row for of, row in self.waiting.items() if row.task != task_id}
        self.waiting |= {of: row for of, row in whole.waiting.items() if row.task == task_id}
        known = self.state.explanations
        known |= {of: why for of, why in whole.state.explanations.items() if of not in known}
        if task_id in whole._lines.shown:
            self._lines.shown[task_id] = whole._lines.shown[task_id]
        events = [event for event in self.events if event.task != task_id]
        events += [event for event in whole.events if event.task == task_id]
        self.events = deque(sorted(events, key=lambda event: event.at), self.bounds.marks)
        for agent, way in whole.ways.items():
            if agent not in self.ways:
                self.ways[agent] = AgentTrack(agent, way.type, mobility=way.mobility, points=self.bounds.points)
            self.ways[agent].adopt(way, task_id, self.began_at)

    def _task(self, at: Micros, change: ch.TaskPut) -> None:
        task = change.task
        old = self.state.tasks.get(task.id)
        apply(self.state, self._board, change)
        story = self.story(task.id)
        if task.run > story.progress.run:
            story.progress = Progress(task.run)
        if old is None or old.status != task.status or old.hold.causes != task.hold.causes or old.run != task.run:
            self._waits_of(at, task)
        if task.outcome.failure is not None:
            story.progress.explain(task.outcome.failure)
        if task.section == "done" and (old is None or old.section != "done"):
            self._done(at, task, story)

    def _waits_of(self, at: Micros, task: TaskRecord) -> None:
        if task.status == "PENDING" and not task.hold.causes:
            self._wait(at, "pending", task.id, task.id, text="waits for agents")
        else:
            self._go_on(at, "pending", task.id)
        held = self.waiting.get(("held", task.id))
        causes = [cause for cause in task.hold.causes if not isinstance(cause, ClearanceHold)]  # that is a question
        text = "; ".join(hold_words(in_words(cause)) for cause in causes)
        if held is not None and held.text != text:
            self._go_on(at, "held", task.id)
        if causes and task.section != "done":
            self._wait(at, "held", task.id, task.id, text=text)

    def _done(self, at: Micros, task: TaskRecord, story: TaskStory) -> None:
        story.progress.cut(at)
        for kind in ("pending", "held"):
            self._go_on(at, kind, task.id)
        self._ended.append(task.id)
        while self.bounds.ended is not None and len(self._ended) > self.bounds.ended:
            self._forget(self._ended.popleft())

    def _forget(self, task_id: str) -> None:
        state = self.state
        for table in (state.tasks, state.explanations, state.memory, state.scopes, self.stories, self._lines.shown):
            table.pop(task_id, None)

    def _agent(self, at: Micros, change: ch.AgentPut) -> None:
        agent = change.agent
        old = self.state.agents.get(agent.id)
        apply(self.state, self._board, change)
        if agent.position is not None and (old is None or agent.position != old.position or agent.task != old.task):
            way = self.ways.get(agent.id)
            if way is None:
                way = self.ways[agent.id] = AgentTrack(
                    agent.id, agent.type, mobility=agent.mobility, points=self.bounds.points
                )
            way.note(at, agent.position, agent.task)
        elif old is not None and agent.heard_at != old.heard_at and agent.id in self.ways:
            self.ways[agent.id].stood(at)
        if needs_person(agent):
            self.stuck.setdefault(agent.id, at)
        elif self.stuck:
            self.stuck.pop(agent.id, None)
        if old is not None and old.landed == "airborne" and agent.landed == "grounded":
            self._landed(at, agent)

    def _landed(self, at: Micros, agent: AgentRecord) -> None:
        self._event(at, agent.id, f"{agent.id} landed", agent.task, "landing")

    def _event(
        self, at: Micros, agent_id: str, name: str, task: str, kind: Literal["landing", "event"] = "event"
    ) -> None:
        agent = self.state.agents.get(agent_id)
        where = agent.position if agent is not None else None
        if where is not None:
            point = Point(round(where.east_m, 2), round(where.north_m, 2), round(where.up_m, 2))
            self.events.append(LedgerEvent(at, task, MapMark(name=name, kind=kind, at=point)))

    def _goal(self, at: Micros, change: ch.GoalPut) -> None:
        goal = change.goal
        old = self.state.goals.get(goal.id)
        apply(self.state, self._board, change)
        row = self._open.get(goal.id)
        if row is None and goal.in_flight:
            row = self._open[goal.id] = row_of(goal, at)
            self.row_began(row)
        if row is not None:
            row.state, row.code = goal.state, goal.code
            if goal.ended or goal.state == "interrupted":
                self._row_ended(at, row, goal)
        if goal.state == "gated":
            if old is None or old.state != "gated" or (old.code, old.text) != (goal.code, goal.text):
                self._gated(at, goal)
        elif old is not None and old.state == "gated":
            self._go_on(at, "gate", goal.id)

    def _row_ended(self, at: Micros, row: ActionRow, goal: GoalRecord) -> None:
        row.end = at
        if goal.action == CONFIRM and goal.state == "succeeded":
            row.state, row.code = "answered", str(goal.result.get("answer", ""))
        if goal.state == "succeeded" and "coverage" in goal.result:
            self._searched(at, row, goal)
        del self._open[goal.id]

    def _searched(self, at: Micros, row: ActionRow, goal: GoalRecord) -> None:
        """Note what an action of any name gives that saw something of a region: its share, and what was found."""
        found = product_of(goal)
        row.detail = ", ".join(text for text in (row.detail, found.text) if text)
        if found.shape is not None:
            self.searches.append(LedgerSearch(at, goal.task, found.shape))
        self.events.extend(LedgerEvent(at, goal.task, mark) for mark in found.marks)

    def _gated(self, at: Micros, goal: GoalRecord) -> None:
        """A goal begins to wait at the gate, or waits for something else now."""
        row = self.waiting.get(("gate", goal.id))
        text = gate_words(goal)
        if row is not None and row.start == at:
            row.text = text
            return
        if row is not None:
            self._go_on(at, "gate", goal.id)
        self._wait(at, "gate", goal.id, goal.task, agent=goal.agent, text=text)

    def _goal_dropped(self, at: Micros, change: ch.GoalDrop) -> None:
        apply(self.state, self._board, change)
        self._go_on(at, "gate", change.goal)
        row = self._open.pop(change.goal, None)
        if row is not None:  # withdrawn: a question answered by another, a goal never sent
            row.end, row.state = at, "withdrawn"

    def _question(self, at: Micros, change: ch.QuestionPut) -> None:
        question = change.question
        old = self.state.questions.get(question.id)
        apply(self.state, self._board, change)
        for line in of_question(at, question, old):
            self.tell(line)
        if old is None:
            self._asked(at, question)
        if question.reply is not None:
            self._go_on(at, "question", question.id, f" {question.reply['answer']}")

    def _asked(self, at: Micros, question: Question) -> None:
        text = f"{question.number} {question.text}"
        self._wait(at, "question", question.id, question.task, agent=", ".join(question.asked), text=text)
        person = next((p for p in question.asked if p in self.state.agents), "")
        self._event(at, person, question.number, question.task)

    def _question_dropped(self, at: Micros, change: ch.QuestionDrop) -> None:
        apply(self.state, self._board, change)
        self._go_on(at, "question", change.question)

    def _memory(self, at: Micros, change: ch.NodeMem) -> None:
        known = change.path in self.state.memory.get(change.task, ())
        apply(self.state, self._board, change)
        if known != (change.mem is not None):
            progress = self.story(change.task).progress
            if known:
                progress.left(change.path)
            else:
                progress.began(change.path, at)

    def _nodes_ended(self, at: Micros, change: ch.NodesEnded) -> None:
        progress = self.story(change.task).progress
        for path, letter, code in change.ended:
            progress.ended(path, letter, code, at)

    def _memory_dropped(self, at: Micros, change: ch.TaskForget) -> None:
        story = self.story(change.task)
        story.names = self.state.scopes.get(change.task, {}).get("", {})
        apply(self.state, self._board, change)
        story.progress.cut(at)

    def _wall(self, at: Micros, change: ch.WallTimerSet) -> None:
        apply(self.state, self._board, change)
        if change.after_us is None:
            self.wall_set.pop(change.timer, None)
        else:
            self.wall_set[change.timer] = at

    # -- waits -------------------------------------------------------------------------------------------------------
    def _wait(self, at: Micros, kind: WaitKind, of: str, task: str, *, agent: str = "", text: str = "") -> None:
        if (kind, of) not in self.waiting:
            self.waiting[kind, of] = WaitRow(task, kind, at, agent=agent, text=text)

    def _go_on(self, at: Micros, kind: str, of: str, more: str = "") -> None:
        row = self.waiting.pop((kind, of), None)
        if row is not None and at > row.start and row.task in self.state.tasks:
            row.end, row.text = at, row.text + more
            self.story(row.task).waits.append(row)
