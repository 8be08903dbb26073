"""What always holds of machines on the ground, judged by where the bodies truly are and what they truly do.

Looked at each quarter of a second, over all engines of a run. What the engine believes is read only where the rule is about it.
"""

from typing import TYPE_CHECKING, Final

from agents_sim.machine import Machine
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Position, horizontal_m, is_within, segment_distance_m
from formiga_bt.base.routes import RouteGraph
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import GoalRequest

if TYPE_CHECKING:
    from tests.simulation.world import World

RULES: Final = {
    "edge": "no two machines are on one edge, clear of its nodes",
    "touch": "no two machines touch",
    "no_go": "no machine is in a no-go region",
    "room": "no more machines are in the region of a resource than it has units",
    "early": "a machine in the region of a resource counts as in it until it is out",
    "shut": "no door, nor anything else that is guarded with a resource, closes while a machine is in its region",
    "called": "no lift is called or closes while a machine is in its cabin",
    "lane": "no machine drives on a node or edge that is not its own",
    "park": "a machine that nobody needs stands at a station or where one may park, or somebody was told",
    "speed": "no machine drives faster than its type or the edge lets it",
    "charge": "no machine goes on with its task at a charge below its reserve",
}
LOOK_US: Final[Micros] = SECOND // 4
NOTICE_US: Final[Micros] = 5 * SECOND
"""So long after its charge fell below the reserve a machine that is heard must have stopped: a status comes each 4 s."""
ON_M: Final = 0.3
"""Who is so near to the line of an edge drives along it."""
SLACK_M_S: Final = 0.01
SLACK_PERCENT: Final = 0.5


class Ground:
    """Looks at the machines of a world that drive or stand."""

    def __init__(self, world: "World") -> None:
        self.world = world
        self._graph = RouteGraph(world.plan.site.routes)
        self._kind = world.plan.catalogue.types["rover"]
        self._bodies = {name: body for name, body in world.machines.items() if world.sim[name].spec.type == "rover"}
        self._known: dict[Position, tuple[str, ...]] = {}
        self._low: dict[str, Micros] = {}
        self._crashes = 0

    def begin(self) -> None:
        """Look from now on."""
        self.look()
        self.world.scheduler.call_at(self.world.now + LOOK_US, self.begin)

    def tell(self, rule: str, text: str, once: str) -> None:
        """Note a violation, but for what was never promised: an engine that died had sent what no step kept."""
        if not self.world.invariants.forgotten:
            self.world.invariants.tell(rule, text, once)

    def begins(self, request: GoalRequest) -> None:
        """A machine begins a goal: at the speed that it asks for, though the machine may not be able to."""
        speed, most = request.fields.get("speed"), self._kind.limits["max_speed_m_s"]
        if request.agent in self._bodies and speed is not None and speed > most:
            self.tell("speed", f"{request.agent} is told to drive {speed:g} m/s, allowed are {most:g}", request.agent)

    def look(self) -> None:
        """Look at where all are now."""
        spots = {name: body.position() for name, body in self._bodies.items()}
        self._regions(spots)
        self._edges(spots)
        for name, body in self._bodies.items():
            agent = self.world.engine.state.agents.get(name)
            if agent is not None:
                self._lane(agent, body, spots[name])
                self._charge(agent, body)
            self._speed(name, body, spots[name])
        for crash in self.world.flight.referee.verdict(self.world.now).crashes[self._crashes :]:
            self._crashes += 1
            self.tell("touch", f"{crash.a} and {crash.b}, {crash.distance_m} m", f"{crash.a} {crash.b}")

    # -- places --------------------------------------------------------------------------------------------------------
    def _regions(self, spots: dict[str, Position]) -> None:
        site = self.world.plan.site
        for name, at in spots.items():
            if any(is_within(at, region) for region in site.no_go):
                self.tell("no_go", f"{name} is at {at}", name)
        for resource in site.resources.values():
            if resource.region is None:
                continue
            inside = [name for name, at in spots.items() if is_within(at, resource.region)]
            if len(inside) > resource.capacity:
                self.tell("room", f"{', '.join(inside)} are in {resource.name}", resource.name)
            for name in inside:
                agent = self.world.engine.state.agents.get(name)
                if agent is not None and resource.name not in agent.inside:
                    self.tell("early", f"{name} is in {resource.name}, and counts as out of it", name)
            for name, listed in site.agents.items():
                body = self.world.machines.get(name)
                doing = body._flight.action if body is not None and body._flight is not None else ""
                if inside and doing and listed.guards.get(doing) == resource.name:
                    rule = "called" if listed.type == "lift" else "shut"
                    self.tell(rule, f"{name} does {doing} while {', '.join(inside)} is in {resource.name}", name)

    def _edges(self, spots: dict[str, Position]) -> None:
        on: dict[str, str] = {}
        for name, at in spots.items():
            for edge in self._clear_edges(at):
                if edge in on:
                    self.tell("edge", f"{on[edge]} and {name} are on {edge}", edge)
                on[edge] = name

    def _clear_edges(self, at: Position) -> tuple[str, ...]:
        """Return the edges that a machine is on, clear of their nodes. Most machines stand: where they do is kept."""
        known = self._known.get(at)
        if known is None:
            edges = self._graph.edges
            known = tuple(part for part in self._graph.touched(at) if part in edges and self._is_clear(part, at))
            self._known[at] = known
        return known

    def _drives_m_s(self, body: Machine) -> float:
        """Return how fast it drives now."""
        segment = body.state().segment
        if not segment.t0 <= self.world.now < segment.t1:
            return 0.0
        return horizontal_m(segment.p0, segment.p1) * SECOND / (segment.t1 - segment.t0)

    def _is_clear(self, edge: str, at: Position) -> bool:
        graph, ends = self._graph, (self._graph.edges[edge].a, self._graph.edges[edge].b)
        clear = all(horizontal_m(graph.nodes[end].at, at) > graph.clear_m[end] for end in ends)
        return clear and segment_distance_m(at, at, *graph.line(edge)) < ON_M

    def _lane(self, agent: AgentRecord, body: Machine, at: Position) -> None:
        """Whoever drives on the routes, clear of what is near: the edge is its own."""
        if not self._drives_m_s(body):
            return
        edges = self._clear_edges(at)
        if edges and not any(edge in agent.on_route for edge in edges):
            self.tell(
                "lane", f"{agent.id} drives on {edges[0]}, and has {', '.join(agent.on_route) or 'nothing'}", agent.id
            )

    # -- limits --------------------------------------------------------------------------------------------------------
    def _speed(self, name: str, body: Machine, at: Position) -> None:
        speed, most = self._drives_m_s(body), self._kind.limits["max_speed_m_s"]
        edges = self._clear_edges(at)
        limits = [most, *(limit for edge in edges if (limit := self._graph.edges[edge].speed_m_s) is not None)]
        if speed > min(limits) + SLACK_M_S:
            self.tell("speed", f"{name} drives {speed:.2f} m/s, allowed are {min(limits):.2f}", name)

    def _charge(self, agent: AgentRecord, body: Machine) -> None:
        """Whoever is heard, and heard by an engine that lives, ends what it does in time."""
        state, world = self.world.engine.state, self.world
        goal = state.goals.get(agent.goal)
        reserve = self._kind.limits["reserve_pct"]
        goes_on = self._drives_m_s(body) > 0.0 and goal is not None and goal.section == "steps" and goal.in_flight
        if not goes_on or body.battery() > reserve - SLACK_PERCENT or world.is_troubled(agent.id):
            self._low.pop(agent.id, None)
        elif world.now - self._low.setdefault(agent.id, world.now) > NOTICE_US:
            self.tell(
                "charge", f"{agent.id} goes on with {goal.id if goal else ''} at {body.battery():.0f} %", agent.id
            )

    # -- the end -------------------------------------------------------------------------------------------------------
    def finish(self) -> None:
        """After the calm: whoever nobody needs stands where it may."""
        for name, body in self._bodies.items():
            agent, at = self.world.engine.state.agents[name], body.position()
            told = agent.pool != "STANDBY" or name in self.world.engine.state.orders
            if not told and not self._graph.end_at(at) and self._graph.touched(at):
                self.tell("park", f"{name} is {agent.pool}, and stands at {at}", name)
