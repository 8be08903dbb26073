"""Ways on routes through what is free: sets of nodes and edges as the bits of one number, so that a look costs a comparison.

The shortest way between two nodes is kept, and the last one that went round something; a search is made only if both are taken.
"""

import heapq
from collections.abc import Iterable
from typing import Final

from msgspec import Struct

from formiga_bt.base.routes import Entry, RouteGraph

NO_WAY: Final = -1


class Found(Struct, frozen=True, gc=False):
    """A way, or what is in the way."""

    end: str
    """Where it leads; "" = there is none."""
    blocked: int = 0
    """If there is none: nodes and edges of which one must become free first."""


class Ways:
    """Ways on one graph. Keeps what it found: of the same question the answer is the same."""

    def __init__(self, graph: RouteGraph) -> None:
        self._graph = graph
        self.bit = {part: 1 << n for n, part in enumerate(graph.parts)}
        """Node or edge -> its bit."""
        self.all = (1 << len(graph.parts)) - 1
        self._steps = {
            node: tuple((follows, self.bit[follows] | self.bit[edge], metres) for follows, edge, metres in steps)
            for node, steps in graph.out.items()
        }
        self._ends = tuple(sorted(graph.ends, key=lambda end: not graph.is_aside(end)))
        self._kept: dict[tuple[str, str], tuple[int, int]] = {}

    def mask(self, parts: Iterable[str]) -> int:
        """Return some nodes and edges as one number."""
        found = 0
        for part in parts:
            found |= self.bit[part]
        return found

    def find(self, entries: Iterable[Entry], to: str, free: int) -> Found:
        """Return the end that a machine can come to by what is free.

        Args:
            entries: where it goes on from.
            to: the end that it is to come to; "" = any.
            free: what is free, its own included.
        """
        blocked = 0
        starts: list[str] = []
        for entry in entries:
            needs = self.bit[entry.node] | (self.bit[entry.edge] if entry.edge else 0)
            if needs & ~free:
                blocked |= needs & ~free
            else:
                starts.append(entry.node)
        for end in (to,) if to else self._ends:
            if self.bit[end] & ~free:
                blocked |= self.bit[end]
            elif any(self._is_kept(start, end, free) for start in starts):
                return Found(end)
            else:
                for start in starts:
                    no = self._search(start, end, free)
                    if not no:
                        return Found(end)
                    blocked |= no
        return Found("", blocked)

    def _is_kept(self, node: str, end: str, free: int) -> bool:
        """Return whether the shortest way, or the last one found, is free."""
        kept = self._kept.get((node, end))
        if kept is None:
            kept = self._kept[node, end] = (self._shortest(node, end), NO_WAY)
        taken = ~free
        return any(way != NO_WAY and not way & taken for way in kept)

    def _shortest(self, node: str, end: str) -> int:
        way = self._graph.way(node, end)
        if way is None:
            return NO_WAY
        found = 0
        for follows in way:
            found |= self.bit[follows] | self.bit[self._graph.edge_of(node, follows)]
            node = follows
        return found

    def _search(self, node: str, end: str, free: int) -> int:
        """Look for a way and keep it; return 0, or if there is none what is in the way."""
        left, begin = self._graph.to(end), node
        if node not in left:
            return 0 if node == end else self.all & ~free
        heap = [(left[node], 0, 0.0, node, 0)]
        seen = {node}
        order = blocked = 0
        while heap:
            _, _, metres, node, way = heapq.heappop(heap)
            if node == end:
                self._kept[begin, end] = self._kept[begin, end][0], way
                return 0
            for follows, needs, more in self._steps[node]:
                if follows in seen or follows not in left:
                    continue
                if needs & ~free:
                    blocked |= needs & ~free
                    continue
                seen.add(follows)
                order += 1
                heapq.heappush(heap, (metres + more + left[follows], order, metres + more, follows, way | needs))
        return blocked
