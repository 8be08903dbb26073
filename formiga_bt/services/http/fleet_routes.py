"""Routes about who belongs to the fleet besides the site file's agents. Thin, over `Members`."""

from urllib.parse import unquote

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.bodies import ByBody, MemberBody
from formiga_bt.services.http.crew_routes import Secret
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import speaker
from formiga_bt.services.members import Members
from formiga_bt.show.facts import FleetFact, FleetList, FleetLoaded, OrderDone


def add(routes: FactRoutes, members: Members) -> None:
    """Add the routes."""

    @routes.post("/v1/agents/{agent}/member", "agents", Deed.FLEET)
    def add_member(agent: str, body: MemberBody | None = None, formiga_secret: Secret = "") -> OrderDone:
        """Add an agent to the fleet, as if the site file listed it; in mode real an approver says so."""
        word, secret = body or MemberBody(), unquote(formiga_secret)
        return OrderDone(members.add(agent, kind=word.type, home=word.home, by=speaker(word.by), secret=secret))

    @routes.post("/v1/agents/{agent}/member/remove", "agents", Deed.FLEET)
    def remove_member(agent: str, body: ByBody | None = None, formiga_secret: Secret = "") -> OrderDone:
        """Take an agent that was added out of the fleet; in mode real an approver says so."""
        return OrderDone(members.remove(agent, by=speaker((body or ByBody()).by), secret=unquote(formiga_secret)))

    @routes.get("/v1/fleets", "agents")
    def fleets() -> FleetList:
        """List the fleets that were saved."""
        return members.fleets()

    @routes.post("/v1/fleets/{name}", "agents", Deed.FLEET)
    def save(name: str, body: ByBody | None = None) -> FleetFact:
        """Keep who belongs to the fleet now, besides the site file's agents, under a name."""
        return members.save(name, by=speaker((body or ByBody()).by))

    @routes.post("/v1/fleets/{name}/load", "agents", Deed.FLEET)
    def load(name: str, body: ByBody | None = None, formiga_secret: Secret = "") -> FleetLoaded:
        """Add every agent of a saved fleet; in mode real an approver says so."""
        return members.load(name, by=speaker((body or ByBody()).by), secret=unquote(formiga_secret))
