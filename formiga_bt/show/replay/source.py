"""`JournalSource`: a journal at a moment as a `show.source.Source`. What draws does not notice."""

from collections import deque
from collections.abc import Callable, Sequence
from datetime import UTC, tzinfo
from functools import partial
from typing import Final, TypeVar

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.lang.model import Task
from formiga_bt.show.facts import Because, BlackboardFact, Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.replay.files import Files
from formiga_bt.show.replay.machine import SOME_US, TimeMachine
from formiga_bt.show.replay.when import in_words

PAST: Final = "past"
"""As how the engine stands."""
NOT_YET: Final = "not_yet"
"""Of a task that nobody had requested by then."""
WINDOW_US: Final[Micros] = 24 * 3600 * SECOND
"""Pictures of all tasks show so much before the moment."""
T = TypeVar("T")


class KeptTasks(Bundles):
    """The versions of tasks that a journal has, read when one is looked at.

    Args:
        files: of the journal.
    """

    def __init__(self, files: Files) -> None:
        super().__init__()
        self._files = files

    def version(self, name: str, bundle: str) -> Task | None:
        """Return a version of a task, or None if its files were not kept."""
        return self._files.task(name, bundle)


class JournalSource:
    """A journal as it stood at a moment; implements `Source`.

    Args:
        machine: on the journal.
        at: engine time; None: its last moment, looked up anew at each question.
        zone: in which moments are told.
    """

    def __init__(self, machine: TimeMachine, at: Micros | None = None, zone: tzinfo = UTC) -> None:
        self.machine = machine
        self._moment = at
        self._zone = zone
        self._tasks = KeptTasks(machine.files)
        self._kept: tuple[tuple[Micros, Micros, bool], Ledger] | None = None

    @property
    def at(self) -> Micros:
        """Return the moment."""
        return self.machine.last if self._moment is None else self._moment

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant."""
        at = self.at
        return self._drawn(self._ledger(at, at - SOME_US), at).now(first=first, count=count, find=find, over=over)

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree, also one that the engine had forgotten by then."""
        return self._of([task_id], lambda source: source.task(task_id))

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands, and the chain of causes."""
        return self._of([of], lambda source: source.why(of))

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all of the last day before the moment."""
        if tasks:
            return self._of(tasks, lambda source: source.timeline(tasks))
        ledger = self._of_window()
        recent = [
            task.id for task in ledger.state.tasks.values() if task.id in ledger.stories and _is_in(ledger, task.id)
        ]
        return self._drawn(ledger, self.at).timeline(recent)

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map with the ways for some tasks, or of all of the last day."""
        if tasks:
            return self._of(tasks, lambda source: source.chart(tasks), ways=True)
        return self._drawn(self._of_window(ways=True), self.at).chart()

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread, of the last hours, or of the last day."""
        at = self.at
        window = round(hours * 3600 * SECOND) if hours > 0 else WINDOW_US
        return self._drawn(self._ledger(at, at - window), at).stats(task=task, hours=window / SECOND / 3600)

    def blackboard(self, prefix: str = "/") -> BlackboardFact:
        """Return the keys of the blackboard that begin with this, as they stood."""
        at = self.at
        return self._drawn(self._ledger(at, at), at).blackboard(prefix)

    # -- ledgers -----------------------------------------------------------------------------------------------------
    def _of_window(self, *, ways: bool = False) -> Ledger:
        at = self.at
        return self._ledger(at, at - WINDOW_US, ways=ways)

    def _ledger(self, at: Micros, since: Micros, *, ways: bool = False) -> Ledger:
        key = (at, since, ways)
        if self._kept is None or self._kept[0] != key:
            self._kept = key, self.machine.moment(at, since, ways=ways)
        return self._kept[1]

    def _drawn(self, ledger: Ledger, at: Micros) -> FoldedSource:
        files = self.machine.files
        return FoldedSource(
            ledger, files.site, self._tasks, files.catalogue, engine=lambda: PAST, clock=partial(int, at)
        )

    def _of(self, ids: Sequence[str], draw: Callable[[FoldedSource], T], *, ways: bool = False) -> T:
        """Draw from the moment's ledger with the stories of some tasks in it, from their beginnings."""
        at = self.at
        ledger = self.machine.moment(at)
        if ways:
            ledger.ways.clear()
            ledger.events.clear()
        for one in dict.fromkeys(ids):
            own = self.machine.story(one, at, ways=ways)
            if own is not None:
                _splice(ledger, own, one)
            elif one not in ledger.state.tasks and one not in ledger.state.agents:
                self._refuse_later(one, at)
        return draw(self._drawn(ledger, at))

    def _refuse_later(self, task_id: str, at: Micros) -> None:
        """Refuse to look at a task at a moment at which nobody had requested it."""
        task = self.machine.record(task_id)
        if task is not None and task.times.submitted_at > at:
            raise TaskError(
                NOT_YET,
                f"{task_id} was requested at {in_words(task.times.submitted_at, self._zone)}, after the moment that "
                f"is looked at: {in_words(at, self._zone)}",
                help=f'--at "{task_id} start" is its beginning, --at "{task_id} end" its end',
            )


def _is_in(ledger: Ledger, task_id: str) -> bool:
    """Return whether anything of a task lies in what was folded."""
    task, story = ledger.state.tasks[task_id], ledger.stories[task_id]
    return (
        task.section != "done"
        or bool(story.rows or story.waits)
        or (task.times.ended_at or 0) >= (ledger.started_at or 0)
    )


def _splice(ledger: Ledger, own: Ledger, task_id: str) -> None:
    """Put the story of a task into the ledger of a moment."""
    record = own.state.tasks[task_id]
    ledger.state.tasks.setdefault(task_id, record)
    ledger.state.explanations |= own.state.explanations
    mine, before = own.story(task_id), ledger.stories.get(task_id)
    if before is not None and before.names and not mine.names:
        mine.names = before.names
    ledger.stories[task_id] = mine
    for key in [key for key, row in ledger.waiting.items() if row.task == task_id]:
        del ledger.waiting[key]
    ledger.waiting |= {key: row for key, row in own.waiting.items() if row.task == task_id}
    for agent, way in own.ways.items():
        if agent not in ledger.ways:
            ledger.ways[agent] = way
        else:
            ledger.ways[agent].pieces += [piece for piece in way.pieces if piece.task == task_id]
    ledger.events = deque([*ledger.events, *(event for event in own.events if event.task == task_id)])
