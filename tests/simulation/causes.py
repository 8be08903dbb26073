"""What open tasks wait for: the product's closed list (`show.why.causes`), and whether who waits would be woken.

Two looks. `waits` goes by the state alone and finds a wait whose cause has gone. `unwoken` asks the nodes of a live engine: one
that would go on if it were visited now has missed its wake.
"""

from collections.abc import Iterator
from typing import Final

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.tasks.taskrun import TaskRun
from formiga_bt.engine.tasks.treerun import CompiledTrees
from formiga_bt.nodes.base import RUNNING
from formiga_bt.nodes.live import WaitForNode
from formiga_bt.show.why.causes import CAUSES, causes_of

LEAVES: Final = ("do", "ask", "wait", "wait_until", "release", "request", "guard")
"""Kinds whose nodes tell exactly whether a visit would change nothing."""


def waits(state: EngineState, task: TaskRecord) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the causes that an open task waits for, and each wait that has none, in words."""
    found = causes_of(state, task)
    none = tuple(f"{one.at or task.status} waits for {one.of or 'nothing'}" for one in found if one.code not in CAUSES)
    if not found:
        none = (f"{task.status} in {task.section or 'no section'} waits for nothing",)
    return frozenset(one.code for one in found if one.code in CAUSES), none


def cause_of(state: EngineState, task: TaskRecord) -> str:
    """Return the first cause that an open task waits for, "" if one of its waits has none."""
    found = causes_of(state, task)
    return found[0].code if found and all(one.code in CAUSES for one in found) else ""


def unwoken(engine: Engine) -> Iterator[tuple[str, str]]:
    """Iterate over (task, node) of who missed a wake, or a visit: asked between two steps, nobody has anything to do."""
    for task_id, run in engine.runs.open.items():
        trees = run.trees
        if not isinstance(trees, CompiledTrees):
            continue
        for key, node in list(trees._nodes.items()):
            if node.status is RUNNING and isinstance(node, WaitForNode) and _has_come(engine, run, node):
                yield task_id, f"{node.kind} at {key}"
            if node.status is not RUNNING or node.kind not in LEAVES:
                continue
            if node.dirty or not node.is_quiet(run):
                yield task_id, f"{node.kind} at {key}"


def _has_come(engine: Engine, run: TaskRun, node: WaitForNode) -> bool:
    agent, event = node.mem.agent, node.step.event
    after = run.events_seen(agent, event) if node.step.since_task else node.mem.after
    return any(one.event == event and one.order > after for one in engine.state.agent_events.get(agent, ()))
