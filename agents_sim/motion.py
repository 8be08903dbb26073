"""Motion as straight segments in engine time, and the exact closest approach of two of them.

Why segments: where a drone is at any instant, and how near two drones came, is computed and never sampled; the result
is the same at every speed of the clock. Used by the drone's body, the referee and the ledger.
"""

import math
from itertools import pairwise
from typing import Any, Final, Literal, Protocol

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros, micros
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.transport.messages import Clearance, Control

MotionKind = Literal["rest", "drive", "hover", "climb", "cruise", "descend", "fall"]
"""What a machine does during a segment. At "rest" it stands, at "drive" it is on the ground; in a "fall" its rotors are off."""

ON_GROUND: Final = frozenset[MotionKind]({"rest", "drive"})

FALL_S: Final = 2.0
"""A fall takes at most this long, from any height."""
LEAST_GROUND_SPEED_M_S: Final = 0.5
"""Against a wind that it cannot make way against a drone still creeps on, so that every leg ends."""

Wind = tuple[float, float]
"""East and north, m/s: where it blows to."""
NO_WIND: Final[Wind] = (0.0, 0.0)


class Segment(Struct, frozen=True):
    """Constant velocity from `p0` at `t0` to `p1` at `t1`; it stands at `p0` before and at `p1` after."""

    t0: Micros
    p0: Position
    t1: Micros
    p1: Position

    def at(self, t: Micros) -> Position:
        """Return where it is at engine time `t`, unrounded."""
        if t >= self.t1:
            return self.p1
        if t <= self.t0:
            return self.p0
        share = (t - self.t0) / (self.t1 - self.t0)
        return Position(
            self.p0.east_m + share * (self.p1.east_m - self.p0.east_m),
            self.p0.north_m + share * (self.p1.north_m - self.p0.north_m),
            self.p0.up_m + share * (self.p1.up_m - self.p0.up_m),
        )

    def shifted(self, by: Micros) -> "Segment":
        """Return the same motion `by` microseconds later."""
        return Segment(self.t0 + by, self.p0, self.t1 + by, self.p1)


class PersonState(Struct, frozen=True, tag="person"):
    """Where a person is and the rest of their way, as kept in a file: the tracker's process may die."""

    place: Place
    walk: tuple[Place, ...] = ()


class BodyState(Struct, frozen=True, tag="drone"):
    """All that a drone's body is, as it is kept in a file while the body's process may die."""

    segment: Segment
    kind: MotionKind
    battery: float
    """Charge at `battery_at`, from where it changes by `-drain_percent_s`."""
    battery_at: Micros
    drain_percent_s: float
    home: Place | None = None
    control: Control = "engine"
    is_alone: bool = False
    """Without a link it does what its card says; it yields when it hears the engine again."""

    def found_at(self, now: Micros, died: Micros, hover_percent_s: float) -> "BodyState":
        """Return the body as found `now`: its process died at `died`, and if in the air it has hovered there since.

        Its segment begins when it died, so that whoever is told of it forgets what was to come after.
        """
        here = self.segment.at(died)
        if self.kind == "fall":
            here = self.segment.p1  # nobody holds it up
        has_landed = self.kind in ON_GROUND or (self.kind in ("descend", "fall") and here.up_m <= 0.0)
        kind: MotionKind = "rest" if has_landed else "hover"
        battery = self.battery - self.drain_percent_s * (died - self.battery_at) / SECOND
        if kind == "hover":
            battery -= hover_percent_s * (now - died) / SECOND
        battery = min(100.0, max(0.0, battery))
        return BodyState(
            Segment(died, here, died, here), kind, battery, now, 0.0, self.home, self.control, self.is_alone
        )


class Recorder(Protocol):
    """Who is told of motion: the referee, a ledger file, or nobody."""

    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        """Take note: from `segment.t0` on the drone moves so, until told otherwise."""
        ...

    def rotors_started(self, agent: str, at: Micros, place: Place, clearance: Clearance | None) -> None:
        """Take note of a rotor start, with the clearance its goal carried."""
        ...

    def person_at(self, person: str, at: Micros, place: Place) -> None:
        """Take note of where a person stands from `at` on."""
        ...


class NoRecorder:
    """Takes no notes."""

    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        """Ignore it."""

    def rotors_started(self, agent: str, at: Micros, place: Place, clearance: Clearance | None) -> None:
        """Ignore it."""

    def person_at(self, person: str, at: Micros, place: Place) -> None:
        """Ignore it."""


def leg_us(
    start: Position,
    end: Position,
    speed_m_s: float,
    climb_m_s: float,
    wind: Wind = NO_WIND,
    wanted_m_s: float | None = None,
) -> Micros:
    """Return how long a straight leg takes: as long as the slower of its horizontal and its vertical part.

    Args:
        start: where it begins.
        end: where it ends.
        speed_m_s: the drone's speed through the air: a wind along the way helps, one against it or across costs time.
        climb_m_s: its speed up or down, whatever the wind.
        wind: where it blows to.
        wanted_m_s: the speed over ground that it does not exceed.
    """
    length_m = horizontal_m(start, end)
    over_ground = ground_speed(start, end, speed_m_s, wind)
    if wanted_m_s is not None:
        over_ground = min(over_ground, wanted_m_s)
    return micros(max(length_m / over_ground, abs(end.up_m - start.up_m) / climb_m_s))


def ground_speed(start: Place | Position, end: Place | Position, speed_m_s: float, wind: Wind) -> float:
    """Return the speed over ground of a drone that flies straight from `start` to `end`, its nose turned into the wind."""
    length_m = horizontal_m(start, end)
    if length_m <= 0.0 or wind == NO_WIND:
        return speed_m_s
    east, north = (end.east_m - start.east_m) / length_m, (end.north_m - start.north_m) / length_m
    along, across = wind[0] * east + wind[1] * north, wind[0] * north - wind[1] * east
    if abs(across) >= speed_m_s:
        return LEAST_GROUND_SPEED_M_S
    return max(LEAST_GROUND_SPEED_M_S, along + math.sqrt(speed_m_s**2 - across**2))


def fall_us(height_m: float) -> Micros:
    """Return how long a fall takes: as in free fall, `FALL_S` at most."""
    return micros(min(FALL_S, math.sqrt(2.0 * max(0.0, height_m) / 9.81)))


class Approach(Struct, frozen=True):
    """The least distance of two motions in a span of time, and when it was."""

    distance_m: float
    at: Micros


def closest_approach(a: Segment, b: Segment, since: Micros, until: Micros) -> Approach:
    """Return the exact closest approach of two motions from `since` to `until` (both included)."""
    best: Approach | None = None
    for t0, t1 in linear_spans(a, b, since, until):
        gap, velocity = _relative(a, b, t0, t1)
        speed2 = _dot(velocity, velocity)
        share = min(1.0, max(0.0, -_dot(gap, velocity) / speed2)) if speed2 > 0.0 else 0.0
        at_best = [g + share * v for g, v in zip(gap, velocity, strict=True)]
        found = Approach(math.sqrt(_dot(at_best, at_best)), t0 + round(share * (t1 - t0)))
        if best is None or found.distance_m < best.distance_m:
            best = found
    assert best is not None, "a span has at least one instant"
    return best


def linear_spans(a: Segment, b: Segment, since: Micros, until: Micros) -> list[tuple[Micros, Micros]]:
    """Return `since`..`until` cut where either motion begins or ends, so that in each part both are linear."""
    assert since <= until, "a span ends before it begins"
    inner = sorted({t for t in (a.t0, a.t1, b.t0, b.t1) if since < t < until})
    cuts = [since, *inner, until]
    return list(pairwise(cuts))


def _relative(a: Segment, b: Segment, t0: Micros, t1: Micros) -> tuple[list[float], list[float]]:
    """Return the gap from a to b at `t0`, and how it changes until `t1`."""
    start, end = _gap(a.at(t0), b.at(t0)), _gap(a.at(t1), b.at(t1))
    return start, [e - s for s, e in zip(start, end, strict=True)]


def _gap(a: Position, b: Position) -> list[float]:
    return [b.east_m - a.east_m, b.north_m - a.north_m, b.up_m - a.up_m]


def _dot(u: list[float], v: list[float]) -> float:
    return sum(x * y for x, y in zip(u, v, strict=True))


class BadFieldError(ValueError):
    """A goal's field is missing or not what the action needs."""


def read_place(value: Any) -> Place:
    """Read a wire place (a wire position serves too).

    Raises:
        BadFieldError: it has no finite `east_m` and `north_m`.
    """
    return Place(_metres(value, "east_m"), _metres(value, "north_m"))


def read_position(value: Any) -> Position:
    """Read a wire position.

    Raises:
        BadFieldError: it has no finite `east_m`, `north_m` and `up_m`.
    """
    return Position(_metres(value, "east_m"), _metres(value, "north_m"), _metres(value, "up_m"))


def read_number(value: Any) -> float:
    """Read a finite number.

    Raises:
        BadFieldError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadFieldError(f"not a finite number: {value!r}")
    return float(value)


def _metres(value: Any, name: str) -> float:
    if not isinstance(value, dict) or name not in value:
        raise BadFieldError(f"no {name} in {value!r}")
    return read_number(value[name])
