"""What stands behind another task or machine: the chain goes on until something that moves, or a person.

A machine that is in the way has its own reason, and the task that keeps an agent busy has one too. Each is told in one line,
deeper than what it explains. What was met before is not told again: then they wait for each other.
"""

from collections.abc import Iterator
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.engine.kernel.causes import kind_and_agent
from formiga_bt.engine.kernel.records import GoalRecord, TaskRecord
from formiga_bt.show.facts import Because
from formiga_bt.show.lapse import cleared_machine
from formiga_bt.show.why.goals import goal_line, question_line, questions, silence_line
from formiga_bt.show.why.going_on import HANDBACK, ways_on, ways_on_of
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.standing import doing, given
from formiga_bt.show.why.waits import waits
from formiga_bt.show.why.words import HOLDS, quarantine_hint, say, span

BLOCKERS: Final = frozenset({"leg_busy", "spot_busy", "port_busy", "route_busy", "draining"})
"""Codes of the gate whose text names a machine, or a goal of one."""
LINKS: Final = 6
"""A chain is followed so far."""

Seen = tuple[str, ...]


def behind_gate(scene: WhyScene, goal: GoalRecord, seen: Seen = ()) -> Iterator[Because]:
    """Tell why what a goal waits for at the gate does not come about."""
    if goal.state == "gated" and goal.code in BLOCKERS and goal.text in scene.state.agents:
        yield from behind_machine(scene, goal.text, (*seen, goal.agent))
    elif goal.state == "gated" and goal.code == "clearance":
        yield from clearance_asked(scene, goal.agent)
    elif goal.state == "gated" and goal.code == "resource_busy":
        yield from _behind_resource(scene, goal, seen)


def _behind_resource(scene: WhyScene, goal: GoalRecord, seen: Seen) -> Iterator[Because]:
    """Tell of those that take up the resource that a way leads through."""
    for one in goal.text.partition(": ")[2].split(", "):
        if one in scene.state.agents:
            yield from behind_machine(scene, one, (*seen, goal.agent))
        elif one in scene.state.tasks:
            yield from behind_task(scene, scene.state.tasks[one], seen)


def clearance_asked(scene: WhyScene, agent_id: str) -> Iterator[Because]:
    """Tell of the question whether people stand clear of a machine."""
    for question in scene.state.questions.values():
        if question.reply is None and cleared_machine(question) == agent_id:
            yield question_line(scene, question, name_task=True)


def behind_machine(scene: WhyScene, agent_id: str, seen: Seen = ()) -> Iterator[Because]:
    """Tell why a machine is where it is: who has it, what it does, what that waits for."""
    agent = scene.state.agents.get(agent_id)
    if agent is None or len(seen) >= LINKS:
        return
    if agent_id in seen:
        text = f"{agent_id} waits in turn: they wait for each other, and one of them is asked to step aside"
        yield Because("circle", text, agent=agent_id)
        return
    if agent.liveness != "ALIVE":
        yield silence_line(scene, agent)
        return
    if agent.pool == "QUARANTINED":
        hint = quarantine_hint(agent_id, agent.quarantine)
        yield Because("quarantined", f"{agent_id} is quarantined: {agent.quarantine}", hint, agent_id)
        return
    if agent.control != "engine" or agent.taken:
        hands = f"is in the hands of its {agent.control}" if agent.control != "engine" else "was taken over"
        then = "" if agent.control != "engine" else HANDBACK.format(agent=agent_id)
        yield Because("control", f"{agent_id} {hands}", then, agent_id)
        return
    order = scene.state.orders.get(agent_id)
    if order is not None:
        text = f"{given(order, scene.now)}: {doing(scene.state, order, scene.now, scene.wall)}"
        hint = " | ".join(ways_on_of(scene.state, agent, scene.catalogue)) if order.scope != "engine" else ""
        yield Because(f"order.{order.stop}", text, hint, agent_id)
        return
    yield from _at_work(scene, agent_id, seen)


def _at_work(scene: WhyScene, agent_id: str, seen: Seen) -> Iterator[Because]:
    agent = scene.state.agents[agent_id]
    mine = [g for g in scene.state.goals.values() if g.agent == agent_id and (g.state == "gated" or g.in_flight)]
    for goal in sorted(mine, key=lambda g: not g.in_flight)[:1]:
        line = goal_line(scene, goal)
        of = f" for {goal.task}" if goal.task else ""
        yield Because(line.code, f"{line.text}{of}", agent=agent_id)
        yield from deeper(behind_gate(scene, goal, seen))
        return
    task = scene.state.tasks.get(agent.task)
    if task is not None and task.id not in seen:
        yield Because("task", f"{agent_id} is {_where(agent.landed)} and belongs to {task.id}", agent=agent_id)
        yield from deeper(behind_task(scene, task, (*seen, agent_id)))
    elif task is None:
        away = agent.pool == "PARKED_AWAY"
        hint = f"bring it home: formiga return {agent_id}" if away else ""
        yield Because("free", f"{agent_id} is {_where(agent.landed)} and has no task", hint, agent_id)


def _where(landed: str) -> str:
    return {"grounded": "on the ground", "airborne": "in the air"}.get(landed, landed)


# -- tasks -------------------------------------------------------------------------------------------------------------
def behind_task(scene: WhyScene, task: TaskRecord, seen: Seen = ()) -> Iterator[Because]:
    """Tell what an open task does or waits for, in as few lines as tell it."""
    if task.ended or task.id in seen or len(seen) >= LINKS:
        return
    seen = (*seen, task.id)
    if task.status == "PENDING":
        request = scene.state.requests.get(task.id)
        waits = "waits for agents itself" if request is None or request.is_ripe else "is not to begin yet"
        yield Because("pending", f"{task.id} {waits}", f"formiga why {task.id}")
        return
    if task.hold.causes:
        hint = " | ".join(ways_on(scene.state, task, scene.catalogue))
        for cause in task.hold.causes:
            word, agent = kind_and_agent(cause)
            text = say(HOLDS, f"{word}:" if agent and f"{word}:" in HOLDS else word, agent=agent)
            asks = list(clearance_asked(scene, agent)) if word == "clearance" else []
            yield Because(f"held.{word}", f"{task.id} is HELD: {text}", "" if asks else hint, agent)
            yield from deeper(asks)
        return
    asked = list(questions(scene, task, name_task=True))
    if asked:
        yield from asked[:1]
        return
    mine = [g for g in scene.state.goals.values() if g.task == task.id and g.action != CONFIRM]
    mine = [g for g in mine if g.state == "gated" or g.in_flight]
    if mine:
        for goal in sorted(mine, key=lambda g: (g.in_flight, g.order))[:1]:
            line = goal_line(scene, goal)
            yield Because(line.code, f"{task.id}: {line.text}{_more(len(mine) - 1)}", agent=goal.agent)
            yield from deeper(behind_gate(scene, goal, seen))
        return
    children = [scene.state.tasks[one] for one in task.family.children if one in scene.state.tasks]
    waited = [child for child in children if not child.ended and not child.family.detached]
    if waited:
        child = waited[0]
        text = f"{task.id} waits for its task {child.id}, which is {child.status}"
        yield Because("child", text, f"formiga why {child.id}")
        yield from deeper(behind_task(scene, child, seen))
        return
    yield from _idle(scene, task)


def _more(count: int) -> str:
    return (
        f"; {count} more of its machines are at work" if count > 1 else "; another of its machines too" if count else ""
    )


def _idle(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell of a task none of whose agents has a goal."""
    for request in scene.state.requests.values():
        if request.node and request.holder == task.id:
            what = ", ".join(request.units) or "more agents"
            text = f"{task.id} waits for {what} since {span(scene.now - request.at)}"
            yield Because("wants", text, f"formiga why {task.id}")
            return
    for line in waits(scene, task):
        yield Because(line.code, f"{task.id}: {line.text}", agent=line.agent)
        return
    part = "its steps" if task.section == "steps" else f"its section {task.section}"
    yield Because("section", f"{task.id} is in {part}", f"formiga why {task.id}")
