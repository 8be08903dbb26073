"""Who may be asked to step aside: a task is preempted for a HIGH request, and begins anew when its agents are free again.

A task may be restarted in this way only while nothing is lost by it: in its steps, not held by a person, with no load on its
machines, no action sent that may not be repeated, and no `critical` step running. `if_lost: rebind` asks the same.
"""

from formiga_bt.engine.core import Core
from formiga_bt.engine.records import TaskRecord
from formiga_bt.lang.places import steps_around


def why_not_preemptible(core: Core, task: TaskRecord) -> str:
    """Return why a task may not be restarted now, or "" if it may.

    One of: `ending` (its steps are over or being stopped, or have not begun), `not_preemptible` (its file says so, or its
    priority is high), `held`, `ordered` (an order stands on a machine of it), `spent` (an action that may not be repeated was
    sent), `loaded`, `critical`.
    """
    return _why_not(core, task, "")


def may_rebind(core: Core, task: TaskRecord, agent_id: str) -> bool:
    """Return whether a task that loses an agent begins anew with another one, instead of its step failing.

    Call it when the agent is lost or quarantined, before the task's trees run on.
    """
    model = core.models.get(task.name)
    if model is None:
        return False
    roles = [name for name, agents in task.roles.items() if agent_id in agents]
    rebinds = any(name in model.roles and model.roles[name].if_lost == "rebind" for name in roles)
    return rebinds and not _why_not(core, task, agent_id)


def _why_not(core: Core, task: TaskRecord, lost: str) -> str:
    model = core.models.get(task.name)
    if task.section != "steps" or task.status != "ACTIVE" or task.stopping or task.outcome or task.again:
        return "ending"
    if model is None or task.system_agent or not model.preemptible:
        return "not_preemptible"
    if any(_by_a_person(cause) for cause in task.held if not (lost and cause.endswith(f":{lost}"))):
        return "held"
    mine = [a for a in core.state.agents.values() if not a.human and (a.task == task.id or a.id == lost)]
    if any(a.id in core.state.orders for a in mine if a.id != lost):
        return "ordered"
    if task.spent:
        return "spent"
    if any(a.payload_kg > 0 for a in mine):
        return "loaded"
    return "critical" if runs_critical(core, task) else ""


def _by_a_person(cause: str) -> bool:
    return not cause.startswith("clearance:")


def runs_critical(core: Core, task: TaskRecord) -> bool:
    """Return whether a step marked `critical`, or one inside of it, runs now."""
    model = core.models[task.name]
    running = core.state.memory.get(task.id, {})
    return any(step.critical for key in running for step in steps_around(model, key))
