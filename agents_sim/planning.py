"""What a goal means for a drone: the straight legs that it is flown in, or the code of its refusal.

The actions of the drones that ship have rules of their own here; any other is flown as the catalogue says: it `moves_to` a
place, it ends in the air or on the ground, or it lasts what is typical. Pure functions; `drone.Drone` flies what comes of them.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal

from msgspec import Struct

from agents_sim.coverage import covered
from agents_sim.kinds import Outcome, SimAction
from agents_sim.motion import BadFieldError, MotionKind, read_number, read_place, read_position
from agents_sim.sweep import sweep
from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Frame, Place, Position, horizontal_m
from formiga_bt.transport.messages import GoalRequest

CUT_MOTORS: Final = "CutMotors"
"""The action that stops the rotors wherever the drone is."""

LAND_WITHIN_M: Final = 10.0
"""LandIn is refused (`too_far`) when the place is farther than this, over ground."""
LOWEST_HOVER_M: Final = 2.0
"""A canceled take-off first rises to here; GoTo to less is refused (`too_low`)."""
SWEEP_SPACING_M: Final = 20.0
START_M: Final = 10.0
"""So high it climbs if an action says that it ends in the air, and not how high."""
EXPLORE: Final = "Explore"


OnLinkLoss = Literal["return", "land", "hold"]
"""What a drone does by itself without a link."""


class Leg(Struct, frozen=True):
    """One straight part of a flight."""

    to: Position
    kind: MotionKind
    wanted_m_s: float | None = None
    """The speed over ground that was asked for; else as fast as it can."""
    lasts_us: Micros | None = None
    """How long it lasts; None = as long as the way takes."""


class ProductFile(Struct, frozen=True):
    """A file that the result of a goal names."""

    name: str
    media_type: str
    data: bytes


class Product(Struct, frozen=True):
    """What a goal makes that ends well."""

    result: Mapping[str, Any] = {}
    """Fields of its result."""
    files: tuple[ProductFile, ...] = ()


class Flight:
    """The motion under way: for a goal, or by the drone's own failsafe (`goal_id` empty)."""

    __slots__ = ("action", "canceled", "ends", "goal_id", "leg", "legs", "outcome", "product", "started")

    def __init__(
        self, goal_id: str, action: str, legs: list[Leg], started: Micros, outcome: Outcome | None = None
    ) -> None:
        self.goal_id = goal_id
        self.action = action
        self.legs = legs
        self.leg = legs[0]
        self.started = started
        self.ends = started
        self.canceled = False
        self.outcome = outcome
        """What is to become of its goal."""
        self.product = Product()
        """What it makes, if it ends well."""


def plan(
    request: GoalRequest,
    action: SimAction,
    here: Position,
    *,
    is_airborne: bool,
    is_low: bool,
    lasts_us: Micros,
) -> list[Leg] | str:
    """Return the legs of a goal, or the code of its refusal.

    Args:
        request: the goal.
        action: what the catalogue says of it.
        here: where the drone is.
        is_airborne: whether its rotors turn.
        is_low: whether its charge is so low that it goes nowhere but down.
        lasts_us: how long it lasts if it goes nowhere.

    Raises:
        BadFieldError: a field is missing or not what the action needs.
    """
    if action.cuts:
        return [fall(here)]
    if action.requires == "grounded" and is_airborne:
        return "already_airborne"
    if action.requires == "airborne" and not is_airborne:
        return "not_airborne"
    if is_low and (action.moves_to or action.effect == "airborne") and action.effect != "grounded":
        return "battery_low"
    own = OWN.get(request.action)
    if own is not None:
        return "battery_low" if is_low and request.action == EXPLORE else own(request, here)
    return _as_said(request, action, here, is_airborne=is_airborne, lasts_us=lasts_us)


def _as_said(
    request: GoalRequest, action: SimAction, here: Position, *, is_airborne: bool, lasts_us: Micros
) -> list[Leg]:
    """Return the legs of an action of which only the catalogue is known: away, then up or down, or some time here."""
    rise: list[Leg] = []
    if not is_airborne and (action.moves_to or action.effect == "airborne"):
        up = read_number(request.fields[action.height]) if action.height in request.fields else START_M
        here = Position(here.east_m, here.north_m, max(up, LOWEST_HOVER_M))
        rise = [Leg(here, "climb")]
    to = _target(request.fields.get(action.moves_to), here) if action.moves_to else None
    way = [] if to is None else [*_rise(here), Leg(to, "cruise", speed_of(request, action.speed))]
    there = here if to is None else to
    if action.effect == "grounded" or (rise and action.effect != "airborne"):
        return [*rise, *way, Leg(Position(there.east_m, there.north_m, 0.0), "descend")]
    return [*rise, *way] or [Leg(here, "hover" if is_airborne else "rest", lasts_us=lasts_us)]


def _target(value: Any, here: Position) -> Position:
    """Return where a place or a position means; a place is gone to at the present height.

    Raises:
        BadFieldError: it is neither.
    """
    if isinstance(value, dict) and "up_m" in value:
        to = read_position(value)
        return Position(to.east_m, to.north_m, max(to.up_m, LOWEST_HOVER_M))
    place = read_place(value)
    return Position(place.east_m, place.north_m, max(here.up_m, LOWEST_HOVER_M))


def fall(here: Position) -> Leg:
    """Return the way down of a drone whose rotors stand still."""
    return Leg(Position(here.east_m, here.north_m, 0.0), "fall")


def way_down(here: Position, at: Place | None = None) -> list[Leg]:
    """Return the legs of a landing at a place (here, if none is given)."""
    at = at or here.ground
    legs = [Leg(Position(at.east_m, at.north_m, 0.0), "descend")]
    if horizontal_m(here, at) > 0.0:
        rise = _rise(here)
        legs = [*rise, Leg(Position(at.east_m, at.north_m, max(here.up_m, LOWEST_HOVER_M)), "cruise"), *legs]
    return legs


def _rise(here: Position) -> list[Leg]:
    """Return the way up to the lowest hover of a drone that is told to go elsewhere while it starts or lands."""
    if here.up_m >= LOWEST_HOVER_M:
        return []
    return [Leg(Position(here.east_m, here.north_m, LOWEST_HOVER_M), "climb")]


def way_home(here: Position, home: Place | None, height_m: float) -> list[Leg]:
    """Return the legs of a drone that comes home by itself: up to `height_m` if it is lower, over home, down."""
    if home is None:
        return way_down(here)
    up = Position(here.east_m, here.north_m, max(here.up_m, height_m, LOWEST_HOVER_M))
    rise = [Leg(up, "climb")] if up.up_m > here.up_m else []
    return [*rise, *way_down(up, home)]


def _take_off(request: GoalRequest, here: Position) -> list[Leg] | str:
    up = read_number(request.fields.get("altitude"))
    if up < LOWEST_HOVER_M:
        return "too_low"
    return [Leg(Position(here.east_m, here.north_m, up), "climb")]


def _leg(request: GoalRequest, here: Position) -> list[Leg] | str:
    to = read_position(request.fields.get("to"))
    return "too_low" if to.up_m < LOWEST_HOVER_M else [*_rise(here), Leg(to, "cruise", speed_of(request, "speed"))]


def _landing(request: GoalRequest, here: Position) -> list[Leg] | str:
    at = read_place(request.fields.get("at"))
    return "too_far" if horizontal_m(here, at) > LAND_WITHIN_M else way_down(here, at)


def _sweep(request: GoalRequest, here: Position) -> list[Leg] | str:
    corners = request.fields.get("region")
    if not isinstance(corners, list | tuple) or len(corners) < 3:
        return "bad_field"
    up = read_number(request.fields.get("altitude", here.up_m))
    if up < LOWEST_HOVER_M:
        return "too_low"
    speed = speed_of(request, "speed")
    places = sweep([read_place(corner) for corner in corners], SWEEP_SPACING_M)
    return [Leg(Position(place.east_m, place.north_m, up), "cruise", speed) for place in places]


def product(request: GoalRequest, legs: list[Leg], frame: Frame | None) -> Product:
    """Return what a goal makes that is flown as planned: of a search the share of its region that was seen, and its cells.

    Args:
        request: the goal.
        legs: its plan.
        frame: of the base; None = the drone does not know it, and writes no file for maps.
    """
    if request.action != EXPLORE:
        return Product()
    corners = [read_place(corner) for corner in request.fields["region"]]
    found = covered(corners, [leg.to.ground for leg in legs], legs[0].to.up_m)
    if frame is None:
        return Product(found.result())
    return Product(found.result(), (ProductFile("coverage.geojson", "application/geo+json", found.geojson(frame)),))


def speed_of(request: GoalRequest, field: str) -> float | None:
    """Return the speed that a goal asks for, m/s; None = as fast as it can.

    Raises:
        BadFieldError: it is no speed.
    """
    wanted = request.fields.get(field)
    if wanted is None:
        return None
    speed = read_number(wanted)
    if speed <= 0.0:
        raise BadFieldError(f"no speed: {wanted!r}")
    return speed


OWN: Final = MappingProxyType[str, Callable[[GoalRequest, Position], list[Leg] | str]](
    {"TakeOff": _take_off, "GoTo": _leg, "LandIn": _landing, EXPLORE: _sweep}
)
"""The actions of the drones that ship: how they are flown, and what is refused of them."""
