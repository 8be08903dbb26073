"""Standing orders and lockdown in plain words: what a machine does for its order, and what comes next.

Pure functions over a state. Liveness is judged in wall time: `wall` is now on the clock of `AgentRecord.heard_wall`, 0 if it
is not known.
"""

from typing import Final

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.records import AgentRecord, Lockdown, StandingOrder
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import OrderDue
from formiga_bt.show.why.words import span

STOPPED: Final = ("hold", "return", "land", "cut")
SCOPES: Final = {
    "agent": "given to {agent}",
    "task": "given to its task",
    "all": "given to all",
    "lockdown": "by lockdown",
    "engine": "by the engine itself",
}

AGAIN: Final = {
    "preempted": "it steps aside: it is being preempted",
    "agent_lost": "it lost a machine",
    "restart": "a person restarts it",
}
"""Why a task is ended to begin anew."""


def doing(state: EngineState, order: StandingOrder, now: Micros, wall: Micros = 0) -> str:
    """Return what the machine of an order does now: `hwd_1 hovers; it returns by itself in 11 min`."""
    agent = state.agents.get(order.agent)
    if agent is None:
        return f"{order.agent} is not known any more"
    waits = _out_of_reach(agent, order, wall)
    if waits:
        return f"{agent.id} {waits}"
    silent = f"{not_heard(agent, wall)}; when it was, it " if agent.liveness == "SUSPECT" else ""
    if order.state == "failed":
        return f"{agent.id} did not carry out `{order.stop}`: look at it"
    if order.stop == "cut":
        if order.state == "done":
            return f"{agent.id}: its motors are off"
        return f"{agent.id}: its motors are ordered to stop; in the air it falls"
    if agent.landed == "grounded":
        return f"{agent.id} {silent}{_on_the_ground(order, was=bool(silent))}"
    carrier = state.tasks.get(order.task)
    by = f" ({order.task})" if carrier is not None and carrier.system.agent else ""
    own = carrier is not None and not carrier.system.agent
    match order.stop:
        case "return":
            port = agent.home or "its port"
            return f"{agent.id} " + (f"is on its way home with {order.task}" if own else f"flies home to {port}{by}")
        case "land":
            return f"{agent.id} lands where it is{by}"
        case _:
            return f"{agent.id} {f'{silent}hovered' if silent else 'hovers'}; {_how_long(state, agent, now)}"


def _out_of_reach(agent: AgentRecord, order: StandingOrder, wall: Micros) -> str:
    then = f"`{order.stop}` stands for when that is done"
    if agent.control in ("pilot", "failsafe"):
        return f"is in the hands of its {agent.control}; `{order.stop}` stands for when its {agent.control} has given it back"
    if agent.taken:
        return f"was taken over and nobody has handed it back yet; {then}"
    if agent.rebooted and agent.seq >= 0 and order.state == "open" and order.stop == "return":
        return f"was started anew; `return` waits until you have looked at it: formiga agents clear {agent.id}"
    if agent.liveness == "SUSPECT" and order.state == "open":
        return (
            f"{not_heard(agent, wall)}: it may not have got `{order.stop}`, which stands for when it is heard of again"
        )
    return f"is not heard of; `{order.stop}` stands for when it is" if agent.liveness == "LOST" else ""


def not_heard(agent: AgentRecord, wall: Micros) -> str:
    """Return for how long a machine is silent, in words."""
    if not agent.heard_wall or not wall:
        return "is not heard of"
    return f"has not been heard of for {span(wall - agent.heard_wall)}"


def _on_the_ground(order: StandingOrder, *, was: bool) -> str:
    if order.stop == "return" and order.state == "open":
        return "is about to start for its port" if not order.task else f"is brought to its port ({order.task})"
    return f"{'stood' if was else 'stands'} on the ground; nothing is sent to it"


def _how_long(state: EngineState, agent: AgentRecord, now: Micros) -> str:
    at = hold_ends(state, agent.id)
    return (
        "it returns by itself before its reserve is reached"
        if at is None
        else (f"it returns by itself in {span(at - now)}")
    )


def hold_ends(state: EngineState, agent: str) -> Micros | None:
    """Return when a machine that hovers by an order flies home by itself, or None: that is not known."""
    deadline = state.deadlines.get(OrderDue(agent))
    return None if deadline is None else deadline.at


def given(order: StandingOrder, now: Micros | None = None) -> str:
    """Return who gave an order, since when it stands, and for what: `return by eve since 2 min, given to all`.

    Args:
        order: the order.
        now: engine time; None: it has just been given.
    """
    scope = SCOPES[order.scope].format(agent=order.agent)
    since = "" if now is None else f" since {span(now - order.at)}"
    if order.scope == "engine":
        return f"{order.stop} {scope}{since}" + (f" ({order.why})" if order.why else "")
    return f"{order.stop} by {order.by or 'somebody'}{since}, {scope}"


def stands(state: EngineState, order: StandingOrder, now: Micros, wall: Micros = 0) -> str:
    """Return an order as a list shows it beside its machine: `HOLD by eve since 2 min: hovers; it returns ...`."""
    by = "" if order.scope in ("engine", "lockdown") or not order.by else f" by {order.by}"
    does = doing(state, order, now, wall).removeprefix(order.agent).lstrip(": ")
    return f"{order.stop.upper()}{by} since {span(now - order.at)}: {does}"


def lockdown_text(found: Lockdown, now: Micros) -> str:
    """Return how lockdown stands: who pressed it, since when, what it keeps from starting."""
    return (
        f"LOCKDOWN ({found.how}) by {found.by or 'somebody'} since {span(now - found.at)}:"
        " nothing starts until formiga lockdown release"
    )
