"""A simulated agent as plain data. Nothing here reads a clock or is random."""

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct

from agents_sim.kinds import Kind, Outcome
from agents_sim.motion import NO_WIND, Wind
from agents_sim.planning import OnLinkLoss
from agents_sim.shipped import DRONE, KINDS, PERSON
from formiga_bt.base.geo import Place, Position


class AgentSpec(Struct, frozen=True, kw_only=True):
    """One simulated agent as plain data."""

    id: str
    type: str
    at: Place | Position = Place(0.0, 0.0)
    """Where it stands; a drone at a Position with `up_m` above 0 hovers there."""
    battery: float = 100.0
    home: Place | None = None
    chargers: tuple[Place, ...] = ()
    """Where it charges besides its home: ports, stations."""
    limits: Mapping[str, float] = {}
    """Overrides of the limits of its type, by name: those of `DroneLimits`, `MachineLimits` or `PersonLimits`."""
    script: Sequence[Mapping[str, Any]] = ()
    """A person's answers, see `person.read_rules`."""
    does: Kind | None = None
    """What the catalogue says of its type; None = a type that ships, or one like `kind`."""
    kind: str = ""
    """`drone` or `person`, for a type that does not ship and of which nothing else is said."""
    outcomes: tuple[Outcome, ...] = ()
    """What is to become of its goals."""
    seed: int = 0
    """Of how long things last that have a typical duration."""
    walk: Sequence[Place] = ()
    """A person's way from `at` on, begun at once."""
    base: tuple[float, float] | None = None
    """Latitude and longitude of the base, degrees: an agent that knows it reports both of itself too."""
    wind: Wind = NO_WIND
    """East and north, m/s, where it blows to: a drone flies in it."""
    payload_kg: float = 0.0
    cut: bool = False
    """Whether a drone announces what cuts its motors."""
    on_link_loss: OnLinkLoss = "return"
    """What a drone does by itself without a link."""


def kind_of(spec: AgentSpec) -> Kind:
    """Return what an agent can do.

    Raises:
        ValueError: nothing says it.
    """
    if spec.does is not None:
        return spec.does
    known = KINDS.get(spec.type) or {"drone": DRONE, "person": PERSON}.get(spec.kind)
    if known is None:
        names = ", ".join(KINDS)
        raise ValueError(f"unknown type {spec.type!r} of {spec.id}; known: {names} (or say kind: drone or person)")
    return known


def is_person(spec: AgentSpec) -> bool:
    """Return whether the spec is of a person.

    Raises:
        ValueError: nothing says it.
    """
    return kind_of(spec).mobility == "people"
