"""The envelope: may this machine fly this goal, and is it still within its limits now?

Called by the gate before a goal leaves (`at_gate`) and by the fleet at each status (`in_flight`). Pure: the same inputs
give the same answer, nothing is sent, nothing raised; what is not known counts as bad for tasks and as no reason against a
rescue. Limits come from `rules.rules_of`, the site's ground and zones from `airspace.Airspace`, charge from `energy`.

A rescue (safety goals and every way home) is not judged by reserve, wind and daylight. A leg of it that starts in a breach
(outside the fence, inside a no-fly region, too high, too low) is allowed when it ends no deeper in that breach, is never
deeper on the way than where it began (half a metre is forgiven), does not come back once it is out, and breaks nothing else.
"""

from collections.abc import Sequence

from msgspec import Struct

from formiga_bt.geo import Place, Position, Region
from formiga_bt.safety.airspace import Airspace, Way
from formiga_bt.safety.energy import Power
from formiga_bt.safety.rules import Rules


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


class GateFlight(Struct, frozen=True, kw_only=True):
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
    raise NotImplementedError


def at_gate(flight: GateFlight, ground: Airspace, rules: Rules) -> Breach | None:
    """Return the first limit that a goal would break, or None."""
    raise NotImplementedError


def in_flight(state: FlightState, ground: Airspace, rules: Rules) -> tuple[Breach, ...]:
    """Return all limits that a machine in the air breaks now, the gravest first (keep_out, keep_in, heights, reserve, ...)."""
    raise NotImplementedError


def safe_landing_spot(
    here: Place,
    people: Sequence[Place],
    taken: Sequence[Place],
    ground: Airspace,
    rules: Rules,
    reach_m: float,
) -> Place:
    """Return the nearest spot to land: clear of people and of other machines, legal, within reach; else `here`.

    Args:
        here: where the machine is, over ground.
        people: known people; the spot is at least `rules.people_clearance_m` from each.
        taken: ground spots of other machines; the spot is at least the site's `min_spacing_m` from each.
        ground: fence, no-fly regions and known ground.
        rules: of the machine.
        reach_m: how far it may go over ground (`energy.reach_m`).
    """
    raise NotImplementedError
