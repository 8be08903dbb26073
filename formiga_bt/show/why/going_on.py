"""How a stopped task or machine goes on: the commands that would not be refused now, and why it stays as it is.

Pure functions over a state. They ask what the engine itself asks (`engine.orders.continuing`).
"""

from collections.abc import Iterator

from formiga_bt.engine.kernel.causes import ResumeHold
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.orders.continuing import came_down, obstacle
from formiga_bt.lang.model import Catalogue
from formiga_bt.show.listed import listing

HANDBACK = "formiga handback {agent} --continue|--return|--end"
CLEAR = "formiga agents clear {agent}"


def machines_of(state: EngineState, task_id: str) -> list[AgentRecord]:
    """Return the machines of a task and of those that it requested and that end with it; none if it is unknown."""
    tasks = list(_family(state, task_id))
    ids = {agent for task in tasks for group in task.agents.roles.values() for agent in group} | {
        t.system.agent for t in tasks
    }
    return sorted((a for a in state.agents.values() if not a.human and a.id in ids), key=listing)


def _family(state: EngineState, task_id: str) -> Iterator[TaskRecord]:
    """Iterate over what `records.family` names, as far as it is kept: a copy of the state forgets tasks that ended."""
    task = state.tasks.get(task_id)
    if task is None:
        return
    yield task
    for child in task.family.children:
        if child in state.tasks and state.tasks[child].attached:
            yield from _family(state, child)


def in_the_way(
    state: EngineState, agent: AgentRecord, catalogue: Catalogue | None, *, steps: bool = True
) -> tuple[str, str] | None:
    """Return (code, text) of why `continue` of a machine would be refused or soon be, or None.

    `steps=False`: of what carries out the order on it, whatever becomes of the steps of its task.
    """
    if agent.control != "engine":
        return "not_in_command", f"{agent.id} is in the hands of its {agent.control}"
    if agent.taken:
        return "not_in_command", f"{agent.id} was taken over, and nobody has handed it back yet"
    order = state.orders.get(agent.id)
    if order is not None and order.brings_down and agent.landed != "grounded":
        return "order_under_way", f"{agent.id} is on its way ({order.stop})"
    if catalogue is None:
        return None
    problem = obstacle(state, agent, lambda name: catalogue.actions[name], steps=steps)
    return None if problem is None else (problem[0], problem[1].partition("; formiga")[0])


def stays(state: EngineState, task_id: str, catalogue: Catalogue | None) -> str:
    """Return why a task cannot be continued now, or an empty text."""
    if state.lockdown is not None:
        return "the site is locked down"
    task = state.tasks.get(task_id)
    steps = task is None or not task.system.agent
    found = [in_the_way(state, agent, catalogue, steps=steps) for agent in machines_of(state, task_id)]
    return "; ".join(problem[1] for problem in found if problem is not None)


def ways_on(state: EngineState, task: TaskRecord, catalogue: Catalogue | None) -> list[str]:
    """Return the commands that a person may give for a stopped task, none of which would be refused now."""
    if state.lockdown is not None:
        return ["formiga lockdown release"]
    if (task.section != "steps" and ResumeHold() not in task.hold.causes) or task.ending.stopping:
        return [f"formiga why {task.id}"]
    system = bool(task.system.agent)  # only another order ends what carries out an order
    end = [] if system else [f"formiga abort {task.id}"]
    machines = machines_of(state, task.id)
    for agent in machines:
        problem = in_the_way(state, agent, catalogue, steps=not system)
        match problem[0] if problem is not None else "":
            case "":
                continue
            case "not_in_command" if agent.control == "engine":
                return [HANDBACK.format(agent=agent.id), *end]
            case "cannot_continue":
                return [f"formiga restart {task.id}", *end]
            case "rebooted":
                return [CLEAR.format(agent=agent.id), *end]
            case _:  # first it must come to its end, or be given back
                return [f"formiga why {task.id}", *end]
    if task.section == "steps" and any(came_down(state, agent) for agent in machines):
        return [f"formiga restart {task.id}", *end]  # `continue` is not refused, but its next step may be
    return [f"formiga continue {task.id}", *end]


def ways_on_of(state: EngineState, agent: AgentRecord, catalogue: Catalogue | None) -> list[str]:
    """Return the commands that a person may give for a stopped machine, none of which would be refused now."""
    task = state.tasks.get(agent.task)
    if task is not None and not task.system.agent:
        return ways_on(state, task, catalogue)
    if state.lockdown is not None:
        return ["formiga lockdown release"]
    problem = in_the_way(state, agent, catalogue)
    if problem is not None and problem[0] == "rebooted":
        return [CLEAR.format(agent=agent.id)]
    return ["formiga agents"] if problem is not None else [f"formiga continue {agent.id}"]
