"""Coverage: which steps and branches of a task the cases reached.

A step counts when it was begun, wherever it was called from; the steps of libraries count too if the task calls them. Branches
are those of the task's own file: the ways through `if` and `switch`, and for `when` both that it held and that the step was
skipped. What only brought a drone home after the task's end does not count.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import If, Step, Switch, Task
from formiga_bt.lang.walk import all_steps
from formiga_bt.nodes.base import Node, Status
from formiga_bt.nodes.composites import IfNode, SwitchNode
from formiga_bt.nodes.decorators import Modifier, WhenNode
from formiga_bt.nodes.run import Run

RECOVER: Final = "recover"
"""Sections whose name begins so bring machines home; their steps are no part of the task."""

Branch = tuple[Mark, str]


@dataclass(slots=True)
class Coverage:
    """What cases reached of one task, so far."""

    task: Task
    steps: dict[Mark, Step] = field(default_factory=dict)
    branches: dict[Branch, Step] = field(default_factory=dict)
    """By the step and the way in words: `then`, `else`, `case yes`, `default`, `when`, `skipped`."""
    reached: set[Mark] = field(default_factory=set)
    taken: set[Branch] = field(default_factory=set)

    def __post_init__(self) -> None:
        for step in all_steps(self.task):
            self.steps.setdefault(step.mark, step)
            if step.mark.file == self.task.mark.file:
                self.branches.update({(step.mark, way): step for way in _ways(step)})

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Let count what runs in this process inside the context.

        Nodes are watched by their class, for its time: many are built while a tree runs (the items of a `for`), and no node
        knows of tests.
        """
        enter: Callable[[Node, Run, str, str], Status] = Node.enter
        count = 0

        def watched(node: Node, run: Run, path: str, scope: str) -> Status:
            nonlocal count
            count += 1
            mine = count
            status = enter(node, run, path, scope)
            self.saw(node, went_in=count > mine)
            return status

        setattr(Node, "enter", watched)  # noqa: B010  (mypy is right that a method is no variable)
        try:
            yield
        finally:
            setattr(Node, "enter", enter)  # noqa: B010

    def saw(self, node: Node, *, went_in: bool) -> None:
        """Take note of a node that was entered; `went_in`: it entered another one at once."""
        step = node.step_model
        if step is None or step.mark not in self.steps or node.path.startswith(RECOVER):
            return
        if isinstance(node, WhenNode):
            self.taken.add((step.mark, "when" if went_in else "skipped"))
        elif not isinstance(node, Modifier):
            self.reached.add(step.mark)
        if isinstance(node, IfNode):
            self.taken.add((step.mark, node.branch))
        elif isinstance(node, SwitchNode) and isinstance(step, Switch):
            self.taken.add((step.mark, "default" if node.case is None else f"case {step.cases[node.case].value}"))

    @property
    def missed(self) -> list[Step]:
        """Return the steps that no case reached, in the order of the files."""
        return [step for mark, step in self.steps.items() if mark not in self.reached]

    @property
    def untaken(self) -> list[tuple[Step, str]]:
        """Return the branches that no case took, of steps that were reached or skipped."""
        return [(step, way) for (mark, way), step in self.branches.items() if (mark, way) not in self.taken]

    @property
    def percent(self) -> float:
        """Return how many of the steps were reached, 0 to 100."""
        return 100.0 * len(self.reached) / len(self.steps) if self.steps else 100.0


def _ways(step: Step) -> Iterator[str]:
    if step.when is not None:
        yield from ("when", "skipped")
    if isinstance(step, If):
        yield from ("then", "else")
    if isinstance(step, Switch):
        yield from (f"case {case.value}" for case in step.cases)
        if step.default:
            yield "default"
