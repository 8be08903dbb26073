"""Why a machine does what it does, or nothing: who has it, which order stands on it, its task, what its goals wait for.

Pure functions over the view's copy of the state; the counterpart of `why`, which explains tasks.
"""

from collections.abc import Iterator

from formiga_bt.clock import Micros
from formiga_bt.engine.records import AgentRecord
from formiga_bt.engine.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.services.because import Because
from formiga_bt.services.going_on import HANDBACK, ways_on_of
from formiga_bt.services.standing import doing, given, lockdown_out, not_heard
from formiga_bt.services.why import goal_line
from formiga_bt.services.why_stopped import breach
from formiga_bt.services.words import not_ready

LAYS_DOWN = ("engine", "lockdown")
"""Scopes of orders that end by themselves, or with lockdown."""


def why_machine(state: EngineState, agent: AgentRecord, now: Micros, catalogue: Catalogue | None) -> list[Because]:
    """Return the chain of a machine or person, most important first."""
    lines = [*_reach(agent), *_orders(state, agent, now, catalogue)]
    if agent.breach:
        lines.append(breach(agent))
    lines += [
        goal_line(goal, now)
        for goal in state.goals.values()
        if goal.agent == agent.id and (goal.state == "gated" or goal.in_flight)
    ]
    lines += _task(state, agent)
    return lines or [
        Because("free", f"{agent.id} is free: it waits for a task that it fits", "formiga run TASK --follow")
    ]


def _reach(agent: AgentRecord) -> Iterator[Because]:
    """Tell whether it can be commanded at all."""
    if agent.refused:
        hint = "list it in site.yaml under agents, with a port as its home"
        yield Because("not_admitted", f"{agent.id} is not admitted: {agent.refused}", hint)
    if agent.liveness != "ALIVE":
        lost = agent.liveness == "LOST"
        text = f"{agent.id} {not_heard(agent)}" + ("; it counts as lost" if lost else "")
        yield Because("lost" if lost else "suspect", text, "is its process running, and connected to this engine?")
    if agent.pool == "QUARANTINED":
        back = agent.liveness == "ALIVE"
        hint = f"look at it, then: formiga agents clear {agent.id}" if back else "find it"
        yield Because("quarantined", f"{agent.id} is quarantined: {agent.quarantine}; it gets no task", hint)
    if agent.control != "engine":
        then = f"when it is given back: {HANDBACK.format(agent=agent.id)}" if agent.taken else ""
        yield Because("control", f"{agent.id} is in the hands of its {agent.control}; nothing is sent to it", then)
    elif agent.taken:
        text = f"{agent.id} was taken over and given back; nothing is sent to it until a person hands it back"
        yield Because("control", text, HANDBACK.format(agent=agent.id))


def _orders(state: EngineState, agent: AgentRecord, now: Micros, catalogue: Catalogue | None) -> Iterator[Because]:
    if state.lockdown is not None and not agent.human:
        yield Because("lockdown", lockdown_out(state).text, "formiga lockdown release")
    order = state.orders.get(agent.id)
    if order is not None:
        free = order.scope not in LAYS_DOWN
        hint = " | ".join(ways_on_of(state, agent, catalogue)) if free else ""
        yield Because(f"order.{order.stop}", f"{given(order)}: {doing(state, order, now)}", hint)


def _task(state: EngineState, agent: AgentRecord) -> Iterator[Because]:
    order = state.orders.get(agent.id)
    task = state.tasks.get(agent.task or (order.task if order is not None else ""))
    if task is not None:
        held = " HELD" if task.held else ""
        role = f" as {agent.role}" if agent.role else ""
        yield Because("task", f"it works{role} for {task.id}, which is {task.status}{held}", f"formiga why {task.id}")
    elif agent.pool == "PARKED_AWAY":
        yield Because("parked_away", f"{agent.id} stands away from its port", f"formiga return {agent.id}")
    bad = not_ready(agent.checks)
    if bad and agent.landed == "grounded":
        yield Because("preflight", f"{agent.id} is not ready to fly: {bad}", f"formiga preflight {agent.id}")
