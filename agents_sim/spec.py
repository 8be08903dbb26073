"""A simulated agent as plain data, and the body and card that come of it.

Used by `world.SimFleet` and by `process.AgentProcess`. Nothing here reads a clock or is random.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, get_args

from msgspec import Struct

from agents_sim.drone import Drone
from agents_sim.faults import Body
from agents_sim.finder import Sight, sees_nothing
from agents_sim.limits import DRONE_TYPES, PERSON_TYPES, TRACKED_TYPES, DroneLimits, PersonLimits
from agents_sim.motion import NO_WIND, BodyState, MotionKind, PersonState, Recorder, Segment, Wind
from agents_sim.person import Person, read_rules
from agents_sim.planning import OnLinkLoss
from formiga_bt.base.clock import Scheduler
from formiga_bt.base.geo import Frame, Place, Position
from formiga_bt.transport.messages import AgentCard


class AgentSpec(Struct, frozen=True, kw_only=True):
    """One simulated agent as plain data."""

    id: str
    type: str
    at: Place | Position = Place(0.0, 0.0)
    """Where it stands; a drone at a Position with `up_m` above 0 hovers there."""
    battery: float = 100.0
    home: Place | None = None
    limits: Mapping[str, float] = {}
    """Overrides of the type's `DroneLimits` or of `PersonLimits`, by name."""
    script: Sequence[Mapping[str, Any]] = ()
    """A person's answers, see `person.read_rules`."""
    kind: str = ""
    """`drone` or `person` for a type that is not known here; else the type says it."""
    walk: Sequence[Place] = ()
    """A person's way from `at` on, begun at once."""
    base: tuple[float, float] | None = None
    """Latitude and longitude of the base, degrees: an agent that knows it reports both of itself too."""
    wind: Wind = NO_WIND
    """East and north, m/s, where it blows to: a drone flies in it."""
    payload_kg: float = 0.0
    cut: bool = False
    """Whether a drone announces CutMotors."""
    on_link_loss: OnLinkLoss = "return"
    """What a drone does by itself without a link."""


def is_person(spec: AgentSpec) -> bool:
    """Return whether the spec is of a person.

    Raises:
        ValueError: the type is unknown and `kind` does not help.
    """
    if spec.kind in ("drone", "person"):
        return spec.kind == "person"
    if spec.type not in DRONE_TYPES and spec.type not in PERSON_TYPES:
        known = ", ".join((*DRONE_TYPES, *PERSON_TYPES))
        raise ValueError(f"unknown type {spec.type!r} of {spec.id}; known: {known} (or say kind: drone or person)")
    return spec.type in PERSON_TYPES


def drone_limits(spec: AgentSpec) -> DroneLimits:
    """Return the limits of a drone: its type's, with the spec's overrides.

    Raises:
        ValueError: an override is wrong.
    """
    return DRONE_TYPES.get(spec.type, DroneLimits()).replaced(spec.limits)


def person_limits(spec: AgentSpec) -> PersonLimits:
    """Return the limits of a person, with the spec's overrides.

    Raises:
        ValueError: an override is wrong.
    """
    return PersonLimits().replaced(spec.limits)


def check_spec(spec: AgentSpec) -> None:
    """Check what can be checked before anything starts.

    Raises:
        ValueError: the spec is wrong (type, limits, script, charge).
    """
    if is_person(spec):
        person_limits(spec)
        read_rules(spec.script)
        return
    drone_limits(spec)
    if not 0.0 <= spec.battery <= 100.0:
        raise ValueError(f"battery of {spec.id} must be 0..100, got {spec.battery!r}")
    if not 0.0 <= spec.payload_kg < math.inf:
        raise ValueError(f"payload_kg of {spec.id} must be 0 or more, got {spec.payload_kg!r}")
    if not all(math.isfinite(part) for part in spec.wind):
        raise ValueError(f"wind of {spec.id} must be two finite numbers in m/s, got {spec.wind!r}")
    if spec.on_link_loss not in get_args(OnLinkLoss):
        raise ValueError(f"on_link_loss of {spec.id} must be return, land or hold, got {spec.on_link_loss!r}")


def build_body(
    spec: AgentSpec,
    scheduler: Scheduler,
    *,
    recorder: Recorder | None = None,
    state: BodyState | PersonState | None = None,
    sight: Sight = sees_nothing,
) -> Body:
    """Return the body of an agent; `state` is how it was found, else it begins as the spec says.

    `sight` is what a picker's tracker knows of drones.

    Raises:
        ValueError: the spec is wrong (type, limits, script, charge).
    """
    check_spec(spec)
    place = spec.at if isinstance(spec.at, Place) else spec.at.ground
    frame = Frame(*spec.base) if spec.base is not None else None
    if is_person(spec):
        walk = spec.walk
        if isinstance(state, PersonState):
            place, walk = state.place, state.walk
        return Person(
            spec.id,
            scheduler,
            place,
            read_rules(spec.script),
            recorder,
            tracked=spec.type in TRACKED_TYPES,
            walk=walk,
            limits=person_limits(spec),
            sight=sight,
            frame=frame,
        )
    limits = drone_limits(spec)
    if not isinstance(state, BodyState):
        here = spec.at if isinstance(spec.at, Position) else Position(place.east_m, place.north_m, 0.0)
        now = scheduler.now()
        kind: MotionKind = "hover" if here.up_m > 0.0 else "rest"
        state = BodyState(Segment(now, here, now, here), kind, spec.battery, now, 0.0, spec.home)
    return Drone(
        spec.id, scheduler, limits, state, recorder, frame,
        wind=spec.wind, payload_kg=spec.payload_kg, can_cut=spec.cut, on_link_loss=spec.on_link_loss,
    )  # fmt: skip


def build_card(spec: AgentSpec, body: Body, boot_id: str) -> AgentCard:
    """Return what the agent announces."""
    limits = body.limits.on_card() if isinstance(body, Drone) else {}
    return AgentCard(
        id=spec.id,
        type=spec.type,
        boot_id=boot_id,
        actions=body.actions,
        mobility="people" if isinstance(body, Person) else "air",
        limits=limits,
        on_link_loss=body.on_link_loss if isinstance(body, Drone) else "hold",
    )
