"""Routes about the catalogue of a running engine. Thin, over `CatalogueOrders`."""

from urllib.parse import unquote

from formiga_bt.base.roles import Deed
from formiga_bt.services.discovered import CatalogueOrders
from formiga_bt.services.http.bodies import ByBody
from formiga_bt.services.http.crew_routes import Secret
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import speaker
from formiga_bt.show.facts import CatalogueFact, OrderDone


def add(routes: FactRoutes, orders: CatalogueOrders) -> None:
    """Add the routes."""

    @routes.get("/v1/catalogue", "agents")
    def catalogue() -> CatalogueFact:
        """Return the types with their actions, and what agents announced besides."""
        return orders.catalogue()

    @routes.post("/v1/catalogue/{action}", "agents", Deed.CATALOGUE)
    def learn(action: str, body: ByBody | None = None, formiga_secret: Secret = "") -> OrderDone:
        """Let tasks use an action that agents announced and no catalogue has; in mode real an approver says so."""
        return OrderDone(orders.learn(action, by=speaker((body or ByBody()).by), secret=unquote(formiga_secret)))
