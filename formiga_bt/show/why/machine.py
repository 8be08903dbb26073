"""Why a machine does what it does, or nothing: who has it, which order stands on it, its task, what its goals wait for.

Pure functions over a state; the counterpart of `why`, which explains tasks.
"""

from collections.abc import Iterator

from formiga_bt.base.asking import CONFIRM
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.show.facts import Because
from formiga_bt.show.why.follow import behind_gate, behind_task
from formiga_bt.show.why.goals import goal_line, question_line
from formiga_bt.show.why.going_on import HANDBACK, ways_on_of
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.standing import doing, given, lockdown_text, not_heard
from formiga_bt.show.why.stopped import breach
from formiga_bt.show.why.words import VERDICT_HINTS, not_ready, quarantine_hint

LAYS_DOWN = ("engine", "lockdown")
"""Scopes of orders that end by themselves, or with lockdown."""


def why_machine(scene: WhyScene, agent: AgentRecord) -> list[Because]:
    """Return the chain of a machine or person, most important first."""
    state = scene.state
    lines = [*_reach(agent, scene), *_orders(scene, agent)]
    if agent.breach:
        lines.append(breach(agent))
    if agent.human:
        mine = [q for q in state.questions.values() if q.reply is None and agent.id in q.asked]
        lines += [question_line(scene, q, name_task=True) for q in sorted(mine, key=lambda q: q.order)]
    for goal in state.goals.values():
        if goal.agent == agent.id and goal.action != CONFIRM and (goal.state == "gated" or goal.in_flight):
            lines += [goal_line(scene, goal), *deeper(behind_gate(scene, goal))]
    told = {line.text for line in lines if line.code == "question"}
    lines += [line for line in _task(scene, agent) if line.text not in told]
    if agent.human:
        return lines or [Because("free", f"{agent.id} is asked nothing")]
    return lines or [
        Because("free", f"{agent.id} is free: it waits for a task that it fits", "formiga run TASK --follow")
    ]


def _reach(agent: AgentRecord, scene: WhyScene) -> Iterator[Because]:
    """Tell whether it can be commanded at all."""
    if agent.refused:
        hint = f"formiga agents add {agent.id}" if agent.refused == "unlisted" else VERDICT_HINTS["not_admitted"]
        yield Because("not_admitted", f"{agent.id} is not admitted: {agent.refused}", hint)
    if agent.liveness != "ALIVE":
        lost = agent.liveness == "LOST"
        text = f"{agent.id} {not_heard(agent, scene.wall)}" + ("; it counts as lost" if lost else "")
        yield Because("lost" if lost else "suspect", text, "is its process running, and connected to this engine?")
    if agent.pool == "QUARANTINED":
        back = agent.liveness == "ALIVE"
        away = f"; if you have taken it away: formiga agents removed {agent.id}" if agent.liveness == "LOST" else ""
        if agent.quarantine == "removed":
            hint = f"when it is back and fit: formiga agents clear {agent.id}"
        else:
            hint = quarantine_hint(agent.id, agent.quarantine) if back else f"find it{away}"
        yield Because("quarantined", f"{agent.id} is quarantined: {agent.quarantine}; it gets no task", hint)
    if agent.control != "engine":
        then = f"when it is given back: {HANDBACK.format(agent=agent.id)}" if agent.taken else ""
        yield Because("control", f"{agent.id} is in the hands of its {agent.control}; nothing is sent to it", then)
    elif agent.rebooted and agent.pool != "QUARANTINED":
        text = f"{agent.id} was started anew and has not said since that it flies: nothing but stops is sent to it"
        yield Because(
            "rebooted", text, f"look at it, then: formiga agents clear {agent.id}; a task may be granted it, too"
        )
    elif agent.taken:
        text = f"{agent.id} was taken over and given back; nothing is sent to it until a person hands it back"
        yield Because("control", text, HANDBACK.format(agent=agent.id))


def _orders(scene: WhyScene, agent: AgentRecord) -> Iterator[Because]:
    state = scene.state
    if state.lockdown is not None and not agent.human:
        yield Because("lockdown", lockdown_text(state.lockdown, scene.now), "formiga lockdown release")
    order = state.orders.get(agent.id)
    if order is not None:
        free = order.scope not in LAYS_DOWN
        hint = " | ".join(ways_on_of(state, agent, scene.catalogue)) if free else ""
        yield Because(
            f"order.{order.stop}", f"{given(order, scene.now)}: {doing(state, order, scene.now, scene.wall)}", hint
        )


def _task(scene: WhyScene, agent: AgentRecord) -> Iterator[Because]:
    state = scene.state
    order = state.orders.get(agent.id)
    task = state.tasks.get(agent.task or (order.task if order is not None else ""))
    if task is not None:
        held = " HELD" if task.hold.causes else ""
        role = f" as {agent.role}" if agent.role else ""
        yield Because("task", f"it works{role} for {task.id}, which is {task.status}{held}", f"formiga why {task.id}")
        if not agent.goal and agent.id not in state.orders:
            yield from deeper(behind_task(scene, task))
    elif agent.pool == "PARKED_AWAY":
        yield Because("parked_away", f"{agent.id} stands away from its port", f"formiga return {agent.id}")
    bad = not_ready(agent.checks)
    if bad and agent.landed == "grounded":
        yield Because("preflight", f"{agent.id} is not ready to fly: {bad}", f"formiga preflight {agent.id}")
