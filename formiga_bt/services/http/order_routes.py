"""Routes of the orders that rank above tasks: thin, over `Stops`. `api` builds them into its app."""

from formiga_bt.services.http import bodies as b
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.stops import Stops
from formiga_bt.show.facts import LockdownFact, OrderReply, PreflightFact


def add(routes: FactRoutes, stops: Stops) -> None:
    """Add the routes."""

    @routes.post("/v1/agents/{agent}/orders", "safety")
    def order_agent(agent: str, body: b.AgentOrderBody) -> OrderReply:
        """Stop one machine (hold, return, land, cut), or let it go on. The same order again changes nothing."""
        return stops.agent(agent, body.order, body.by or "http", body.confirmed)

    @routes.post("/v1/tasks/{task_id}/orders", "safety")
    def order_task(task_id: str, body: b.TaskOrderBody) -> OrderReply:
        """Stop all machines of a task, let it go on, or restart it."""
        return stops.task(task_id, body.order, body.by or "http")

    @routes.post("/v1/orders", "safety")
    def order_all(body: b.AllOrderBody) -> OrderReply:
        """Stop every machine, or let all go on; the answer names those that did not get the order, and why."""
        return stops.all(body.order, body.by or "http")

    @routes.post("/v1/lockdown", "safety")
    def lockdown(body: b.LockdownBody | None = None) -> OrderReply:
        """Press lockdown (what flies does `how`; without a body it returns), or release it."""
        order = body or b.LockdownBody()
        return stops.lockdown(order.how, order.by or "http")

    @routes.get("/v1/lockdown", "safety")
    def lockdown_now() -> LockdownFact:
        """Tell whether the site is locked down."""
        return stops.lockdown_now()

    @routes.post("/v1/agents/{agent}/handback", "safety")
    def handback(agent: str, body: b.HandbackBody | None = None) -> OrderReply:
        """Give a machine back that its pilot had taken over, and say what becomes of the interrupted step."""
        order = body or b.HandbackBody()
        return stops.hand_back(agent, order.how, order.by or "http")

    @routes.get("/v1/agents/{agent}/preflight", "safety")
    def preflight(agent: str) -> PreflightFact:
        """Tell whether a machine is ready to fly, check by check."""
        return stops.preflight(agent)
