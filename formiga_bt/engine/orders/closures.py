"""Regions that people close for machines while the engine runs, and open again.

A closed region binds like a no-fly and a no-go region of the site file: the gate refuses what leads into it, and
who is in it leaves its envelope. What is under way is judged at once: whose way leads into it is stopped like who is in it.
A way home that leads into it is canceled: it is tried anew, and if none is left the machine lands.
"""

import math
from typing import Final, assert_never

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import CloseRegion, OpenRegion
from formiga_bt.engine.kernel.records import AgentRecord, Closure
from formiga_bt.engine.orders.breaches import Breaches
from formiga_bt.safety.area import area_of, zone_offence
from formiga_bt.safety.zones import Zone

AROUND_M: Final = 30.0
"""Of a place so much is closed around it."""
CORNERS: Final = 16


class Closures:
    """Carries out what people say of regions."""

    def __init__(self, core: Core, goals: Goals, breaches: Breaches) -> None:
        self._core = core
        self._goals = goals
        self._breaches = breaches

    def take(self, given: CloseRegion | OpenRegion) -> None:
        """Carry out an order.

        Raises:
            TaskError: no such region or place; it is not closed, or the site file closes it.
        """
        match given:
            case CloseRegion():
                self._close(given)
            case OpenRegion():
                self._open(given)
            case _:
                assert_never(given)

    def _close(self, given: CloseRegion) -> None:
        core = self._core
        region = self._region(given.name)
        if not given.reason:
            raise TaskError("no_reason", "say why it is closed: others will ask")
        core.emit(ch.ClosurePut(given.name, Closure(region, given.reason, given.by, core.now)))
        zone = next(one for one in core.airspace.closed if one.outline.region == region)
        for agent in list(core.state.agents.values()):
            if agent.mobility in MOVING and agent.liveness != "LOST":
                self._breaches.look(agent.id, "")
                self._judge(core.state.agents[agent.id], zone)

    def _judge(self, agent: AgentRecord, zone: Zone) -> None:
        """Stop a machine whose way leads into a region that is closed now."""
        core = self._core
        goal = core.state.goals.get(agent.goal)
        if goal is None or not goal.in_flight or goal.cancel_asked or agent.control != "engine" or agent.taken:
            return
        here = agent.position
        ways = [(here or leg[0], leg[1]) for leg in (goal.leg, goal.also) if leg is not None]
        rescue = goal.safety or goal.section == "recover"
        enters = any(zone.offence(a, b, rescue=rescue) is not None for a, b in ways)
        if goal.area is not None and not enters:
            corners = tuple(Place(one.east_m, one.north_m) for one in goal.area.corners)
            enters = zone_offence_of(Region(corners), goal.area.up_m, here, zone)
        if enters:
            self._breaches.way_is_closed(agent, f"its way enters {zone.name}")
            left = core.state.goals.get(goal.id)
            if (
                left is not None and left.in_flight and not left.cancel_asked
            ):  # a way home, which a breach does not stop
                self._goals.cancel(goal.id)

    def _open(self, given: OpenRegion) -> None:
        if given.name not in self._core.state.closures:
            self._region(given.name)
            raise TaskError("not_closed", f"nobody closed {given.name}; what site.yaml closes is changed there")
        self._core.emit(ch.ClosurePut(given.name, None))

    def _region(self, name: str) -> Region:
        site = self._core.site
        found = site.regions.get(name, site.places.get(name))
        if isinstance(found, Region):
            return found
        if isinstance(found, Place | Position):
            return _circle(found)
        known = (*site.regions, *site.places)
        raise TaskError("unknown_place", f"the site has no region or place '{name}'", near=known)


def zone_offence_of(region: Region, up_m: float, here: Position | None, zone: Zone) -> bool:
    """Return whether to go about in a region touches a zone."""
    return zone_offence(area_of(region, up_m, here), zone) is not None


def _circle(at: Place | Position) -> Region:
    reach = AROUND_M / math.cos(math.pi / CORNERS)
    turns = [2 * math.pi * k / CORNERS for k in range(CORNERS)]
    return Region(tuple(Place(at.east_m + reach * math.cos(t), at.north_m + reach * math.sin(t)) for t in turns))
