"""Whether what was stopped may go on: asked before a `continue` by the engine, and by whatever proposes one to people.

Pure functions over the state; `action` is how an action is looked up by its name.
"""

from collections.abc import Callable, Iterator

from formiga_bt.engine.records import AgentRecord, GoalRecord
from formiga_bt.engine.state import EngineState
from formiga_bt.geo import horizontal_m
from formiga_bt.lang.model import ActionSpec
from formiga_bt.safety.gate import AT_PORT_M

Lookup = Callable[[str], ActionSpec]


def waiting(state: EngineState, agent: AgentRecord) -> Iterator[GoalRecord]:
    """Iterate over the goals of a machine that wait at the gate or for a person's word."""
    return (g for g in state.goals.values() if g.agent == agent.id and g.task and g.state in ("interrupted", "gated"))


def is_done(goal: GoalRecord, agent: AgentRecord, spec: ActionSpec) -> bool:
    """Return whether what an interrupted goal was for is so already: it is in the air, or stands where it was to land."""
    if goal.state != "interrupted" or not spec.effect or agent.landed != spec.effect:
        return False
    target = goal.fields.get(spec.moves_to)
    if target is None:
        return not spec.moves_to
    return agent.position is not None and horizontal_m(agent.position, target) <= AT_PORT_M


def cannot(goal: GoalRecord, agent: AgentRecord, spec: ActionSpec) -> str:
    """Return why a goal cannot be sent anew, or an empty text."""
    if is_done(goal, agent, spec):
        return ""
    if goal.state == "interrupted" and not spec.repeatable:
        return f"{goal.action} of {agent.id} may not be done a second time"
    if spec.requires and agent.landed != spec.requires:
        return f"{goal.action} needs {agent.id} {spec.requires}, it is {agent.landed}"
    return ""


def obstacle(state: EngineState, agent: AgentRecord, action: Lookup) -> tuple[str, str] | None:
    """Return (code, text) of why a machine under our command cannot go on now, or None."""
    order = state.orders.get(agent.id)
    carrier = state.tasks.get(order.task) if order is not None else None
    if order is not None and order.stop == "cut":
        return "cut", f"the motors of {agent.id} were ordered to be cut"
    if order is not None and carrier is not None and carrier.section != "done" and agent.landed != "grounded":
        return (
            "order_under_way",
            f"{agent.id} is on its way ({order.stop}); let it end, or formiga hold {agent.id} first",
        )
    for goal in waiting(state, agent):
        text = cannot(goal, agent, action(goal.action))
        if text and goal.section == "steps":
            way_out = f"formiga restart {goal.task} begins anew, formiga abort {goal.task} ends it"
            return "cannot_continue", f"{text}; {way_out}"
    return None
