"""Machines on the routes as jobs of the safe order: what each takes up, and where it is still to drive.

A machine with a goal on its way counts as being at the node that it was granted: it comes there whatever others do. One that
stands where it may stay, and wants nothing, is in the way like one that is lost: nobody counts on its leaving. Reads the core;
keeps what it made of records that are the same still, and the last safe order.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import way_gap_m
from formiga_bt.base.routes import Entry, RouteGraph
from formiga_bt.engine.allocator.safe_order import Job, Way, all_end, worse_off
from formiga_bt.engine.allocator.witness import Held, Witness
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord

Moved = tuple[str, str, str]
"""A machine, the node that it would be at, and where its way ends."""


class Refusal(Struct, frozen=True):
    """Why a machine may not drive on: it holds while those that it is about are as they were."""

    waits: str
    """Who could not come to its end."""
    about: dict[str, Held]
    """Machines that cannot end then, or are in the way of those."""
    at: Micros


ANEW_US: Final[Micros] = 10 * SECOND
"""A refusal is looked for anew after so long in any case."""

REACH_M: Final = 0.5
"""How far a machine reaches from its position, if nothing else is known."""


class Drives:
    """The machines of a site that has routes; no jobs if it has none."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._placed = any(one.region is not None for one in core.site.resources.values())
        """Some resource lies on the ways: what a machine needs depends on what its task has."""
        self._witness = Witness(core.route_graph) if core.route_graph is not None else None
        self._known: dict[str, tuple[AgentRecord, GoalRecord | None, Held]] = {}
        self._refused: dict[str, tuple[Moved, Refusal]] = {}
        """Machine -> where it was last not let drive, and why."""

    @staticmethod
    def job_id(agent: str) -> str:
        """Return the id of a machine's job."""
        return f">{agent}"

    def jobs(self, moved: Moved | None) -> list[Job]:
        """Return a job for each machine that is, or wants to be, on its way; `moved`: with one of them at another node."""
        graph, core = self._core.route_graph, self._core
        if graph is None:
            return []
        found = [
            one.job
            for name in core.index.on_route.members()
            if (one := self._machine(name, graph)).job is not None and (moved is None or name != moved[0])
        ]
        if moved is not None and moved[1] != moved[2]:
            found.append(self._moved(core.state.agents[moved[0]], moved, graph))
        return found

    def held_up_by_way(self, agent: AgentRecord, node: str, to: str) -> str | None:
        """Return the machine that could not come to its end any more if another one drove on; "" = all can.

        None: others than drives matter (`safe_order`).
        """
        if self._witness is None or self._placed:
            return None
        moved = agent.id, node, to
        if self._still_refused(moved):
            return self._refused[agent.id][1].waits
        machines = self._machines(moved)
        then = self._witness.all_end(machines.values())
        if not then.waits or self.leaves_at_once(agent, node, to):
            self._refused.pop(agent.id, None)
            return ""
        about = {
            name: one
            for name, one in machines.items()
            if name != agent.id and (one.parts & then.blocked or self.job_id(name) in then.held_by)
        }
        before = self._machines(None)
        is_sure = then.is_sure and not self._witness.all_end(before.values()).waits
        waits = then.waits if is_sure else self._worse_off(self._witness, before, machines)
        if waits:
            self._refused[agent.id] = moved, Refusal(waits, about, self._core.now)
        return waits

    @staticmethod
    def _worse_off(witness: Witness, before: Mapping[str, Held], after: Mapping[str, Held]) -> str:
        """Return who could come to its end before, and cannot any more, where some could not even before."""
        jobs = [one.job for one in after.values() if one.job is not None]
        can = witness.ends(after.values())
        if all_end(jobs, can):
            return ""
        stood = [one.job for one in before.values() if one.job is not None]
        return worse_off(stood, jobs, witness.ends(before.values()), can)

    def _still_refused(self, moved: Moved) -> bool:
        """Return whether a machine was not let drive there, and all that this was about is as it was."""
        graph, known = self._core.route_graph, self._refused.get(moved[0])
        if graph is None or known is None or known[0] != moved:
            return False
        agents = self._core.state.agents
        return self._core.now - known[1].at < ANEW_US and all(
            name in agents and agents[name].on_route and self._machine(name, graph) == one
            for name, one in known[1].about.items()
        )

    def _machines(self, moved: Moved | None) -> dict[str, Held]:
        graph, core, witness = self._core.route_graph, self._core, self._witness
        assert graph is not None
        assert witness is not None
        mine = moved[0] if moved is not None else ""
        found = {name: self._machine(name, graph) for name in core.index.on_route.members() if name != mine}
        if moved is not None:
            job = self._moved(core.state.agents[mine], moved, graph) if moved[1] != moved[2] else None
            found[mine] = Held(witness.ways.bit[moved[1]], job)
        return found

    def _machine(self, agent_id: str, graph: RouteGraph) -> Held:
        """Return a machine on the routes; of records that are the same still, what it was before."""
        core = self._core
        agent = core.state.agents[agent_id]
        goal_id = core.index.driving.get(agent_id)
        goal = core.state.goals[goal_id] if goal_id is not None else None
        known = self._known.get(agent_id)
        if known is not None and known[0] is agent and known[1] is goal and not self._placed:
            return known[2]
        assert self._witness is not None
        made = Held(self._witness.ways.mask(self._held(agent, goal)), self._job(agent, goal, graph))
        self._known[agent_id] = agent, goal, made
        return made

    def take(self, free: dict[str, int], moved: Moved | None) -> None:
        """Note in `free` which nodes and edges are, and which machines take up."""
        graph, core = self._core.route_graph, self._core
        if graph is None:
            return
        free.update(dict.fromkeys(graph.parts, 1))
        goals = core.index.driving
        for agent_id in core.index.on_route.members():
            if moved is not None and agent_id == moved[0]:
                continue
            agent = core.state.agents[agent_id]
            goal = core.state.goals[goals[agent_id]] if agent_id in goals else None
            for part in self._held(agent, goal):
                free[part] -= 1
        if moved is not None:
            free[moved[1]] -= 1

    def leaves_at_once(self, agent: AgentRecord, node: str, to: str) -> bool:
        """Return whether a machine could drive on to its end right away, where it is in nobody's way: that harms nobody.

        Whoever could end before it went on can end after it has come there.
        """
        core, graph = self._core, self._core.route_graph
        assert graph is not None
        if core.site.resources or not graph.is_aside(to):
            return False
        on_route, here = core.index.on_route, node
        for follows in graph.way(node, to) or ():
            if any(one != agent.id for one in (*on_route.of(follows), *on_route.of(graph.edge_of(here, follows)))):
                return False
            here = follows
        if here != to:
            return False
        for other in on_route.members():
            goal_id = core.index.driving.get(other)
            if other == agent.id:
                continue
            goal = core.state.goals[goal_id] if goal_id is not None else None
            if (goal is None or goal.path[-1] == to) and not self._stays(core.state.agents[other], goal, graph):
                return False
        return True

    # -- parts ---------------------------------------------------------------------------------------------------------
    def _job(self, agent: AgentRecord, goal: GoalRecord | None, graph: RouteGraph) -> Job | None:
        if agent.pool == "QUARANTINED" or agent.liveness == "LOST" or agent.position is None:
            return None
        entries = self._entries(agent, goal, graph)
        to = goal.path[-1] if goal is not None else ""
        stays = len(entries) == 1 and not entries[0].edge and graph.nodes[entries[0].node].is_end
        if stays and to in ("", entries[0].node):
            return None
        holds = dict.fromkeys(self._held(agent, goal), 1)
        needs = self._needs(agent, entries, to, graph)
        return Job(self.job_id(agent.id), agent.id, holds, needs, way=Way(entries, to), may_stay=stays)

    def _moved(self, agent: AgentRecord, moved: Moved, graph: RouteGraph) -> Job:
        _, node, to = moved
        entries = (Entry(node),)
        return Job(
            self.job_id(agent.id), agent.id, {node: 1}, self._needs(agent, entries, to, graph), way=Way(entries, to)
        )

    def _stays(self, agent: AgentRecord, goal: GoalRecord | None, graph: RouteGraph) -> bool:
        if agent.pool == "QUARANTINED" or agent.liveness == "LOST" or agent.position is None:
            return True
        entries = self._entries(agent, goal, graph)
        return len(entries) == 1 and not entries[0].edge and graph.nodes[entries[0].node].is_end

    @staticmethod
    def _entries(agent: AgentRecord, goal: GoalRecord | None, graph: RouteGraph) -> tuple[Entry, ...]:
        if goal is not None and goal.in_flight and goal.released:
            return (Entry(goal.path[0]),)
        assert agent.position is not None
        return graph.entries(agent.position, agent.on_route)

    @staticmethod
    def _held(agent: AgentRecord, goal: GoalRecord | None) -> tuple[str, ...]:
        lost = agent.pool == "QUARANTINED" or agent.liveness == "LOST"
        if goal is not None and goal.in_flight and goal.released and not lost:
            return (goal.path[0],)
        return agent.on_route

    def _needs(self, agent: AgentRecord, entries: tuple[Entry, ...], to: str, graph: RouteGraph) -> Mapping[str, int]:
        """Return the resources that its way leads through, and that neither it nor its task has."""
        core = self._core
        placed = [one for one in core.site.resources.values() if one.region is not None]
        best = graph.best(entries, to) if placed and to else None
        if best is None:
            return {}
        task = core.state.tasks.get(agent.task)
        held = task.resources.units if task is not None else {}
        nodes = [graph.nodes[one].at for one in (best[0].node, *best[1])]
        ways = list(pairwise(nodes)) or [(nodes[0], nodes[0])]
        return {
            one.name: 1
            for one in placed
            if one.name not in held
            and one.name not in agent.inside
            and any(way_gap_m(a, b, one.region) <= REACH_M for a, b in ways)
        }
