"""Standing orders and lockdown as the API shows them; their words are in `show.why.standing`."""

from formiga_bt.base.clock import Micros, passed_us
from formiga_bt.engine.kernel.records import StandingOrder
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.services.replies.order_models import LockdownOut, StandingOrderOut
from formiga_bt.show.why.standing import doing, lockdown_text, stands


def wall_us() -> Micros:
    """Return now on the clock in which the silence of agents is counted."""
    return passed_us()


def standing_out(state: EngineState, order: StandingOrder, now: Micros) -> StandingOrderOut:
    """Return an order as the API shows it."""
    return StandingOrderOut(
        agent=order.agent,
        stop=order.stop,
        by=order.by,
        scope=order.scope,
        why=order.why,
        state=order.state,
        task=order.task,
        unix_millis_at=order.at // 1000,
        since_s=max(0, now - order.at) / 1e6,
        text=doing(state, order, now, wall_us()),
        note=stands(state, order, now, wall_us()),
    )


def lockdown_out(state: EngineState, now: Micros) -> LockdownOut:
    """Return how lockdown stands at engine time `now`."""
    found = state.lockdown
    if found is None:
        return LockdownOut(on=False, how="", by="", unix_millis_at=None, text="")
    text = lockdown_text(found, now)
    return LockdownOut(on=True, how=found.how, by=found.by, unix_millis_at=found.at // 1000, text=text)
