"""Resources with a region, at the gate: which of them a goal goes through, who is inside, and when a machine is out again.

A machine takes a resource up (`AgentRecord.inside`) from the moment a goal leaves that leads it through the region, or a status
puts it there, until a status puts all of it outside and nothing that it still does leads it in. So it stays through failure,
loss and the way home, and through a restart of the engine. Decides nothing itself: the rule is `safety.resources`.
"""

from typing import Final

from formiga_bt.base.geo import Place, Position, Region, horizontal_m, outline_of, regions_meet, way_gap_m
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.resource_use import use_of
from formiga_bt.lang.model import Resource
from formiga_bt.safety.gate import GateInput, Hold, Refuse
from formiga_bt.safety.resources import Passage, may_pass, may_shut

HALF_A_MACHINE_M: Final = 0.5
"""How far a machine reaches from its position, if its type or card does not say it (`radius_m`)."""

Way = tuple[Position | Place, Position | Place]


class Passages:
    """The site's resources with a region, and the machines in them."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._placed: list[Resource] = [one for one in core.site.resources.values() if one.region is not None]

    def verdict(self, goal: GoalRecord, ask: GateInput) -> Hold | Refuse | None:
        """Return what a goal that could leave waits for, or why it must not; None = it may go."""
        core = self._core
        if not self._placed:
            return None
        agent = core.state.agents[goal.agent]
        guarded = core.guards.get(agent.id, {}).get(goal.action, "")
        if guarded in core.site.resources:
            no = may_shut(use_of(core, guarded), agent.id)
            if no is not None:
                return no
        task = core.state.tasks.get(goal.task)
        rescue = goal.safety or goal.section == "recover" or (task is not None and bool(task.system.agent))
        for resource in self._placed:
            passage = self._passage(resource, agent, ask)
            if passage is not None:
                use, shutting = use_of(core, resource.name), self._shutting(resource.name, agent.id)
                no_pass = may_pass(use, agent.id, agent.task, passage, rescue=rescue, shutting=shutting)
                if no_pass is not None:
                    return no_pass
        return None

    def taken(self, agent: AgentRecord, ask: GateInput) -> tuple[str, ...]:
        """Return the resources that a machine takes up once a goal has left."""
        if agent.mobility not in MOVING:
            return ()
        new = [one.name for one in self._placed if self._passage(one, agent, ask) is not None]
        return tuple(dict.fromkeys((*agent.inside, *new)))

    def seen(self, agent: AgentRecord, position: Position | None) -> tuple[str, ...]:
        """Return the resources that a machine takes up, by where it says it is now."""
        if not self._placed or position is None or agent.mobility not in MOVING:
            return agent.inside  # a door stands in its own doorway, and fills nothing
        goal = self._core.state.goals.get(agent.goal)
        found = []
        for one in self._placed:
            assert one.region is not None
            reach = self._reach_m(agent)
            is_in = outline_of(one.region).outside_m(position.east_m, position.north_m) <= reach
            if is_in or (one.name in agent.inside and self._leads_in(one.region, agent, position, goal, reach)):
                found.append(one.name)
        return tuple(found)

    # -- parts ---------------------------------------------------------------------------------------------------------
    def _leads_in(
        self, region: Region, agent: AgentRecord, position: Position, goal: GoalRecord | None, reach: float
    ) -> bool:
        """Return whether what a machine still does, or may do for all that is known, leads it through a region."""
        ends = [agent.lost_leg[1]] if agent.lost_leg is not None else []
        if goal is not None and goal.in_flight:
            ends += goal.ends
            explored = next((value for value in goal.fields.values() if isinstance(value, Region)), None)
            if explored is not None and regions_meet(explored, region):
                return True
        return any(way_gap_m(position, end, region) <= reach for end in ends) or (
            agent.lost_area is not None and regions_meet(Region(agent.lost_area.corners), region)
        )

    def _passage(self, resource: Resource, agent: AgentRecord, ask: GateInput) -> Passage | None:
        """Return what a goal does with the region of a resource; None = nothing."""
        region, here, target = resource.region, ask.position, ask.target
        assert region is not None
        reach = self._reach_m(agent)
        if ask.region is not None:
            meets = regions_meet(ask.region, region) or (here is not None and self._touches(here, here, region, reach))
            return ("stays" if resource.name in agent.inside else "enters") if meets else None
        if target is None:
            return None
        if not self._touches(here if here is not None else target, target, region, reach):
            return None
        if resource.name not in agent.inside:
            return "enters"
        ends_outside = outline_of(region).outside_m(target.east_m, target.north_m) > reach
        return "leaves" if ends_outside else "stays"

    @staticmethod
    def _touches(a: Place | Position, b: Place | Position, region: Region, reach: float) -> bool:
        if horizontal_m(a, b) == 0.0:
            return outline_of(region).outside_m(a.east_m, a.north_m) <= reach
        return way_gap_m(a, b, region) <= reach

    def _reach_m(self, agent: AgentRecord) -> float:
        known = {**self._core.agent_type(agent).limits, **agent.limits}
        return known.get("radius_m", HALF_A_MACHINE_M)

    def _shutting(self, name: str, but: str) -> str:
        """Return a machine whose action under way guards a resource, or ""."""
        state = self._core.state
        for agent_id, guards in self._core.guards.items():
            agent = state.agents.get(agent_id)
            if agent is None or agent_id == but:
                continue
            goal = state.goals.get(agent.goal)
            if goal is not None and goal.in_flight and guards.get(goal.action) == name:
                return agent_id
        return ""
