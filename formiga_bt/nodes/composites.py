"""Composites: sequence, fallback, if, switch, and the body of a call. Children run one after another, with memory.

A child's end starts the next child in the same pass. Skipped children (their `when` was false) are neither success nor
failure: a sequence passes over them, a fallback tries its next child; all skipped = skipped, except that a fallback fails
`nothing_applied`. An `if` without a branch to take counts as skipped.
"""

from collections.abc import Callable
from collections.abc import Sequence as Seq
from typing import ClassVar

from py_trees import composites
from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.lang.model import EvalError, UnknownState
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.ends import End
from formiga_bt.nodes.memory import CallMem, FallbackMem, IfMem, Mem, SequenceMem, SwitchMem
from formiga_bt.nodes.run import Failure, Run


def skipped_before(path: str) -> Failure:
    """Return what `error` is in a fallback's child when all children before it were skipped."""
    return Failure("nothing_applied", "every child before was skipped", path)


def adopt_children(parent: Node, children: Seq[Node]) -> None:
    """Make `children` the children of `parent`."""
    for child in children:
        child.parent = parent
    parent.children = list(children)


class Chain(Node):
    """Common part of nodes that run a list of children in order until one fails."""

    ran = False
    index = 0

    def body(self) -> list[Node]:
        """Return the children that this run goes through."""
        return self.children  # type: ignore[no-any-return]

    def memo(self) -> Mem:
        """Return the memory for the present place."""
        raise NotImplementedError

    def child_scope(self) -> str:
        """Return the scope of the children."""
        return self.scope

    def place(self, index: int) -> str:
        """Return the instance path of a child."""
        return f"{self.path}.{self.body()[index].seg}"

    def arrive(self, run: Run) -> None:
        """The child at `index` is about to start."""

    def start_chain(self, run: Run) -> Status:
        """Start from the first child."""
        self.ran, self.index = False, 0
        return self._advance(run, 0)

    def _advance(self, run: Run, index: int) -> Status:
        children = self.body()
        while index < len(children):
            self.index = index
            self.remember(run, self.memo())
            self.arrive(run)
            child = children[index]
            if child.enter(run, self.place(index), self.child_scope()) is RUNNING:
                return RUNNING
            ended = self._child_ended(child)
            if ended is not None:
                return ended
            index += 1
        return self.conclude(run)

    def _child_ended(self, child: Node) -> Status | None:
        if child.status is FAILURE:
            return self.fail_as(child.failure)
        self.ran = self.ran or not child.skipped
        if child.breaking:
            self.breaking = True
            return SUCCESS
        return None

    def conclude(self, run: Run) -> Status:  # noqa: ARG002
        """End after the last child."""
        self.skipped = not self.ran
        return SUCCESS

    def on_proceed(self, run: Run) -> Status:
        """Visit the running child; go on with the next when it ends."""
        child = self.body()[self.index]
        if child.proceed(run) is RUNNING:
            return RUNNING
        ended = self._child_ended(child)
        return ended if ended is not None else self._advance(run, self.index + 1)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the running child."""
        body = self.body()
        return body[self.index].halt(run) if self.index < len(body) else []

    def restore_chain(self, run: Run, index: int, *, ran: bool) -> None:
        """Rebuild the place in the chain."""
        self.index, self.ran = index, ran
        for done in self.body()[:index]:
            done.status = SUCCESS
        self.body()[index].restore(run, self.place(index), self.child_scope())


class SequenceNode(Chain, composites.Sequence):
    """`sequence`, and the root of every section."""

    kind: ClassVar[str] = "sequence"
    memory = True

    def __init__(self, name: str, step: model.Step | None, children: Seq[Node], joint: str = "") -> None:
        Node.__init__(self, name, step)
        self.joint = joint or ("/" if step is None else ".")
        self.tells = step is not None or self.joint == "/"  # not an item of a `for`, nor a `finally`
        adopt_children(self, children)

    @property
    def current_child(self) -> Node | None:  # type: ignore[override]
        """Return the running child, for py_trees' displays."""
        return self.body()[self.index] if self.children else None

    def place(self, index: int) -> str:
        """Return the path of a child; the root of a section is that section itself."""
        return f"{self.path}{self.joint}{self.body()[index].seg}"

    def memo(self) -> Mem:
        """Return the memory."""
        return SequenceMem(self.index, self.ran)

    def on_enter(self, run: Run) -> Status:
        """Start the first child."""
        return self.start_chain(run)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, SequenceMem)
        self.restore_chain(run, mem.index, ran=mem.ran)


class FallbackNode(Chain, composites.Selector):
    """`fallback`: the first child that succeeds."""

    kind: ClassVar[str] = "fallback"
    gives_error = True
    memory = True

    def __init__(self, name: str, step: model.Fallback, children: Seq[Node]) -> None:
        Node.__init__(self, name, step)
        adopt_children(self, children)
        self.last: Failure | None = None

    @property
    def current_child(self) -> Node | None:  # type: ignore[override]
        """Return the running child, for py_trees' displays."""
        return self.body()[self.index] if self.children else None

    def memo(self) -> Mem:
        """Return the memory."""
        return FallbackMem(self.index, self.last)

    def error_for_children(self) -> Failure | None:
        """Return the failure of the child before the running one; there is one for the later children."""
        return self.last or (skipped_before(self.path) if self.index else None)

    def on_enter(self, run: Run) -> Status:
        """Start the first child."""
        self.last = None
        return self.start_chain(run)

    def _child_ended(self, child: Node) -> Status | None:
        if child.status is FAILURE:
            self.last = child.failure
            return None
        return None if child.skipped else SUCCESS

    def conclude(self, run: Run) -> Status:  # noqa: ARG002
        """Fail: with the last child's failure, or `nothing_applied` when all were skipped."""
        if self.last is not None:
            return self.fail_as(self.last)
        return self.fail("nothing_applied", "every child of the fallback was skipped")

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, FallbackMem)
        self.last = mem.failure
        self.restore_chain(run, mem.index, ran=False)


class IfNode(Chain):
    """`if`: one of two lists of steps, chosen once at entry."""

    kind: ClassVar[str] = "if"

    def __init__(self, name: str, step: model.If, then: Seq[Node], otherwise: Seq[Node]) -> None:
        Node.__init__(self, name, step)
        self.step = step
        self.branches = {"then": list(then), "else": list(otherwise)}
        self.branch = "then"
        adopt_children(self, [*then, *otherwise])

    def body(self) -> list[Node]:
        """Return the branch taken."""
        return self.branches[self.branch]

    def memo(self) -> Mem:
        """Return the memory."""
        return IfMem(self.branch, self.index, self.ran)

    def on_enter(self, run: Run) -> Status:
        """Choose the branch and start it."""
        env = run.env(self.scope, self.error_here())
        self.branch = "then" if self.step.cond.run(env) else "else"
        return self.start_chain(run)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, IfMem)
        self.branch = mem.branch
        self.restore_chain(run, mem.index, ran=mem.ran)


class SwitchNode(Chain):
    """`switch`: one of several lists of steps, chosen once at entry by a value."""

    kind: ClassVar[str] = "switch"

    def __init__(self, name: str, step: model.Switch, cases: Seq[Seq[Node]], default: Seq[Node]) -> None:
        Node.__init__(self, name, step)
        self.step = step
        self.cases = [list(case) for case in cases]
        self.default = list(default)
        self.case: int | None = None
        adopt_children(self, [*(child for case in cases for child in case), *default])

    def body(self) -> list[Node]:
        """Return the branch taken."""
        return self.default if self.case is None else self.cases[self.case]

    def memo(self) -> Mem:
        """Return the memory."""
        return SwitchMem(self.case, self.index, self.ran)

    def on_enter(self, run: Run) -> Status:
        """Choose the branch and start it; a value that nothing stands for cannot be gone on with."""
        value = self.step.on.run(run.env(self.scope, self.error_here()))
        found = (index for index, case in enumerate(self.step.cases) if case.value == value)
        self.case = next(found, None)
        if self.case is None and not self.default:
            raise EvalError(f"{self.step.on.source} is {value!r}, which is none of the cases")
        return self.start_chain(run)

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, SwitchMem)
        self.case = mem.case
        self.restore_chain(run, mem.index, ran=mem.ran)


class CallNode(Chain):
    """`call`: a subtree's body in a scope of its own, which is its instance path."""

    kind: ClassVar[str] = "call"

    def __init__(self, name: str, step: model.Call, children: Seq[Node]) -> None:
        Node.__init__(self, name, step)
        self.step = step
        adopt_children(self, children)

    def memo(self) -> Mem:
        """Return the memory."""
        return CallMem(self.index, self.ran)

    def child_scope(self) -> str:
        """Return the call's own scope."""
        return self.path

    def place(self, index: int) -> str:
        """Return the path of a child, marked as inside the call."""
        return f"{self.path}.call.{self.body()[index].seg}"

    def on_enter(self, run: Run) -> Status:
        """Evaluate the arguments in the caller's scope, then start the body in the new one."""
        env = run.env(self.scope, self.error_here())
        values = {name: expr.run(env) for name, expr in self.step.args.items()}
        run.open_scope(self.path, values)
        try:
            for name, param in self.step.subtree.params.items():
                if name not in values and param.default is not None:
                    run.set_var(self.path, name, param.default.run(run.env(self.path)))
        except UnknownState:
            run.close_scope(self.path)
            raise
        return self._body(run, self.start_chain)

    def on_proceed(self, run: Run) -> Status:
        """Go on with the body."""
        return self._body(run, super().on_proceed)

    def on_halt(self, run: Run) -> list[End]:
        """Stop the body and forget its scope."""
        drained = super().on_halt(run)
        run.close_scope(self.path)
        return drained

    def conclude(self, run: Run) -> Status:
        """Save what the subtree returns; a call whose steps were all skipped is skipped."""
        returns = self.step.subtree.returns
        if self.step.save_as and returns is not None:
            run.set_var(self.scope, self.step.save_as, returns.run(run.env(self.path)))
        return super().conclude(run)

    def _body(self, run: Run, act: Callable[[Run], Status]) -> Status:
        try:
            status = act(run)
        except UnknownState:  # what it returns reads a state that is not known
            run.close_scope(self.path)
            raise
        if status is not RUNNING:
            run.close_scope(self.path)
        return status

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, CallMem)
        self.restore_chain(run, mem.index, ran=mem.ran)
