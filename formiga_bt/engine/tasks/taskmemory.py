"""What the trees of one task remember: memory of nodes and names, written as changes after each pass."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.lang.model import MOST_VISITS
from formiga_bt.nodes.memory import Mem
from formiga_bt.nodes.run import AROUND, THROUGH, EndLetter, Failure, Runaway

NO_VALUES: Final[Mapping[str, Any]] = MappingProxyType({})


class TaskMemory:
    """Implements `NodeRun` (but for waking) and `NameRun`."""

    def __init__(self, core: Core, task_id: str) -> None:
        self._core = core
        self.task_id = task_id
        self._fresh: dict[str, Mem | None] = {}
        self._ended: list[tuple[str, str, str]] = []
        self._spent = 0
        self._spent_seq = -1

    def spend(self) -> None:
        """Count a visit against this input's budget."""
        if self._spent_seq != self._core.state.seq:
            self._spent_seq, self._spent = self._core.state.seq, 0
        self._spent += 1
        if self._spent > MOST_VISITS:
            self._spent = 0  # what cleans up after this runs in the same step, with a budget of its own
            raise Runaway(f"more than {MOST_VISITS} nodes visited for one input")

    def env(self, scope: str, error: Failure | None = None, extra: Mapping[str, Any] | None = None) -> TaskEnv:
        """Return the names of a scope."""
        state = self._core.state
        task = state.tasks[self.task_id]
        scopes = state.scopes.get(self.task_id)
        values = (scopes.get(scope) if scopes is not None else None) or NO_VALUES
        if error is None and task.section in ("on_failure", "finally"):
            error = task.outcome.failure
        return TaskEnv(self._core, task, values, error, extra)

    def remember(self, path: str, mem: Mem | None) -> None:
        """Keep a node's memory until the pass is over."""
        self._fresh[path] = mem

    def memory(self, path: str) -> Mem | None:
        """Return a node's memory."""
        if path in self._fresh:
            return self._fresh[path]
        return self._core.state.memory.get(self.task_id, {}).get(path)

    def ended(self, path: str, how: EndLetter, code: str = "") -> None:
        """Tell how a step ended when the pass is over."""
        self._ended.append((path, how, code))

    def flush(self) -> None:
        """Write what changed in a pass: which steps ended, then the memory of those that run."""
        if self._ended:
            self._core.emit(ch.NodesEnded(self.task_id, tuple(self._ended)))
            self._ended.clear()
        if self._fresh:
            self._core.keep_memory(self.task_id, self._fresh)
            self._fresh.clear()

    def open_scope(self, scope: str, values: Mapping[str, Any]) -> None:
        """Open a scope."""
        self._core.emit(ch.ScopePut(self.task_id, scope, dict(values)))

    def close_scope(self, scope: str) -> None:
        """Forget a scope."""
        if scope in self._core.state.scopes.get(self.task_id, {}):
            self._core.emit(ch.ScopePut(self.task_id, scope, None))

    def set_var(self, scope: str, name: str, value: Any) -> None:
        """Set a name, in the scope that it belongs to."""
        scopes = self._core.state.scopes[self.task_id]
        while THROUGH in scopes[scope] and name not in scopes[scope]:
            scope = scopes[scope][AROUND]
        self._core.emit(ch.VarPut(self.task_id, scope, name, value))
