"""Helpers that read an expression for each item of a list, under the name `item`: `where(finds, item.score > 3)`.

Called by the checker. Neither a list nor what is read of its items may hold another such call: so the cost of a call grows
with the length of one list only.
"""

from collections.abc import Callable
from typing import Any, Final

from formiga_bt.lang.model import Env, EvalError
from formiga_bt.lang.types import AgentRef, Value

ITEM_NAME: Final = "item"
MOST_ITEMS: Final = 10_000
"""A longer list is not gone through item by item."""

Run = Callable[[Env], Any]
OverItems = Callable[[tuple[Any, ...], tuple[Any, ...]], Any]
"""Makes a result of the items, and of what was read of each of them."""


class ItemEnv:
    """An environment in which `item` has a value."""

    __slots__ = ("_env", "item")

    def __init__(self, env: Env) -> None:
        self._env = env
        self.item: Value = None

    def name(self, name: str) -> Value:
        """Return the item, or what the name means around."""
        return self.item if name == ITEM_NAME else self._env.name(name)

    def is_set(self, name: str) -> bool:
        """Return whether the name has a value."""
        return name == ITEM_NAME or self._env.is_set(name)

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        """Return an agent's field as last known."""
        return self._env.agent_field(agent, name)

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Return the agents of a type."""
        return self._env.members(agent_type)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return degrees."""
        return self._env.lat_lng(point)

    def place(self, lat: float, lng: float) -> Any:
        """Return a place."""
        return self._env.place(lat, lng)

    def ground_up_m(self, place: Any) -> float:
        """Return the height of the ground over the base's."""
        return self._env.ground_up_m(place)


def item_calls_code(make: OverItems, items: Run, inner: Run) -> Run:
    """Return the code that reads `inner` for each item and makes the result of that."""

    def run(env: Env) -> Any:
        found = items(env)
        if len(found) > MOST_ITEMS:
            raise EvalError(f"the list has {len(found)} items, {MOST_ITEMS} are the most that are gone through")
        around = ItemEnv(env)
        read = []
        for one in found:
            around.item = one
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
