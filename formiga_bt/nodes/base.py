"""The base of all nodes: a py_trees Behaviour that is stepped directly.

`enter` starts a node and returns its status at once (an instant action succeeds here), `proceed` steps a running node that
was woken, `halt` stops it and everything below. py_trees' own `tick()` is a generator around the same calls, so visitors,
tree handlers and displays of py_trees work on our trees.

Why not `Behaviour.__init__`: it makes a uuid4, a logger and a generator per node (4.5 us and 830 bytes, measured with
py_trees 2.6); we set what visitors and displays read and derive the rest on demand. `id` is a uuid5 of the path, so no
random number enters.
"""

import uuid
from collections.abc import Generator, Sequence
from typing import Any, ClassVar

from py_trees import common
from py_trees.behaviour import Behaviour
from py_trees.common import Status as Status

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import EvalError, Step, UnknownState, Unset, why_not_computed
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.memory import Mem
from formiga_bt.nodes.run import Failure, Run, Runaway, StepRun

RUNNING, SUCCESS, FAILURE, INVALID = Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID


class LeafError(Exception):
    """A leaf raised: a value that cannot be computed (`code` cannot_compute), or a bug (exception). It fails its own task only.

    `path` is the instance path of the innermost node; the original is the `__cause__`.
    """

    def __init__(self, path: str, mark: Mark | None, cause: Exception) -> None:
        super().__init__(f"{path} ({mark}): {why_not_computed(cause)}")
        self.path = path
        self.mark = mark
        self.code = "cannot_compute" if isinstance(cause, EvalError | Unset) else "exception"


class Node(Behaviour):
    """One node of a running tree.

    Life: `enter` once, `proceed` whenever it is dirty and RUNNING, then either it ends by itself (SUCCESS, FAILURE) or
    `halt` ends it (INVALID). After that it may be entered again, at another instance path.
    """

    kind: ClassVar[str] = "node"
    watches: ClassVar[bool] = False
    """Nodes of this class hold a watch while they run, which may set a deadline."""
    times: ClassVar[bool] = False
    """Nodes of this class set a deadline of their own."""
    gives_error: ClassVar[bool] = False
    """Nodes of this class may tell their children what `error` is."""
    tells = True
    """Its end is the end of its step, or of a section; False: another node tells of that."""

    # What a node that never ran has: of the class, so that it costs nothing before it is entered.
    parent: Any = None
    children: Any = ()
    status = INVALID
    feedback_message = ""
    blackbox_level = common.BlackBoxLevel.NOT_A_BLACKBOX
    path = ""
    suffix = ""
    """What its key has behind the path."""
    key = ""
    """Of this node's memory, deadline and wakes."""
    scope = ""
    dirty = False
    skipped = False
    breaking = False
    """A `break_if` below ended it: everything up to the nearest loop ends with success."""
    failure: Failure | None = None
    run: Run | None = None
    kept = False
    """It has memory, and may have a deadline and a watch."""

    def __init__(self, name: str, step: Step | None = None) -> None:
        # Deliberately not Behaviour.__init__ (see the module's head).
        self.name = name
        self.step_model = step
        self.seg = step.seg if step else ""

    # -- what py_trees reads -------------------------------------------------------------------------------------
    @property
    def id(self) -> uuid.UUID:  # type: ignore[override]  # py_trees has an attribute here
        """Return an id that is the same in every run: uuid5 of the path. Only py_trees' visitors need it."""
        return uuid.uuid5(uuid.NAMESPACE_OID, f"{self.path}:{self.kind}")

    @property
    def qualified_name(self) -> str:  # type: ignore[override]
        """Return the name."""
        return self.name

    @property
    def mark(self) -> Mark | None:
        """Return the source mark of the step."""
        return self.step_model.mark if self.step_model else None

    # -- our life cycle -------------------------------------------------------------------------------------------
    def enter(self, run: Run, path: str, scope: str) -> Status:
        """Start at an instance path in a scope; return the status, which may be terminal at once."""
        assert self.status is not RUNNING, f"{self.path} entered twice"
        self.run, self.path, self.scope = run, path, scope
        self.key = path + self.suffix
        self.dirty = self.skipped = self.breaking = False
        self.failure = None
        self.status = RUNNING
        run.spend()
        try:
            status = self.on_enter(run)
        except Exception as error:  # noqa: BLE001 - mapped to LeafError, or to a failure with its reason
            status = self._failed_by(error)
        return self._settle(run, status)

    def proceed(self, run: Run) -> Status:
        """Step a woken node. A node that was not woken, or does not run, is left as it is."""
        if not self.dirty or self.status is not RUNNING:
            return self.status
        self.dirty = False
        run.spend()
        try:
            status = self.on_proceed(run)
        except Exception as error:  # noqa: BLE001 - mapped to LeafError, or to a failure with its reason
            status = self._failed_by(error)
        if status is RUNNING:  # most visits end here: nothing to settle
            return status
        return self._settle(run, status)

    def halt(self, run: Run) -> list[End]:
        """Stop this node and all below; return the goals whose end the caller must wait for. May be called twice."""
        if self.status is not RUNNING:
            return []
        drained = self.on_halt(run)
        self.report_stopped(run)
        self._leave(run)
        self.status = INVALID
        return drained

    def restore(self, run: Run, path: str, scope: str) -> None:
        """Rebuild this running node from its memory."""
        self.run, self.path, self.scope = run, path, scope
        self.key = path + self.suffix
        self.status = RUNNING
        self.kept = True
        run.register(self.key, self)
        mem = run.memory(self.key)
        assert mem is not None, f"no memory for {self.key}"
        self.on_restore(run, mem)

    def is_quiet(self, run: Run) -> bool:  # noqa: ARG002
        """Return whether a visit now would change nothing: a node woken for nothing, and those around it, are not visited.

        Asked at each wake. It may answer False to be on the safe side, and must not raise.
        """
        return False

    def wake(self) -> None:
        """Make this node, and the way from the root to it, due for a visit."""
        node: Any = self
        while node is not None and not node.dirty:
            node.dirty = True
            node = node.parent

    # -- what a kind implements --------------------------------------------------------------------------------
    def on_enter(self, run: Run) -> Status:
        """Start. Return RUNNING (after `remember`), SUCCESS or FAILURE (after setting `failure`)."""
        raise NotImplementedError

    def on_proceed(self, run: Run) -> Status:
        """Go on after a wake."""
        raise NotImplementedError

    def on_halt(self, run: Run) -> list[End]:  # noqa: ARG002
        """Stop what this node has under way; return the goals to wait for."""
        return []

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Rebuild caches and children from memory."""

    # -- common ----------------------------------------------------------------------------------------------------
    def remember(self, run: StepRun, mem: Mem) -> None:
        """Keep memory under this node's key, and be reachable for wakes."""
        key = self.key
        run.remember(key, mem)
        if not self.kept:
            self.kept = True
            run.register(key, self)

    def fail(
        self, code: str, reason: str = "", agent: str = "", *, retryable: bool = True, by_another: bool = False
    ) -> Status:
        """Set the failure and return FAILURE."""
        self.failure = Failure(
            code=code, reason=reason, step=self.path, agent=agent, retryable=retryable, by_another=by_another
        )
        return FAILURE

    def unset(self, run: Run, names: Sequence[str]) -> None:
        """Take the value of each of these names of its scope that has one."""
        for name in names:
            if run.env(self.scope).is_set(name):
                run.set_var(self.scope, name, None)

    def fail_as(self, failure: Failure | None) -> Status:
        """Fail with a child's failure."""
        assert failure is not None
        self.failure = failure
        return FAILURE

    def error_here(self) -> Failure | None:
        """Return the failure that `error` names at this place: that of the nearest fallback's former child."""
        node: Any = self.parent
        while node is not None:
            if node.gives_error:
                failure: Failure | None = node.error_for_children()
                if failure is not None:
                    return failure
            elif node.kind == "call":
                return None
            node = node.parent
        return None

    def error_for_children(self) -> Failure | None:
        """Return the failure that the children of this node may read, if it provides one."""
        return None

    def _failed_by(self, error: Exception) -> Status:
        if isinstance(error, LeafError | Runaway):
            raise error
        if isinstance(error, UnknownState):
            return self.fail("unknown_state", f"{error.key} is not known yet")
        raise LeafError(self.path, self.mark, error) from error

    def _settle(self, run: StepRun, status: Status) -> Status:
        self.status = status
        if status is not RUNNING:
            self.feedback_message = self.failure.code if self.failure else ""
            self.report_end(run)
            self._leave(run)
        return status

    def report_end(self, run: StepRun) -> None:
        """Tell how the step ended."""
        if not self.tells:
            return
        if self.status is FAILURE:
            run.ended(self.path, "F", self.failure.code if self.failure else "")
        else:
            run.ended(self.path, "K" if self.skipped else "S")

    def report_stopped(self, run: StepRun) -> None:
        """Tell that the step was stopped."""
        if self.tells:
            run.ended(self.path, "H")

    def _leave(self, run: StepRun) -> None:
        self.dirty = False
        if not self.kept:
            return
        self.kept = False
        key = self.key
        if self.watches:
            run.clear_deadline(key)
            run.unwatch(key)
        elif self.times:
            run.clear_deadline(key)
        run.remember(key, None)
        run.unregister(key)

    # -- py_trees' own driving -----------------------------------------------------------------------------------
    def tick(self) -> Generator[Behaviour, None, None]:
        """Step this tree as py_trees does: visit what was woken, then yield every node that has run, children first."""
        if self.run is not None and self.status is RUNNING:
            self.proceed(self.run)
        for node in self.iterate():
            if node.status is not INVALID:
                yield node

    def update(self) -> Status:
        """Return the status; py_trees asks for this method, our stepping does not use it."""
        return self.status

    def stop(self, new_status: Status = INVALID) -> None:
        """Stop this tree (py_trees' word); goals under way are canceled, nothing waits for them here."""
        assert new_status is INVALID, "only a node itself ends with SUCCESS or FAILURE"
        if self.run is not None:
            self.halt(self.run)

    def tip(self) -> Behaviour | None:
        """Return the deepest running node, for py_trees' displays."""
        for child in self.children:
            if child.status is RUNNING:
                return child.tip()  # type: ignore[no-any-return]
        return self if self.status is not INVALID else None
