"""A flight as the envelope sees it: what a goal would do, where a machine is at a status, and what limit it breaks.

Made by the gate and the fleet of the engine, judged in `envelope`.
"""

from msgspec import Struct

from formiga_bt.base.energy import Power
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.traffic import Way


class Breach(Struct, frozen=True):
    """A limit that a goal would break, or that a machine breaks now."""

    name: str
    """reserve, max_height, terrain_clearance, keep_in, keep_out, wind_max, daylight_only, or position (it is unknown)."""
    text: str
    """For people: what, by how much, where."""
    value: float | None = None
    limit: float | None = None
    only_alarm: bool = False
    """A landing is finished in spite of it, and the task ends then."""

    @property
    def code(self) -> str:
        """Return the reason code."""
        return f"envelope.{self.name}"


class GateFlight(Struct, frozen=True, kw_only=True, gc=False):
    """What a goal would do, and with which machine."""

    agent: str
    here: Position | None
    """Where the machine is; None = unknown, which a task's goal that moves it does not get past."""
    grounded: bool = False
    """It stands on the ground now."""
    ways: tuple[Way, ...] = ()
    """The straight ways of the action in order, the first from `here`; see `ways_of`."""
    region: Region | None = None
    """Of an action that covers an area: all within the convex hull of it and the place it comes from must be legal."""
    region_up_m: float | None = None
    """Its height over the base's ground; None = the machine's own."""
    lands_at: Place | None = None
    """Where the action ends on the ground."""
    hover_s: float = 0.0
    """How long the action lasts besides its ways, seconds: its typical time, 0 when it only moves."""
    speed_m_s: float | None = None
    """The speed that the goal asks for; None = the machine's own."""
    spots: tuple[Place, ...] = ()
    """Further places near which it may be low: where it took off. Its home, start and landing spot count by themselves."""
    battery: float | None = None
    """Percent; None = unknown, which refuses every goal of a task for a machine with a known drain."""
    payload_kg: float = 0.0
    wind: tuple[float, float] | None = None
    """East and north, m/s, where it blows to; None = the machine cannot tell, reckoned as calm."""
    power: Power | None = None
    """What the machine uses; None = it has no drain that is known, and the reserve is not checked."""
    home: Place | None = None
    """Its own port; without one it is reckoned to land where the action ends."""
    layer_m: float | None = None
    """Its layer over the base's ground; None = the site's highest."""
    sun_up: bool | None = None
    """Whether the sun is up (`Airspace.sun_is_up`); None = unknown, which a machine with daylight_only does not get past."""
    rescue: bool = False
    """A safety goal or a goal of recover."""


class FlightState(Struct, frozen=True, kw_only=True):
    """A machine in the air at one status. Fields as in `GateFlight`."""

    agent: str
    here: Position | None
    spots: tuple[Place, ...] = ()
    """Where it took off, while it rises or is still low; home and landing spot count by themselves."""
    lands_at: Place | None = None
    """The place of the landing under way: the reserve is reckoned for landing there first."""
    descending: bool = False
    """The landing is in its last phase: reserve, wind and daylight are only alarms."""
    battery: float | None = None
    payload_kg: float = 0.0
    wind: tuple[float, float] | None = None
    power: Power | None = None
    home: Place | None = None
    layer_m: float | None = None
    sun_up: bool | None = None


def ways_of(
    here: Position | None, target: Place | Position | None, ground: Airspace, rises_to_m: float | None = None
) -> tuple[Way, ...]:
    """Return the straight ways of an action that moves a machine.

    Args:
        here: where it is; None gives the end alone.
        target: a position is flown to straight; over a place it is flown to at the present height, then straight down.
        ground: for the height of the ground at a place.
        rises_to_m: of a take-off: straight up to this height over the base's ground.
    """
    if here is not None and rises_to_m is not None:
        return ((here, Position(here.east_m, here.north_m, rises_to_m)),)
    if isinstance(target, Position):
        return ((target if here is None else here, target),)
    if not isinstance(target, Place):
        return ()
    down = Position(target.east_m, target.north_m, ground.ground_m(target))
    if here is None:
        return ((down, down),)
    over = Position(target.east_m, target.north_m, max(here.up_m, down.up_m))
    return ((over, down),) if over == here else ((here, over), (over, down))
