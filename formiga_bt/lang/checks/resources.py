"""E111, E112, E113: what `with_resource` blocks may do while they hold, so that no two tasks wait for each other.

Who holds a resource waits for nothing but further resources, and for those everywhere in one order. Inside a task: a block
inside another one, calls included. Between tasks: the order in which blocks are nested, over all tasks that are checked
together.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath

from msgspec import Struct

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.lang.model import Call, Request, Site, Step, Task, WithAgents, WithResource
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import children

_TOGETHER = "take both at once: with_resource: [{}]"
_ONCE = "hold it once, in the outer block"


class NestedClaim(Struct, frozen=True):
    """A resource that is waited for while another one is held."""

    task: str
    outer: str
    inner: str
    at: Mark
    """The inner block, or the call that leads to it."""

    @property
    def said(self) -> str:
        """Return where it stands."""
        return f"{PurePath(self.at.file).name}:{self.at.line}"


def check_waits(steps: tuple[Step, ...], site: Site | None, problems: Problems) -> None:
    """Report E112 for who waits for agents or tasks while it holds a resource, E111 for blocks that need too much together."""
    reported: set[Mark] = set()
    for step, at, held in _inside(steps, {}, None):
        if at in reported:
            continue
        names = " and ".join(f"'{name}'" for name in held)
        if isinstance(step, WithAgents):
            reported.add(at)
            what = f"this waits for agents while it holds {names}: who has them may wait for the resource"
            problems.add("E112", at, what, "put with_resource inside with_agents")
        elif isinstance(step, Request) and step.wait:
            reported.add(at)
            what = f"this waits for {step.task} while it holds {names}: it may need them itself"
            problems.add("E112", at, what, "request it before or after the block, or with wait: false")
        elif isinstance(step, WithResource) and site is not None:
            for name, units in step.units.items():
                have = site.resources[name].capacity if name in site.resources else units
                if name in held and units <= have < units + held[name]:
                    reported.add(at)
                    what = f"'{name}' has {have} in all, and {held[name]} are held here already: this waits for ever"
                    problems.add("E111", at, what, _ONCE)


def _inside(
    steps: Iterable[Step], held: dict[str, int], call: Mark | None
) -> Iterator[tuple[Step, Mark, dict[str, int]]]:
    """Iterate over all steps inside blocks, calls included: where to report them, and what is held there."""
    for step in steps:
        at = call or step.mark
        if held:
            yield step, at, held
        if isinstance(step, Call):
            yield from _inside(step.subtree.steps, held, at)
        elif isinstance(step, WithResource):
            inside = {name: held.get(name, 0) + step.units.get(name, 0) for name in (*held, *step.units)}
            yield from _inside(step.steps, inside, call)
        else:
            yield from _inside(children(step), held, call)


def check_order(task: Task, problems: Problems) -> None:
    """Report E113 for blocks of one task that are nested in opposite orders."""
    told = [one.mark for one in problems.found if one.code == "E111"]  # it waits for ever, and for itself
    for one in _circles(list(_nested(task))):
        if one.mark in told:
            continue
        problems.add("E113", one.mark, one.message, one.help)


def check_orders(tasks: Sequence[Task]) -> list[Diagnostic]:
    """Return E113 for blocks of different tasks that are nested in opposite orders."""
    edges = [edge for task in tasks for edge in _nested(task)]
    return [one for one in _circles(edges) if one.within]


def _nested(task: Task) -> Iterator[NestedClaim]:
    seen: set[tuple[str, str]] = set()
    for steps in (task.steps, task.on_failure, task.on_abort, task.finally_):
        for step, at, held in _inside(steps, {}, None):
            for inner in step.units if isinstance(step, WithResource) else ():
                for outer in held:
                    if (outer, inner) not in seen:
                        seen.add((outer, inner))
                        yield NestedClaim(task.name, outer, inner, at)


def _circles(edges: list[NestedClaim]) -> list[Diagnostic]:
    """Return E113 for each circle among the orders, once for the resources that are in it; of several tasks with the task."""
    found: list[Diagnostic] = []
    told: set[frozenset[str]] = set()
    for number, edge in enumerate(edges):
        way = [edge] if edge.inner == edge.outer else _way_back(edge, edges[: number + 1])
        names = frozenset(one.outer for one in way)
        if not way or names in told:
            continue
        told.add(names)
        several = len({one.task for one in way}) > 1
        help_ = _TOGETHER.format(", ".join(sorted(names))) if len(names) > 1 else _ONCE
        found.append(Diagnostic("E113", edge.at, _told(way), help_, edge.task * several))
    return found


def _way_back(edge: NestedClaim, edges: Sequence[NestedClaim]) -> list[NestedClaim]:
    """Return a shortest circle of orders that begins with an edge, or nothing."""
    ways = [[edge]]
    seen = {edge.inner}
    while ways:
        longer: list[list[NestedClaim]] = []
        for way in ways:
            for one in edges:
                if one.outer != way[-1].inner:
                    continue
                if one.inner == edge.outer:
                    return [*way, one]
                if one.inner not in seen:
                    seen.add(one.inner)
                    longer.append([*way, one])
        ways = longer
    return []


def _told(way: Sequence[NestedClaim]) -> str:
    if len(way) == 1:
        return f"'{way[0].inner}' is taken while '{way[0].outer}' is held already: possible deadlock"
    several = len({one.task for one in way}) > 1
    parts = [
        f"{one.task + ' takes' if several else 'here'} '{one.inner}' {'' if several else 'is taken '}inside '{one.outer}'"
        + (f" ({one.said})" if number or several else "")
        for number, one in enumerate(way)
    ]
    return f"{'; '.join(parts)}: possible deadlock".replace("; here", "; and there")
