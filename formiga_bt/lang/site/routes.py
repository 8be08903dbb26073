"""The routes of a site file: read, and checked as a graph on the ground.

Every station is a node. Edges lie inside the fence and outside no-go regions; whoever is at one end can come to each other end
that is joined to it; parts that share no node lie as far apart as what drives on them is wide. Called by `lang.site.reader`
and, once all keys are read without error, by `lang.site.whole`.
"""

from collections.abc import Iterator, Mapping
from typing import Protocol

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, Region, horizontal_m, segment_distance_m, way_enters, way_leaves
from formiga_bt.base.routes import THERE_M, RouteEdge, RouteGraph, RouteNode, Routes
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.keyed import Keys, read_inside
from formiga_bt.lang.model import Site, Station
from formiga_bt.lang.site.keys import EDGE, NODE, ROUTES
from formiga_bt.lang.text.document import Entry, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_listing,
    read_name,
    read_text,
    shorten,
    what_is,
)
from formiga_bt.lang.text.synonyms import surely


class Written(Protocol):
    """Where nodes and edges stand in the file."""

    nodes: dict[str, Mark]
    edges: dict[str, Mark]


class Reads(Protocol):
    """The reader of the file that the routes are a part of."""

    keys: Keys
    problems: Problems

    @property
    def written(self) -> Written:
        """Where the parts stand."""

    def point(self, node: Node, what: str) -> Place | Position | None:
        """Return a point of the file, or None."""


def read_routes(reader: Reads, stations: Mapping[str, Station]) -> Routes:
    """Return the routes of a site file; no nodes if it has none."""
    if "routes" not in reader.keys:
        return Routes()
    keys = reader.keys.inside("routes", ROUTES, "routes")
    nodes = {name: RouteNode(name, one.at, is_end=True) for name, one in stations.items()}
    for entry in keys.entries("nodes"):
        at = read_name(entry.key, reader.problems, "nodes")
        node = _node(entry, reader) if at is not None else None
        if at is not None and at.text in stations:
            what = f"'{at.text}' is a station already, and every station is a node"
            reader.problems.add("E018", at.mark, what, "take it out of nodes")
        elif at is not None and node is not None:
            nodes[at.text] = node
            reader.written.nodes[at.text] = at.mark
    edges: list[RouteEdge] = []
    for item in keys.listed("edges", such_as="such as: [[a, b], [b, c, {one_way: true}]]"):
        edge = _edge(item, nodes, edges, reader.problems)
        if edge is not None:
            edges.append(edge)
            reader.written.edges[edge.name] = item.mark
    return Routes(nodes, tuple(edges))


def _node(entry: Entry, reader: Reads) -> RouteNode | None:
    name = entry.key.text
    keys = read_inside(entry.value, NODE, reader.problems, name, f"node '{name}'")
    at = reader.point(keys["at"].value, "at") if "at" in keys else None
    return RouteNode(name, at, keys.flag("park")) if isinstance(at, Place) else None


def _edge(item: Node, nodes: Mapping[str, RouteNode], before: list[RouteEdge], problems: Problems) -> RouteEdge | None:
    parts = read_listing(item, problems, "an edge") or ()
    if not 2 <= len(parts) <= 3:
        what = f"an edge is [a, b] or [a, b, {{speed, one_way, width}}], this is {what_is(item)} of {len(parts)}"
        problems.add("E008", item.mark, what, "such as: [a, b, {one_way: true}]")
        return None
    ends = [_named(part, nodes, problems) for part in parts[:2]]
    keys = read_inside(parts[2], EDGE, problems, "an edge", "an edge") if len(parts) == 3 else Keys(EDGE, problems)
    a, b = ends
    if a is None or b is None:
        return None
    if a == b:
        problems.add("E008", item.mark, f"this edge leads from '{a}' to itself", "an edge joins two nodes")
        return None
    if any({one.a, one.b} == {a, b} for one in before):
        what = f"'{a}' and '{b}' are joined twice"
        help_ = "keep one edge; without one_way it is driven both ways, by one machine at a time"
        problems.add("E018", item.mark, what, help_)
        return None
    speed = keys.number("speed") if "speed" in keys else None
    return RouteEdge(a, b, speed, keys.flag("one_way"), keys.number("width"))


def _named(part: Node, nodes: Mapping[str, RouteNode], problems: Problems) -> str | None:
    at: Scalar | None = read_text(part, problems, "a node")
    if at is None or at.text in nodes:
        return at.text if at is not None else None
    meant = surely(at.text, nodes)
    what = f"no node is called '{shorten(at.text)}'{did_you_mean(at.text, nodes)}"
    problems.add("E120", at.mark, what, f"nodes and stations: {quoted_list(nodes)}", fix_word(at, meant))
    return None


# -- the whole graph -----------------------------------------------------------------------------------------------------


def check_routes(
    site: Site, nodes: Mapping[str, Mark], edges: Mapping[str, Mark], stations: Mapping[str, Mark], problems: Problems
) -> None:
    """Report what is wrong with the routes of a site.

    Args:
        site: as it was read.
        nodes: where its nodes stand,
        edges: its edges,
        stations: and its stations.
        problems: where to report.
    """
    graph = RouteGraph(site.routes)
    marks = {**stations, **nodes}
    _check_zones(site, graph, nodes, edges, problems)
    _check_reached(graph, marks, problems)
    _check_apart(graph, {**marks, **edges}, problems)
    for end in graph.ends:
        if not graph.is_aside(end):
            what = f"who stands at '{end}' is in the way of all that drive from one side of it to the other"
            help_ = "let it lie beside the way: an edge of its own that leads only there"
            problems.add("W124", marks[end], what, help_)


def _check_zones(
    site: Site, graph: RouteGraph, nodes: Mapping[str, Mark], edges: Mapping[str, Mark], problems: Problems
) -> None:
    for part, mark in (*nodes.items(), *edges.items()):
        a, b = graph.line(part)
        what = f"node '{part}'" if part in nodes else f"the edge {part}"
        if site.fence is not None and way_leaves(a, b, site.fence):
            problems.add("E121", mark, f"{what} leaves the fence", "move it inside, or widen the fence")
        for region in site.no_go:
            if way_enters(a, b, region):
                where = f"{what} enters {_called(region, site)}"
                problems.add("E121", mark, where, "lead it round, with a node at each corner")
                break


def _called(region: Region, site: Site) -> str:
    named = (f"the no-go region '{name}'" for name, known in site.regions.items() if known == region)
    return next(named, "a no-go region")


def _check_reached(graph: RouteGraph, marks: Mapping[str, Mark], problems: Problems) -> None:
    if not graph.ends:
        first = next(iter(marks.values()))
        what = "routes can end nowhere: there is no station, and no node is marked 'park'"
        problems.add("E122", first, what, "mark the nodes where machines may stay: a: {at: .., park: true}")
        return
    for name in graph.nodes:
        if not graph.edges_at(name):
            problems.add("E122", marks[name], f"no edge leads to '{name}'", f"join it: [{name}, ..] under edges")
    for name in (*graph.ends, *(one for one in graph.nodes if one not in graph.ends)):
        if graph.edges_at(name) and _is_shut(graph, name, marks, problems):
            return  # what else cannot be reached is so for the same edges


def _is_shut(graph: RouteGraph, name: str, marks: Mapping[str, Mark], problems: Problems) -> bool:
    others = [end for end in graph.ends if end != name]
    ends = [end for end in others if _are_joined(graph, name, end)]
    help_ = "look at the edges that are one_way"
    if others and not ends:
        what = f"no way leads between '{name}' and any other place where a machine may stay, such as '{others[0]}'"
        problems.add("E122", marks[name], what, "join them by an edge, or mark another node beside it: park: true")
        return True
    if ends and not any(name in graph.to(end) for end in ends):
        what = f"who drives to '{name}' can come to no other place where it may stay, such as '{ends[0]}'"
        problems.add("E122", marks[name], what, help_)
        return True
    shut = next((end for end in ends if end not in graph.to(name)), None)
    if shut is not None:
        problems.add("E122", marks[name], f"nobody can drive from '{shut}' to '{name}'", help_)
    return shut is not None


def _are_joined(graph: RouteGraph, a: str, b: str) -> bool:
    """Return whether two nodes hang together, whichever way edges are driven."""
    seen, left = {a}, [a]
    while left:
        node = left.pop()
        if node == b:
            return True
        for follows, _, _ in (*graph.out[node], *graph.into[node]):
            if follows not in seen:
                seen.add(follows)
                left.append(follows)
    return False


def _check_apart(graph: RouteGraph, marks: Mapping[str, Mark], problems: Problems) -> None:
    """Report E123 where machines on parts that share no node would touch, and edges too short to be clear of their ends."""
    for name, edge in graph.edges.items():
        metres = horizontal_m(graph.nodes[edge.a].at, graph.nodes[edge.b].at)
        clear, node = max((graph.clear_m[edge.a], edge.a), (graph.clear_m[edge.b], edge.b))
        if metres <= clear + THERE_M:
            other = edge.b if node == edge.a else edge.a
            what = f"the edge {name} is {_m(metres)} long: who stands at '{other}' is not clear of '{node}'"
            help_ = f"more than {_m(clear + THERE_M)}: move a node, or let the edges at '{node}' part at a wider angle"
            problems.add("E123", marks[name], what, help_)
    for one, other, need in _too_near(graph):
        what = f"{_part(graph, one)} and {_part(graph, other)} are less than {_m(need)} apart, and share no node"
        problems.add("E123", marks[other], what, "move one of them, or put a node where they cross")


def _too_near(graph: RouteGraph) -> Iterator[tuple[str, str, float]]:
    """Iterate over the pairs of parts that do not touch each other and come too near, and how far they must be apart."""
    width = {name: edge.width_m for name, edge in graph.edges.items()}
    reach = {name: max((edge.width_m for edge in graph.edges_at(name)), default=0.0) for name in graph.nodes}
    spans = sorted((*_span(graph, part, {**reach, **width}[part]), part) for part in graph.parts)
    for i, (_, east, one) in enumerate(spans):
        for west, _, other in spans[i + 1 :]:
            if west > east:
                break
            need = ({**reach, **width}[one] + {**reach, **width}[other]) / 2
            if not _share(graph, one, other) and segment_distance_m(*graph.line(one), *graph.line(other)) < need - 1e-6:
                yield one, other, need


def _span(graph: RouteGraph, part: str, width: float) -> tuple[float, float]:
    a, b = graph.line(part)
    return min(a.east_m, b.east_m) - width / 2, max(a.east_m, b.east_m) + width / 2


def _share(graph: RouteGraph, one: str, other: str) -> bool:
    return not {*_nodes(graph, one)}.isdisjoint(_nodes(graph, other))


def _nodes(graph: RouteGraph, part: str) -> tuple[str, ...]:
    edge = graph.edges.get(part)
    return (part,) if edge is None else (edge.a, edge.b)


def _part(graph: RouteGraph, part: str) -> str:
    return f"the edge {part}" if part in graph.edges else f"node '{part}'"


def _m(metres: float) -> str:
    return format_quantity("distance", round(metres, 1))
