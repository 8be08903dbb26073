"""Model -> nodes: one tree per section of a task, made fresh for each run.

Called by the engine when a section starts or a task is resumed. The map between nodes and source marks is the nodes
themselves: every node has the mark of its step, and its instance path begins with the section's name.
"""

from collections.abc import Sequence
from typing import assert_never

from formiga_bt.lang import model
from formiga_bt.nodes.base import Node
from formiga_bt.nodes.cleanup import CleanupNode, FinallyNode
from formiga_bt.nodes.composites import CallNode, FallbackNode, IfNode, SequenceNode, SwitchNode
from formiga_bt.nodes.decorators import IgnoreFailureNode, RetryNode, TimeoutNode, WhenNode
from formiga_bt.nodes.extra import WithAgentsNode
from formiga_bt.nodes.leaves import AskNode, CheckNode, DoNode, FailNode, NotifyNode, ReleaseNode, SetNode, WaitNode
from formiga_bt.nodes.live import GuardNode, ReactiveNode, WaitForNode, WaitUntilNode
from formiga_bt.nodes.loops import BreakIfNode, ForNode, LoopNode
from formiga_bt.nodes.parallel import ForParallelNode, ParallelNode
from formiga_bt.nodes.request import RequestNode
from formiga_bt.nodes.resources import WithResourceNode
from formiga_bt.nodes.run import Failure
from formiga_bt.nodes.tracking import TrackingNode


def compile_section(name: str, steps: Sequence[model.Step]) -> SequenceNode:
    """Return the tree of a section: a sequence of its steps, named after the section."""
    return SequenceNode(name, None, [compile_step(step) for step in steps])


def compile_finally(steps: Sequence[model.Step], error: Failure | None = None) -> FinallyNode:
    """Return the tree of a `finally`; `error` is what it sees under that name once it is on its own."""
    return FinallyNode([compile_step(step) for step in steps], error)


def compile_step(step: model.Step) -> Node:
    """Return the tree of one step: its kind, inside its modifiers."""
    node = _compile_kind(step)
    if step.retry is not None:
        if step.retry.attempt_timeout is not None:
            node = TimeoutNode(step, node, step.retry.attempt_timeout, "attempt_timeout")
        node = RetryNode(step, node)
    if step.timeout is not None:
        node = TimeoutNode(step, node, step.timeout)
    if step.ignore_failure:
        node = IgnoreFailureNode(step, node)
    if step.when is not None:
        node = WhenNode(step, node)
    return node


def _sequence(step: model.Sequence) -> Node:
    children = [compile_step(s) for s in step.steps]
    node: Node = ReactiveNode(step, children) if step.reactive else SequenceNode(step.title, step, children)
    if step.finally_:
        return CleanupNode(step, node, lambda: compile_finally(step.finally_))
    return node


def _compile_kind(step: model.Step) -> Node:
    match step:
        case model.Do():
            return DoNode(step) if step.track is None else TrackingNode(step, step.track)
        case model.Ask():
            return AskNode(step)
        case model.Call():
            return CallNode(step.title, step, [compile_step(s) for s in step.subtree.steps])
        case model.Wait():
            return WaitNode(step)
        case model.Check():
            return CheckNode(step)
        case model.Set():
            return SetNode(step)
        case model.Notify():
            return NotifyNode(step)
        case model.Fail():
            return FailNode(step)
        case model.Sequence():
            return _sequence(step)
        case model.Fallback():
            children = [compile_step(s) for s in step.steps]
            return ReactiveNode(step, children) if step.reactive else FallbackNode(step.title, step, children)
        case model.WaitFor():
            return WaitForNode(step)
        case model.WaitUntil():
            return WaitUntilNode(step)
        case model.Guard():
            return GuardNode(step, [compile_step(s) for s in step.steps])
        case model.Request():
            return RequestNode(step)
        case model.WithAgents():
            return WithAgentsNode(step, [compile_step(s) for s in step.steps])
        case model.WithResource():
            return WithResourceNode(step, [compile_step(s) for s in step.steps])
        case model.Parallel():
            return ParallelNode(step, [compile_step(s) for s in step.steps])
        case model.Loop():
            return LoopNode(step, [compile_step(s) for s in step.steps])
        case model.For():
            if step.parallel:
                return ForParallelNode(step, lambda: [compile_step(s) for s in step.steps])
            return ForNode(step, [compile_step(s) for s in step.steps])
        case model.BreakIf():
            return BreakIfNode(step)
        case model.Release():
            return ReleaseNode(step)
        case model.If():
            return IfNode(
                step.title, step, [compile_step(s) for s in step.then], [compile_step(s) for s in step.otherwise]
            )
        case model.Switch():
            cases = [[compile_step(s) for s in case.steps] for case in step.cases]
            return SwitchNode(step.title, step, cases, [compile_step(s) for s in step.default])
        case _:
            assert_never(step)
