"""Pieces of the answers that `stops` gives: which machines an order is for, who got it, what comes next.

Pure functions over the view's copy of the state.
"""

from collections.abc import Iterable, Mapping

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.causes import HoldCause
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.services.standing import wall_us
from formiga_bt.show.facts import OrderedFact, OrderReply, SkippedFact
from formiga_bt.show.listed import listing
from formiga_bt.show.why.going_on import HANDBACK, in_the_way, stays, ways_on, ways_on_of
from formiga_bt.show.why.standing import doing


def machines(state: EngineState) -> list[AgentRecord]:
    """Return all machines, by name."""
    return sorted((a for a in state.agents.values() if not a.human), key=listing)


def held_tasks(state: EngineState) -> dict[str, tuple[HoldCause, ...]]:
    """Return the causes of each open task that is HELD."""
    return {task.id: task.hold.causes for task in state.tasks.values() if task.hold.causes and task.section != "done"}


def same_order(before: StandingOrder | None, after: StandingOrder | None) -> bool:
    """Return whether it is the same order: how far it is does not count."""
    if before is None or after is None:
        return before is after
    return (before.stop, before.scope, before.at) == (after.stop, after.scope, after.at)


def sorted_out(
    state: EngineState,
    stop: str,
    agents: Iterable[AgentRecord],
    now: Micros,
    before: Mapping[str, StandingOrder],
    *,
    at_lockdown: bool = False,
) -> tuple[list[OrderedFact], list[SkippedFact]]:
    """Return which of these machines got a stop, and which did not and why."""
    ordered, skipped = [], []
    for agent in agents:
        order = state.orders.get(agent.id)
        fresh = order is not None and (order.state == "open" or not same_order(before.get(agent.id), order))
        if order is not None and agent.liveness == "SUSPECT" and fresh and order.stop == stop:
            skipped.append(passed_over(state, agent, "suspect", doing(state, order, now, wall_us()), "formiga agents"))
        elif order is not None and (order.stop == stop or not same_order(before.get(agent.id), order)):
            other = "" if order.stop == stop else f"; `{stop}` became `{order.stop}`: it has too little charge to hover"
            ordered.append(OrderedFact(who=agent.id, text=doing(state, order, now, wall_us()) + other))
        elif order is not None:
            text = f"`{order.stop}` stands on it, which goes before: {doing(state, order, now, wall_us())}"
            skipped.append(passed_over(state, agent, "ordered", text))
        elif agent.liveness == "LOST" or agent.pool == "QUARANTINED":
            text = "is not heard of, nothing can be sent to it" if agent.liveness == "LOST" else "is quarantined"
            away = f"; if you have taken it away: formiga agents removed {agent.id}" if agent.liveness == "LOST" else ""
            hint = f"find it; when it is here again: formiga agents clear {agent.id}{away}"
            skipped.append(passed_over(state, agent, "agent_lost", f"{agent.id} {text}", hint))
        elif agent.control != "engine" or agent.taken:
            has_it = agent.control != "engine"
            who = (
                f"is in the hands of its {agent.control}" if has_it else "was taken over, and nobody has handed it back"
            )
            text = f"{agent.id} {who}" + ("; lockdown reaches it when that is done" if at_lockdown else "")
            when = f"when its {agent.control} has given it back: " if has_it else ""
            hint = when + HANDBACK.format(agent=agent.id)
            skipped.append(passed_over(state, agent, "not_in_command", text, hint))
        elif agent.landed == "grounded":
            ordered.append(OrderedFact(who=agent.id, text=f"{agent.id} stands on the ground"))
        elif at_lockdown and agent.task in state.tasks and state.tasks[agent.task].section == "recover":
            ordered.append(OrderedFact(who=agent.id, text=f"{agent.id} is on its way home with {agent.task}"))
        else:
            skipped.append(passed_over(state, agent, "not_ordered", f"{agent.id} did not get it", "formiga agents"))
    return ordered, skipped


def told_of(skipped: list[SkippedFact]) -> str:
    """Return how many machines did not get an order, or may not have got it, after the count of those that did."""
    silent = sum(one.code == "suspect" for one in skipped)
    text = f"; {silent} may not have got it" if silent else ""
    return text + (f"; {len(skipped) - silent} did not get it" if len(skipped) > silent else "")


def passed_over(state: EngineState, agent: AgentRecord, code: str, text: str, hint: str = "") -> SkippedFact:
    """Return a machine that did not get an order."""
    text = text if text.startswith(agent.id) else f"{agent.id}: {text}"
    may_fly = state.agents[agent.id].may_be_airborne
    return SkippedFact(who=agent.id, code=code, text=text, hint=hint, may_be_airborne=may_fly)


def after_stop(state: EngineState, order: str, target: str, catalogue: Catalogue | None) -> list[str]:
    """Return the commands of which a person should give one after a stop; none of them would be refused now."""
    if order == "cut":
        return ["formiga agents"]
    if not target:
        kept = [a for a in machines(state) if a.id in state.orders and not state.orders[a.id].brings_down]
        ready = [a for a in kept if in_the_way(state, a, catalogue) is None]
        first = "formiga lockdown release" if state.lockdown is not None else "formiga continue --all"
        return [first if ready or state.lockdown is not None else "formiga agents", "formiga tasks"]
    agent = state.agents.get(target)
    if agent is not None:
        return ways_on_of(state, agent, catalogue)
    return ways_on(state, state.tasks[target], catalogue) if target in state.tasks else ["formiga tasks"]


def restarted(state: EngineState, task: str, keep: Iterable[AgentRecord]) -> OrderReply:
    """Return the answer to a restart; `keep`: its machines."""
    text = f"{task} tidies up, what flies comes home, what stands stays where it is, and it begins anew from its first step"
    orders = [state.orders[agent.id] for agent in keep if agent.id in state.orders]
    kept = [
        SkippedFact(
            who=order.agent,
            code="held",
            text=f"{order.agent} is not granted to it before: `{order.stop}` was given to it by itself, and stands",
            hint=f"then: formiga continue {order.agent}",
        )
        for order in orders
        if order.scope in ("agent", "all")
    ]
    return OrderReply(
        order="restart",
        target=task,
        stands_already=False,
        text=text,
        ordered=(OrderedFact(who=task, text=text),),
        skipped=tuple(kept),
        next=(f"formiga why {task}",),
    )


def released(
    state: EngineState | None, held: list[str], text: str, catalogue: Catalogue | None = None, *, already: bool = False
) -> OrderReply:
    """Return the answer to the release of a lockdown; `held`: the tasks that wait for a word."""
    left, ways = [], []
    for task in held:
        assert state is not None
        then = ways_on(state, state.tasks[task], catalogue)
        ways.append(then)
        why = stays(state, task, catalogue)
        said = f"{task} was interrupted and waits for your word" + (f"; it cannot go on now: {why}" if why else "")
        left.append(SkippedFact(who=task, code="held", text=said, hint=then[0]))
    go_on = any(then[0].startswith("formiga continue") for then in ways)
    following = (
        ["formiga continue --all", f"formiga abort {held[0]}"] if go_on else ways[0] if ways else ["formiga tasks"]
    )
    return OrderReply(
        order="lockdown",
        target="release",
        stands_already=already,
        text=text,
        ordered=(),
        skipped=tuple(left),
        next=tuple(following),
    )


def count(number: int, noun: str) -> str:
    """Return how many there are, in words."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
