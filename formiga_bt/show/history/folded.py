"""`FoldedSource`: everything that is shown of a site, read from a ledger in this process.

The same for a running engine, a dry run and a stored history: whoever feeds the ledger decides what it is a picture of.
"""

import heapq
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import islice
from typing import Any, Final, TypeVar

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.library import model_of
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import board_of
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.places import steps_with_paths
from formiga_bt.show.amounts import Wording
from formiga_bt.show.facts import (
    ActionFact,
    Because,
    BlackboardFact,
    Chart,
    Drawing,
    FileSpot,
    Now,
    Stats,
    StepFact,
    TaskFact,
    TaskPicture,
    Timeline,
    Top,
    Waiting,
)
from formiga_bt.show.history.alarms import alarm_fact, in_order
from formiga_bt.show.history.charting import chart
from formiga_bt.show.history.holding import resource_facts
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.history.notes import notes
from formiga_bt.show.history.records import agent_fact, agents_of, goal_fact, question_fact, task_fact
from formiga_bt.show.history.rows import ActionRow, deed_of
from formiga_bt.show.history.spreads import stats
from formiga_bt.show.history.urgency import NEVER, UrgencyIndex
from formiga_bt.show.lapse import lapses_at
from formiga_bt.show.listed import listing, port_of
from formiga_bt.show.why.front import explain, unknown
from formiga_bt.show.why.standing import lockdown_text
from formiga_bt.show.why.words import REASONS, say

LINES: Final = 60
"""Of the log."""
Row = TypeVar("Row", ActionFact, Waiting)


class FoldedSource:
    """A `Source` over a ledger.

    Args:
        ledger: fed by somebody else, in this thread or under `lock`.
        site, tasks, catalogue: what the engine was made of; a task that is not among `tasks` has an empty drawing.
        desk: the people who answer at this engine.
        engine: tells how the engine stands: ok, overloaded, draining, deposed, stopping or failed.
        clock: engine time; never before the newest step, which it is without one.
        wall: now on the clock of `AgentRecord.heard_wall`; without one it is not told how long somebody is silent.
        speed: engine seconds per wall second.
        lock: held while something is read.
        recall: called before tasks of these ids (none: of all) are looked at, to make the ledger know their beginnings.
        ahead: engine time less the wall clock.
    """

    def __init__(
        self,
        ledger: Ledger,
        site: Site,
        tasks: Mapping[str, Task],
        catalogue: Catalogue | None = None,
        *,
        desk: Callable[[], Collection[str]] = tuple,
        engine: Callable[[], str] = lambda: "ok",
        clock: Callable[[], Micros] = lambda: 0,
        wall: Callable[[], Micros] = lambda: 0,
        speed: float = 1.0,
        lock: AbstractContextManager[Any] | None = None,
        recall: Callable[[Sequence[str]], None] = lambda _ids: None,
        ahead: Callable[[], Micros] = lambda: 0,
    ) -> None:
        self.ledger = ledger
        self._site = site
        self._tasks = tasks
        self._catalogue = catalogue
        self._desk, self._engine, self._clock, self._wall, self._speed = desk, engine, clock, wall, speed
        self._lock: AbstractContextManager[Any] = lock if lock is not None else nullcontext()
        self._recall = recall
        self._ahead = ahead
        self._words = Wording(site)
        self._drawings: dict[str, tuple[Task, Drawing]] = {}

    def _at(self) -> Micros:
        return max(self._clock(), self.ledger.state.now)

    # -- the whole site ----------------------------------------------------------------------------------------------
    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant; see `Source.now`."""
        with self._lock:
            state, index = self.ledger.state, UrgencyIndex(self.ledger, self._at(), self._speed)
            counts: dict[str, int] = {}
            for task in state.tasks.values():
                counts[task.status] = counts.get(task.status, 0) + 1
            page, total, waiting = self._page(index, first, count, find.lower(), over=over)
            desk, wall = self._desk(), self._wall()
            agents = sorted(state.agents.values(), key=listing)
            questions = sorted(
                (q for group in index.questions.values() for q in group),
                key=lambda q: (NEVER if (at := lapses_at(state, q)) is None else at, q.order),
            )
            return Now(
                site=self._site.name,
                at=index.now,
                engine=self._engine(),
                mode=self._site.mode,
                speed=self._speed,
                ahead_us=self._ahead(),
                top=self._top(index),
                counts=counts,
                tasks=tuple(page),
                total=total,
                waiting=waiting,
                agents=tuple(
                    agent_fact(state, agent, index.now, wall, port_of(self._site, agent), desk) for agent in agents
                ),
                questions=tuple(question_fact(state, question, desk) for question in questions),
                lines=tuple(islice(reversed(self.ledger.lines), LINES))[::-1],
                alarms=tuple(map(alarm_fact, in_order(one for one in state.alarms.values() if one.is_open))),
                resources=resource_facts(state, self._site.resources.values()),
            )

    def _page(
        self, index: UrgencyIndex, first: int, count: int, find: str, *, over: bool
    ) -> tuple[list[TaskFact], int, int]:
        """Return a page of tasks, how many match, and how many of these only wait for agents."""
        tasks = index.state.tasks.values()
        going = [task for task in tasks if task.section != "done"]
        ended = [task for task in tasks if task.section == "done"] if over else []
        if find:
            going = [task for task in going if self._fits(index, task, find)]
            ended = [task for task in ended if self._fits(index, task, find)]
        first, count = max(0, first), max(0, count)
        last = first + count
        if last < len(going):
            shown = heapq.nsmallest(last, going, key=index.rank)[first:]
        else:
            ended.sort(key=lambda task: (-(task.times.ended_at or 0), -task.order))
            shown = [*sorted(going, key=index.rank), *ended][first:last]
        waiting = sum(index.waits(task) for task in going)
        return [task_fact(index, task) for task in shown], len(going) + len(ended), waiting

    @staticmethod
    def _fits(index: UrgencyIndex, task: TaskRecord, find: str) -> bool:
        plain = (
            task.id,
            task.outcome.code,
            task.status,
            task.request.by,
            task.outcome.reason,
            *agents_of(task),
            *task.hold.words,
        )
        return any(find in word.lower() for word in plain) or find in index.doing(task).lower()

    def _top(self, index: UrgencyIndex) -> Top:
        state, ledger = index.state, self.ledger
        machines = [agent for agent in state.agents.values() if not agent.human]
        asked = [question.asked_at for group in index.questions.values() for question in group]
        waits = [*asked, *ledger.stuck.values()]
        alarms = [alarm for alarm in state.alarms.values() if alarm.is_open]
        raised = sum(alarm.state == "raised" for alarm in alarms)
        named = {alarm.agent for alarm in alarms}
        standing = sum(
            bool(agent.breach or agent.quarantine or agent.liveness == "LOST") and agent.id not in named
            for agent in machines
        )
        return Top(
            airborne=sum(agent.landed == "airborne" for agent in machines),
            needs_you=len(waits),
            longest_wait_us=index.now - min(waits) if waits else 0,
            alarms=raised + standing,
            held=sum(bool(task.hold.causes) and task.section != "done" for task in state.tasks.values()),
            taken=tuple(
                (agent.control.upper(), agent.id) for agent in machines if agent.control in ("pilot", "failsafe")
            ),
            lockdown=lockdown_text(state.lockdown, index.now) if state.lockdown is not None else "",
        )

    # -- one task ----------------------------------------------------------------------------------------------------
    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        self._recall([task_id])
        with self._lock:
            state, index = self.ledger.state, UrgencyIndex(self.ledger, self._at(), self._speed)
            task = self._known(task_id)
            story = self.ledger.story(task_id)
            model = model_of(self._tasks, task)
            mine = {*agents_of(task), *(agent.id for agent in index.agents.get(task_id, ()))}
            agents = sorted((agent for agent in state.agents.values() if agent.id in mine), key=listing)
            return TaskPicture(
                at=index.now,
                task=task_fact(index, task),
                drawing=self._drawing(task, model),
                steps=tuple(self._steps(task, model, index.now)),
                values=self._words.scopes(state.scopes.get(task_id) or {"": story.names}, model, index.now),
                goals=tuple(goal_fact(goal) for goal in index.goals.get(task_id, ())),
                questions=tuple(question_fact(state, q, self._desk()) for q in index.questions.get(task_id, ())),
                agents=tuple(
                    agent_fact(state, agent, index.now, self._wall(), port_of(self._site, agent), self._desk())
                    for agent in agents
                ),
                lines=tuple(story.lines),
            )

    def _known(self, task_id: str) -> TaskRecord:
        task = self.ledger.state.tasks.get(task_id)
        if task is None and task_id in self.ledger.state.agents:
            raise TaskError("unknown_task", f"'{task_id}' is an agent, and a task is wanted")
        if task is None:
            raise unknown(task_id, self.ledger.state.tasks)
        return task

    def _drawing(self, task: TaskRecord, model: Task | None) -> Drawing:
        if model is None:  # a task of the engine itself, or of a file that is gone
            return Drawing(task=task.name, spot=FileSpot("", 0, 0))
        kept = self._drawings.get(task.name)
        if kept is None or kept[0] is not model:
            from formiga_bt.show.tree.drawing import drawing_of

            kept = self._drawings[task.name] = (model, drawing_of(model))
        return kept[1]

    def _steps(self, task: TaskRecord, model: Task | None, now: Micros) -> list[StepFact]:
        """Return the facts of the steps, in the order of the file, with what they do now and why they failed."""
        story = self.ledger.story(task.id)
        said = notes(self.ledger.state, task, now)
        facts = {fact.path: fact for fact in story.progress.facts()}
        for path, fact in facts.items():
            reason = fact.reason
            if fact.status == "failure" and not reason and not _passed_on(fact, facts):
                reason = say(REASONS, fact.code)
            if reason != fact.reason or path in said:
                facts[path] = replace(fact, reason=reason, note=said.get(path, "") if fact.running else "")
        order = {path: n for n, (path, _) in enumerate(steps_with_paths(model))} if model is not None else {}
        return sorted(facts.values(), key=lambda fact: (order.get(fact.path, -1), fact.path))

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands, and the chain of causes."""
        self._recall([of])
        with self._lock:
            story = self.ledger.stories.get(of)
            actions: Sequence[ActionFact] = [row.fact() for row in story.rows] if story is not None else ()
            return explain(
                self.ledger.state, self._tasks, of, self._at(),
                catalogue=self._catalogue, wall=self._wall(), desk=self._desk(), actions=actions,
            )  # fmt: skip

    # -- time and space ----------------------------------------------------------------------------------------------
    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions and waits of some tasks, or of all."""
        self._recall(tasks)
        with self._lock:
            state, index = self.ledger.state, UrgencyIndex(self.ledger, self._at(), self._speed)
            shown = [self._known(one) for one in dict.fromkeys(tasks)] if tasks else list(state.tasks.values())
            wanted = {task.id for task in shown}
            stories = [self.ledger.story(task.id) for task in shown]
            waits = [row.fact() for story in stories for row in story.waits]
            waits += [
                row.fact() for row in self.ledger.waiting.values() if _lasts(row.start, index.now, row.task, wanted)
            ]
            return Timeline(
                at=index.now,
                tasks=tuple(task_fact(index, task) for task in sorted(shown, key=lambda one: one.order)),
                actions=_by_start([self._told(row) for story in stories for row in story.rows]),
                waits=_by_start(waits),
            )

    def _told(self, row: ActionRow) -> ActionFact:
        spec = self._catalogue.actions.get(row.action) if self._catalogue is not None else None
        return replace(row.fact(), does=deed_of(row.action, spec))

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map with the ways of the agents of some tasks, or of all agents."""
        if tasks:
            self._recall(tasks)
        with self._lock:
            return chart(self.ledger, self._site, self._at(), [self._known(one).id for one in tasks])

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread."""
        with self._lock:
            return stats(self.ledger, self._at(), task=task, hours=hours)

    def blackboard(self, prefix: str = "/") -> BlackboardFact:
        """Return the keys of the blackboard that begin with this."""
        with self._lock:
            found = dict(board_of(self.ledger.state).under(prefix))
        return BlackboardFact(self._at(), found)


def _passed_on(fact: StepFact, facts: Mapping[str, StepFact]) -> bool:
    """Return whether a step failed because one below it did."""
    below = fact.path if fact.path.endswith("/") else f"{fact.path}."
    return any(
        other.path.startswith(below) and other.path != fact.path and other.failed and other.code == fact.code
        for other in facts.values()
    )


def _lasts(start: Micros, now: Micros, task: str, wanted: Collection[str]) -> bool:
    return task in wanted and now > start


def _by_start(rows: list[Row]) -> tuple[Row, ...]:
    return tuple(sorted(rows, key=lambda row: row.start))
