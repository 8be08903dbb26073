"""Whether what was stopped may go on: asked before a `continue` by the engine, and by whatever proposes one to people.

Pure functions over the state; `action` is how an action is looked up by its name.
"""

from collections.abc import Iterable
from math import ceil

from formiga_bt.base.geo import horizontal_m
from formiga_bt.engine.goals.climbing import Lookup, climb, is_up, top_m
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import PortDue
from formiga_bt.safety.gate import AT_PORT_M
from formiga_bt.safety.traffic import VERTICAL_M


def waiting(state: EngineState, agent: AgentRecord) -> list[GoalRecord]:
    """Return the goals of a machine that wait at the gate or for a person's word, or will as soon as it has stopped."""
    mine = (g for g in state.goals.values() if g.agent == agent.id and g.task)
    return [g for g in mine if g.state in ("interrupted", "gated") or g.stopping]


def is_done(goal: GoalRecord, agent: AgentRecord, action: Lookup) -> bool:
    """Return whether what an interrupted goal was for is so already: it is up there, or stands where it was to land."""
    spec = action(goal.rest_of or goal.action)
    if goal.state != "interrupted" or not spec.effect or agent.landed != spec.effect:
        return False
    top = top_m(goal, action)
    if top is not None:
        return is_up(agent, top)
    target = goal.fields.get(spec.moves_to)
    if target is None:
        return not spec.moves_to
    return agent.position is not None and horizontal_m(agent.position, target) <= AT_PORT_M


def climbs_to_m(goal: GoalRecord, agent: AgentRecord, action: Lookup) -> float | None:
    """Return how high a machine climbs when its take-off, broken off on the way up, goes on; None if that is not so."""
    begun = goal.state != "gated" or bool(goal.rest_of)
    if not begun or agent.landed != "airborne":
        return None
    top = top_m(goal, action)
    return None if top is None or is_up(agent, top) else top


def cannot(state: EngineState, goal: GoalRecord, agent: AgentRecord, action: Lookup) -> str:
    """Return why a goal cannot be sent anew, or an empty text."""
    if is_done(goal, agent, action):
        return ""
    name = goal.rest_of or goal.action
    spec = action(name)
    if goal.state != "gated" and not spec.repeatable:
        return f"{name} of {agent.id} may not be done a second time"
    top = climbs_to_m(goal, agent, action)
    if top is not None:
        return "" if climb(agent, top, action) is not None else _stays_low(name, agent, top)
    if goal.stopping or (goal.rest_of and agent.landed == "airborne"):
        return ""  # where it stops is not known yet; or it is up by now
    if spec.requires and agent.landed != spec.requires:
        return f"{name} needs {agent.id} {spec.requires}, it is {agent.landed}"
    target = goal.fields.get(spec.moves_to)
    if not spec.lands or target is None or agent.position is None or PortDue(goal.id) in state.deadlines:
        return ""  # of those that wait for their port, the engine brings them back above it
    away = horizontal_m(agent.position, target)
    return f"{name} needs {agent.id} within {VERTICAL_M:g} m, it is {ceil(away)} m away" if away > VERTICAL_M else ""


def _stays_low(name: str, agent: AgentRecord, top: float) -> str:
    if agent.position is None:
        return f"{name} of {agent.id} was broken off in the air, and it is not known where it is"
    up = agent.position.up_m
    return f"{name} of {agent.id} was broken off {up:.0f} m up, and it has no action that climbs on to {top:.0f} m"


def came_down(state: EngineState, agent: AgentRecord) -> bool:
    """Return whether a machine came down while the engine was away, in mid-task: its next step may need it in the air."""
    task = state.tasks.get(agent.task)
    found = task.hold.found.get(agent.id) if task is not None and task.section == "steps" else None
    return found is not None and found.flew and agent.landed == "grounded"


def way_on(state: EngineState, record: TaskRecord, machines: Iterable[AgentRecord], action: Lookup) -> str:
    """Return the command by which a person lets a HELD task go on; `formiga why` where none would be taken now."""
    task = record.id
    for agent in machines:
        if agent.control == "engine" and agent.taken:
            return f"formiga handback {agent.id} --continue|--return|--end"
        problem = obstacle(state, agent, action, steps=not record.system.agent)
        if problem is not None and problem[0] == "rebooted":
            return f"formiga agents clear {agent.id}"
        if problem is not None and problem[0] == "cannot_continue":
            return f"formiga restart {task} or formiga abort {task}"
        if problem is not None or agent.control != "engine":
            return f"formiga why {task}"
        if came_down(state, agent):
            return f"formiga restart {task} or formiga abort {task}"
    return f"formiga continue {task}"


def obstacle(state: EngineState, agent: AgentRecord, action: Lookup, *, steps: bool = True) -> tuple[str, str] | None:
    """Return (code, text) of why a machine under our command cannot go on now, or None.

    `steps=False`: only the order on it goes on; the steps of its task stay interrupted, whether they can be continued or not.
    """
    order = state.orders.get(agent.id)
    carrier = state.tasks.get(order.task) if order is not None else None
    if order is not None and order.stop == "cut" and order.state != "failed":
        return "cut", f"the motors of {agent.id} were ordered to be cut"
    moves = agent.landed != "grounded" or agent.mobility == "ground"
    if order is not None and carrier is not None and carrier.section != "done" and moves:
        return (
            "order_under_way",
            f"{agent.id} is on its way ({order.stop}); let it end, or formiga hold {agent.id} first",
        )
    if agent.rebooted and agent.seq >= 0:  # else it has announced itself only, and may fly
        return "rebooted", f"{agent.id} was started anew; look at it, then: formiga agents clear {agent.id}"
    for goal in waiting(state, agent):
        text = cannot(state, goal, agent, action) if steps and goal.section == "steps" else ""
        if text:
            way_out = f"formiga restart {goal.task} begins anew, formiga abort {goal.task} ends it"
            return "cannot_continue", f"{text}; {way_out}"
    return None
