"""A moment that moves: it plays as time passes, steps from event to event and from failure to failure, jumps."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import (
    Abort,
    Alarm,
    Assign,
    EngineStep,
    LockdownOrder,
    NotifyPeople,
    Operator,
    Prioritize,
    PublishState,
    Submit,
    Unassign,
)
from formiga_bt.engine.kernel.records import ENDED
from formiga_bt.show.facts import Because, BlackboardFact, Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.replay.machine import TimeMachine
from formiga_bt.show.replay.source import JournalSource

WRONG: Final = frozenset({"failed", "rejected", "lost", "gate_refused", "in_doubt", "taken_over"})
"""States of goals that are failures."""
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0)
Kind = Callable[[EngineStep], bool]


def is_event(step: EngineStep) -> bool:
    """Return whether people see anything of a step: a status, a goal sent or ended, a question, a notice, an order."""
    if isinstance(step.input, Submit | Abort | Operator | LockdownOrder | Assign | Unassign | Prioritize):
        return True
    if any(isinstance(effect, PublishState | NotifyPeople | Alarm) for effect in step.effects):
        return True
    return any(
        isinstance(change, ch.QuestionPut)
        or (isinstance(change, ch.GoalPut) and (change.goal.state in ENDED or change.goal.state == "sent"))
        for change in step.changes
    )


def is_failure(step: EngineStep) -> bool:
    """Return whether something went wrong: a task or a goal failed, or an alarm was given."""
    if any(
        isinstance(one, Alarm) or (isinstance(one, PublishState) and one.status == "FAILED") for one in step.effects
    ):
        return True
    return any(isinstance(change, ch.GoalPut) and change.goal.state in WRONG for change in step.changes)


class Cursor:
    """A `show.source.Source` at a moment that moves.

    Args:
        machine: on the journal.
        at: where it begins.
        task: only this task's events count for stepping; "" = all.
        speed: seconds of history a second, while it plays.
    """

    def __init__(self, machine: TimeMachine, at: Micros, *, task: str = "", speed: float = 1.0) -> None:
        self.machine, self.task_id, self.speed = machine, task, speed
        self.plays = False
        self._source = JournalSource(machine, at)
        self._at = at

    @property
    def at(self) -> Micros:
        """Return the moment."""
        return self._at

    def go(self, at: Micros) -> None:
        """Go to a moment, or as near to it as the journal reaches."""
        at = min(max(at, self.machine.first), self.machine.last)
        if at != self._at:
            self._at, self._source = at, JournalSource(self.machine, at)

    def play(self, elapsed_s: float) -> None:
        """Let so many seconds pass for who watches; at the end it stands."""
        if self.plays:
            self.go(self._at + round(elapsed_s * self.speed * SECOND))
            self.plays = self._at < self.machine.last

    def faster(self, steps: int) -> None:
        """Take the next speed, or (below 0) the one before."""
        nearest = min(range(len(SPEEDS)), key=lambda n: abs(SPEEDS[n] - self.speed))
        self.speed = SPEEDS[min(max(nearest + steps, 0), len(SPEEDS) - 1)]

    def step(self, direction: int, kind: Kind = is_event) -> bool:
        """Go to the next event (`direction` 1) or the one before (-1); return whether there is one."""
        found = self._later(kind) if direction > 0 else self._earlier(kind)
        if found is None:
            return False
        self.plays = False
        self.go(found)
        return True

    def _later(self, kind: Kind) -> Micros | None:
        after = self.machine.journal.seq_at(self._at)
        steps = (kept.step for kept in self.machine.events(after, task=self.task_id))
        return next((step.at for step in steps if step.at > self._at and kind(step)), None)

    def _earlier(self, kind: Kind) -> Micros | None:
        for low, high in self._pieces():
            steps = [kept.step for kept in self.machine.events(low, high, self.task_id)]
            found = next((step.at for step in reversed(steps) if step.at < self._at and kind(step)), None)
            if found is not None:
                return found
        return None

    def _pieces(self) -> Iterator[tuple[int, int]]:
        """Yield what lies between two snapshots, the newest before the moment first."""
        high = self.machine.journal.seq_at(self._at)
        for seq, _ in reversed(self.machine.journal.snapshots()):
            if seq < high:
                yield seq, high
                high = seq

    # -- what is seen from here --------------------------------------------------------------------------------------
    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant."""
        return self._source.now(first=first, count=count, find=find, over=over)

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        return self._source.task(task_id)

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands, and the chain of causes."""
        return self._source.why(of)

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all."""
        return self._source.timeline(tasks)

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map."""
        return self._source.chart(tasks)

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread."""
        return self._source.stats(task=task, hours=hours)

    def blackboard(self, prefix: str = "/") -> BlackboardFact:
        """Return the keys of the blackboard that begin with this."""
        return self._source.blackboard(prefix)
