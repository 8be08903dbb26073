"""Facts of fleets: agents that people added to those of the site file, and sets of them that were saved by name."""

from msgspec import Struct

from formiga_bt.base.machines import Mobility
from formiga_bt.show.facts.orders import SkippedFact


class MemberFact(Struct, frozen=True, kw_only=True):
    """An agent of a saved fleet."""

    agent: str
    type: str
    home: str = ""
    """Its own port or station."""


class FleetFact(Struct, frozen=True, kw_only=True):
    """A fleet that was saved."""

    name: str
    agents: tuple[MemberFact, ...]


class FleetList(Struct, frozen=True):
    """The fleets that were saved, by name."""

    fleets: tuple[FleetFact, ...]


class FleetLoaded(Struct, frozen=True, kw_only=True):
    """What became of the agents of a saved fleet."""

    fleet: str
    added: tuple[str, ...]
    skipped: tuple[SkippedFact, ...]
    """Who could not be added, and why."""


class TypeFact(Struct, frozen=True, kw_only=True):
    """A type of the catalogue."""

    name: str
    label: str
    mobility: Mobility
    actions: tuple[str, ...]


class DiscoveredFact(Struct, frozen=True, kw_only=True):
    """An action that agents announced and that no catalogue of the site has."""

    action: str
    types: tuple[str, ...]
    agents: tuple[str, ...]
    known: bool
    """Tasks may use it."""
    by: str = ""
    """Who said so; empty in mode simulation."""
    fault: str = ""
    """Why it cannot be used."""
    text: str = ""
    """As a catalogue writes it."""


class CatalogueFact(Struct, frozen=True, kw_only=True):
    """The types of an engine, and what agents announced besides."""

    types: tuple[TypeFact, ...]
    discovered: tuple[DiscoveredFact, ...]
