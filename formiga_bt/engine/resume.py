"""After a restart: the trees of a loaded state are rebuilt from node memory, so that the next input finds them as they were."""

from formiga_bt.engine.core import Core
from formiga_bt.engine.taskmodel import section_steps
from formiga_bt.engine.tasks import Tasks


def restore_trees(core: Core, tasks: Tasks) -> None:
    """Rebuild the trees of every task whose memory says that one runs."""
    for task in list(core.state.tasks.values()):
        memory = core.state.memory.get(task.id, {})
        if task.section in memory:
            steps = section_steps(core.model(task), task.section)
            tasks.run_of(task.id).trees.restore(task.section, steps, "")
        if task.tidying:
            tasks.run_of(task.id).tidies.restore()
        for recovering in task.recovering:
            if f"recover:{recovering.agent}#{recovering.attempt}" in memory:
                tasks.recovery.restore(recovering, tasks.run_of(task.id).trees)
