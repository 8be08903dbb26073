"""Trees of a loaded state are rebuilt from node memory, so that the next input finds them as they were.

With a look, as an engine that was away does it, what cannot be rebuilt is told, task by task, and stops nothing else.
"""

from collections.abc import Callable, Collection

from msgspec.structs import replace

from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.tasks.recovery import Recovery
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.engine.tasks.taskmodel import section_steps


def restore_trees(
    core: Core, runs: Runs, recovery: Recovery, without: Collection[str] = (), look: Callable[[str], None] | None = None
) -> dict[str, str]:
    """Rebuild the trees of every task whose memory says that one runs.

    Args:
        core: of an engine with a loaded state.
        runs: the runs of its tasks.
        recovery: what brings machines home.
        without: tasks whose trees are not rebuilt.
        look: told of each task before it is rebuilt, and of "" at the end; then a tree that cannot be rebuilt raises nothing.

    Returns:
        Tasks whose trees could not be rebuilt -> why.
    """
    failed: dict[str, str] = {}
    for task in list(core.state.tasks.values()):
        if task.section == "done" or task.id in without:
            continue
        if look is None:
            _restore(core, runs, recovery, task)
            continue
        look(task.id)
        try:
            _restore(core, runs, recovery, task)
        except Exception as error:  # noqa: BLE001 - whatever it is, the other tasks go on
            failed[task.id] = f"{type(error).__name__}: {error}".rstrip(": ")
            runs.open.pop(task.id, None)
    if look is not None:
        look("")
    return failed


def _restore(core: Core, runs: Runs, recovery: Recovery, task: TaskRecord) -> None:
    memory = core.state.memory.get(task.id, {})
    if task.section in memory:
        steps = section_steps(core.model(task), task.section)
        runs.of(task.id).trees.restore(task.section, steps, "")
    if task.ending.cleanups:
        runs.of(task.id).cleanups.restore()
    for recovering in task.agents.recovering:
        if recovering.section in memory:
            recovery.restore(recovering, runs.of(task.id).trees)


def copy_of(state: EngineState) -> EngineState:
    """Return a state that goes its own way: records are shared, tables are not."""
    return replace(
        state,
        tasks=dict(state.tasks),
        memory={task: dict(memory) for task, memory in state.memory.items()},
        scopes={
            task: {scope: dict(values) for scope, values in scopes.items()} for task, scopes in state.scopes.items()
        },
        agents=dict(state.agents),
        goals=dict(state.goals),
        questions=dict(state.questions),
        clearances=dict(state.clearances),
        deadlines=dict(state.deadlines),
        wall=dict(state.wall),
        orders=dict(state.orders),
        approvals=dict(state.approvals),
        duty=dict(state.duty),
        drafted=dict(state.drafted),
        library=dict(state.library),
        agent_events={agent: list(told) for agent, told in state.agent_events.items()},
        requests=dict(state.requests),
        explanations=dict(state.explanations),
        counters=dict(state.counters),
        wakes=dict(state.wakes),
    )
