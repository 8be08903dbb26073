"""Routes of standing rules: thin, over `RuleDesk`. `api` builds them into its app."""

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.bodies import RuleBody
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import speaker
from formiga_bt.services.orders import ServiceOrders
from formiga_bt.show.facts import Explanation, OrderDone, RuleList


def add(routes: FactRoutes, orders: ServiceOrders) -> None:
    """Add the routes."""

    @routes.get("/v1/rules", "rules")
    def rules() -> RuleList:
        """List the standing rules: what each is on, what it started, and what waits for a person."""
        return orders.rules.all()

    @routes.get("/v1/rules/{rule}/why", "rules")
    def why(rule: str) -> Explanation:
        """Explain a rule: what waits, what it watches, and what became of what happened."""
        return orders.why_rule(rule)

    @routes.post("/v1/rules/{rule}/start", "rules", Deed.RULES)
    def start(rule: str, body: RuleBody | None = None) -> OrderDone:
        """Start the task of something that happened and waits for a person."""
        word = body or RuleBody()
        return orders.rules.say(rule, "start", word.agent, speaker(word.by))

    @routes.post("/v1/rules/{rule}/dismiss", "rules", Deed.RULES)
    def dismiss(rule: str, body: RuleBody | None = None) -> OrderDone:
        """Dismiss something that happened and waits for a person: its task does not start."""
        word = body or RuleBody()
        return orders.rules.say(rule, "dismiss", word.agent, speaker(word.by))
