"""What people at this engine's desk tell in fields: their events (`picker.sos`, by `formiga event` or over HTTP), and forms.

Agents with a wire of their own tell their events themselves.
"""

from collections.abc import Callable, Collection, Mapping
from difflib import get_close_matches
from typing import Any

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import render
from formiga_bt.lang.model import AgentType, Catalogue, Site
from formiga_bt.lang.request.binding import bind_fields
from formiga_bt.lang.types import Type
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.transport.desk import DeskTransport
from formiga_bt.transport.messages import to_wire


class Telling:
    """Raises events for the people of this process.

    Args:
        desk: where they work.
        here: who works there.
        view: the engine's read-only copy.
        site, catalogue: what the engine was made of.
        now: engine time.
    """

    def __init__(
        self,
        desk: DeskTransport,
        here: Collection[str],
        view: EngineView,
        site: Site,
        catalogue: Catalogue,
        now: Callable[[], Micros],
    ) -> None:
        self._desk = desk
        self._here = here
        self._view = view
        self._site = site
        self._catalogue = catalogue
        self._now = now

    def tell(self, agent: str, event: str, fields: Mapping[str, str]) -> str:
        """Raise an event; return a text that says so. `fields` are texts as the language reads them.

        Raises:
            Refused: unknown or not at this desk, not admitted, no such event, or fields that do not fit it.
        """
        kind = self._kind(agent)
        types = kind.events.get(event)
        if types is None:
            near = get_close_matches(event, kind.events, n=1, cutoff=0.5)
            known = ", ".join(kind.events)
            hint = f"events: {known}" if known else "the catalogue gives events to a type under events:"
            raise Refused("unknown_event", f"{kind.name} has no event '{event}'", hint, near=near)
        values = self.read(event, types, fields)
        self._desk.report_event(agent, event, {name: to_wire(value) for name, value in values.items()})
        return f"{agent} reports {event}"

    def read(self, what: str, types: Mapping[str, Type], fields: Mapping[str, str]) -> dict[str, Any]:
        """Return the values of the fields of an event or a form, from texts as the language reads them.

        Raises:
            Refused: one is missing, unknown, or of another type; `what` says of what.
        """
        values, problems, sources = bind_fields(what, types, fields, self._site, self._now())
        if problems:
            texts = [render(problem, sources) for problem in problems]
            said = problems[0].message
            text = said if said.startswith(f"{what} ") else f"{what}: {said}"
            raise Refused("bad_fields", text, problems[0].help or "", texts)
        return values

    def _kind(self, agent: str) -> AgentType:
        with self._view.reading() as state:
            record = state.agents.get(agent)
        if record is None:
            raise Refused("unknown_agent", f"there is no agent '{agent}'", "formiga agents lists them")
        if agent not in self._here:
            who = "with their own app" if record.human else "itself"
            hint = "let people work at this engine: formiga up --desk PERSON:TYPE"
            raise Refused("not_here", f"{agent} reports events {who} and not here", hint)
        kind = self._catalogue.types.get(record.type)
        if record.refused or kind is None:
            raise Refused(
                "not_admitted", f"{agent} is not admitted: {record.refused}", "list it in site.yaml under agents"
            )
        return kind
