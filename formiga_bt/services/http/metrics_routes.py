"""`GET /metrics`: figures for a monitoring system. Beyond this machine only where `formiga up --metrics` says so."""

from typing import Annotated

from fastapi import Header
from fastapi.responses import Response

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.metrics import Measured, Metrics
from formiga_bt.services.refused import Refused

OFF = "this engine is called from other machines, and shows its figures to none"


def add(routes: FactRoutes, engine: Measured, *, shown: bool) -> None:
    """Add the route.

    Args:
        routes: of the API.
        engine: whose figures are shown.
        shown: False = whoever asks is refused.
    """
    metrics = Metrics(engine)
    may = routes.guard("GET", "/metrics", Deed.METRICS)

    @routes.app.get("/metrics", tags=["engine"], response_model=None, response_class=Response, dependencies=may)
    def figures(accept: Annotated[str, Header(max_length=1000)] = "") -> Response:
        """Return the figures of the engine, in the OpenMetrics or Prometheus text format. They name no person."""
        if not shown:
            raise Refused("metrics_off", OFF, "start it with formiga up --metrics")
        text, kind = metrics.write(accept)
        return Response(text, 200, {"Content-Type": kind, "Cache-Control": "no-store"}, media_type=None)
