"""Which machines an expression stands for, as keys of a sky: a role, one item of a list, or all of a list."""

import re
from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.lang.checks.flight.flight_states import Sky, States, merge
from formiga_bt.lang.checks.known import agents_of
from formiga_bt.lang.model import Expr, For, Step
from formiga_bt.lang.types import AgentRef, Value
from formiga_bt.lang.walk import bare, commands, item_name

_AROUND: Final = re.compile(r"reverse\((.*)\)")


class MachineSet(Struct, frozen=True):
    """The machines that an expression stands for. `all`: every one of them, so that what happens to it happens to each."""

    name: str
    keys: tuple[str, ...]
    all: bool = True
    open: bool = False
    """Of a list of unknown length, which may be empty."""
    twice: bool = False
    """A list that has one of them more than once."""

    def states(self, sky: Sky) -> States:
        """Return the states of any of them."""
        return merge(sky[key] for key in self.keys)


def machines_of(expr: Expr, sky: Sky) -> MachineSet:
    """Return the machines that an expression stands for; no keys if there are none that fly."""
    name, item = item_name(expr)
    if not name and (found := _AROUND.fullmatch(bare(expr))) is not None:
        name = found[1].strip()
    listed = _listed(name, sky)
    if name in sky:
        return MachineSet(name, (name,))
    if name and not item and listed:
        return MachineSet(name, listed, open=listed[0].endswith("[*]"))
    value = agents_of(expr, _names(sky))
    if value is not None:  # an agent that is written by its id is none of the machines of the task
        every = [one.id for one in ((value,) if isinstance(value, AgentRef) else value) if one.id in sky]
        those = tuple(dict.fromkeys(every))
        first = "".join(those[:1])
        return MachineSet(
            first if isinstance(value, AgentRef) else first.partition("[")[0], those, twice=len(those) < len(every)
        )
    if item and listed:
        one = listed[-1] if item == "[-1]" else name + item
        return (
            MachineSet(name + item, (one,))
            if one in sky and one[-2] != "*"
            else MachineSet(name + item, listed, all=False)
        )
    reads = tuple(dict.fromkeys(read.name for read in expr.reads if not read.field))
    keys = tuple(key for one in reads for key in ((one,) if one in sky else _listed(one, sky)))
    display = expr.source == "" or re.fullmatch(r"\[[\w\s,]*\]", bare(expr)) is not None
    return MachineSet("".join(reads[:1]), keys, all=display and keys == reads)


def _names(sky: Sky) -> dict[str, Value]:
    """Return the machines of a sky as what expressions read; lists of unknown length are left out."""
    names: dict[str, Value] = {}
    lists: dict[str, list[AgentRef]] = {}
    for key in sky:
        name, item, index = key.partition("[")
        if not item:
            names[name] = AgentRef(key)
        elif index != "*]":
            lists.setdefault(name, []).append(AgentRef(key))
    return {**names, **{name: tuple(machines) for name, machines in lists.items()}}


def twins_of(bound: Mapping[str, MachineSet], step: For | None = None) -> dict[str, str]:
    """Return the local names that surely are the same machine as an earlier one, with that one.

    Of params of a subtree those that get one machine; of the names of a loop (`step`) those that go over the same list.
    """
    twins: dict[str, str] = {}
    first: dict[tuple[str, ...], str] = {}
    for name, one in bound.items():
        word = bare(step.lists[name]) if step is not None else ""
        if one.all and (word if step is not None else len(one.keys) == 1 and not name.endswith("[*]")):
            known = first.setdefault((word, *one.keys), name)
            if known != name:
                twins[name] = known
    return twins


def both(twins: Mapping[str, str]) -> str:
    """Return in words which names are one machine."""
    return ", ".join(f"it is both '{one}' and '{other}'" for other, one in twins.items())


def _listed(name: str, sky: Sky) -> tuple[str, ...]:
    return tuple(key for key in sky if key.startswith(f"{name}[")) if name else ()


def back(sky: Sky, end: Sky | None, bound: Mapping[str, MachineSet]) -> Sky | None:
    """Return a sky with what happened to the machines that had local names."""
    if end is None:
        return None
    after = {
        key: states if key in bound else end.get(key, states) for key, states in sky.items()
    }  # one may be called so too
    for name, one in bound.items():
        for key in one.keys:
            after[key] = end[name] if one.all else merge((sky[key], end[name]))
    return after


def commanded(step: Step, sky: Sky) -> list[str]:
    """Return the keys of the machines that a step commands."""
    found: dict[str, None] = {}
    for agents, _ in commands(step, {}):
        for agent in agents:
            name = agent.partition("[")[0]
            one = (agent,) if agent in sky else _listed(name, sky)
            found.update(dict.fromkeys(one))
    return list(found)


def is_filled(step: For) -> bool:
    """Return whether a `for` surely goes over at least one item."""
    return any(isinstance(expr.const, tuple) and expr.const for expr in step.lists.values())
