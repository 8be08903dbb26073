"""The trees that every engine builds, written once, and as a task file for ours."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal

Kind = Literal["sequence", "fallback", "parallel", "timeout", "retry", "act", "check"]


@dataclass(frozen=True)
class Node:
    """One node.

    An `act` runs until its result comes from outside, a `check` holds at once. A timeout stands over a retry or an act, a retry
    over an act: so all engines have them.
    """

    kind: Kind
    children: tuple["Node", ...] = ()
    name: str = ""
    n: int = 0
    """Seconds of a timeout, attempts of a retry."""

    def walk(self) -> Iterator["Node"]:
        """Yield this node and all below, from the root, left to right."""
        yield self
        for child in self.children:
            yield from child.walk()


def sequence(*children: Node) -> Node:
    """Return a sequence with memory."""
    return Node("sequence", children)


def fallback(*children: Node) -> Node:
    """Return a fallback with memory."""
    return Node("fallback", children)


def timeout(seconds: int, child: Node) -> Node:
    """Return a child that fails after so long."""
    return Node("timeout", (child,), n=seconds)


def retry(attempts: int, child: Node) -> Node:
    """Return a child that is tried so often."""
    return Node("retry", (child,), n=attempts)


def act(name: str) -> Node:
    """Return an action."""
    return Node("act", name=name)


CHECK: Final = Node("check")


def twelve() -> Node:
    """Return the tree of bench_wake.py: one action deep down, checks before and after it."""
    inner = sequence(CHECK, timeout(7200, retry(3, act("deep"))), CHECK)
    return sequence(CHECK, timeout(10800, sequence(CHECK, fallback(inner, CHECK))))


def wide(width: int = 50) -> Node:
    """Return a parallel of actions."""
    return sequence(Node("parallel", tuple(act(f"wide_{i}") for i in range(width))))


def chain(depth: int = 28) -> Node:
    """Return sequences within sequences, each of which begins with a check, and an action at the bottom."""
    tree = act("bottom")
    for _ in range(depth):
        tree = sequence(CHECK, tree)
    return tree


def mission() -> Node:
    """Return a tree like the PickUp: out, land, a question that is put again, and home, ten actions one after another."""
    out = sequence(*(timeout(600, act(f"out_{i}")) for i in range(4)))
    home = sequence(*(timeout(600, act(f"home_{i}")) for i in range(3)))
    loaded = timeout(3600, retry(3, act("loaded")))
    return sequence(CHECK, out, timeout(600, act("land")), loaded, timeout(600, act("take_off")), home)


TREES: Final[Mapping[str, Node]] = MappingProxyType(
    {"twelve": twelve(), "watch": twelve(), "mission": mission(), "wide": wide(), "chain": chain()}
)
"""By name. The action of `watch` is a wait for a machine's charge: its news are looked at, and it goes on waiting."""

WATCH: Final = "watch"

ACTIONS_IN_TURN: Final = (
    "out_0",
    "out_1",
    "out_2",
    "out_3",
    "land",
    "loaded",
    "take_off",
    "home_0",
    "home_1",
    "home_2",
)
"""Of the mission."""


def task_text(name: str, tree: Node) -> str:
    """Return a tree as a task file of ours (JSON, which is YAML)."""
    import json

    assert tree.kind == "sequence", "a task's steps are a sequence"
    params: dict[str, Any] = {"n": {"type": "number", "default": 1}}
    task: dict[str, Any] = {"formiga": 1, "task": name.capitalize(), "params": params}
    deed: dict[str, Any] | None = None
    if name == WATCH:
        params["who"] = {"type": "agent", "of": ["cart"]}
        deed = {"wait_until": "who.battery < 20 %"}
    else:
        task["agents"] = {"worker": {"type": "worker", "id": "worker_0"}}
    return json.dumps({**task, "steps": [_step(child, deed) for child in tree.children]}, indent=1)


def _step(node: Node, deed: dict[str, Any] | None) -> dict[str, Any]:
    if node.kind in ("timeout", "retry"):
        step = _step(node.children[0], deed)
        if node.kind == "timeout":
            step["timeout"] = f"{node.n} s"
        else:
            step["retry"] = {"attempts": node.n}
        return step
    if node.kind == "act":
        return dict(deed) if deed is not None else {"do": "worker.Work", "with": {"leaf": node.name}}
    if node.kind == "check":
        return {"check": "n > 0"}
    return {node.kind: [_step(child, deed) for child in node.children]}
