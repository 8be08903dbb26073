"""BehaviorTree.CPP, compiled, through the package `behaviortreepy` (extra `btcpp`).

`Sleep`, `Timeout` and `Delay` start a thread for each node, so none of them is ever used here: a timeout becomes a retry of one
attempt, which is the same number of nodes and has no clock. Building stops if threads appear all the same.
"""

import os
from collections.abc import Callable
from importlib.metadata import version
from types import ModuleType
from typing import Any
from xml.sax.saxutils import quoteattr

from benchmarks.peers.protocol import Mail
from benchmarks.peers.ticking import TickingFleet
from benchmarks.peers.trees import Node

THREADS = 2
"""So many more may the process have after the first trees; beyond, nodes have threads of their own."""
TRIED = 2
FORBIDDEN = ("<Sleep", "<Timeout", "<Delay")
TAGS = {"sequence": "Sequence", "fallback": "Fallback", "parallel": "Parallel"}


def xml_of(tree: Node, native: bool) -> str:
    """Return a tree as XML; `native`: actions are nodes of BT.CPP's own that wait for a blackboard key."""

    def element(node: Node) -> str:
        below = "".join(element(child) for child in node.children)
        if node.kind == "act":
            if native:
                return f'<WaitValueUpdate entry="{{{node.name}}}"><AlwaysSuccess/></WaitValueUpdate>'
            return f"<{node.name} name={quoteattr(node.name)}/>"
        if node.kind == "check":
            return "<AlwaysSuccess/>"
        if node.kind in ("timeout", "retry"):
            attempts = node.n if node.kind == "retry" else 1
            return f'<RetryUntilSuccessful num_attempts="{attempts}">{below}</RetryUntilSuccessful>'
        extra = ' success_count="-1" failure_count="1"' if node.kind == "parallel" else ""
        return f"<{TAGS[node.kind]}{extra}>{below}</{TAGS[node.kind]}>"

    text = f'<root BTCPP_format="4"><BehaviorTree ID="T">{element(tree)}</BehaviorTree></root>'
    assert not any(word in text for word in FORBIDDEN), "these start a thread each"
    return text


class CompiledFleet(TickingFleet):
    """Trees of one factory, which must outlive them."""

    def __init__(self, trees: list[Any], ticks: list[Callable[[], str]], mails: list[Mail], factory: Any) -> None:
        self.factory = factory
        self.trees = trees
        super().__init__(ticks, mails)

    def close(self) -> None:
        super().close()
        self.trees.clear()
        self.factory = None


class NativeFleet(CompiledFleet):
    """Trees whose actions wait for a key of their own blackboard."""

    def results(self, trees: Any, action: str, ok: bool = True) -> None:
        assert ok, "a native action only succeeds"
        for tree in trees:
            self.trees[tree].root_blackboard().set_int(action, 1)
            self.tick(tree)

    def running(self, tree: int) -> frozenset[str]:
        raise NotImplementedError("the package does not show a tree's nodes")


class BtCpp:
    """BehaviorTree.CPP with actions in Python, or with its own."""

    lacks: tuple[str, ...] = ()
    most = 10_000

    def __init__(self, native: bool = False) -> None:
        self.native = native
        self.name = "BT.CPP native leaves" if native else "BT.CPP python leaves"
        leaves = "WaitValueUpdate of its own" if native else "Python functions, one for each action of the file"
        self.given = (
            f"compiled; a retry of one attempt for each timeout (its Timeout has a thread a node); leaves: {leaves}"
        )

    def version(self) -> str:
        import behaviortreepy

        del behaviortreepy
        return f"behaviortreepy {version('behaviortreepy')}"

    def build(self, tree: Node, name: str, count: int) -> CompiledFleet:
        del name
        import behaviortreepy as bt

        words = {bt.NodeStatus.RUNNING: "running", bt.NodeStatus.SUCCESS: "success", bt.NodeStatus.FAILURE: "failure"}
        before = threads()
        factory = bt.BehaviorTreeFactory()
        turn = [Mail()]
        """The mail of the tree that is ticked: so a leaf needs no look-up of which instance it belongs to."""
        if not self.native:
            for action in sorted({node.name for node in tree.walk() if node.kind == "act"}):
                _register(bt, factory, action, turn)
        factory.register_behavior_tree_from_text(xml_of(tree, self.native))
        trees: list[Any] = []
        mails: list[Mail] = []
        for made in range(count):
            trees.append(factory.create_tree("T"))
            mails.append(Mail())
            if made < TRIED:
                turn[0] = mails[-1]
                trees[-1].tick_exactly_once()
                refuse_threads(before)
        ticks = [_ticker(one, mail, turn, words) for one, mail in zip(trees, mails, strict=True)]
        return (NativeFleet if self.native else CompiledFleet)(trees, ticks, mails, factory)


def _ticker(tree: Any, mail: Mail, turn: list[Mail], words: dict[Any, str]) -> Callable[[], str]:
    once = tree.tick_exactly_once  # no look at the wake-up signal, which costs more than the tick

    def tick() -> str:
        turn[0] = mail
        return words[once()]

    return tick


def _register(bt: ModuleType, factory: Any, action: str, turn: list[Mail]) -> None:
    running, success, failure = bt.NodeStatus.RUNNING, bt.NodeStatus.SUCCESS, bt.NodeStatus.FAILURE

    def on_start(_: Any) -> Any:
        turn[0].running.add(action)
        return running

    def on_running(_: Any) -> Any:
        result = turn[0].results.pop(action, None)
        if result is None:
            return running
        turn[0].running.discard(action)
        return success if result else failure

    factory.register_simple_stateful_action(action, on_start, on_running, lambda _: turn[0].running.discard(action))


def threads() -> int:
    """Return how many threads this process has, whoever started them."""
    return len(os.listdir("/proc/self/task"))


def refuse_threads(before: int) -> None:
    """Let nothing more be built if there are many more threads than before.

    Raises:
        RuntimeError: there are.
    """
    new = threads() - before
    if new > THREADS:
        raise RuntimeError(f"{new} new threads after the first trees: some node starts its own; nothing more is built")
