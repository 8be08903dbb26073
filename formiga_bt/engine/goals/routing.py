"""Drives on the routes of a site: one goal an edge, and what a machine takes up of them.

A step that sends a machine to a place sends one goal after the other along the shortest way: each attempt of it is an edge, and
the last one its own action. An edge and its far node are a machine's from the moment its goal leaves until a status puts it
outside, so through failure, loss and the way home. A goal waits while another machine takes one of the two up (`route_busy`),
or while its going would keep somebody from ever coming to where it is to go (`route_order`, the safe order). What waits long
goes round; what cannot come to its end at all drives to another one, out of the way.
"""

from collections.abc import Iterator
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position, horizontal_m, way_gap_m
from formiga_bt.base.routes import THERE_M, Entry, RouteGraph
from formiga_bt.engine.allocator.drives import REACH_M
from formiga_bt.engine.allocator.holders import Holders
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.timers import AsideDue
from formiga_bt.engine.resting import home_of, is_taken
from formiga_bt.lang.model import ActionSpec
from formiga_bt.safety.gate import Hold, Refuse

PATIENCE_US: Final = 10 * SECOND
"""Who has waited so long takes any other way, and who cannot come to its end drives out of the way."""

LOOK_AHEAD: Final = 8
"""Who stands where it may stay leaves once so many nodes of its way are free."""

DETOUR: Final = 1.5
"""Who finds its way taken goes round at once, if that is at most so many times as long."""


class Routing:
    """Says of drives on the routes where they go on, and who takes up what."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._holders = Holders(core)
        self._lie_in = _resources_on(core)
        """Node or edge -> the resources whose region it leads through."""

    # -- goals ---------------------------------------------------------------------------------------------------------
    def drives(self, goal: GoalRecord) -> bool:
        """Return whether a goal leads along the routes."""
        return self._target(goal) is not None and self._core.state.agents[goal.agent].position is not None

    def _target(self, goal: GoalRecord) -> Place | Position | None:
        core = self._core
        if core.route_graph is None or core.state.agents[goal.agent].mobility != "ground":
            return None
        spec = core.action(goal.action)
        target = goal.fields.get(spec.moves_to) if spec.moves_to else None
        return target if isinstance(target, Place | Position) else None

    def planned(self, goal: GoalRecord) -> GoalRecord:
        """Return a new goal with its way, if it is to drive one: whoever waits is counted on to leave."""
        graph = self._core.route_graph
        if graph is None or not self.drives(goal):
            return goal
        agent = self._core.state.agents[goal.agent]
        if agent.aside and agent.aside == self._stands_at(agent):
            self._core.put_agent(agent.id, aside="")
        first = next(self.hops(goal))
        return goal if isinstance(first, Refuse) else replace(goal, path=first.path)

    def hops(self, goal: GoalRecord, *, patient: bool = False) -> Iterator[GoalRecord | Refuse]:
        """Iterate over goals that would bring a machine on to where a goal leads, the best first; or say why there is none.

        Args:
            goal: as its step ordered it, or one that was sent already and came back.
            patient: it has waited: any other way will do.
        """
        graph, target = self._core.route_graph, self._target(goal)
        agent = self._core.state.agents[goal.agent]
        assert graph is not None
        assert target is not None
        assert agent.position is not None
        if goal.goes_on:
            yield replace(goal, code="", text="")
            return
        end = graph.end_at(target)
        if not end:
            near = graph.nearest(target, graph.ends)
            text = (
                f"routes end at stations and at nodes marked park, not where {goal.action} leads; the nearest is {near}"
            )
            yield Refuse("off_routes", text)
            return
        entries, to = graph.entries(agent.position, agent.on_route), agent.aside or end
        best = graph.best(entries, to)
        if best is None:
            yield Refuse("no_route", f"no route leads from where {agent.id} is to {to}")
            return
        yield self._hop(goal, agent, graph, best, end)
        round_ = graph.free_way(entries, (to,), lambda part: self._is_open(part, agent))
        if round_ is None or round_ == best:
            return
        if patient or agent.aside or _metres(graph, round_) <= DETOUR * _metres(graph, best):
            yield self._hop(goal, agent, graph, round_, end)

    def _hop(
        self, goal: GoalRecord, agent: AgentRecord, graph: RouteGraph, way: tuple[Entry, tuple[str, ...]], end: str
    ) -> GoalRecord:
        entry, rest = way
        stands = self._stands_at(agent) == entry.node
        path = (rest or (entry.node,)) if stands else (entry.node, *rest)
        edge = graph.edges.get(graph.edge_of(entry.node, path[0]) if stands else entry.edge)
        if path == (end,):
            fields = _slowed(goal.fields, self._core.action(goal.action), edge.speed_m_s if edge is not None else None)
            return replace(goal, path=path, fields=fields, code="", text="")
        name = self._plain_drive(agent) or goal.action
        spec = self._core.action(name)
        own = self._core.action(goal.action).moves_to
        fields = {key: value for key, value in goal.fields.items() if key in spec.fields and key != own}
        fields[spec.moves_to] = graph.nodes[path[0]].at
        fields = _slowed(fields, spec, edge.speed_m_s if edge is not None else None)
        return replace(goal, action=name, fields=fields, rest_of=goal.action, path=path, code="", text="")

    def _plain_drive(self, agent: AgentRecord) -> str:
        """Return the first action of a machine that brings it to a place and needs nothing else, or ""."""
        for name in agent.actions:
            spec = self._core.catalogue.actions.get(name)
            needed = [key for key, field in spec.fields.items() if not field.optional] if spec is not None else []
            if spec is not None and spec.moves_to and needed == [spec.moves_to] and spec.repeatable:
                return name
        return ""

    def still_waits(self, goal: GoalRecord) -> Hold | None:
        """Return what a goal waits for that is known to wait for it still: then nothing else need be looked at."""
        if goal.code != "route_busy" or not goal.path:
            return None
        agent = self._core.state.agents[goal.agent]
        if agent.goal or not agent.is_reachable or agent.position is None:
            return None
        taken = any(goal.text in self._others(part, agent.id) for part in self._ahead(agent, goal))
        return Hold(goal.code, goal.text) if taken else None

    def may_go(self, hop: GoalRecord) -> Hold | None:
        """Return what an edge of a way waits for; None = nothing."""
        agent = self._core.state.agents[hop.agent]
        for part in self._ahead(agent, hop):
            others = self._others(part, agent.id)
            if others:
                return Hold("route_busy", others[0])
        if hop.path[0] == self._stands_at(agent):
            return None
        who = self._holders.held_up_by_way(agent, hop.path[0], hop.path[-1])
        return Hold("route_order", who) if who and not self._is_awaited_by(agent, who) else None

    def _is_awaited_by(self, agent: AgentRecord, who: str) -> bool:
        """Return whether a machine waits for this one to leave where it stands: to stay there would help it least."""
        core = self._core
        task = core.state.tasks.get(who)
        waiting = task.agents.granted if task is not None else (who,)
        goals = [core.state.goals[one] for name in waiting if (one := core.index.driving.get(name)) is not None]
        return any(goal.state == "gated" and goal.code == "leg_busy" and goal.text == agent.id for goal in goals)

    # -- waiting -------------------------------------------------------------------------------------------------------
    def waits(self, goal: GoalRecord) -> None:
        """A goal waits for others on the routes: look again when it has waited for long."""
        due = AsideDue(goal.id)
        if due not in self._core.state.deadlines:
            self._core.set_deadline(due, self._core.now + PATIENCE_US, goal.task)

    def has_waited(self, goal: GoalRecord) -> bool:
        """Return whether a goal still waits for others when its patience is over; it is then looked at again and again."""
        if goal.state != "gated" or goal.code not in ("route_busy", "route_order"):
            return False
        self._core.set_deadline(AsideDue(goal.id), self._core.now + PATIENCE_US, goal.task)
        return True

    def leads_elsewhere(self, goal: GoalRecord) -> bool:
        """Return whether a way home that waits leads to where another machine stands by now, and there is another home."""
        graph, target = self._core.route_graph, self._target(goal)
        agent = self._core.state.agents[goal.agent]
        if graph is None or target is None or not is_taken(self._core, agent, target):
            return False
        home = home_of(self._core, agent)
        return bool(graph.end_at(target)) and home is not None and horizontal_m(target, home) > THERE_M

    def step_aside(self, goal: GoalRecord) -> bool:
        """Send a machine that stands in the way to an end that it can come to first; return whether there is one."""
        core, graph = self._core, self._core.route_graph
        agent = core.state.agents[goal.agent]
        here = self._stands_at(agent)
        if graph is None or agent.position is None:
            return False
        if agent.aside:
            taken = bool(self._others(agent.aside, agent.id))
            if taken:  # somebody came to stand there meanwhile: first its own way again
                core.put_agent(agent.id, aside="")
            return taken
        stays = bool(here) and graph.nodes[here].is_end
        if not (self._is_in_circle(agent, goal.path[-1]) if stays else self._holders.is_stuck(agent)):
            return False
        entries = graph.entries(agent.position, agent.on_route)
        wanted = {core.state.goals[one].path[-1] for one in core.index.driving.values()}
        free = [end for end in graph.ends if end != here and end not in wanted]
        for ends in ([end for end in free if graph.is_aside(end)], free, graph.ends if not stays else ()):
            found = graph.free_way(entries, ends, lambda part: self._is_open(part, agent))
            if found is not None:
                core.put_agent(agent.id, aside=found[1][-1] if found[1] else found[0].node)
                return True
        return False

    def _is_in_circle(self, agent: AgentRecord, target: str) -> bool:
        """Return whether machines that stand where they may stay each want the place of the next, the last one of the first."""
        core = self._core
        for _ in core.index.driving:
            there = next(iter(self._others(target, "")), "")
            if there == agent.id:
                return True
            goal_id = core.index.driving.get(there)
            if goal_id is None or core.state.agents[there].aside:
                return False
            target = core.state.goals[goal_id].path[-1]
        return False

    # -- what machines take up -----------------------------------------------------------------------------------------
    def taken(self, agent: AgentRecord, goal: GoalRecord) -> tuple[str, ...]:
        """Return the nodes and edges that a machine takes up once a goal has left."""
        if not goal.path or agent.position is None:
            return agent.on_route
        return tuple(dict.fromkeys((*agent.on_route, *self._parts(agent, goal.path[0]))))

    def seen(self, agent: AgentRecord, position: Position | None, *, stands: bool) -> tuple[str, ...]:
        """Return the nodes and edges that a machine takes up, by where it says it is now.

        Args:
            agent: as it was known.
            position: where it says it is.
            stands: it surely goes nowhere by itself.
        """
        graph = self._core.route_graph
        if graph is None or position is None or agent.mobility != "ground":
            return agent.on_route
        if agent.lost_leg is not None and not stands:
            return agent.on_route  # it may go on as far as it was let
        goal = self._core.state.goals.get(agent.goal)
        ahead = goal.path[0] if goal is not None and goal.in_flight and goal.path and goal.released else ""
        touched = [part for part in agent.on_route if graph.touches(part, position)] or graph.touched(position)
        kept = [part for part in agent.on_route if ahead and self._is_ahead(graph, part, ahead, position)]
        return tuple(part for part in dict.fromkeys((*agent.on_route, *touched)) if part in touched or part in kept)

    @staticmethod
    def _is_ahead(graph: RouteGraph, part: str, node: str, at: Position) -> bool:
        edge = graph.edges.get(part)
        if edge is None:
            return part == node
        return node in (edge.a, edge.b) and not graph.touches(node, at)

    # -- parts ---------------------------------------------------------------------------------------------------------
    def _stands_at(self, agent: AgentRecord) -> str:
        graph = self._core.route_graph
        if graph is None or agent.position is None:
            return ""
        entries = graph.entries(agent.position, agent.on_route)
        return entries[0].node if entries and not entries[0].edge and entries[0].metres == 0.0 else ""

    def _parts(self, agent: AgentRecord, node: str) -> tuple[str, ...]:
        """Return the node that a machine goes on to, and the edge to it."""
        graph = self._core.route_graph
        assert graph is not None
        assert agent.position is not None
        for entry in graph.entries(agent.position, agent.on_route):
            edge = entry.edge if entry.node == node else graph.edge_of(entry.node, node) if not entry.edge else ""
            if edge:
                return node, edge
        return (node,)

    def _ahead(self, agent: AgentRecord, hop: GoalRecord) -> tuple[str, ...]:
        """Return what must be free before a machine goes on.

        That is an edge and a node; of one that stands where it may stay more of its way, else all crowd the ways.
        """
        graph, here = self._core.route_graph, self._stands_at(agent)
        assert graph is not None
        parts = self._parts(agent, hop.path[0])
        return parts if not here or not graph.nodes[here].is_end else (*parts, *hop.path[1:LOOK_AHEAD])

    def _is_open(self, part: str, agent: AgentRecord) -> bool:
        """Return whether a machine may go out of its way there: nobody else is, and it needs no resource that it has not."""
        task = self._core.state.tasks.get(agent.task)
        units = task.resources.units if task is not None else {}
        known = all(name in agent.inside or name in units for name in self._lie_in.get(part, ()))
        return known and not self._others(part, agent.id)

    def _others(self, part: str, agent: str) -> tuple[str, ...]:
        return tuple(one for one in self._core.index.on_route.of(part) if one != agent)


def _resources_on(core: Core) -> dict[str, tuple[str, ...]]:
    graph = core.route_graph
    placed = [one for one in core.site.resources.values() if one.region is not None]
    if graph is None or not placed:
        return {}
    return {
        part: names
        for part in graph.parts
        if (names := tuple(one.name for one in placed if way_gap_m(*graph.line(part), one.region) <= REACH_M))
    }


def _slowed(fields: dict[str, Any], spec: ActionSpec, most: float | None) -> dict[str, Any]:
    if most is None or not spec.speed:
        return fields
    asked = fields.get(spec.speed)
    return {**fields, spec.speed: min(most, asked) if isinstance(asked, int | float) else most}


def _metres(graph: RouteGraph, way: tuple[Entry, tuple[str, ...]]) -> float:
    return way[0].metres + graph.length_m((way[0].node, *way[1]))
