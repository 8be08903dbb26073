"""Facts of standing orders and lockdown; their words are in `show.why.standing`."""

from formiga_bt.base.clock import Micros, passed_us
from formiga_bt.engine.kernel.records import StandingOrder
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.show.facts import LockdownFact, OrderFact
from formiga_bt.show.why.going_on import ways_on_of
from formiga_bt.show.why.standing import doing, lockdown_text, stands


def wall_us() -> Micros:
    """Return now on the clock in which the silence of agents is counted."""
    return passed_us()


def order_fact(state: EngineState, order: StandingOrder, now: Micros, catalogue: Catalogue | None = None) -> OrderFact:
    """Return an order that stands."""
    agent = state.agents.get(order.agent)
    return OrderFact(
        agent=order.agent,
        stop=order.stop,
        by=order.by,
        scope=order.scope,
        why=order.why,
        state=order.state,
        task=order.task,
        since=order.at,
        text=doing(state, order, now, wall_us()),
        note=stands(state, order, now, wall_us()),
        next=tuple(ways_on_of(state, agent, catalogue)) if agent is not None else (),
    )


def lockdown_fact(state: EngineState, now: Micros) -> LockdownFact:
    """Return how lockdown stands at engine time `now`."""
    found = state.lockdown
    if found is None:
        return LockdownFact(on=False)
    return LockdownFact(on=True, how=found.how, by=found.by, since=found.at, text=lockdown_text(found, now))
