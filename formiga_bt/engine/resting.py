"""Where machines belong when idle, by how they move and by `rest` of their type, and which way leads there.

| moves | belongs | `home` | `return` ends |
|---|---|---|---|
| air | at its own port | that port | at its own port |
| ground, docked | at a station that it may use | its own, else the nearest free one | at a station |
| ground, parked | inside the fence, in no no-go region | the same, else where it stands | at a station, if there is one |
| ground, anywhere | where it stands | as parked | as parked |
| fixed, none | where it stands | its place | at once |

On routes a machine belongs at a station or a node marked `park`. It comes home to the nearest station that is free, and to the
nearest such node if none is.
"""

from formiga_bt.base.geo import Place, Position, horizontal_m, is_within
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.lang.model import Station
from formiga_bt.safety.gate import AT_PORT_M


def home_of(core: Core, agent: AgentRecord) -> Place | None:
    """Return where a machine comes home to; None of one that has no home and is not known to stand anywhere."""
    if agent.flies:
        port = core.site.ports.get(agent.home)
        return port.at if port is not None else None
    if agent.mobility == "ground":
        station = _station_of(core, agent)
        if station is not None:
            return station.at
        end = _end_of(core, agent)
        if end is not None:
            return end
    listed = core.listed(agent.id)
    if agent.mobility == "fixed" and listed is not None and listed.at is not None:
        return listed.at
    return agent.position.ground if agent.position is not None else None


def is_taken(core: Core, agent: AgentRecord, spot: Place | Position) -> bool:
    """Return whether another machine on the ground stands in a place, or is about to."""
    return _is_taken(core, spot, _taken(core, agent))


def is_at_home(core: Core, agent: AgentRecord) -> bool:
    """Return whether `return` has nothing left to do for a machine that stands."""
    match agent.mobility:
        case "air":
            return _is_near(agent, home_of(core, agent))
        case "ground":
            return not _stations(core, agent) or any(_is_near(agent, one.at) for one in _stations(core, agent))
        case _:
            return True


def is_in_its_place(core: Core, agent: AgentRecord) -> bool:
    """Return whether a machine that stands may stay where it is when its task has ended."""
    if agent.mobility != "ground":
        return not agent.flies or is_at_home(core, agent)
    match core.agent_type(agent).rest:
        case "docked":
            return is_at_home(core, agent)
        case "parked":
            at, graph = agent.position, core.route_graph
            if at is None:
                return True
            if graph is not None and agent.on_route and not graph.end_at(at):
                return False  # in the way of others
            return not any(zone.is_broken_at(at) for zone in core.airspace.ground_zones)
        case _:
            return True


def _end_of(core: Core, agent: AgentRecord) -> Place | None:
    """Return where routes let a machine stay that has no station: where it stands, or the nearest node that is free.

    Not one in a resource: whoever stays there keeps others out.
    """
    graph, at = core.route_graph, agent.position
    if graph is None or at is None:
        return None
    placed = [one.region for one in core.site.resources.values() if one.region is not None]
    parks = [
        end
        for end in graph.ends
        if end not in core.site.stations and not any(is_within(graph.nodes[end].at, region) for region in placed)
    ]
    taken = _taken(core, agent)
    free = [end for end in parks if not core.index.on_route.of(end) and not _is_taken(core, graph.nodes[end].at, taken)]
    end = graph.end_at(at) or graph.nearest(at, free) or graph.nearest(at, parks)
    return graph.nodes[end].at if end else None


def _stations(core: Core, agent: AgentRecord) -> list[Station]:
    """Return the stations that a ground machine may use: its own alone, if it has one; never another one's own."""
    own = core.site.stations.get(agent.home)
    if own is not None:
        return [own]
    taken = {one.home for one in core.site.agents.values()} | {one.home for one in core.state.agents.values()}
    usable = [one for one in core.site.stations.values() if not one.kinds or agent.type in one.kinds]
    return [one for one in usable if one.name not in taken]


def _station_of(core: Core, agent: AgentRecord) -> Station | None:
    """Return the station that a machine would go to: its own, or the nearest one at which no other stands or is about to.

    On routes nobody goes to one that is taken: it would wait on the lanes, perhaps for ever.
    """
    known, at = _stations(core, agent), agent.position
    if not known or at is None or known[0].name == agent.home:
        return known[0] if known else None
    taken = _taken(core, agent)
    free = [one for one in known if not _is_taken(core, one.at, taken)]
    if not free and core.route_graph is not None:
        return None
    return min(free or known, key=lambda one: (horizontal_m(one.at, at), one.name))


def _taken(core: Core, agent: AgentRecord) -> list[Place]:
    """Return where other machines on the ground stand, and are about to."""
    others = [one for one in core.state.agents.values() if one.id != agent.id and one.mobility == "ground"]
    taken = [one.position.ground for one in others if one.position is not None]
    taken += [end.ground for goal in core.state.goals.values() if goal.agent != agent.id for end in goal.ends]
    if core.route_graph is not None:
        goals = (core.state.goals[goal_id] for one, goal_id in core.index.driving.items() if one != agent.id)
        taken += [core.route_graph.nodes[goal.path[-1]].at for goal in goals]
    return taken


def _is_taken(core: Core, spot: Place | Position, taken: list[Place]) -> bool:
    return any(horizontal_m(spot, one) < core.site.min_spacing_m for one in taken)


def _is_near(agent: AgentRecord, spot: Place | None) -> bool:
    return spot is not None and agent.position is not None and horizontal_m(spot, agent.position) <= AT_PORT_M
