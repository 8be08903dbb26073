"""Trees in the short form as edits see them: steps by their path, machines by their role. Nothing is changed in place."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.base.units import parse_quantity
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.shaping.walking import INNER
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.amounts import Amount
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

Step = Mapping[str, Any]
Path = tuple[str | int, ...]
Found = tuple[Path, Step]
Edited = tuple[Mapping[str, Any], str]
"""A tree, and what was done to it, in words."""
_TWICE: Final = ("if", "for", "repeat")
"""Kinds of steps whose inner steps may be done never, or several times."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A role of a machine."""

    name: str
    type: str
    count: int = 1
    id: str = ""


@dataclass(frozen=True, slots=True)
class EditCase:
    """A tree, what it was written for, and one thing that is wrong with it."""

    tree: Mapping[str, Any]
    words: Words
    world: RequestWorld
    verbs: Mapping[str, AgentVerb]
    wrong: Shortfall

    @property
    def machines(self) -> tuple[Machine, ...]:
        """Return the machines in the order in which the tree names them."""
        types, agents = self.world.catalogue.types, self.world.site.agents
        found = []
        for role in _dicts(self.tree.get("agents")):
            id_ = str(role.get("id") or "")
            type_ = agents[id_].type if id_ in agents else str(role.get("type"))
            if type_ in types and not types[type_].human and isinstance(role.get("name"), str):
                count = role.get("count")
                found.append(Machine(role["name"], type_, count if isinstance(count, int) else 1, id_))
        return tuple(found)

    @property
    def is_plain(self) -> bool:
        """Return whether each step is done once, whatever happens."""
        return not any(key in step for _, step in steps_of(self.tree) for key in _TWICE)

    def of(self, agent: str) -> list[Found]:
        """Return what an agent does, in the order in which it is written."""
        return [one for one in steps_of(self.tree) if one[1].get("agent") == agent and "do" in one[1]]


def steps_of(node: Mapping[str, Any], path: Path = ()) -> Iterator[Found]:
    """Yield each step below a node with its path, in the order in which they are written."""
    for key in INNER:
        listed = node.get(key)
        for index, step in enumerate(listed if isinstance(listed, list) else ()):
            if isinstance(step, dict):
                yield (*path, key, index), step
                yield from steps_of(step, (*path, key, index))


def put(tree: Mapping[str, Any], path: Path, steps: Sequence[Step]) -> dict[str, Any]:
    """Return a tree with other steps in place of one; several of them in a branch of a `parallel` are a sequence."""
    return span(tree, path, 1, steps)


def span(tree: Mapping[str, Any], path: Path, count: int, steps: Sequence[Step]) -> dict[str, Any]:
    """Return a tree with other steps in place of some that stand one after the other in one list."""
    key, index, rest = str(path[0]), int(path[1]), path[2:]
    listed = list(tree[key])
    if rest:
        listed[index] = span(listed[index], rest, count, steps)
    else:
        whole = [{"sequence": list(steps)}] if key == "parallel" and len(steps) > 1 else list(steps)
        listed[index : index + count] = whole
    return {**tree, key: listed}


def after(tree: Mapping[str, Any], path: Path, step: Step) -> dict[str, Any]:
    """Return a tree with a step behind the one at a path."""
    return put(tree, path, [at(tree, path), step])


def at_end(tree: Mapping[str, Any], *steps: Step) -> dict[str, Any]:
    """Return a tree with more steps at its end."""
    return {**tree, "steps": [*tree["steps"], *steps]}


def at(tree: Any, path: Path) -> Any:
    """Return what stands at a path."""
    for key in path:
        tree = tree[key]
    return tree


def next_to(tree: Mapping[str, Any], path: Path) -> Step | None:
    """Return the step that follows one in the same list, where they are done one after the other."""
    index, listed = int(path[-1]) + 1, at(tree, path[:-1])
    one = listed[index] if path[-2] != "parallel" and index < len(listed) else None
    return one if isinstance(one, dict) else None


def is_so(value: Any, amount: Amount) -> bool:
    """Return whether a value of the short form is an amount of the request."""
    found = parse_quantity(value) if isinstance(value, str) else None
    return found is not None and amount.means(*found)


def _dicts(value: Any) -> list[dict[str, Any]]:
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list) else []
