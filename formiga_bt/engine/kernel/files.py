"""Files that agents name in results and events, noted beside the step that they came with."""

from collections.abc import Sequence
from typing import Final

from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.records import TaskFile
from formiga_bt.transport.attachments import Attachment, usable

MOST_FILES: Final = 32
"""Of one task; beyond that the oldest are forgotten."""


def note_files(core: Core, task_id: str, agent: str, what: str, given: Sequence[Attachment], goal: str = "") -> None:
    """Note files that came with an event.

    Args:
        core: of the engine.
        task_id: for which task; none, or one that is not known: only what is refused is reported.
        agent: who names them.
        what: the action, or the event of the agent's own.
        given: as the agent names them.
        goal: of the action.
    """
    good, bad = usable(given)
    task = core.state.tasks.get(task_id)
    if bad:
        core.effect(Alarm("attachment_refused", f"{agent}: {what}: {'; '.join(bad)}", task_id if task else "", agent))
    if task is None or not good:
        return
    known = {(one.goal, one.file) for one in task.files.found}
    new = [
        TaskFile(agent=agent, what=what, goal=goal, at=core.now, file=one)
        for one in dict.fromkeys(good)
        if (goal, one) not in known
    ]
    if new:
        core.put_part(task_id, "files", found=(*task.files.found, *new)[-MOST_FILES:])
