"""Drain sets: what a stop waits for, whoever ordered it - a node, a `finally` on its own, or the task itself."""

from typing import assert_never

from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.nodes.ends import AgentReleased, ChildEnd, End, FinallyEnd, GoalEnd


def is_over(state: EngineState, task: TaskRecord, end: End) -> bool:
    """Return whether a member of a drain set of a task need not be waited for any more."""
    match end:
        case GoalEnd(goal_id):
            goal = state.goals.get(goal_id)
            return goal is None or goal.ended
        case FinallyEnd(cleanup_id):
            cleanup = task.cleanup(cleanup_id)
            return cleanup is None or cleanup.ended
        case AgentReleased(agent):
            return agent not in task.agents.releasing
        case ChildEnd(child_id):
            child = state.tasks.get(child_id)
            return child is None or child.ended
        case _:
            assert_never(end)


def adopt(core: Core, task_id: str, end: End, owner: str) -> None:
    """Make the node with key `owner` the one that is woken at an end; `!task` = the task itself."""
    task = core.task(task_id)
    match end:
        case GoalEnd(goal):
            core.put_goal(goal, owner=owner)
        case FinallyEnd(cleanup_id):
            cleanups = tuple(replace(one, owner=owner) if one.id == cleanup_id else one for one in task.ending.cleanups)
            core.put_part(task_id, "ending", cleanups=cleanups)
        case AgentReleased(agent):
            if agent in task.agents.releasing:
                now = replace(task.agents.releasing[agent], owner=owner)
                core.put_part(task_id, "agents", releasing={**task.agents.releasing, agent: now})
        case ChildEnd(child):
            core.put_part(child, "family", node=owner)
        case _:
            assert_never(end)


def forget(core: Core, task_id: str, end: End) -> None:
    """Drop what is over, if anything of it is kept."""
    match end:
        case GoalEnd(goal):
            if goal in core.state.goals:
                core.emit(ch.GoalDrop(goal))
        case FinallyEnd(cleanup_id):
            core.put_part(
                task_id,
                "ending",
                cleanups=tuple(one for one in core.task(task_id).ending.cleanups if one.id != cleanup_id),
            )
        case AgentReleased() | ChildEnd():
            pass
        case _:
            assert_never(end)
