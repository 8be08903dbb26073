"""Facts of which the API has more than pictures: a task with all that it did, and a task of the library.

Pure functions; called with the view held still.
"""

from collections.abc import Iterable

from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.lang.model import Task
from formiga_bt.show.facts import FailureFact, LibraryTask, LineFact, RunningStep, TaskDetail, VersionFact
from formiga_bt.show.history.records import file_facts, goal_fact, task_fact
from formiga_bt.show.history.rows import ActionRow
from formiga_bt.show.history.urgency import UrgencyIndex
from formiga_bt.show.listed import param_fact
from formiga_bt.show.why.places import StepPlaces, running_leaves, title


def task_detail(
    index: UrgencyIndex,
    task: TaskRecord,
    rows: Iterable[ActionRow],
    lines: Iterable[LineFact],
    places: StepPlaces | None,
) -> TaskDetail:
    """Return everything about a task; `rows` are its actions, `lines` its notices."""
    state, failure = index.state, task.outcome.failure
    nodes = []
    for key in running_leaves(state.memory.get(task.id, {})):
        step = places.of(key) if places is not None else None
        mark = f"{step.mark.file}:{step.mark.line}" if step is not None else ""
        nodes.append(RunningStep(node=key, title=title(step) if step is not None else "", place=mark))
    return TaskDetail(
        at=index.now,
        task=task_fact(index, task),
        bundle=task.request.bundle,
        run=task.run,
        outcome="" if task.restart.why else task.outcome.status,
        roles=dict(task.agents.roles),
        granted=task.agents.granted,
        active_at=task.times.active_at,
        failure=None
        if failure is None
        else FailureFact(
            code=failure.code,
            reason=failure.reason,
            step=failure.step,
            place=places.place(failure.step) if places is not None else failure.step,
            agent=failure.agent,
        ),
        notes=tuple(task.outcome.notes),
        running=tuple(nodes),
        goals=tuple(goal_fact(goal) for goal in state.goals.values() if goal.task == task.id and not goal.ended),
        questions=tuple(q.number for q in state.questions.values() if q.task == task.id and q.reply is None),
        actions=tuple(row.fact() for row in rows),
        lines=tuple(lines),
        files=file_facts(task),
    )


def library_task(task: Task, versions: tuple[VersionFact, ...]) -> LibraryTask:
    """Return a task as the library shows it."""
    return LibraryTask(
        task=task.name,
        aliases=task.aliases,
        description=task.description,
        file=task.mark.file,
        bundle=task.bundle,
        params=tuple(param_fact(param) for param in task.params.values()),
        version=versions[-1].version,
        versions=versions,
    )
