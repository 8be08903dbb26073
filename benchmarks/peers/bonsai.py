"""bonsai: compiled (Rust), through the package `bonsai-bt` (extra `peers`). Time is handed in with each tick."""

from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from benchmarks.peers.protocol import Mail
from benchmarks.peers.ticking import TickingFleet
from benchmarks.peers.trees import Node

TICK_S = 0.0
"""No time passes in the trees, so that no timeout is ever reached."""


class Bonsai:
    """bonsai-bt."""

    name = "bonsai-bt"
    given = "compiled; it has no retry: a sequence of one child stands there (ours retries)"
    lacks: tuple[str, ...] = ()
    most = 1_000_000

    def version(self) -> str:
        import bonsai_bt

        del bonsai_bt
        return version("bonsai-bt")

    def build(self, tree: Node, name: str, count: int) -> TickingFleet:
        del name
        import bonsai_bt as bt

        shape = _built(bt, tree)
        mails = [Mail() for _ in range(count)]
        return TickingFleet([_ticker(bt, shape, mail) for mail in mails], mails)


def _built(bt: Any, node: Node) -> Any:
    below = [_built(bt, child) for child in node.children]
    if node.kind == "act":
        return bt.Action(node.name)
    if node.kind == "check":
        return bt.Action("")
    if node.kind == "timeout":
        return bt.Timeout(float(node.n), below[0])
    if node.kind == "parallel":
        return bt.WhenAll(below)
    return bt.Select(below) if node.kind == "fallback" else bt.Sequence(below)


def _ticker(bt: Any, shape: Any, mail: Mail) -> Callable[[], str]:
    tree = bt.BT(shape, None)
    running, success, failure = bt.RUNNING, (bt.Status.Success, 0.0), (bt.Status.Failure, 0.0)
    words = {bt.Status.Running: "running", bt.Status.Success: "success", bt.Status.Failure: "failure"}

    def leaf(args: Any, _: Any) -> Any:
        action = args.action
        if not action:
            return success
        result = mail.results.pop(action, None)
        if result is None:
            mail.running.add(action)
            return running
        mail.running.discard(action)
        return success if result else failure

    def tick() -> str:
        ended = tree.tick(TICK_S, leaf)
        return words[ended[0]] if ended is not None else "running"

    return tick
