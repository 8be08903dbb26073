"""The time machine: the site at any moment of its journal, as a ledger from which every picture is drawn.

A moment is the snapshot before it and the steps after that: how long a look takes does not depend on how much is kept.
"""

from collections.abc import Iterable, Iterator
from heapq import merge
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from types import TracebackType
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import JournalError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, Resumed
from formiga_bt.engine.kernel.records import TaskRecord, holder_of
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.records import Gap, KeptStep
from formiga_bt.journal.store import Journal
from formiga_bt.journal.thin import TrackPoint, lay_over
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.history.tracks import AgentTrack
from formiga_bt.show.replay.files import Files

SOME_US: Final[Micros] = 600 * SECOND
"""Of the history before a moment is folded for lines and alarms."""

Fix = tuple[int, str, TrackPoint]
"""A way point behind the `seq` of its step and its agent."""


class Restart(Struct, frozen=True):
    """An engine ended, and another one went on from the journal."""

    ended_at: Micros
    """The former one's last sign of life."""
    at: Micros
    away_us: Micros
    """In between, on the clock of the wall."""
    is_clean: bool
    """It was told to end."""


class TimeMachine:
    """Looks at one site's journal, also while an engine writes it; a context manager.

    Args:
        where: path or URL of the journal.
        site: name of the site.

    Raises:
        JournalError: there is none, it cannot be read, or it has nothing of this site.
    """

    def __init__(self, where: str | Path, site: str) -> None:
        self.journal = Journal(where, site, read_only=True)
        first = self.journal.first_snapshot_at()
        if first is None:
            self.close()
            raise JournalError(f"the journal {self.journal.where} has nothing of the site '{site}'")
        self.first: Micros = first
        self.files = Files(self.journal)

    def __enter__(self) -> "TimeMachine":
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let the journal go."""
        self.journal.close()

    # -- which moments there are -------------------------------------------------------------------------------------
    @property
    def last(self) -> Micros:
        """Return the last moment that is known."""
        return max(self.first, self.journal.last()[1])

    def gap(self, at: Micros) -> Gap | None:
        """Return the gap in the history that a moment is in."""
        return next((gap for gap in self.journal.gaps() if gap.at <= at < gap.to_at), None)

    def _whole_from(self, at: Micros) -> tuple[int, Micros]:
        """Return `seq` and time of the snapshot after the last gap before a moment: from there nothing is missing."""
        gaps = [gap for gap in self.journal.gaps() if gap.to_at <= at]
        if not gaps:
            return 0, 0
        after = (one for one in self.journal.snapshots() if one[0] >= gaps[-1].to_seq and one[1] <= at)
        return next(after, (0, 0))

    # -- the whole site ----------------------------------------------------------------------------------------------
    def moment(self, at: Micros, since: Micros | None = None, *, ways: bool = False) -> Ledger:
        """Return the site as it stood at a moment, steps at that very moment included.

        Args:
            at: engine time.
            since: lines, waits and rows from then on at least; None: from the snapshot before.
            ways: the agents' ways too.

        Raises:
            JournalError: nothing is kept of that moment.
        """
        gap = self.gap(at)
        if gap is not None:
            raise JournalError(
                f"the journal {self.journal.where} has nothing from {gap.at} to {gap.to_at} us: {gap.why}"
            )
        begin = at if since is None else max(min(since, at), self.first, self._whole_from(at)[1])
        state = self.journal.snapshot_at(begin, light=True) if at >= self.first else None
        if state is None:
            raise JournalError(
                f"the journal {self.journal.where} has nothing of {at} us",
                help=f"its earliest moment is {self.first} us",
            )
        after = state.seq
        ledger = Ledger(ALL, state)
        ledger.started_at = max(state.now, begin) if since is not None else state.now
        fixes: Iterable[Fix] = self._fixes(after, max(state.now, begin), at) if ways else ()
        put = follow(ledger, (kept.step for kept in self.journal.read(after, until=at)), fixes)
        lay_over(state, self.journal.points_at(state.agents, after, at), put)
        state.now = max(state.now, at)
        return ledger

    def state(self, at: Micros) -> EngineState:
        """Return the state at a moment, without explanations from before the snapshot; see `moment`."""
        return self.moment(at).state

    def _fixes(self, after: int, since: Micros, until: Micros, agent: str = "") -> list[Fix]:
        way = self.journal.way(agent, since, until)
        return sorted(((p.seq, name, p) for name, p in way if p.seq > after), key=itemgetter(0))

    # -- one task ----------------------------------------------------------------------------------------------------
    def story(self, task_id: str, at: Micros, *, ways: bool = False, to: int | None = None) -> Ledger | None:
        """Return a ledger with the story of one task until a moment, whenever that was; None: the journal does not know it.

        Only what is about the task is in it; how the site stood is not. `to`: `seq` of the last step that counts.
        """
        whole, whole_at = self._whole_from(at)
        steps = [kept.step for kept in self.journal.read(to=to, until=at, task=task_id)]
        if not steps:
            return None
        base = EngineState()
        if not _begins(steps[0], task_id) or (whole and steps[0].seq <= whole):  # what came before is no longer kept
            base = self.journal.snapshot_at(whole_at if steps[-1].seq > whole and whole else self.first) or base
            base.memory = {task_id: base.memory.get(task_id, {})}
            steps = [step for step in steps if step.seq > base.seq]
            if not steps:
                return None
        ledger = Ledger(ALL, base)
        own = (_part(step, task_id, ledger.state) for step in steps)
        agents = _agents_of(steps, task_id) if ways else ()
        fixes = merge(*(self._fixes(0, steps[0].at, steps[-1].at, one) for one in agents), key=itemgetter(0))
        follow(ledger, own, fixes)
        task = ledger.state.tasks.get(task_id)
        if task is None:
            return None
        _close(ledger, task)
        return ledger

    def go_on(self, story: Ledger, task_id: str, to: int) -> None:
        """Bring what `story` returned up to the step `to`."""
        steps = [kept.step for kept in self.journal.read(story.state.seq, to, task=task_id)]
        follow(story, (_part(step, task_id, story.state) for step in steps))
        _close(story, story.state.tasks[task_id])

    def record(self, task_id: str) -> TaskRecord | None:
        """Return a task as it stood last; None: the journal does not know it."""
        story = self.story(task_id, self.last)
        return story.state.tasks[task_id] if story is not None else None

    def restarts(self, since: Micros, until: Micros) -> list[Restart]:
        """Return the ends of engines at `since` or later, after which another one had started by `until`, oldest first."""
        found = []
        for before, start in pairwise(self.journal.starts()):
            if start.at < since or start.at > until:
                continue
            first = next(self.journal.read(start.seq, start.seq + 1), None)
            if first is None or not isinstance(first.step.input, Resumed):
                continue
            told = first.step.input
            if since <= told.at and first.at <= until:
                found.append(Restart(told.at, first.at, told.wall - told.since, is_clean=before.ended is not None))
        return found

    def began_again(self, epoch: int) -> Micros | None:
        """Return when the engine of an epoch began, if another one was before it in what is kept; None: it was the first."""
        starts = self.journal.starts()
        began = next((start.at for start in starts if start.epoch == epoch), None)
        return began if began is not None and self.first < began and starts[0].epoch != epoch else None

    def events(self, after: int = 0, to: int | None = None, task: str = "") -> Iterator[KeptStep]:
        """Return kept steps in order, of a task or of all."""
        return self.journal.read(after, to, task=task)


def follow(ledger: Ledger, steps: Iterable[EngineStep], fixes: Iterable[Fix] = ()) -> dict[str, int]:
    """Feed steps, and way points in between; return the `seq` of the last record of each agent."""
    put: dict[str, int] = {}
    rest = iter(fixes)
    fix = next(rest, None)
    for step in steps:
        while fix is not None and fix[0] < step.seq:
            _went(ledger, fix)
            fix = next(rest, None)
        ledger.feed(step)
        for change in step.changes:
            if type(change) is ch.AgentPut:
                put[change.agent.id] = step.seq
    while fix is not None:
        _went(ledger, fix)
        fix = next(rest, None)
    return put


def _went(ledger: Ledger, fix: Fix) -> None:
    _, name, point = fix
    agent, position = ledger.state.agents.get(name), point.position
    if agent is None or position is None:
        return
    way = ledger.ways.get(name)
    if way is None:
        way = ledger.ways[name] = AgentTrack(name, agent.type, mobility=agent.mobility, points=ledger.bounds.points)
    way.note(point.at, position, agent.task)


def _begins(step: EngineStep, task_id: str) -> bool:
    return any(
        type(c) is ch.TaskPut and c.task.id == task_id and c.task.times.submitted_at == step.at for c in step.changes
    )


def _agents_of(steps: Iterable[EngineStep], task_id: str) -> list[str]:
    found: dict[str, None] = {}
    for step in steps:
        for change in step.changes:
            if type(change) is ch.TaskPut and change.task.id == task_id:
                found.update(dict.fromkeys(change.task.agents.granted))
            elif type(change) is ch.GoalPut and change.goal.task == task_id:
                found[change.goal.agent] = None
    return list(found)


def _part(step: EngineStep, task_id: str, state: EngineState) -> EngineStep:
    """Return what of a step is about a task, and about agents."""
    changes = tuple(change for change in step.changes if _is_about(change, task_id, state))
    effects = tuple(one for one in step.effects if getattr(one, "task", "") == task_id)
    mine = getattr(step.input, "target", task_id) == task_id
    return EngineStep(step.seq, step.at, step.input, changes, effects, step.reply if mine else None)


def _is_about(change: ch.Change, task_id: str, state: EngineState) -> bool:
    match change:
        case ch.AgentPut():
            return True
        case ch.TaskPut(task):
            return task.id == task_id
        case ch.GoalPut(goal):
            return goal.task == task_id
        case ch.QuestionPut(question):
            return question.task == task_id
        case ch.GoalDrop(goal):
            return goal in state.goals
        case ch.QuestionDrop(question):
            return question in state.questions
        case ch.TaskGone():
            return False
        case _:
            return holder_of(str(getattr(change, "task", ""))) == task_id


def _close(ledger: Ledger, task: TaskRecord) -> None:
    """End what a task that is over cannot wait for any more: its end may not have been about the task."""
    if task.times.ended_at is None:
        return
    for (kind, of), row in list(ledger.waiting.items()):
        if row.task == task.id:
            del ledger.waiting[kind, of]
            row.end = task.times.ended_at
            if row.end > row.start:
                ledger.story(task.id).waits.append(row)
    for action in ledger.story(task.id).rows:
        if action.end is None:
            action.end, action.state = task.times.ended_at, "withdrawn"
