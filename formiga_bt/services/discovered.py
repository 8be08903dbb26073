"""Actions that agents announced and no catalogue has: lists and orders for the API, and what of them outlives a start.

Kept in the site's runtime folder, `discovered.jsonl`: a line for each action that tasks may use since then, never changed. A
start reads it before it reads any task.
"""

from pathlib import Path
from typing import Any

from formiga_bt.base.site_folder import DISCOVERED, read_lines
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, Learn
from formiga_bt.lang.growing import grow, read_announced
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.site.keys import APPROVERS
from formiga_bt.services.order_taker import PersonalOrders
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import CatalogueFact, DiscoveredFact, TypeFact


def lines_of(step: EngineStep) -> list[dict[str, Any]]:
    """Return the lines about actions that tasks may use since a step, or may use with more types."""
    found: list[dict[str, Any]] = []
    for change in step.changes:
        if isinstance(change, ch.DiscoveredPut) and change.discovered.known:
            one = change.discovered
            found.append(
                {"action": change.action, "types": one.types, "text": one.text, "by": one.by, "at_us": step.at}
            )
    return found


def restore(folder: Path, catalogue: Catalogue, site: Site) -> None:
    """Let a growing catalogue have what tasks could use before; where flights are real only what a person said."""
    for line in read_lines(folder / DISCOVERED):
        name, types = str(line.get("action", "")), line.get("types")
        spec, _ = read_announced(name, str(line.get("text", "")))
        if spec is not None and isinstance(types, list) and (site.mode == "simulation" or line.get("by")):
            grow(catalogue, spec, map(str, types))


class CatalogueOrders:
    """What the API says of the catalogue of a running engine, and takes.

    Args:
        orders: gives them to the running engine.
        view: the engine's read-only copy.
        site, catalogue: of the engine; the catalogue grows.
    """

    def __init__(self, orders: PersonalOrders, view: EngineView, site: Site, catalogue: Catalogue) -> None:
        self._orders = orders
        self._view = view
        self._site = site
        self._catalogue = catalogue

    def catalogue(self) -> CatalogueFact:
        """Return the types with their actions, and what agents announced besides."""
        with self._view.reading() as state:
            found = dict(state.discovered)
        types = tuple(
            TypeFact(name=kind.name, label=kind.label, mobility=kind.mobility, actions=kind.actions)
            for kind in self._catalogue.types.values()
        )
        announced = tuple(
            DiscoveredFact(
                action=name, types=one.types, agents=one.agents, by=one.by, fault=one.fault, text=one.text,
                known=name in self._catalogue.actions,
            )
            for name, one in found.items()
        )  # fmt: skip
        return CatalogueFact(types=types, discovered=announced)

    def learn(self, action: str, *, by: str = "", secret: str = "") -> str:
        """Let tasks use an action that agents announced; return what happened.

        Raises:
            Refused: nobody announced it, it cannot be used, or by nobody who may, or without their secret.
        """
        self._orders.prove(by, secret, self._site.people.get(APPROVERS, ()))
        reply = self._orders.give(Learn(action, by), action)
        with self._view.reading() as state:
            types = ", ".join(state.discovered[action].types)
        return with_keeping(f"tasks may use {action}, of {types}", reply)
