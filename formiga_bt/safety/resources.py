"""Resources of the site: who takes up how much of one, and which legs and goals must wait for it.

A machine inside the region of a resource takes up a unit of it, whoever has claimed it. A task with a claim takes up what it
claims, or what its machines inside take up, if that is more; a machine inside whose task has no claim takes up a unit of its
own.

| goal | it may go |
|---|---|
| a leg through the region, of `steps` or of cleanup | if its task holds a unit that none of its machines takes up |
| a leg of a way home, or of an order | if a unit is free, or its task holds one |
| a leg of a machine inside that ends outside, or is part of a way home | always: it only leaves |
| an action that guards the resource (`Close`) | if nobody is inside, or on the way in; else it is refused |
"""

from collections.abc import Mapping
from typing import Literal

from msgspec import Struct

from formiga_bt.safety.gate import Hold, Refuse


class ResourceUse(Struct, frozen=True):
    """One resource now."""

    name: str
    capacity: int
    claimed: Mapping[str, int]
    """Task -> units that it holds."""
    inside: Mapping[str, str]
    """Machine that takes it up -> its task, "" = none."""

    def taken_by_others(self, task: str) -> int:
        """Return how many units all but a task take up: other tasks, and machines of no task."""
        inside: dict[str, int] = {}
        alone = 0
        for owner in self.inside.values():
            if not owner:
                alone += 1
            else:
                inside[owner] = inside.get(owner, 0) + 1
        owners = dict.fromkeys((*self.claimed, *inside))
        return alone + sum(max(self.claimed.get(o, 0), inside.get(o, 0)) for o in owners if o != task)

    def inside_of(self, task: str) -> int:
        """Return how many machines of a task take it up."""
        return sum(owner == task for owner in self.inside.values()) if task else 0


def holders_of(use: ResourceUse, but: str) -> tuple[str, ...]:
    """Return who takes up a resource, tasks before machines, all but a task or machine."""
    machines = [agent for agent, task in use.inside.items() if task not in use.claimed]
    return tuple(one for one in (*use.claimed, *machines) if one != but)


Passage = Literal["enters", "stays", "leaves"]
"""What a leg does with a region: it begins outside; inside and stays, or goes through again; inside and ends outside."""


def may_pass(use: ResourceUse, agent: str, task: str, passage: Passage, *, rescue: bool, shutting: str) -> Hold | None:
    """Return what a leg through a region waits for; None = it may go.

    Args:
        use: of the resource.
        agent: the machine.
        task: its task, "" = none.
        passage: what the leg does with the region.
        rescue: it is part of a way home, or carries out an order.
        shutting: a machine whose action under way guards the resource, or "".
    """
    inside = agent in use.inside
    if inside and (rescue or passage == "leaves"):
        return None
    claimed = use.claimed.get(task, 0)
    if not inside and shutting:
        return Hold("resource_busy", f"{use.name}: {shutting}")
    if not claimed and not rescue:
        return Hold("no_claim", use.name)
    if inside:
        return None
    mine = use.inside_of(task) + 1
    if not rescue and mine > claimed:
        return Hold("resource_busy", f"{use.name}: {', '.join(a for a, of in use.inside.items() if of == task)}")
    if use.taken_by_others(task) + max(claimed, mine) > use.capacity:
        return Hold("resource_busy", f"{use.name}: {', '.join(holders_of(use, task))}")
    return None


def may_shut(use: ResourceUse, agent: str) -> Refuse | None:
    """Return why an action that guards a resource must not begin; None = nobody is inside."""
    others = [one for one in use.inside if one != agent]
    return Refuse("occupied", f"{use.name} is occupied by {', '.join(others)}") if others else None
