"""What happened in a run, folded from the engine's steps: actions with start and end, tasks, lowest battery, alarms.

Used by `dryrun` and `demo`. It holds a state of its own, folded with the engine's `apply`, so that it can be read in another
thread than the engine's.
"""

from collections.abc import Iterable

from msgspec import Struct

from formiga_bt.blackboard import Blackboard
from formiga_bt.clock import Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.inputs import Alarm, Notify, Step
from formiga_bt.engine.records import GoalRecord, TaskRecord
from formiga_bt.engine.state import EngineState, apply


class ActionRow(Struct):
    """One goal of one agent, from sending to its end."""

    task: str
    agent: str
    action: str
    start: Micros
    end: Micros | None = None
    state: str = ""
    code: str = ""
    goal: str = ""

    @property
    def outcome(self) -> str:
        """Return how it ended in words, `running` if it did not."""
        if self.end is None:
            return "running"
        code = "" if self.code == self.state else self.code
        return f"{self.state} {code}".strip()


class Line(Struct, frozen=True):
    """A line of the log for people."""

    at: Micros
    text: str
    severity: str = "info"


class RunLog:
    """Folds steps; `feed` them in order."""

    def __init__(self) -> None:
        self.state = EngineState()
        self.actions: list[ActionRow] = []
        self.lines: list[Line] = []
        self.least_battery: dict[str, float] = {}
        self.started_at: Micros | None = None
        self.errors: list[str] = []
        self._board = Blackboard()
        self._open: dict[str, ActionRow] = {}

    def feed(self, step: Step) -> None:
        """Take one step."""
        if self.started_at is None:
            self.started_at = step.at
        self.state.now, self.state.seq = step.at, step.seq
        for change in step.changes:
            before = self._before(change)
            apply(self.state, self._board, change)
            self._note(step.at, change, before)
        for effect in step.effects:
            match effect:
                case Notify(text, to, severity):
                    self.lines.append(Line(step.at, f"to {', '.join(to) or 'nobody'}: {text}", severity))
                case Alarm(code, text, task):
                    self.lines.append(Line(step.at, f"{text} ({code}{', ' + task if task else ''})", "alarm"))

    def _before(self, change: ch.Change) -> GoalRecord | TaskRecord | None:
        match change:
            case ch.GoalPut(goal):
                return self.state.goals.get(goal.id)
            case ch.GoalDrop(goal_id):
                return self.state.goals.get(goal_id)
            case ch.TaskPut(task):
                return self.state.tasks.get(task.id)
        return None

    def _note(self, at: Micros, change: ch.Change, before: GoalRecord | TaskRecord | None) -> None:
        match change:
            case ch.GoalPut(goal):
                self._goal(at, goal)
            case ch.GoalDrop(goal_id):
                row = self._open.pop(goal_id, None)
                if row is not None:  # withdrawn: a question answered by another, a goal never sent
                    row.end, row.state = at, "withdrawn"
            case ch.AgentPut(agent) if agent.battery is not None and not agent.human:
                self.least_battery[agent.id] = min(agent.battery, self.least_battery.get(agent.id, 100.0))
            case ch.TaskPut(task):
                self._task(at, task, before if isinstance(before, TaskRecord) else None)

    def _goal(self, at: Micros, goal: GoalRecord) -> None:
        row = self._open.get(goal.id)
        if row is None and goal.in_flight:
            row = ActionRow(goal.task, goal.agent, goal.action, at, goal=goal.id)
            self._open[goal.id] = row
            self.actions.append(row)
        if row is not None and goal.ended:
            row.end, row.state, row.code = at, goal.state, goal.code
            del self._open[goal.id]

    def _task(self, at: Micros, task: TaskRecord, before: TaskRecord | None) -> None:
        if before is None or task.status != before.status:
            why = f": {task.code} {task.reason}".rstrip() if task.code else ""
            self.lines.append(Line(at, f"{task.id} {task.status}{why}"))
        elif task.held != before.held:
            what = f"HELD ({', '.join(task.held)})" if task.held else "goes on"
            self.lines.append(Line(at, f"{task.id} {what}"))

    def since_start(self, at: Micros) -> float:
        """Return seconds of engine time since the first step."""
        return (at - (self.started_at or at)) / 1e6

    def rows_of(self, task_ids: Iterable[str]) -> list[ActionRow]:
        """Return the actions of these tasks in order of start."""
        wanted = set(task_ids)
        return [row for row in self.actions if row.task in wanted]

    def all_succeeded(self) -> bool:
        """Return whether every task ended SUCCEEDED."""
        return bool(self.state.tasks) and all(task.status == "SUCCEEDED" for task in self.state.tasks.values())
