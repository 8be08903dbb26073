"""Facts of fleets: agents that people added to those of the site file, and sets of them that were saved by name."""

from msgspec import Struct

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
