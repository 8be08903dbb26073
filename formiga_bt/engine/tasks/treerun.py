"""The trees of one task: they run passes until nothing is dirty, and tell which sections ended.

`TaskTrees` is the seam between the engine and whatever interprets a task's steps: `CompiledTrees` steps py_trees nodes along
the way to what was woken; the tests' naive interpreter walks the whole model each pass. Both act through `TaskRun`.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from msgspec import Struct

from formiga_bt.lang import model
from formiga_bt.nodes.base import FAILURE, RUNNING, LeafError, Node, Status
from formiga_bt.nodes.cleanup import FinallyNode
from formiga_bt.nodes.compile import compile_finally, compile_section
from formiga_bt.nodes.composites import SequenceNode
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.run import Failure, Run, Runaway


class Ended(Struct, frozen=True):
    """A section's tree ended. `failure` is None on success; `fatal` = nothing in the tree may catch it."""

    section: str
    failure: Failure | None = None
    fatal: bool = False


class TreeHost(Run, Protocol):
    """What the trees need of their task's run besides the services of nodes."""

    def flush(self) -> None:
        """Write the ends and the node memory of a pass as changes."""
        ...


class TaskTrees(Protocol):
    """The trees of one task."""

    def start(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        """Start a section in the next pass; with `at`, the `finally` of the stopped sequence of that path."""
        ...

    def take_over(
        self, section: str, tree: Any, steps: Sequence[model.Step], scope: str, at: str, error: Failure | None
    ) -> None:
        """Go on as a section with a `finally` that runs already: `tree` is what the nodes handed over."""
        ...

    def wake(self, key: str) -> None:
        """Make the node with this key due."""
        ...

    def run_passes(self) -> list[Ended]:
        """Run passes until nothing is dirty; return the sections that ended, in order."""
        ...

    def halt(self, section: str) -> list[End]:
        """Stop a section; return what must be waited for."""
        ...

    def restore(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        """Rebuild a running section from the task's memory."""
        ...

    def statuses(self) -> dict[str, str]:
        """Return the status of every node that is running, by key."""
        ...


TreesFactory = Callable[[TreeHost], TaskTrees]


class CompiledTrees:
    """py_trees nodes, stepped along the path to what was woken."""

    def __init__(self, host: TreeHost, *, tick: bool = False) -> None:
        self.host = host
        self.roots: dict[str, SequenceNode] = {}
        self._pending: list[tuple[str, str, str]] = []
        self._due = False
        """A node may be due for a visit."""
        self._nodes: dict[str, Node] = {}
        self._tick = tick
        """Drive the nodes by py_trees' own `tick()` instead of `proceed()`: for tests, the outcome is the same."""

    def register(self, key: str, node: Any) -> None:
        """Let wakes for `key` reach `node`."""
        self._nodes[key] = node

    def unregister(self, key: str) -> None:
        """Forget a key."""
        self._nodes.pop(key, None)

    def start(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        """Start a section in the next pass."""
        self.roots[section] = compile_finally(steps, error) if at else compile_section(section, steps)
        self._pending.append((section, at or section, scope))

    def take_over(
        self, section: str, tree: Any, steps: Sequence[model.Step], scope: str, at: str, error: Failure | None
    ) -> None:
        """Go on with a tree that runs already."""
        del steps, scope, at
        tree.parent, tree.error = None, error
        self.roots[section] = tree
        self._due = True

    def wake(self, key: str) -> None:
        """Make a node due, if it still runs and has something to do."""
        node = self._nodes.get(key)
        if node is not None and not node.is_quiet(self.host):
            node.wake()
            self._due = True

    def run_passes(self) -> list[Ended]:
        """Run passes until nothing is dirty."""
        ended: list[Ended] = []
        while self._due or self._pending:
            if self._pending:
                self._step(*self._pending.pop(0), ended)
            else:
                dirty = [section for section, root in self.roots.items() if root.dirty and root.status is RUNNING]
                if not dirty:
                    self._due = False
                    break
                for section in dirty:
                    self._step(section, "", "", ended)
            self.host.flush()
        return ended

    def _proceed(self, root: SequenceNode) -> Status:
        if self._tick:
            for _ in root.tick():
                pass
            return root.status
        return root.proceed(self.host)

    def _step(self, section: str, at: str, scope: str, ended: list[Ended]) -> None:
        """Enter the tree of a section at a path, or (no path) go on with it."""
        root = self.roots[section]
        try:
            status = root.enter(self.host, at, scope) if at else self._proceed(root)
        except LeafError as error:
            failure = Failure(code=error.code, reason=str(error), step=error.path, retryable=False)
            ended.append(Ended(section, failure, fatal=True))
            return
        except Runaway as error:
            failure = Failure(code="runaway", reason=str(error), step=section, retryable=False)
            ended.append(Ended(section, failure, fatal=True))
            return
        if status is not RUNNING:
            ended.append(Ended(section, root.failure if status is FAILURE else None))
            if isinstance(root, FinallyNode):
                del self.roots[section]

    def halt(self, section: str) -> list[End]:
        """Stop a section's tree."""
        self._pending = [item for item in self._pending if item[0] != section]
        root = self.roots.get(section)
        ends = root.halt(self.host) if root is not None else []
        if isinstance(root, FinallyNode):
            del self.roots[section]
        self.host.flush()
        return ends

    def restore(
        self, section: str, steps: Sequence[model.Step], scope: str, at: str = "", error: Failure | None = None
    ) -> None:
        """Rebuild a running section."""
        root = compile_finally(steps, error) if at else compile_section(section, steps)
        self.roots[section] = root
        root.restore(self.host, at or section, scope)

    def close(self) -> None:
        """Take the trees apart: nodes know their parents, so else only the garbage collector would find them."""
        for root in self.roots.values():
            for node in root.iterate():
                node.parent = None
                if isinstance(node, Node):
                    node.run = None
        self.roots.clear()
        self._nodes.clear()
        del self.host

    def statuses(self) -> dict[str, str]:
        """Return the running nodes by key."""
        found: dict[str, str] = {}
        for root in self.roots.values():
            for node in root.iterate():
                if isinstance(node, Node) and node.status is RUNNING:
                    found[node.key] = node.status.name
        return found
