"""W076: a step that changes nothing, because the one before it did the same.

Two equal steps in a row come from copying; who means it writes `repeat: 2`. A machine that is sent up or down to a height over
where it is, right after it was sent somewhere at that height, is there already. Waits and assignments may stand twice.
"""

import re
from collections.abc import Hashable, Mapping
from functools import cache
from itertools import pairwise
from typing import Any, Final, cast

from msgspec import Struct

from formiga_bt.lang.model import BreakIf, Catalogue, Do, Expr, Set, Step, Subtree, Wait
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import bare, children

_MAY_REPEAT: Final = (Wait, Set, BreakIf)
_PLACES: Final = ("mark", "seg", "room")
_HERE: Final = re.compile(r"at_height\(ground\((\w+)\.position\), (.+)\)")


def check_repeats(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    """Report W076 for the steps of a body and what is inside them."""
    for before, one in pairwise(steps):
        with problems.within(one.title):
            if not isinstance(one, _MAY_REPEAT) and not _follows(one) and same(before, one):
                what = f"this is the same as the step before it ({before.mark.said})"
                problems.add("W076", one.mark, what, "remove it; if it is meant, write repeat: 2")
            elif _is_there(before, one, catalogue):
                assert isinstance(one, Do)
                what = f"'{one.who.name}' is at this height already ({before.mark.said})"
                problems.add("W076", one.mark, what, "remove it, or put it before the other one")
    for step in steps:
        with problems.within(step.title):
            for body in bodies(step):
                check_repeats(body, catalogue, problems)


def _follows(step: Step) -> bool:
    """Return whether an order goes by what another agent does, and so is another one each time: fly over where they are now."""
    return isinstance(step, Do) and any(
        read.field and read.name != step.who.name and read.field != "home"
        for expr in step.fields.values()
        for read in expr.reads
    )


def bodies(step: Step) -> list[tuple[Step, ...]]:
    """Return the lists of steps inside a step that run in their order; branches of other steps stand alone."""
    found = []
    for name in parts_of(step):
        value = getattr(step, name)
        if isinstance(value, tuple) and value and isinstance(value[0], Step):
            found.append(value)
    if not found:
        return [(child,) for child in children(step)]
    in_order = step.kind not in ("parallel", "race", "fallback")
    return found if in_order else [(child,) for body in found for child in body]


def parts_of(value: Any) -> tuple[str, ...]:
    """Return the names of what a part of the model says, its places left out."""
    return _parts(cast("Hashable", type(value)))


@cache
def _parts(kind: Hashable) -> tuple[str, ...]:
    """Return the names of what a class of the model says, its places left out."""
    return tuple(name for name in cast("Any", kind).__struct_fields__ if name not in _PLACES)


def same(one: Any, other: Any) -> bool:
    """Return whether two parts of a model say the same, wherever they stand."""
    if type(one) is not type(other):
        return False
    match one:
        case Expr():
            return bool(one.source == other.source and one.type == other.type)
        case Subtree():
            return bool(one.mark == other.mark)
        case tuple():
            return len(one) == len(other) and all(map(same, one, other))
        case Mapping():
            return one.keys() == other.keys() and all(same(value, other[key]) for key, value in one.items())
    if isinstance(one, Struct):
        return all(same(getattr(one, name), getattr(other, name)) for name in parts_of(one))
    return bool(one == other)


def _is_there(before: Step, step: Step, catalogue: Catalogue) -> bool:
    """Return whether a machine is sent to a height over where it is that it was sent to at last."""
    if (
        not isinstance(before, Do)
        or not isinstance(step, Do)
        or before.who.name != step.who.name
        or before.when is not None
    ):
        return False
    spec = catalogue.actions.get(step.action)
    if spec is None or before.action != step.action or not spec.moves_to or before.ignore_failure:
        return False
    if spec.moves_to not in step.fields or spec.moves_to not in before.fields:
        return False
    found = _HERE.fullmatch(bare(step.fields[spec.moves_to]))
    last = bare(before.fields[spec.moves_to])
    return (
        found is not None
        and found[1] == step.who.name
        and last.startswith("at_height(")
        and last.endswith(f", {found[2]})")
    )
