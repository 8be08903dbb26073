"""py_trees: its own nodes, `root.tick()` drawn to its end."""

from collections.abc import Callable

from py_trees import behaviours, common, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.version import __version__

from benchmarks.peers.protocol import Mail
from benchmarks.peers.ticking import TickingFleet
from benchmarks.peers.trees import Node

WORDS = {Status.RUNNING: "running", Status.SUCCESS: "success", Status.FAILURE: "failure"}


class Act(Behaviour):
    """An action that runs until its result has come."""

    def __init__(self, name: str, mail: Mail) -> None:
        super().__init__(name)
        self.mail = mail

    def initialise(self) -> None:
        self.mail.running.add(self.name)

    def update(self) -> Status:
        result = self.mail.results.pop(self.name, None)
        if result is None:
            return Status.RUNNING
        return Status.SUCCESS if result else Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        del new_status
        self.mail.running.discard(self.name)


def built(node: Node, mail: Mail) -> Behaviour:
    """Return a node of py_trees."""
    below = [built(child, mail) for child in node.children]
    if node.kind == "act":
        return Act(node.name, mail)
    if node.kind == "check":
        return behaviours.Success("check")
    if node.kind == "timeout":
        return decorators.Timeout("timeout", below[0], float(node.n))
    if node.kind == "retry":
        return decorators.Retry("retry", below[0], node.n)
    if node.kind == "parallel":
        return composites.Parallel("parallel", common.ParallelPolicy.SuccessOnAll(), below)
    return {"sequence": composites.Sequence, "fallback": composites.Selector}[node.kind](
        node.kind, memory=True, children=below
    )


def ticker(root: Behaviour) -> Callable[[], str]:
    """Return what ticks a tree."""

    def tick() -> str:
        for _ in root.tick():
            pass
        return WORDS[root.status]

    return tick


class PyTrees:
    """py_trees."""

    name = "py_trees"
    given = "bare root.tick() without its BehaviourTree class, visitors or blackboards, which cost more"
    lacks: tuple[str, ...] = ()
    most = 1_000_000

    def version(self) -> str:
        return str(__version__)

    def build(self, tree: Node, name: str, count: int) -> TickingFleet:
        del name
        mails = [Mail() for _ in range(count)]
        return TickingFleet([ticker(built(tree, mail)) for mail in mails], mails)
