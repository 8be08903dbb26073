"""The referee: judges from motion segments how near drones came, and whether rotors started near people.

Rules (docs: safety, "keeping apart"). A crash is two drones within 2 m of each other, at least one of them in the air,
counted once per time they come so near; of two on the ground, at least one
of which drives, 0.5 m. A low flight is a cruise below 2 m. An unsafe start is a rotor start within 5 m
of a person without a clearance that is at most 60 s old. The closest pass is of two drones that both fly; besides there is
that of two that cruise or hover, as one that takes off or lands keeps half the separation only.

It gets every segment as a `Recorder` (from `world.SimFleet`, or read from ledgers), and computes the closest approach
of segments, never of samples. Memory stays small: what is judged is forgotten but for its verdict. With many drones ask for
the verdict now and then: only pairs that come near each other meanwhile are looked at closely.
"""

import math
from itertools import combinations
from typing import Final

from msgspec import Struct

from agents_sim.motion import ON_GROUND, Approach, MotionKind, Segment, closest_approach, linear_spans
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, distance_m, horizontal_m, mm
from formiga_bt.transport.messages import Clearance

CRASH_M: Final = 2.0
BUMP_M: Final = 0.5
"""Two machines on the ground that are nearer than this have touched."""
LOW_M: Final = 2.0
ROTOR_M: Final = 5.0
CLEARANCE_LASTS_US: Final[Micros] = 60 * SECOND

LEVEL: Final = frozenset[MotionKind]({"cruise", "hover"})
"""What is neither a take-off nor a landing."""

CLOCK_SKEW_US: Final[Micros] = 2 * SECOND
"""An agent extrapolates engine time between heartbeats: its stamp of a start may lie this much before the word."""


class Crash(Struct, frozen=True):
    """Two machines came too near: when they were nearest while it lasted, and how near."""

    a: str
    b: str
    at: Micros
    distance_m: float


class Pass(Struct, frozen=True):
    """The nearest that two flying drones came to each other."""

    a: str
    b: str
    at: Micros
    distance_m: float


class UnsafeStart(Struct, frozen=True):
    """Rotors started near a person who had not said that people stand clear."""

    agent: str
    person: str
    at: Micros
    distance_m: float


class LowFlight(Struct, frozen=True):
    """A drone cruised lower than 2 m."""

    agent: str
    at: Micros
    up_m: float


class Verdict(Struct, frozen=True):
    """What the referee has found so far."""

    crashes: tuple[Crash, ...]
    unsafe_starts: tuple[UnsafeStart, ...]
    low_flights: tuple[LowFlight, ...]
    closest_pass: Pass | None
    closest_cruise: Pass | None = None
    """Of two neither of which climbs or descends: a take-off or landing keeps less."""

    @property
    def is_clean(self) -> bool:
        """Return whether nothing happened that must not happen."""
        return not (self.crashes or self.unsafe_starts or self.low_flights)


class _Motion(Struct, frozen=True):
    """A segment in force from `since` to `until` (None: until told otherwise)."""

    segment: Segment
    kind: MotionKind
    since: Micros
    until: Micros | None = None


class Referee:
    """Judges the motion of all drones of one world. Feed it as a `Recorder`; ask `verdict(now)` at any time."""

    def __init__(self, *, crash_m: float = CRASH_M, rotor_m: float = ROTOR_M) -> None:
        self._crash_m = crash_m
        self._rotor_m = rotor_m
        self._tracks: dict[str, list[_Motion]] = {}
        self._people: dict[str, Place] = {}
        self._judged: Micros | None = None
        self._touching: dict[tuple[str, str], int] = {}
        self._crashes: list[Crash] = []
        self._starts: list[UnsafeStart] = []
        self._low: list[LowFlight] = []
        self._closest: Pass | None = None
        self._cruise: Pass | None = None

    # A Recorder.

    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        """Take note: from `segment.t0` on the drone moves so. What it did before is cut there. Repeating it is harmless."""
        track = self._tracks.setdefault(agent, [])
        if track and (track[-1].segment, track[-1].kind) == (segment, kind):
            return
        while track and track[-1].since >= segment.t0:
            track.pop()
        if track:
            last = track[-1]
            track[-1] = _Motion(last.segment, last.kind, last.since, segment.t0)
        track.append(_Motion(segment, kind, segment.t0))
        lowest = min(segment.p0, segment.p1, key=lambda point: point.up_m)
        if kind == "cruise" and lowest.up_m < LOW_M:
            self._low.append(LowFlight(agent, segment.t0, mm(lowest.up_m)))

    def rotors_started(self, agent: str, at: Micros, place: Place, clearance: Clearance | None) -> None:
        """Judge a rotor start against where people stand now."""
        if clearance is not None and -CLOCK_SKEW_US <= at - clearance.at <= CLEARANCE_LASTS_US:
            return
        for person in sorted(self._people):
            distance = horizontal_m(place, self._people[person])
            if distance < self._rotor_m:
                self._starts.append(UnsafeStart(agent, person, at, mm(distance)))

    def person_at(self, person: str, at: Micros, place: Place) -> None:  # noqa: ARG002  (a Recorder's)
        """Take note of where a person stands. Told in order of time, like all else."""
        self._people[person] = place

    # The verdict.

    def verdict(self, now: Micros) -> Verdict:
        """Judge all motion up to `now` and return everything found so far."""
        self._judge(now)
        return Verdict(tuple(self._crashes), tuple(self._starts), tuple(self._low), self._closest, self._cruise)

    def statistics(self) -> dict[str, int]:
        """Return counts: drones, people, motions kept, crashes, unsafe starts, low flights."""
        return {
            "drones": len(self._tracks),
            "people": len(self._people),
            "motions": sum(len(track) for track in self._tracks.values()),
            "crashes": len(self._crashes),
            "unsafe_starts": len(self._starts),
            "low_flights": len(self._low),
        }

    def _judge(self, now: Micros) -> None:
        starts = [track[0].since for track in self._tracks.values() if track]
        if not starts:
            return
        since = min(starts) if self._judged is None else self._judged
        if now < since:
            return
        pairs = self._near_pairs(now)
        for apart in self._touching.keys() - pairs.keys():
            del self._touching[apart]
        for a, b in sorted(pairs):
            self._judge_pair(a, b, since, now)
        for track in self._tracks.values():
            # A motion that ended is judged for good.
            while len(track) > 1 and track[1].since <= now:
                track.pop(0)
        self._judged = now

    def _near_pairs(self, now: Micros) -> dict[tuple[str, str], None]:
        """Return the pairs whose boxes over ground come so near that they may matter: for a crash, or as closest pass."""
        boxes = [_Box(agent, track, now) for agent, track in self._tracks.items() if track]
        if self._closest is None or self._cruise is None:
            return {_pair(a, b): None for a, b in combinations(boxes, 2) if a.flies or b.flies}
        near_m = max(self._crash_m, self._cruise.distance_m)  # the closest of all is no farther
        boxes.sort(key=lambda box: (box.west, box.agent))
        found: dict[tuple[str, str], None] = {}
        for i, a in enumerate(boxes):
            for b in boxes[i + 1 :]:
                if b.west - a.east > near_m:
                    break
                if (a.flies or b.flies) and b.south - a.north <= near_m and a.south - b.north <= near_m:
                    found[_pair(a, b)] = None
        return found

    def _judge_pair(self, a: str, b: str, since: Micros, now: Micros) -> None:
        mine, other = self._tracks[a], self._tracks[b]
        i = j = 0
        while i < len(mine) and j < len(other):
            m, o = mine[i], other[j]
            m_end, o_end = _end(m, now), _end(o, now)
            start, end = max(m.since, o.since, since), min(m_end, o_end, now)
            if start <= end:
                self._judge_motions(a, b, m, o, start, end)
            if m_end <= o_end:
                i += 1
            else:
                j += 1

    def _judge_motions(self, a: str, b: str, m: _Motion, o: _Motion, start: Micros, end: Micros) -> None:
        if m.kind == "rest" and o.kind == "rest":
            self._touching.pop((a, b), None)
            return
        flying = (m.kind not in ON_GROUND) + (o.kind not in ON_GROUND)
        if flying == 2:
            found = closest_approach(m.segment, o.segment, start, end)
            near = Pass(a, b, found.at, mm(found.distance_m))
            self._closest = _nearer(self._closest, near)
            if m.kind in LEVEL and o.kind in LEVEL:
                self._cruise = _nearer(self._cruise, near)
        for t0, t1 in linear_spans(m.segment, o.segment, start, end):
            found = closest_approach(m.segment, o.segment, t0, t1)
            self._judge_span(a, b, found, m.segment, o.segment, t1, self._crash_m if flying else BUMP_M)

    def _judge_span(self, a: str, b: str, found: Approach, m: Segment, o: Segment, end: Micros, crash_m: float) -> None:
        """Count a crash where the pair comes near, or sharpen the one that still lasts.

        In a span of linear motion the pair is near in one stretch of time at most, so the two ends tell whether it
        goes on.
        """
        pair = (a, b)
        if found.distance_m >= crash_m:
            self._touching.pop(pair, None)
            return
        crash = Crash(a, b, found.at, mm(found.distance_m))
        index = self._touching.get(pair)
        if index is None:
            index = self._touching[pair] = len(self._crashes)
            self._crashes.append(crash)
        elif crash.distance_m < self._crashes[index].distance_m:
            self._crashes[index] = crash
        if distance_m(m.at(end), o.at(end)) >= crash_m:
            del self._touching[pair]


class _Box:
    """Where a drone is over ground in all its motions that began by `now`."""

    __slots__ = ("agent", "east", "flies", "north", "south", "west")

    def __init__(self, agent: str, track: list[_Motion], now: Micros) -> None:
        self.agent = agent
        self.flies = False
        self.west = self.south = math.inf
        self.east = self.north = -math.inf
        for motion in track:
            if motion.since > now:
                break
            self.flies = self.flies or motion.kind != "rest"
            for point in (motion.segment.p0, motion.segment.p1):
                self.west, self.east = min(self.west, point.east_m), max(self.east, point.east_m)
                self.south, self.north = min(self.south, point.north_m), max(self.north, point.north_m)


def _nearer(known: Pass | None, found: Pass) -> Pass:
    return found if known is None or found.distance_m < known.distance_m else known


def _pair(a: _Box, b: _Box) -> tuple[str, str]:
    return (a.agent, b.agent) if a.agent < b.agent else (b.agent, a.agent)


def _end(motion: _Motion, now: Micros) -> Micros:
    return now if motion.until is None else motion.until
