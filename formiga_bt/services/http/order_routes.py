"""Routes of the orders that rank above tasks: thin, over `Stops`. `api` builds them into its app."""

from fastapi import FastAPI

from formiga_bt.services.http.urgent import in_lane
from formiga_bt.services.replies import order_models as m
from formiga_bt.services.stops import Stops


def add(app: FastAPI, stops: Stops) -> None:
    """Add the routes to an app."""

    @app.post("/v1/agents/{agent}/orders", tags=["safety"])
    @in_lane
    def order_agent(agent: str, body: m.AgentOrderBody) -> m.OrderReply:
        """Stop one machine (hold, return, land, cut), or let it go on. The same order again changes nothing."""
        return stops.agent(agent, body.order, body.by or "http", body.confirmed)

    @app.post("/v1/tasks/{task_id}/orders", tags=["safety"])
    @in_lane
    def order_task(task_id: str, body: m.TaskOrderBody) -> m.OrderReply:
        """Stop all machines of a task, let it go on, or restart it."""
        return stops.task(task_id, body.order, body.by or "http")

    @app.post("/v1/orders", tags=["safety"])
    @in_lane
    def order_all(body: m.AllOrderBody) -> m.OrderReply:
        """Stop every machine, or let all go on; the answer names those that did not get the order, and why."""
        return stops.all(body.order, body.by or "http")

    @app.post("/v1/lockdown", tags=["safety"])
    @in_lane
    def lockdown(body: m.LockdownBody | None = None) -> m.OrderReply:
        """Press lockdown (what flies does `how`; without a body it returns), or release it."""
        order = body or m.LockdownBody()
        return stops.lockdown(order.how, order.by or "http")

    @app.get("/v1/lockdown", tags=["safety"])
    def lockdown_now() -> m.LockdownOut:
        """Tell whether the site is locked down."""
        return stops.lockdown_now()

    @app.post("/v1/agents/{agent}/handback", tags=["safety"])
    def handback(agent: str, body: m.HandbackBody | None = None) -> m.OrderReply:
        """Give a machine back that its pilot had taken over, and say what becomes of the interrupted step."""
        order = body or m.HandbackBody()
        return stops.hand_back(agent, order.how, order.by or "http")

    @app.get("/v1/agents/{agent}/preflight", tags=["safety"])
    def preflight(agent: str) -> m.PreflightOut:
        """Tell whether a machine is ready to fly, check by check."""
        return stops.preflight(agent)
