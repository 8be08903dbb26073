"""Measures of a tree against a reference tree, after the paper's equations: `ngram_tree`, `subtree_match`, `flow_match`.

They compare the JSON forms of tasks, not Python programs: their values stand beside the paper's CodeBLEU values for shape
only, and are never the same quantity. docs/experiments.md has the formulas. All lie from 0 to 1; a tree against itself is 1.
"""

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm.trees import KEYWORDS, Branch, flows, shapes, steps_of, tokens

KEYWORD_WEIGHT: Final = 5.0
ORDERS: Final = (1, 2, 3, 4)
ZERO_COUNT: Final = 0.1
"""An order without any match counts as so many matches, as in CodeBLEU's smoothing."""
NEAR: Final = 0.25
"""Trees whose relative edit distance is at most this are near-duplicates."""


class Measures(Struct, frozen=True):
    """How near a tree is to its reference."""

    ngram_tree: float
    subtree_match: float
    flow_match: float


def measure(candidate: Any, reference: Any) -> Measures:
    """Return all measures of a task in JSON form against another one."""
    return Measures(
        ngram_tree(tokens(candidate), tokens(reference)),
        _share(shapes(candidate), shapes(reference)),
        _share(flows(candidate), flows(reference)),
    )


def ngram_tree(candidate: Sequence[str], reference: Sequence[str]) -> float:
    """Return the weighted n-gram match (n = 1 to 4): n-grams with a keyword weigh five times as much."""
    if not candidate or not reference:
        return float(not candidate and not reference)
    logs = []
    for n in ORDERS:
        have, due = _grams(candidate, n), _grams(reference, n)
        if not have:
            continue
        total = sum(_weight(gram) * count for gram, count in have.items())
        match = sum(_weight(gram) * min(count, due[gram]) for gram, count in have.items())
        logs.append(math.log(max(match, ZERO_COUNT) / total))
    brevity = min(1.0, math.exp(1.0 - len(reference) / len(candidate)))
    return min(1.0, brevity * math.exp(math.fsum(logs) / len(logs)))


def _grams(words: Sequence[str], n: int) -> Counter[tuple[str, ...]]:
    return Counter(tuple(words[i : i + n]) for i in range(len(words) - n + 1))


def _weight(gram: tuple[str, ...]) -> float:
    return KEYWORD_WEIGHT if any(word in KEYWORDS for word in gram) else 1.0


def _share(candidate: Iterable[Hashable], reference: Iterable[Hashable]) -> float:
    """Return the share of the reference's items that the candidate has too, each counted as often as it occurs."""
    have, due = Counter(candidate), Counter(reference)
    total = due.total()
    return sum(min(count, have[one]) for one, count in due.items()) / total if total else float(not have)


def distance(a: Any, b: Any) -> float:
    """Return the edit distance of two tasks' trees of steps over the size of the larger, 0 to 1."""
    one, other = steps_of(a), steps_of(b)
    return min(1.0, _edits(one, other) / max(one.size, other.size))


def is_near(a: Any, b: Any, at_most: float = NEAR) -> bool:
    """Return whether one of two tasks is a near-duplicate of the other."""
    return distance(a, b) <= at_most


class _Ordered:
    """A tree in post-order, with the leftmost leaf below each node, as Zhang and Shasha want it."""

    def __init__(self, root: Branch) -> None:
        self.labels: list[str] = []
        self.leftmost: list[int] = []
        self._add(root)
        last = {left: i for i, left in enumerate(self.leftmost)}
        self.keyroots = sorted(last.values())

    def _add(self, node: Branch) -> int:
        lefts = [self._add(child) for child in node.children]
        left = lefts[0] if lefts else len(self.labels)
        self.labels.append(node.label)
        self.leftmost.append(left)
        return left


def _edits(a: Branch, b: Branch) -> int:
    """Return the least number of steps to add, drop or replace (Zhang and Shasha)."""
    x, y = _Ordered(a), _Ordered(b)
    trees = [[0] * len(y.labels) for _ in x.labels]
    for i in x.keyroots:
        for j in y.keyroots:
            _forest(x, y, i, j, trees)
    return trees[-1][-1]


def _forest(x: _Ordered, y: _Ordered, i: int, j: int, trees: list[list[int]]) -> None:
    li, lj = x.leftmost[i], y.leftmost[j]
    rows, columns = i - li + 2, j - lj + 2
    cost = [[r + c if r == 0 or c == 0 else 0 for c in range(columns)] for r in range(rows)]
    for r in range(1, rows):
        for c in range(1, columns):
            p, q = li + r - 1, lj + c - 1
            least = min(cost[r - 1][c], cost[r][c - 1]) + 1
            if x.leftmost[p] == li and y.leftmost[q] == lj:
                cost[r][c] = trees[p][q] = min(least, cost[r - 1][c - 1] + (x.labels[p] != y.labels[q]))
            else:
                cost[r][c] = min(least, cost[x.leftmost[p] - li][y.leftmost[q] - lj] + trees[p][q])
