"""Standing rules for callers: the list, and a person's word on what waits for them."""

from collections.abc import Callable
from typing import Literal

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.inputs import Input, RuleOrder
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.lang.model import Site
from formiga_bt.safety.approval import rules_digest
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import OrderDone, RuleList
from formiga_bt.show.history.rules import rule_fact


class RuleDesk:
    """What people ask of rules, and say to them.

    Args:
        ask: hands an input to the engine and returns its reply; raises `Refused`.
        view: the copy of the engine's state.
        site: what the engine was made of.
        now: the engine time.
    """

    def __init__(
        self, ask: Callable[[Input], Accepted | Done], view: EngineView, site: Site, now: Callable[[], Micros]
    ) -> None:
        self._ask = ask
        self._view = view
        self._site = site
        self._now = now

    def all(self) -> RuleList:
        """Return the rules of the site, in the order of its files."""
        with self._view.reading() as state:
            approved = self._site.mode != "real" or rules_digest(self._site) in state.approvals
            known = [state.rules[name] for name in self._site.rules if name in state.rules]
            return RuleList(self._now(), tuple(rule_fact(state, one, approved=approved) for one in known))

    def say(self, rule: str, do: Literal["start", "dismiss"], agent: str = "", by: str = "") -> OrderDone:
        """Start what waits for a person, or dismiss it; return what happened.

        Raises:
            Refused: `unknown_rule`, `not_waiting`, or why its task cannot start now either.
        """
        reply = self._ask(RuleOrder(rule, do, agent, by))
        self._view.catch_up()
        if isinstance(reply, Accepted):
            return OrderDone(f"{reply.task} was requested for rule:{rule}")
        return OrderDone(with_keeping(f"what waited of rule:{rule} is dismissed", reply))
