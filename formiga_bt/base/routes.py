"""Routes of machines on the ground: a graph of nodes and straight edges, and the ways on it.

A node and an edge are each for one machine at a time. A machine keeps a node until it is `clear_m` away from it: so far that
nobody who comes to the node by another edge can touch it. Shortest ways go by length, ties by the order of the site file.
Pure; read by the checker of sites, the gate and the safe order.
"""

import heapq
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final

from msgspec import Struct, field

from formiga_bt.base.geo import Place, Position, horizontal_m, segment_distance_m

EDGE_WIDTH_M: Final = 1.0
"""Of an edge that does not say it: as wide as a machine of which nothing is known."""

THERE_M: Final = 0.5
"""Who is so near to a node stands at it."""

CELL_M: Final = 20.0

Point = Place | Position


class RouteNode(Struct, frozen=True):
    """A point that machines drive through; at an end (a node marked `park`, a station) they may stay."""

    name: str
    at: Place
    is_end: bool = False


class RouteEdge(Struct, frozen=True):
    """A straight way between two nodes."""

    a: str
    b: str
    speed_m_s: float | None = None
    """At most so fast; None = as fast as the machine may drive anywhere."""
    one_way: bool = False
    """It is driven from `a` to `b` only."""
    width_m: float = EDGE_WIDTH_M

    @property
    def name(self) -> str:
        """Return how it is called: `a-b`."""
        return f"{self.a}-{self.b}"


class Routes(Struct, frozen=True):
    """The routes of a site; none if it has no nodes. Each station is a node."""

    nodes: Mapping[str, RouteNode] = field(default_factory=dict)
    edges: tuple[RouteEdge, ...] = ()


class Entry(Struct, frozen=True):
    """A node that a machine may come to without passing another one."""

    node: str
    edge: str = ""
    """The one that it is on; "" = it stands at the node, or on none and joins the routes there."""
    metres: float = 0.0


class RouteGraph:
    """Routes made ready for questions. What it is asked twice it keeps; there is nothing else that changes."""

    def __init__(self, routes: Routes) -> None:
        self.nodes = routes.nodes
        self.edges: dict[str, RouteEdge] = {edge.name: edge for edge in routes.edges}
        self.parts: tuple[str, ...] = (*self.nodes, *self.edges)
        """Names of all nodes and edges."""
        self.out: dict[str, list[tuple[str, str, float]]] = {name: [] for name in self.nodes}
        """Node -> (next node, edge, metres) that may be driven to."""
        self.into: dict[str, list[tuple[str, str, float]]] = {name: [] for name in self.nodes}
        for edge in routes.edges:
            metres = horizontal_m(self.nodes[edge.a].at, self.nodes[edge.b].at)
            for a, b in ((edge.a, edge.b),) if edge.one_way else ((edge.a, edge.b), (edge.b, edge.a)):
                self.out[a].append((b, edge.name, metres))
                self.into[b].append((a, edge.name, metres))
        self.has_one_way = any(edge.one_way for edge in routes.edges)
        self.ends: tuple[str, ...] = tuple(name for name, node in self.nodes.items() if node.is_end)
        self.clear_m: dict[str, float] = {name: self._clear_m(name) for name in self.nodes}
        self.around = {
            name: tuple(dict.fromkeys((node, edge) for node, edge, _ in (*self.out[name], *self.into[name])))
            for name in self.nodes
        }
        """Node -> (node, edge) beside it, whichever way the edge is driven."""
        self._to: dict[str, dict[str, float]] = {}
        self._aside: dict[str, bool] = {}
        self._cells: dict[tuple[int, int], list[str]] = {}
        for name in self.parts:
            self._note_cells(name)

    # -- geometry ------------------------------------------------------------------------------------------------------
    def edge_of(self, a: str, b: str) -> str:
        """Return the edge that is driven from one node to the next, or ""."""
        return next((edge for node, edge, _ in self.out[a] if node == b), "")

    def line(self, part: str) -> tuple[Position, Position]:
        """Return the straight line of an edge, or a node as a line without length."""
        edge = self.edges.get(part)
        a, b = (part, part) if edge is None else (edge.a, edge.b)
        return _flat(self.nodes[a].at), _flat(self.nodes[b].at)

    def edges_at(self, node: str) -> list[RouteEdge]:
        """Return the edges that begin or end at a node."""
        names = dict.fromkeys(edge for _, edge, _ in (*self.out[node], *self.into[node]))
        return [self.edges[name] for name in names]

    def _clear_m(self, node: str) -> float:
        """Return how far from a node a machine on one edge is clear of those that come to it by others."""
        edges, here = self.edges_at(node), self.nodes[node].at
        most = max((edge.width_m for edge in edges), default=EDGE_WIDTH_M)
        for i, one in enumerate(edges):
            for other in edges[i + 1 :]:
                gap = (one.width_m + other.width_m) / 2
                angle = abs(_bearing(here, self._far(one, node)) - _bearing(here, self._far(other, node)))
                angle = min(angle, 2 * math.pi - angle)
                most = max(most, gap / max(math.sin(angle), 0.01) if angle < math.pi / 2 else gap)
        return most

    def _far(self, edge: RouteEdge, node: str) -> Place:
        return self.nodes[edge.b if edge.a == node else edge.a].at

    def touches(self, part: str, at: Point) -> bool:
        """Return whether a machine takes a node or an edge up where it is. Who stands at a node is on none of its edges."""
        edge = self.edges.get(part)
        if edge is None:
            return part in self.nodes and horizontal_m(self.nodes[part].at, at) < self.clear_m[part]
        if min(horizontal_m(self.nodes[node].at, at) for node in (edge.a, edge.b)) <= THERE_M:
            return False
        here = _flat(at)
        return segment_distance_m(here, here, *self.line(part)) < max(edge.width_m, EDGE_WIDTH_M)

    def touched(self, at: Point) -> tuple[str, ...]:
        """Return all nodes and edges that a machine takes up where it is."""
        near = self._cells.get((math.floor(at.east_m / CELL_M), math.floor(at.north_m / CELL_M)), ())
        return tuple(part for part in near if self.touches(part, at))

    def _note_cells(self, part: str) -> None:
        (a, b), edge = self.line(part), self.edges.get(part)
        reach = self.clear_m[part] if edge is None else max(edge.width_m, EDGE_WIDTH_M)
        west, east = sorted((a.east_m, b.east_m))
        south, north = sorted((a.north_m, b.north_m))
        for x in range(math.floor((west - reach) / CELL_M), math.floor((east + reach) / CELL_M) + 1):
            for y in range(math.floor((south - reach) / CELL_M), math.floor((north + reach) / CELL_M) + 1):
                self._cells.setdefault((x, y), []).append(part)

    def end_at(self, at: Point) -> str:
        """Return the end at a place, or ""."""
        return next((name for name in self.ends if horizontal_m(self.nodes[name].at, at) <= THERE_M), "")

    def nearest(self, at: Point, names: Iterable[str] | None = None) -> str:
        """Return the node (of some) that is nearest to a place as the crow flies, or ""."""
        known = self.nodes if names is None else names
        return min(known, key=lambda name: horizontal_m(self.nodes[name].at, at), default="")

    def entries(self, at: Point, held: Sequence[str]) -> tuple[Entry, ...]:
        """Return where a machine may go on from.

        Args:
            at: where it is.
            held: nodes and edges that it takes up.
        """
        for part in held:
            if part in self.nodes and horizontal_m(self.nodes[part].at, at) <= THERE_M:
                return (Entry(part),)
        for part in held:
            edge = self.edges.get(part)
            if edge is not None and self.touches(part, at):
                ahead = Entry(edge.b, part, horizontal_m(self.nodes[edge.b].at, at))
                back = Entry(edge.a, part, horizontal_m(self.nodes[edge.a].at, at))
                return (ahead,) if edge.one_way else (ahead, back)
        node = self.nearest(at)
        return (Entry(node, "", horizontal_m(self.nodes[node].at, at)),) if node else ()

    # -- ways ----------------------------------------------------------------------------------------------------------
    def to(self, target: str) -> Mapping[str, float]:
        """Return how far it is from each node to a target; nodes from which no way leads there are missing."""
        known = self._to.get(target)
        if known is None:
            known = self._to[target] = self._search({target: 0.0}, self.into)
        return known

    def _search(
        self, begin: Mapping[str, float], steps: Mapping[str, list[tuple[str, str, float]]]
    ) -> dict[str, float]:
        found: dict[str, float] = {}
        heap = [(metres, order, node) for order, (node, metres) in enumerate(begin.items())]
        heapq.heapify(heap)
        order = len(heap)
        while heap:
            metres, _, node = heapq.heappop(heap)
            if node in found:
                continue
            found[node] = metres
            for follows, _, more in steps[node]:
                if follows not in found:
                    order += 1
                    heapq.heappush(heap, (metres + more, order, follows))
        return found

    def way(self, node: str, target: str) -> tuple[str, ...] | None:
        """Return the nodes of the shortest way from a node to a target, the first one not among them; None: there is none."""
        left = self.to(target)
        if node not in left:
            return None
        found: list[str] = []
        while node != target:
            node = min((one for one in self.out[node] if one[0] in left), key=lambda one: one[2] + left[one[0]])[0]
            found.append(node)
        return tuple(found)

    def length_m(self, nodes: Sequence[str]) -> float:
        """Return how long the way along some nodes is."""
        return sum(horizontal_m(self.nodes[a].at, self.nodes[b].at) for a, b in pairwise(nodes))

    def best(self, entries: Iterable[Entry], target: str) -> tuple[Entry, tuple[str, ...]] | None:
        """Return where a machine goes on to a target, and the nodes after that; None: no way leads there."""
        left = self.to(target)
        known = [one for one in entries if one.node in left]
        if not known:
            return None
        entry = min(known, key=lambda one: one.metres + left[one.node])
        return entry, self.way(entry.node, target) or ()

    def free_way(
        self, entries: Iterable[Entry], targets: Iterable[str], is_free: Callable[[str], bool]
    ) -> tuple[Entry, tuple[str, ...]] | None:
        """Return the shortest way whose nodes and edges are all free, to the nearest of some targets; None: there is none."""
        wanted = frozenset(one for one in targets if is_free(one))
        if not wanted:
            return None
        first: dict[str, Entry] = {}
        before: dict[str, str] = {}
        heap: list[tuple[float, int, str, str]] = []
        for order, entry in enumerate(entries):
            if is_free(entry.node) and (not entry.edge or is_free(entry.edge)):
                first.setdefault(entry.node, entry)
                heapq.heappush(heap, (entry.metres, order, entry.node, ""))
        order = len(heap)
        while heap:
            metres, _, node, came = heapq.heappop(heap)
            if node in before:
                continue
            before[node] = came
            if node in wanted:
                return self._traced(node, before, first)
            for follows, edge, more in self.out[node]:
                if follows not in before and is_free(follows) and is_free(edge):
                    order += 1
                    heapq.heappush(heap, (metres + more, order, follows, node))
        return None

    def reaches(self, starts: Iterable[str], end: str, free: Mapping[str, int]) -> bool:
        """Return whether a way by free nodes and edges leads from some node to an end; what is near it comes first."""
        left, out = self.to(end), self.out
        stack = [node for node in starts if node in left]
        seen = set(stack)
        while stack:
            node = stack.pop()
            if node == end:
                return True
            steps = [
                (left[follows], follows)
                for follows, edge, _ in out[node]
                if follows in left and follows not in seen and free.get(follows, 0) > 0 and free.get(edge, 0) > 0
            ]
            if len(steps) > 1:
                steps.sort(reverse=True)
            for _, follows in steps:
                seen.add(follows)
                stack.append(follows)
        return False

    @staticmethod
    def _traced(node: str, before: Mapping[str, str], first: Mapping[str, Entry]) -> tuple[Entry, tuple[str, ...]]:
        found: list[str] = []
        while before[node]:
            found.append(node)
            node = before[node]
        return first[node], tuple(reversed(found))

    def is_aside(self, end: str) -> bool:
        """Return whether who stands at an end is in nobody's way: without it all other ends reach each other as before."""
        known = self._aside.get(end)
        if known is None:
            known = self._aside[end] = len(self.edges_at(end)) < 2 or not self._cuts(end)
        return known

    def _cuts(self, end: str) -> bool:
        others = [one for one in self.ends if one != end]
        for steps in (self.out, self.into):
            reached = [self._search({others[0]: 0.0}, one) for one in (steps, _without(steps, end))] if others else []
            if reached and any(one in reached[0] and one not in reached[1] for one in others):
                return True
        return False


class Patches:
    """Which free nodes hang together by free nodes and edges, whichever way edges are driven; more become free, one by one.

    Disjoint sets with halved paths (R. E. Tarjan, J. van Leeuwen, 1984).
    """

    def __init__(self, graph: RouteGraph, free: dict[str, int]) -> None:
        self._graph = graph
        self._free = free
        self._above: dict[str, str] = {}
        self.renew()

    def renew(self) -> None:
        """Something is free no more (`free` says so already): find all anew."""
        graph, free = self._graph, self._free
        self._above = {node: node for node in graph.nodes if free.get(node, 0) > 0}
        for edge in graph.edges.values():
            if edge.a in self._above and edge.b in self._above and free.get(edge.name, 0) > 0:
                self._join(edge.a, edge.b)

    def of(self, node: str) -> str:
        """Return what a node shares with those it hangs together with; "" = it is not free."""
        above = self._above
        if node not in above:
            return ""
        while above[node] != node:
            above[node] = node = above[above[node]]
        return node

    def release(self, parts: Iterable[str]) -> None:
        """Nodes and edges have become free (`free` says so already)."""
        graph, free, above = self._graph, self._free, self._above
        for part in parts:
            edge = graph.edges.get(part)
            if edge is not None:
                if edge.a in above and edge.b in above and free[part] > 0:
                    self._join(edge.a, edge.b)
            elif part in graph.nodes and part not in above and free[part] > 0:
                above[part] = part
                for node, name in graph.around[part]:
                    if node in above and free[name] > 0:
                        self._join(node, part)

    def _join(self, a: str, b: str) -> None:
        self._above[self.of(a)] = self.of(b)


def _without(steps: Mapping[str, list[tuple[str, str, float]]], node: str) -> dict[str, list[tuple[str, str, float]]]:
    return {name: [one for one in nexts if one[0] != node] for name, nexts in steps.items()}


def _flat(at: Point) -> Position:
    return Position(at.east_m, at.north_m, 0.0)


def _bearing(a: Place, b: Place) -> float:
    return math.atan2(b.east_m - a.east_m, b.north_m - a.north_m)
