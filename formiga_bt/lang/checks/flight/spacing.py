"""W073: drones of one task sent closer to one another than `min_spacing`.

Only what is sure before any run: the rounds of a parallel `for` that all name one place, or go over places whose distances are
known (`sampled`; a param has its default), and branches of a parallel that end at one place. Called once for each body by
`checks`.
"""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Any, Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.sampled import Samples
from formiga_bt.lang.model import Call, Catalogue, Do, Expr, For, Parallel, Sequence, Step
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import agent_params, bare, children, plain_name

_MOST: Final = 200
"""Of a longer list nothing is said."""
_POINTS: Final = ("place", "position")


def check_spacing(
    steps: tuple[Step, ...], catalogue: Catalogue, samples: Samples, least_m: float, problems: Problems
) -> None:
    """Report W073 for the steps of a body and what is inside them; `least_m` is the site's `min_spacing`."""
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, For) and step.parallel and step.max_parallel != 1:
                _check_rounds(step, catalogue, samples, least_m, problems)
            if isinstance(step, Parallel):
                _check_branches(step, catalogue, least_m, problems)
            check_spacing(children(step), catalogue, samples, least_m, problems)


def _report(problems: Problems, mark: Mark, distance_m: float, least_m: float) -> None:
    apart = format_quantity("distance", round(distance_m, 1))
    least = format_quantity("distance", least_m)
    what = f"two drones are sent {apart} apart at {mark.said}; min_spacing is {least}"
    problems.add("W073", mark, what, "give each its own place, or its own height")


def _targets(step: Step, catalogue: Catalogue) -> Iterator[tuple[tuple[Expr, ...], Mark]]:
    """Iterate over where a step sends a drone: what says so, and the place in the file."""
    if isinstance(step, Do):
        spec = catalogue.actions.get(step.action)
        if spec is not None and spec.moves_to in step.fields:
            yield (step.fields[spec.moves_to],), step.fields[spec.moves_to].mark
    elif isinstance(step, Call):
        agents = agent_params(step.subtree)
        told = tuple(arg for name, arg in step.args.items() if name not in agents)
        points = [arg for arg in told if arg.type.name in _POINTS]
        if points and agents:
            yield told, points[0].mark
    else:
        for child in children(step):
            yield from _targets(child, catalogue)


def _check_rounds(step: For, catalogue: Catalogue, samples: Samples, least_m: float, problems: Problems) -> None:
    if not any(expr.type.item is not None and expr.type.item.name == "agent" for expr in step.lists.values()):
        return
    for child in step.steps:
        for told, mark in _targets(child, catalogue):
            reads = {read.name for expr in told for read in expr.reads}
            if not reads & step.lists.keys():
                _report(problems, mark, 0.0, least_m)
                return
            lists = [step.lists[name] for name in step.lists if name in reads]
            close = [_closest(value) for value in samples.values(lists[0])] if len(lists) == 1 else []
            if close and max(close) < least_m:
                _report(problems, mark, min(close), least_m)
                return


def _closest(points: Any) -> float:
    """Return how near to one another any two points of a list are."""
    pairs = combinations(points, 2) if isinstance(points, tuple) and len(points) <= _MOST else ()
    return min((d for a, b in pairs if (d := _apart(a, b)) is not None), default=math.inf)


def _check_branches(step: Parallel, catalogue: Catalogue, least_m: float, problems: Problems) -> None:
    ends = [end for branch in step.steps if (end := _end(branch, catalogue)) is not None]
    for (one, _), (other, mark) in combinations(ends, 2):
        distance = _apart(one.const, other.const) if one.is_const and other.is_const else None
        if distance is None and bare(one) and bare(one) == bare(other) and not any(read.field for read in one.reads):
            distance = 0.0
        if distance is not None and distance < least_m:
            _report(problems, mark, distance, least_m)
            return


def _end(step: Step, catalogue: Catalogue) -> tuple[Expr, Mark] | None:
    """Return where a branch surely leaves its drone."""
    if isinstance(step, Sequence) and step.steps:
        return _end(step.steps[-1], catalogue)
    if isinstance(step, Call) and step.when is None and step.subtree.steps:
        inner = _end(step.subtree.steps[-1], catalogue)
        given = step.args.get(plain_name(inner[0])) if inner is not None else None
        return (given, given.mark) if given is not None else None
    if not isinstance(step, Do) or step.when is not None:
        return None
    told = next(_targets(step, catalogue), None)
    return (told[0][0], told[1]) if told is not None else None


def _apart(one: Any, other: Any) -> float | None:
    """Return the distance of two points; None if one of them is none, or only one has a height."""
    if isinstance(one, Position) and isinstance(other, Position):
        return float((horizontal_m(one, other) ** 2 + (one.up_m - other.up_m) ** 2) ** 0.5)
    if isinstance(one, Place) and isinstance(other, Place):
        return float(horizontal_m(one, other))
    return None
