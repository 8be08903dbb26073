"""Routes of regions that people close: thin, over `ZoneDesk`. `api` builds them into its app."""

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.bodies import ByBody, ZoneBody
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import speaker
from formiga_bt.services.zones import ZoneDesk
from formiga_bt.show.facts import OrderDone, ZoneList


def add(routes: FactRoutes, zones: ZoneDesk) -> None:
    """Add the routes."""

    @routes.get("/v1/zones", "safety")
    def list_zones() -> ZoneList:
        """List what people closed for machines."""
        return zones.all()

    @routes.post("/v1/zones/{zone}/close", "safety", Deed.ZONES)
    def close(zone: str, body: ZoneBody) -> OrderDone:
        """Close a region of the site, or 30 m around a place: no machine enters it, what is in it leaves."""
        return zones.close(zone, body.reason, speaker(body.by))

    @routes.post("/v1/zones/{zone}/open", "safety", Deed.ZONES)
    def open_again(zone: str, body: ByBody | None = None) -> OrderDone:
        """Open what was closed."""
        return zones.open(zone, speaker((body or ByBody()).by))
