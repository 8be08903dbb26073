"""Why a task that runs is where it is: goals and what they wait for, questions, waits, tasks that it requested, time limits."""

from collections.abc import Iterator

from formiga_bt.base.asking import CONFIRM
from formiga_bt.engine.kernel.pace import throttled
from formiga_bt.engine.kernel.records import GoalRecord, TaskRecord
from formiga_bt.engine.kernel.timers import TaskTime
from formiga_bt.lang.model import WAKES_A_SECOND
from formiga_bt.show.facts import Because
from formiga_bt.show.why.follow import behind_gate, behind_task
from formiga_bt.show.why.goals import goal_line, questions
from formiga_bt.show.why.resources import claims_asked, held, wanted
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.waiting import asked
from formiga_bt.show.why.waits import waits
from formiga_bt.show.why.words import span


def running(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell what a task does and waits for; what it waits for comes first."""
    state = scene.state
    mine = [g for g in state.goals.values() if g.task == task.id and g.action != CONFIRM]
    yield from questions(scene, task)
    for goal in mine:
        if goal.state == "gated":
            yield _with_step(scene, task, goal)
            if goal.code != "clearance":  # its question is told above
                yield from deeper(behind_gate(scene, goal))
    for request in state.requests.values():
        if request.units and request.holder == task.id:
            since = span(scene.now - request.at)
            yield Because("wants", f"{scene.place(task, request.node)} waits for {wanted(request)} since {since}")
            yield from deeper(claims_asked(scene, request))
        elif request.node and request.holder == task.id:
            since = span(scene.now - request.at)
            yield Because("wants", f"{scene.place(task, request.node)} waits for its agents since {since}")
            yield from deeper(asked(scene, request))
    for goal in mine:
        if goal.in_flight:
            yield _with_step(scene, task, goal)
    for child in [
        state.tasks[one] for one in task.family.children if one in state.tasks and not state.tasks[one].ended
    ]:
        words = " HELD" if child.hold.causes else ""
        words += ", which outlives it" if child.family.detached else ""
        yield Because("child", f"its task {child.id} is {child.status}{words}", f"formiga why {child.id}")
        yield from deeper(behind_task(scene, child, (task.id,)))
    yield from waits(scene, task)
    yield from held(scene, task)
    yield from _throttled(scene, task)
    yield from _limits(scene, task)
    if task.section in ("on_failure", "on_abort", "finally", "recover") and not task.outcome.status:
        yield Because("section", f"it is in its section {task.section}")
    if task.section == "recover" and task.agents.recovering:
        home = [f"{r.agent} ({r.state})" for r in task.agents.recovering]
        yield Because("recover", f"its machines are brought home: {', '.join(home)}")


def _with_step(scene: WhyScene, task: TaskRecord, goal: GoalRecord) -> Because:
    """Return the line of a goal with the step that sent it, where that is known."""
    line = goal_line(scene, goal)
    step = scene.step(task, goal.owner) if goal.owner and goal.owner[0] != "!" else None
    where = f", at {step.mark.file}:{step.mark.line}" if step is not None else ""
    return Because(line.code, line.text + where, line.hint, line.agent)


def _throttled(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell that its waits are made longer, and which one was last."""
    slow = throttled(scene.state, task, scene.now)
    if slow is not None and slow.since is not None:
        last = scene.place(task, slow.path)
        most = f"more than {WAKES_A_SECOND} times a second"
        text = (
            f"it is throttled since {span(scene.now - slow.since)}: its waits would wake it {most}; the last at {last}"
        )
        yield Because("throttled", text, "wait longer, or wait_until a condition")


def _limits(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell when the task's own time is over."""
    limits: tuple[tuple[TaskTime, str], ...] = (("timeout", "its timeout"), ("cleanup", "the time of its cleanup"))
    for what, words in limits:
        ends = scene.task_ends(task, what)
        if ends is not None:
            yield Because("limit", f"{words} comes in {span(ends - scene.now)}")
