"""What lists of places are like before any run, wherever the places are that a caller gives.

How many places `circle(spot, 30 m, 6)` has, and how near to one another they are, does not depend on where `spot` is. So places
without a value are taken to be somewhere, twice: what comes out alike both times is so in every run.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.checks.known import Names, value_of
from formiga_bt.lang.model import Expr, Set, Site, Task
from formiga_bt.lang.types import Type, Value
from formiga_bt.lang.walk import all_steps

_TIMES: Final = (0, 1)


def length_of(expr: Expr, types: Mapping[str, Type], site: Site | None) -> int | None:
    """Return how many items a list has if what it reads are places only; None if that is not sure.

    Args:
        expr: the list.
        types: of the names that it reads.
        site: where `base` and the places of the site are.
    """
    lengths = set()
    for which in _TIMES:
        names = {name: place for name, place in _somewhere(types, which) if place is not None}
        value = value_of(expr, names, site)
        lengths.add(len(value) if isinstance(value, tuple) else None)
    return lengths.pop() if len(lengths) == 1 else None


class Samples:
    """The names of a task twice over: defaults of params, vars that no step sets, and places that may be anywhere.

    Args:
        task: whose names they are.
        site: where it is to run.
        sound: nothing of it was refused; of another task only constants are known.
    """

    def __init__(self, task: Task, site: Site | None, *, sound: bool) -> None:
        self._site = site
        self._names: list[Names] = []
        if not sound:
            return
        changed = {name for step in all_steps(task) if isinstance(step, Set) for name in step.assign}
        self._names = [self._all(task, changed, which) for which in _TIMES]

    def values(self, expr: Expr) -> list[Any]:
        """Return the value of an expression each time; empty if one of them is not known."""
        if expr.is_const:
            return [expr.const]
        found = [value_of(expr, names, self._site) for names in self._names]
        return [] if None in found else found

    def _all(self, task: Task, changed: set[str], which: int) -> Names:
        somewhere = dict(_somewhere({name: param.type for name, param in task.params.items()}, which))
        names: dict[str, Value] = {}
        for name, param in task.params.items():
            value = value_of(param.default, {}, self._site) if param.default is not None else somewhere[name]
            if value is not None:
                names[name] = value
        for name, expr in task.vars.items():
            value = value_of(expr, names, self._site) if name not in changed else None
            if value is not None:
                names[name] = value
        return names


def _somewhere(types: Mapping[str, Type], which: int) -> Iterator[tuple[str, Place | Position | None]]:
    """Iterate over names with a place for each that is one: each time another one, far from those of the other names."""
    for index, (name, type_) in enumerate(types.items(), start=1):
        east, north = 131.0 * index + 57.0 * which, 89.0 * index - 43.0 * which
        place = Place(east, north) if type_.name == "place" else None
        yield name, Position(east, north, 60.0) if type_.name == "position" else place
