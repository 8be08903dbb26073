"""How a task ended: code and reason, the step that failed first, what was tried before, what its cleanup did."""

from collections.abc import Iterator
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.lang.places import static_path
from formiga_bt.show.facts import ActionFact, Because
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.words import REASONS, REPEATS, say, span

TRIES: Final = 5
"""So many attempts of the step that failed are told, the newest."""
CLEANUP: Final = ("on_failure", "on_abort", "finally", "recover")
UNSAID: Final = ("", "operator", "abandoned", "restart")
"""Reasons of an abort that its words say already."""
STATES: Final = {"succeeded": "", "failed": " failed", "running": " (runs)"}


def outcome(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell how a task's steps ended, and why."""
    if task.outcome.status == "SUCCEEDED":
        took = (
            f" after {span(task.times.ended_at - task.times.submitted_at)}" if task.times.ended_at is not None else ""
        )
        yield Because("succeeded", f"it succeeded{took}" if task.section == "done" else "its steps succeeded")
    else:
        words = say(REASONS, task.outcome.code)
        reason = (
            f": {task.outcome.reason}" if task.outcome.reason and task.outcome.reason not in (*REPEATS, words) else ""
        )
        said = (
            ""
            if task.outcome.code != "aborted" or task.ending.abort_reason in UNSAID
            else f" ({task.ending.abort_reason})"
        )
        yield Because(
            task.outcome.code or "ended", f"{task.outcome.status} ({task.outcome.code}): {words}{reason}{said}"
        )
    failure = task.outcome.failure
    if failure is not None and failure.step:
        agent = f" with {failure.agent}" if failure.agent else ""
        text = f"first failed: {scene.place(task, failure.step)}{agent}"
        yield Because("where", text, agent=failure.agent, depth=1)
        yield from _tried(scene, task, failure.step)
    yield from _children(scene, task)
    yield from _cleanup(scene, task)


def _tried(scene: WhyScene, task: TaskRecord, key: str) -> Iterator[Because]:
    """Tell of the attempts of the step that failed, if there were several, and of who was asked."""
    path = static_path(key)
    found = [one for one in _of_this_run(scene, task) if one.path == path]
    asked = bool(found) and found[0].action == CONFIRM
    if len(found) < 2 and not asked:
        return
    told = ", then ".join(_ended_as(one) for one in found[-TRIES:])
    times = f"{len(found)} times" if len(found) > 1 else "once"
    yield Because("tried", f"it was {'asked' if asked else 'sent'} {times}: {told}", depth=2)


def _of_this_run(scene: WhyScene, task: TaskRecord) -> list[ActionFact]:
    mine = f"{task.id}/{task.run}/"
    return [one for one in scene.actions if one.task == task.id and (not one.goal or one.goal.startswith(mine))]


def _ended_as(action: ActionFact) -> str:
    if action.action == CONFIRM:
        return f"{action.agent} " + (f"said {action.code}" if action.state == "answered" else "did not answer")
    if not action.code or action.code == action.state:
        return f"{action.agent} {action.state}"
    own = action.code.startswith(f"{action.state}:")  # an agent's own code: failed:motor
    return f"{action.agent} {action.code}" if own else f"{action.agent} {action.state} ({action.code})"


def _children(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell of the tasks that it requested and that did not succeed."""
    for one in task.family.children:
        child = scene.state.tasks.get(one)
        if child is not None and child.ended and child.outcome.status != "SUCCEEDED":
            text = (
                f"its task {child.id} {child.outcome.status} ({child.outcome.code}): {say(REASONS, child.outcome.code)}"
            )
            yield Because("child", text, f"formiga why {child.id}", depth=1)


def _section(action: ActionFact) -> str:
    """Return the section of a task that sent an action; the engine's own way home has no path, but an id."""
    parts = action.goal.split("/", 2)
    return (action.path or (parts[2] if len(parts) > 2 else "")).partition("/")[0].partition(":")[0]


def _cleanup(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell what was done after the steps, what went wrong in it, and what became of the machines."""
    found = [one for one in _of_this_run(scene, task) if _section(one) in CLEANUP and one.action != CONFIRM]
    if found and task.outcome.status != "SUCCEEDED":
        told = ", ".join(f"{one.agent}.{one.action}{STATES.get(one.state, ' ' + one.state)}" for one in found[-TRIES:])
        yield Because("cleanup", f"after that: {told}")
    for note in task.outcome.notes:
        yield Because("note", f"while it cleaned up: {note}")
    for one in task.agents.recovering:
        if one.state == "failed":
            hint = f"look at it, then: formiga agents clear {one.agent}"
            yield Because("stayed", f"{one.agent} could not be brought home ({one.tries} tries)", hint, one.agent)
    for agent in [scene.state.agents[one] for one in dict.fromkeys(task.agents.granted) if one in scene.state.agents]:
        if task.section == "done" and agent.pool == "PARKED_AWAY" and not agent.task:
            text = f"{agent.id} stands away from its port"
            yield Because("parked_away", text, f"formiga return {agent.id}", agent.id)
