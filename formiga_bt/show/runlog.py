"""What happened in a run, folded from the engine's steps: actions, tasks, lowest battery, alarms, what went wrong.

Used by `dryrun` and `demo`. It holds a state of its own, folded with the engine's `apply`, so that it can be read in another
thread than the engine's.
"""

from collections.abc import Iterable

from msgspec import Struct

from formiga_bt.blackboard import Blackboard
from formiga_bt.clock import Micros
from formiga_bt.engine import changes as ch
from formiga_bt.engine.inputs import Abort, Alarm, LockdownOrder, Notify, Operator, PublishState, Step
from formiga_bt.engine.records import GoalRecord, Question
from formiga_bt.engine.state import EngineState, apply
from formiga_bt.geo import Place, Position
from formiga_bt.show.happened import Happenings


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
    detail: str = ""
    """Where it goes, for people."""

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


def where(goal: GoalRecord) -> str:
    """Return where a goal moves its agent: metres east, north and up of the base station."""
    for value in goal.fields.values():
        if isinstance(value, Position):
            return f"to {value.east_m:.0f} E {value.north_m:.0f} N {value.up_m:.0f} up"
        if isinstance(value, Place):
            return f"at {value.east_m:.0f} E {value.north_m:.0f} N"
    return ""


class RunLog:
    """Folds steps; `feed` them in order."""

    def __init__(self) -> None:
        self.state = EngineState()
        self.actions: list[ActionRow] = []
        self.lines: list[Line] = []
        self.least_battery: dict[str, float] = {}
        self.started_at: Micros | None = None
        self.errors: list[str] = []
        self.happened = Happenings()
        self._board = Blackboard()
        self._open: dict[str, ActionRow] = {}
        self._shown: dict[str, str] = {}
        """task -> the status told last"""

    def feed(self, step: Step) -> None:
        """Take one step."""
        if self.started_at is None:
            self.started_at = step.at
        self.state.now, self.state.seq = step.at, step.seq
        self.happened.begin(step.input)
        self._note_refusal(step)
        for change in step.changes:
            self.happened.before(step.at, change, self.state)
            asked = self._asked_before(change)
            apply(self.state, self._board, change)
            self._note(step.at, change, asked)
        for effect in step.effects:
            match effect:
                case Notify(text, to, severity):
                    self.lines.append(Line(step.at, f"to {', '.join(to) or 'nobody'}: {text}", severity))
                case Alarm(code, text, task):
                    self.lines.append(Line(step.at, f"{text} ({code}{', ' + task if task else ''})", "alarm"))
                case PublishState(task, "HELD") if not self.state.tasks[task].held:
                    pass  # and went on in the same step
                case PublishState(task, status, code, reason):
                    self.lines.append(Line(step.at, f"{task} {self._status_text(task, status, code, reason)}"))

    def _note_refusal(self, step: Step) -> None:
        given = step.input
        if not step.reply.startswith("error:") or not isinstance(given, Operator | LockdownOrder | Abort):
            return
        match given:
            case Operator(order, target, _):
                what = f"{order} {target or 'all'}"
            case LockdownOrder(how, _):
                what = f"lockdown {how}"
            case Abort(task):
                what = f"abort {task}"
        text = step.reply.split(":", 2)[2]
        self.lines.append(Line(step.at, f"refused to {given.by or 'somebody'}: {what}: {text}", "warning"))

    def _status_text(self, task: str, status: str, code: str, reason: str) -> str:
        was, self._shown[task] = self._shown.get(task), status
        if status == "HELD":
            return f"HELD ({', '.join(self.state.tasks[task].held)})"
        if was == "HELD" and status in ("ASSIGNED", "ACTIVE"):
            return "goes on"
        return f"{status}: {code} {reason}".rstrip() if code else status

    def _asked_before(self, change: ch.Change) -> Question | None:
        return self.state.questions.get(change.question.id) if isinstance(change, ch.QuestionPut) else None

    def _note(self, at: Micros, change: ch.Change, asked: Question | None) -> None:
        match change:
            case ch.GoalPut(goal):
                self._goal(at, goal)
            case ch.GoalDrop(goal_id):
                row = self._open.pop(goal_id, None)
                if row is not None:  # withdrawn: a question answered by another, a goal never sent
                    row.end, row.state = at, "withdrawn"
            case ch.QuestionPut(question):
                self._question(at, question, asked)
            case ch.AgentPut(agent) if agent.battery is not None and not agent.human:
                self.least_battery[agent.id] = min(agent.battery, self.least_battery.get(agent.id, 100.0))

    def _question(self, at: Micros, question: Question, asked: Question | None) -> None:
        if asked is None:
            who = ", ".join(question.asked) or "nobody"
            self.lines.append(Line(at, f"{question.number} to {who}: {question.text} ({', '.join(question.options)})"))
        if question.reply is not None and (asked is None or asked.reply is None):
            self.lines.append(
                Line(at, f"{question.number} is answered: {question.reply['answer']} by {question.reply['by']}")
            )

    def _goal(self, at: Micros, goal: GoalRecord) -> None:
        row = self._open.get(goal.id)
        if row is None and goal.in_flight:
            row = ActionRow(goal.task, goal.agent, goal.action, at, goal=goal.id, detail=where(goal))
            self._open[goal.id] = row
            self.actions.append(row)
        if row is not None and (goal.ended or goal.state == "interrupted"):
            row.end, row.state, row.code = at, goal.state, goal.code
            if goal.action == "Confirm" and goal.state == "succeeded":
                row.state, row.code = "answered", str(goal.result.get("answer", ""))
            del self._open[goal.id]

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
