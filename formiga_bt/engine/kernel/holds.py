"""HELD: a flag with a list of causes beside a task's status.

While held, no new goal of `steps` leaves, goals in flight end naturally, and - unless the only causes are clearances - the
task's deadlines stand still.
"""

from collections.abc import Iterator

from msgspec.structs import replace

from formiga_bt.engine.kernel.causes import ClearanceHold, HoldCause, ResumeHold
from formiga_bt.engine.kernel.core import Core, clock_stands
from formiga_bt.engine.kernel.records import TaskRecord


def hold(core: Core, task_id: str, cause: HoldCause) -> None:
    """Add a cause, if it is not there yet."""
    task = core.state.tasks.get(task_id)
    if task is None or cause in task.hold.causes or task.section == "done":
        return
    stood = clock_stands(task)
    if not stood and not isinstance(cause, ClearanceHold):
        core.pause_deadlines(task_id)
        core.put_part(task_id, "hold", clock=replace(core.task(task_id).hold.clock, stands_since=core.now))
    core.put_part(task_id, "hold", causes=(*core.task(task_id).hold.causes, cause))


def unhold(core: Core, task_id: str, cause: HoldCause) -> None:
    """Take a cause away; with the last one the clocks run and waiting goals are looked at again."""
    task = core.state.tasks.get(task_id)
    if task is None or cause not in task.hold.causes:
        return
    stood = clock_stands(task)
    found = {} if isinstance(cause, ResumeHold) else task.hold.found
    task = core.put_part(task_id, "hold", causes=tuple(c for c in task.hold.causes if c != cause), found=found)
    if stood and not clock_stands(task):
        core.put_part(task_id, "hold", clock=task.hold.clock.resumed(core.now))
        core.resume_deadlines(task_id)
    core.stale.update(_machines_of(core, task))


def _machines_of(core: Core, task: TaskRecord) -> Iterator[str]:
    """Iterate over the agents that a task has, and those of which a goal of it waits."""
    for agents in task.agents.roles.values():
        yield from agents
    for goal_id in core.index.gated:
        goal = core.state.goals[goal_id]
        if goal.task == task.id:
            yield goal.agent
