"""Helpers that read an expression for each item of a list, under the name `item`: `where(finds, item.score > 3)`.

Called by the checker. Neither a list nor what is read of its items may hold another such call: so the cost of a call grows
with the length of one list only.
"""

from collections.abc import Callable
from typing import Any, Final

from formiga_bt.lang.expr.around import EnvWith
from formiga_bt.lang.model import Env, EvalError

ITEM_NAME: Final = "item"
MOST_ITEMS: Final = 10_000
"""A longer list is not gone through item by item."""

Run = Callable[[Env], Any]
OverItems = Callable[[tuple[Any, ...], tuple[Any, ...]], Any]
"""Makes a result of the items, and of what was read of each of them."""


def item_calls_code(make: OverItems, items: Run, inner: Run) -> Run:
    """Return the code that reads `inner` for each item and makes the result of that."""

    def run(env: Env) -> Any:
        found = items(env)
        if len(found) > MOST_ITEMS:
            raise EvalError(f"the list has {len(found)} items, {MOST_ITEMS} are the most that are gone through")
        around = EnvWith(env, ITEM_NAME)
        read = []
        for one in found:
            around.value = one
            read.append(inner(around))
        return make(found, tuple(read))

    return run


def where(items: tuple[Any, ...], holds: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the items for which it holds."""
    return tuple(item for item, yes in zip(items, holds, strict=True) if yes)


def count(_items: tuple[Any, ...], holds: tuple[Any, ...]) -> int:
    """Return for how many it holds."""
    return sum(1 for yes in holds if yes)


def each(_items: tuple[Any, ...], values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return what was read of each item."""
    return values


def ordered(items: tuple[Any, ...], by: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the items from the least to the greatest; equal ones stay in their order."""
    return tuple(items[index] for index in sorted(range(len(items)), key=by.__getitem__))
