"""What the simulated drones really do, seen from beside the engine: every motion, every goal that a body begins.

`Sky` stands before the referee (a `Recorder`) and before each body. It judges what no message tells: how near drones of
different tasks come, whether the true path stays inside the fence, out of closed areas and below the ceiling, whether a goal
is begun twice, and how old the word is with which rotors start. shapely judges shapes here, plain arithmetic in the product.
"""

from collections.abc import Callable
from typing import Any

import shapely
from msgspec import Struct

from agents_sim.drone import Drone
from agents_sim.motion import MotionKind, Recorder, Segment, closest_approach
from agents_sim.world import SimAgent
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Region, horizontal_m
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.transport.messages import Clearance, GoalRequest

SLACK_M = 0.05
"""Rounding: a way along the fence is inside."""
HEIGHT_SLACK_M = 0.5
AT_PORT_M = 3.0
WORD_LASTS_US: Micros = 60 * SECOND
LATE_US: Micros = 11 * SECOND
"""A goal may reach its drone so much later than it left (ten heartbeats)."""

Tell = Callable[[str, str], None]
"""Report a violation: rule, text."""


class _Motion(Struct):
    segment: Segment
    kind: MotionKind


class Sky:
    """The true motion of all drones.

    Args:
        recorder: who else is told (the referee).
        site, catalogue: limits.
        tell: takes violations.
        now: engine time.
    """

    def __init__(
        self, recorder: Recorder, site: Site, catalogue: Catalogue, tell: Tell, now: Callable[[], Micros]
    ) -> None:
        self.recorder = recorder
        self.catalogue = catalogue
        self.tell = tell
        self.now = now
        self.ports = [port.at for port in site.ports.values()]
        self.keep_m = site.separation_m / 2
        self.ceiling = site.envelope.get("max_height_m")
        self.relief_m = site.relief_m
        self.fence = _shape(site.fence).buffer(SLACK_M) if site.fence is not None else None
        self.closed = [_shape(region).buffer(-SLACK_M) for region in site.no_fly]
        self.types: dict[str, str] = {}
        self.ceilings: dict[str, float] = {}
        """task -> its own greatest height, metres"""
        self.goal: dict[str, GoalRequest] = {}
        """drone -> the goal that its body began last"""
        self.begun: dict[str, str] = {}
        self.group: dict[str, str] = {}
        """drone -> whose it is: the task, or itself; "-" = not at the engine's command, so only the referee judges it"""
        self.flight: dict[str, _Motion] = {}
        self.judged: Micros = now()
        self.near: set[tuple[str, str]] = set()
        self.closest_m = float("inf")

    # -- who is watched ----------------------------------------------------------------------------------------------
    def watch(self, agent: SimAgent) -> None:
        """Stand before a body: note each goal that it begins."""
        if not isinstance(agent.body, Drone):
            return
        name, begin = agent.spec.id, agent.front.start
        self.types[name] = agent.spec.type

        def start(request: GoalRequest) -> str:
            before = self.goal.get(name)
            self.goal[name] = request
            code = begin(request)
            if code:
                if before is None:
                    self.goal.pop(name, None)
                else:
                    self.goal[name] = before
                return code
            if request.goal_id in self.begun:
                self.tell("twice", f"{name} began {request.goal_id} a second time")
            self.begun[request.goal_id] = name
            return ""

        agent.front.start = start  # type: ignore[method-assign]

    def regroup(self, groups: dict[str, str]) -> None:
        """Take who belongs to whom from now on."""
        if groups != self.group:
            self.judge()
            self.group = groups

    # -- a Recorder ----------------------------------------------------------------------------------------------------
    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        self.recorder.moved(agent, segment, kind)
        self.judge()
        self.flight[agent] = _Motion(segment, kind)
        if kind in ("climb", "cruise", "descend"):
            self._path(agent, segment)

    def rotors_started(self, agent: str, at: Micros, place: Place, clearance: Clearance | None) -> None:
        self.recorder.rotors_started(agent, at, place, clearance)
        if any(horizontal_m(port, place) < AT_PORT_M for port in self.ports):
            return
        age = None if clearance is None else at - clearance.at
        if age is None or age > WORD_LASTS_US + LATE_US:
            told = "without a word" if age is None else f"with a word {age / SECOND:.0f} s old"
            self.tell("clearance", f"{agent} starts its rotors away from every port {told}")

    def person_at(self, person: str, at: Micros, place: Place) -> None:
        self.recorder.person_at(person, at, place)

    # -- judging -------------------------------------------------------------------------------------------------------
    def judge(self) -> None:
        """Judge how near drones came to each other since the last time."""
        since, until = self.judged, self.now()
        self.judged = until
        flying = [(name, m) for name, m in self.flight.items() if m.kind != "rest"]
        for index, (a, mine) in enumerate(flying):
            for b, other in flying[index + 1 :]:
                if self._together(a, b) or _apart(mine.segment, other.segment, self.keep_m):
                    self.near.discard((a, b))
                    continue
                gap = closest_approach(mine.segment, other.segment, since, until).distance_m
                self.closest_m = min(self.closest_m, gap)
                if gap >= self.keep_m - SLACK_M:
                    self.near.discard((a, b))
                elif (a, b) not in self.near:
                    self.near.add((a, b))
                    self.tell("separation", f"{a} and {b} of different tasks came within {gap:.1f} m")

    def _together(self, a: str, b: str) -> bool:
        mine, other = self.group.get(a, "-"), self.group.get(b, "-")
        return "-" in (mine, other) or mine == other

    def _path(self, agent: str, segment: Segment) -> None:
        request = self.goal.get(agent)
        if request is None or request.safety or _section(request.goal_id) in ("recover", ""):
            return
        if self.group.get(agent) == "-":
            return  # its pilot, or its own failsafe
        way = shapely.LineString([(p.east_m, p.north_m) for p in (segment.p0, segment.p1)])
        if self.fence is not None and not self.fence.covers(way):
            self.tell("keep_in", f"{agent} leaves the fence with {request.goal_id}")
        if any(area.intersects(way) for area in self.closed):
            self.tell("keep_out", f"{agent} enters a closed area with {request.goal_id}")
        spec = self.catalogue.types[self.types[agent]]
        limits = [spec.limits.get("max_height_m"), self.ceiling, self.ceilings.get(request.task_id)]
        ceiling = min((one for one in limits if one is not None), default=None)
        top = max(segment.p0.up_m, segment.p1.up_m)
        if ceiling is not None and top > ceiling + HEIGHT_SLACK_M and segment.p1.up_m >= segment.p0.up_m:
            self.tell("max_height", f"{agent} flies at {top:.0f} m with {request.goal_id}, allowed are {ceiling:.0f} m")


def _section(goal_id: str) -> str:
    parts = goal_id.split("/", 3)
    return parts[2].split(":", 1)[0] if len(parts) == 4 else ""


def _shape(region: Any) -> Any:
    corners = region.corners if isinstance(region, Region) else region
    return shapely.Polygon([(c.east_m, c.north_m) for c in corners])


def _apart(a: Segment, b: Segment, keep_m: float) -> bool:
    """Return whether two motions cannot come near: their boxes over ground are farther apart."""
    return (
        min(a.p0.east_m, a.p1.east_m) - max(b.p0.east_m, b.p1.east_m) > keep_m
        or min(b.p0.east_m, b.p1.east_m) - max(a.p0.east_m, a.p1.east_m) > keep_m
        or min(a.p0.north_m, a.p1.north_m) - max(b.p0.north_m, b.p1.north_m) > keep_m
        or min(b.p0.north_m, b.p1.north_m) - max(a.p0.north_m, a.p1.north_m) > keep_m
    )
