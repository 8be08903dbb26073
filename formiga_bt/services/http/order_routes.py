"""Routes of the orders that rank above tasks, and of agents given by hand: thin, over `Stops` and `HandDesk`."""

from typing import Final

from formiga_bt.base.roles import Deed
from formiga_bt.services.by_hand import HandDesk
from formiga_bt.services.http import bodies as b
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import require, speaker
from formiga_bt.services.stops import Stops
from formiga_bt.show.facts import AssignedFact, LockdownFact, OrderDone, OrderReply, PreflightFact

STOPS: Final = frozenset({"hold", "return", "land"})


def add(routes: FactRoutes, stops: Stops, by_hand: HandDesk) -> None:
    """Add the routes."""

    @routes.post("/v1/agents/{agent}/orders", "safety", Deed.STOP)
    def order_agent(agent: str, body: b.AgentOrderBody) -> OrderReply:
        """Stop one machine (hold, return, land, cut), or let it go on. The same order again changes nothing."""
        _may(body.order)
        return stops.agent(agent, body.order, speaker(body.by), body.confirmed)

    @routes.post("/v1/tasks/{task_id}/orders", "safety", Deed.STOP)
    def order_task(task_id: str, body: b.TaskOrderBody) -> OrderReply:
        """Stop all machines of a task, let it go on, or restart it."""
        _may(body.order)
        return stops.task(task_id, body.order, speaker(body.by))

    @routes.post("/v1/orders", "safety", Deed.STOP)
    def order_all(body: b.AllOrderBody) -> OrderReply:
        """Stop every machine, or let all go on; the answer names those that did not get the order, and why."""
        _may(body.order)
        return stops.all(body.order, speaker(body.by))

    @routes.post("/v1/lockdown", "safety", Deed.LOCKDOWN)
    def lockdown(body: b.LockdownBody | None = None) -> OrderReply:
        """Press lockdown (what flies does `how`; without a body it returns), or release it."""
        order = body or b.LockdownBody()
        if order.how == "release":
            require(Deed.RELEASE)
        return stops.lockdown(order.how, speaker(order.by))

    @routes.get("/v1/lockdown", "safety")
    def lockdown_now() -> LockdownFact:
        """Tell whether the site is locked down."""
        return stops.lockdown_now()

    @routes.post("/v1/agents/{agent}/handback", "safety", Deed.HANDBACK)
    def handback(agent: str, body: b.HandbackBody | None = None) -> OrderReply:
        """Give a machine back that its pilot had taken over, and say what becomes of the interrupted step."""
        order = body or b.HandbackBody()
        return stops.hand_back(agent, order.how, speaker(order.by))

    @routes.post("/v1/tasks/{task_id}/assign", "tasks", Deed.ASSIGN)
    def assign(task_id: str, body: b.AssignBody) -> AssignedFact:
        """Give an agent to a task that waits for agents, through every filter of the allocator."""
        return by_hand.assign(task_id, body.agent, body.role, speaker(body.by))

    @routes.post("/v1/agents/{agent}/unassign", "agents", Deed.ASSIGN)
    def unassign(agent: str, body: b.ByBody | None = None) -> AssignedFact:
        """Take an agent back: what flies comes home, and its task begins anew without it."""
        return by_hand.unassign(agent, speaker((body or b.ByBody()).by))

    @routes.post("/v1/agents/{agent}/out", "agents", Deed.OUT)
    def out(agent: str, body: b.OutBody) -> OrderDone:
        """Take a machine out of service: it ends what it does, then no task is granted it."""
        return by_hand.out(agent, body.reason, speaker(body.by))

    @routes.post("/v1/agents/{agent}/in", "agents", Deed.OUT)
    def back(agent: str, body: b.ByBody | None = None) -> OrderDone:
        """Take a machine back into service."""
        return by_hand.back(agent, speaker((body or b.ByBody()).by))

    @routes.post("/v1/tasks/{task_id}/priority", "tasks", Deed.PRIORITY)
    def prioritize(task_id: str, body: b.PriorityBody) -> OrderDone:
        """Give a task that waits another priority, or the first place in it."""
        return by_hand.prioritize(task_id, body.priority, first=body.first, by=speaker(body.by))

    @routes.get("/v1/agents/{agent}/preflight", "safety")
    def preflight(agent: str) -> PreflightFact:
        """Tell whether a machine is ready to fly, check by check."""
        return stops.preflight(agent)


def _may(order: str) -> None:
    """Look at what an order is: a stop is not what lets go on, nor what cuts the motors."""
    if order not in STOPS:
        require(Deed.CUT if order == "cut" else Deed.CONTINUE)
