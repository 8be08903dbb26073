"""Which node of the old tree is which of the new one, in the manner of GumTree (Falleri et al., ASE 2014).

1. What is known by its name (params, roles, sections, subtrees) is matched by it.
2. Top-down: equal subtrees, the largest first; where several are equal, those under matched parents.
3. Bottom-up: containers that hold much of the same.
4. Recovery: the children of matched containers that are left over, in their order, between their matched neighbours.
5. What is left is matched wherever in its body it stands: equal steps, then steps of one kind that say mostly the same.
"""

from collections import Counter, defaultdict, deque
from collections.abc import Iterator, Sequence
from typing import Any, Final

from formiga_bt.show.diff.outline import DEFINED, OutlineNode

HOLDS: Final = 0.4
"""So much of what two containers hold must be the same."""
SAYS: Final = 0.5
"""So much of what two steps say must be the same for one that changed its action."""
FAR: Final = 0.6
"""The same for a step that changed its place too."""
_CELLS: Final = 10_000
"""More pairs of children than this are not weighed one by one."""


class Matching:
    """Pairs of nodes, found on construction.

    Args:
        old: the old tree, read with the new names.
        new: the new tree.
    """

    def __init__(self, old: OutlineNode, new: OutlineNode) -> None:
        self.to_new: dict[OutlineNode, OutlineNode] = {}
        self.to_old: dict[OutlineNode, OutlineNode] = {}
        self.parent: dict[OutlineNode, OutlineNode | None] = {old: None, new: None}
        self.size: dict[OutlineNode, int] = {}
        self._digest: dict[OutlineNode, int] = {}
        self._known: dict[object, int] = {}
        self._said: dict[tuple[int, int], float] = {}
        self._inside: dict[OutlineNode, tuple[Counter[object], Counter[object]]] = {}
        self._olds, self._news = self._read(old), self._read(new)
        self._by_name(old, new)
        self._equal(self._unmatched(self._olds), self._unmatched(self._news))
        self._containers()
        self._recover(old)
        self._equal(self._unmatched(self._olds), self._unmatched(self._news))
        self._far()

    # -- preparing -----------------------------------------------------------------------------------------------------
    def _read(self, root: OutlineNode) -> list[OutlineNode]:
        """Return the nodes of a tree, children before parents, with their sizes and digests."""
        nodes = list(root.below())
        nodes.reverse()
        for node in nodes:
            inside = [self._digest[child] for child in node.children]
            if node.kind == "group" and node.sub in ("params", "vars", "agents", "subtrees"):
                inside.sort()
            sub = node.sub if node.kind in DEFINED else ""
            says: Any = (
                node.scope,
                node.kind,
                sub,
                frozenset((key, v.atoms) for key, v in node.fields.items()),
                tuple(inside),
            )
            self._digest[node] = self._known.setdefault(says, len(self._known))
            self.size[node] = 1 + sum(self.size[child] for child in node.children)
            for child in node.children:
                self.parent[child] = node
        return nodes

    def _unmatched(self, nodes: Sequence[OutlineNode]) -> list[OutlineNode]:
        return [node for node in nodes if node not in self.to_new and node not in self.to_old]

    def _match(self, one: OutlineNode, other: OutlineNode) -> None:
        self.to_new[one] = other
        self.to_old[other] = one

    def _free(self, one: OutlineNode, other: OutlineNode) -> bool:
        return one not in self.to_new and other not in self.to_old

    # -- 1 -------------------------------------------------------------------------------------------------------------
    def _by_name(self, one: OutlineNode, other: OutlineNode) -> None:
        """Match two nodes, and what is in both by its name."""
        self._match(one, other)
        named = {(child.kind, child.sub): child for child in other.children if child.kind in DEFINED}
        for child in one.children:
            same = named.get((child.kind, child.sub)) if child.kind in DEFINED else None
            if same is not None and self._free(child, same):
                self._by_name(child, same)

    # -- 2, 5 ----------------------------------------------------------------------------------------------------------
    def _equal(self, olds: list[OutlineNode], news: list[OutlineNode]) -> None:
        """Match equal subtrees; of several equal leaves only those whose parents are matched."""
        here: dict[int, list[OutlineNode]] = defaultdict(list)
        there: dict[int, list[OutlineNode]] = defaultdict(list)
        for node in reversed(olds):
            here[self._digest[node]].append(node)
        for node in reversed(news):
            there[self._digest[node]].append(node)
        for digest in sorted(here.keys() & there.keys(), key=lambda one: (-self.size[here[one][0]], one)):
            ones = [node for node in here[digest] if node not in self.to_new and node.is_step]
            others = [node for node in there[digest] if node not in self.to_old and node.is_step]
            if not ones or not others:
                continue
            if len(ones) == len(others) == 1:
                self._all(ones[0], others[0])
                continue
            self._under_parents(ones, others)
            if self.size[ones[0]] > 1:
                left = [node for node in ones if node not in self.to_new]
                for one, other in zip(left, [n for n in others if n not in self.to_old], strict=False):
                    self._all(one, other)

    def _under_parents(self, ones: list[OutlineNode], others: list[OutlineNode]) -> None:
        by_parent: dict[OutlineNode | None, deque[OutlineNode]] = defaultdict(deque)
        for other in others:
            by_parent[self.parent[other]].append(other)
        count = Counter(self.parent[one] for one in ones)
        for one in ones:
            parent = self.parent[one]
            there = self.to_new.get(parent) if parent is not None else None
            if there is not None and count[parent] == len(by_parent[there]):
                self._all(one, by_parent[there][0])
                by_parent[there].popleft()
                count[parent] -= 1

    def _all(self, one: OutlineNode, other: OutlineNode) -> None:
        for inner, same in zip(one.below(), other.below(), strict=True):
            if self._free(inner, same):
                self._match(inner, same)

    # -- 3 -------------------------------------------------------------------------------------------------------------
    def _containers(self) -> None:
        for node in self._olds:
            if node in self.to_new or not node.children or not node.is_step:
                continue
            found = self._ancestors_of_matches(node)
            if not found:
                continue
            ranked = {one: self._rank(node, one, common) for one, common in found.items()}
            best = max(ranked, key=lambda one: (ranked[one], -self.size[one]))
            says = bool(node.fields) and self._says(node, best) == 1.0
            if self._held(node, best, found[best]) >= (HOLDS / 2 if says else HOLDS):
                self._pair(node, best)

    def _rank(self, one: OutlineNode, other: OutlineNode, common: float) -> float:
        """Return how well a container fits: by what it holds; of two around one another, also by what they say and where."""
        return self._held(one, other, common) + 0.15 * self._says(one, other) + 0.1 * (one.path == other.path)

    def _ancestors_of_matches(self, node: OutlineNode) -> Counter[OutlineNode]:
        found: Counter[OutlineNode] = Counter()
        for inner in node.below():
            there = self.to_new.get(inner)
            at = self.parent[there] if there is not None else None
            while at is not None:
                if at.kind == node.kind and at.scope == node.scope and at not in self.to_old:
                    found[at] += 1
                at = self.parent[at]
        return found

    def _held(self, one: OutlineNode, other: OutlineNode, common: float) -> float:
        return 2 * common / max(1, self.size[one] + self.size[other] - 2)

    def _pair(self, one: OutlineNode, other: OutlineNode) -> None:
        """Match two steps with their branches and roles."""
        self._by_name(one, other)
        cases = [[c for c in n.children if c.kind == "branch"] for n in (one, other)]
        for inner, same in zip(*cases, strict=False):
            if len(cases[0]) == len(cases[1]) and self._free(inner, same):
                self._by_name(inner, same)

    # -- 4 -------------------------------------------------------------------------------------------------------------
    def _recover(self, root: OutlineNode) -> None:
        queue = deque([root])
        while queue:
            node = queue.popleft()
            there = self.to_new.get(node)
            if there is not None:
                for ones, others in self._gaps(node, there):
                    self._align(ones, others)
            queue.extend(node.children)

    def _gaps(self, one: OutlineNode, other: OutlineNode) -> Iterator[tuple[list[OutlineNode], list[OutlineNode]]]:
        """Iterate over the free children of two matched nodes, between the matched ones that kept their order."""
        place = {child: at for at, child in enumerate(other.children)}
        kept = [(at, place[self.to_new[c]]) for at, c in enumerate(one.children) if self.to_new.get(c) in place]
        anchors = [kept[at] for at in rising([there for _, there in kept])]
        low, low_there = -1, -1
        for at, there in [*anchors, (len(one.children), len(other.children))]:
            ones = [c for c in one.children[low + 1 : at] if c not in self.to_new and c.is_step]
            others = [c for c in other.children[low_there + 1 : there] if c not in self.to_old and c.is_step]
            if ones and others:
                yield ones, others
            low, low_there = at, there

    def _align(self, ones: list[OutlineNode], others: list[OutlineNode]) -> None:
        """Match two rows of steps in their order, so that the pairs are as alike as they can be."""
        if len(ones) * len(others) > _CELLS:
            piece = int(_CELLS**0.5)
            for at in range(0, min(len(ones), len(others)), piece):
                self._align(ones[at : at + piece], others[at : at + piece])
            return
        weight = [[self._alike(one, other) for other in others] for one in ones]
        best = [[0.0] * (len(others) + 1) for _ in range(len(ones) + 1)]
        for i in range(len(ones) - 1, -1, -1):
            for j in range(len(others) - 1, -1, -1):
                both = weight[i][j] + best[i + 1][j + 1] if weight[i][j] else 0.0
                best[i][j] = max(both, best[i + 1][j], best[i][j + 1])
        i = j = 0
        while i < len(ones) and j < len(others):
            if weight[i][j] and best[i][j] == weight[i][j] + best[i + 1][j + 1]:
                if self._digest[ones[i]] == self._digest[others[j]]:
                    self._all(ones[i], others[j])
                else:
                    self._pair(ones[i], others[j])
                i, j = i + 1, j + 1
            elif best[i][j] == best[i + 1][j]:
                i += 1
            else:
                j += 1

    def _alike(self, one: OutlineNode, other: OutlineNode) -> float:
        """Return how alike two steps are, 0 = not one and the same."""
        if one.kind != other.kind:
            return 0.0
        if self._digest[one] == self._digest[other]:
            return 3.0
        says = self._says(one, other)
        if one.children or other.children:
            common = max(
                sum(1 for inner in one.below() if self._is_inside(self.to_new.get(inner), other)),
                self._equal_inside(one, other),
            )
            held = self._held(one, other, common)
            return 1.0 + says + held if held >= HOLDS / 2 or (one.fields and says >= SAYS) else 0.0
        if one.sub == other.sub:
            return 1.0 + says
        return 0.5 + says if says >= SAYS else 0.0

    def _equal_inside(self, one: OutlineNode, other: OutlineNode) -> float:
        """Return how many steps inside two containers are equal; those of one kind count a half."""
        (equal, kinds), (same, others) = self._contents(one), self._contents(other)
        return max(float((equal & same).total()), (kinds & others).total() / 2)

    def _contents(self, node: OutlineNode) -> tuple[Counter[object], Counter[object]]:
        if node not in self._inside:
            inner = [one for one in node.below() if one is not node and one.kind != "branch"]
            self._inside[node] = (
                Counter(self._digest[one] for one in inner),
                Counter((one.kind, one.sub) for one in inner),
            )
        return self._inside[node]

    def _is_inside(self, node: OutlineNode | None, other: OutlineNode) -> bool:
        at = self.parent[node] if node is not None else None
        while at is not None and at is not other:
            at = self.parent[at]
        return at is other

    def _says(self, one: OutlineNode, other: OutlineNode) -> float:
        """Return how much two nodes say the same, 0..1."""
        pair = self._digest[one], self._digest[other]
        if pair not in self._said:
            self._said[pair] = _alike_fields(one, other)
        return self._said[pair]

    # -- 5 -------------------------------------------------------------------------------------------------------------
    def _far(self) -> None:
        olds = [node for node in reversed(self._unmatched(self._olds)) if node.is_step]
        news: dict[tuple[str, str, str], list[OutlineNode]] = defaultdict(list)
        for node in reversed(self._unmatched(self._news)):
            news[node.scope, node.kind, node.sub].append(node)
        for node in olds:
            near = news[node.scope, node.kind, node.sub]
            if node in self.to_new or node.children or len(near) > 50:
                continue
            found = [one for one in near if one not in self.to_old and not one.children]
            best = max(found, key=lambda one: self._says(node, one), default=None)
            if best is not None and self._says(node, best) >= FAR:
                self._match(node, best)


def _alike_fields(one: OutlineNode, other: OutlineNode) -> float:
    keys = one.fields.keys() | other.fields.keys()
    total = 0.0
    for key in one.fields.keys() & other.fields.keys():
        before, after = one.fields[key].atoms, other.fields[key].atoms
        if before == after:
            total += 1.0
        else:
            same = (Counter(before) & Counter(after)).total()
            total += 0.8 * 2 * same / max(1, len(before) + len(after))
    return total / len(keys) if keys else 1.0


def rising(numbers: Sequence[int], weights: Sequence[int] | None = None) -> list[int]:
    """Return the places of the heaviest rising row in a list of different numbers."""
    heavy = weights or [1] * len(numbers)
    order = sorted(range(len(numbers)), key=lambda at: numbers[at])
    rank = {at: i + 1 for i, at in enumerate(order)}
    tree: list[tuple[int, int]] = [(0, -1)] * (len(numbers) + 1)  # a Fenwick tree of (weight, last place)
    before = [-1] * len(numbers)
    for at in range(len(numbers)):
        i, best = rank[at] - 1, (0, -1)
        while i > 0:
            best = max(best, tree[i])
            i -= i & -i
        before[at] = best[1]
        mine = (best[0] + heavy[at], at)
        i = rank[at]
        while i <= len(numbers):
            tree[i] = max(tree[i], mine)
            i += i & -i
    best = (0, -1)
    i = len(numbers)
    while i > 0:
        best = max(best, tree[i])
        i -= i & -i
    row, at = [], best[1]
    while at >= 0:
        row.append(at)
        at = before[at]
    return row[::-1]
