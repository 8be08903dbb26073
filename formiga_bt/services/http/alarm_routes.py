"""Routes of alarms: thin, over `AlarmDesk`. `api` builds them into its app."""

from typing import Annotated

from fastapi import Query

from formiga_bt.base.roles import Deed
from formiga_bt.services.alarms import AlarmDesk
from formiga_bt.services.http.bodies import AcknowledgeBody
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import speaker
from formiga_bt.show.facts import AlarmList, OrderDone


def add(routes: FactRoutes, alarms: AlarmDesk) -> None:
    """Add the routes."""

    @routes.get("/v1/alarms", "alarms")
    def list_alarms(
        cleared: Annotated[bool, Query(description="also the newest of those that are over")] = False,
    ) -> AlarmList:
        """List the alarms that are open: those that nobody acknowledged first."""
        return alarms.all(cleared=cleared)

    @routes.post("/v1/alarms/{alarm}/ack", "alarms", Deed.ACKNOWLEDGE)
    def acknowledge(alarm: str, body: AcknowledgeBody | None = None) -> OrderDone:
        """Acknowledge an alarm: the caller takes care of it, and it is not escalated any more."""
        word = body or AcknowledgeBody()
        return alarms.acknowledge(alarm, speaker(word.by), word.note)
