"""From a running node's key to the steps of the file: the one it stands for, and all that are around it.

A key is an instance path, for example `steps/steps[1].for#7.steps[0]@2:timeout`; rounds, items, attempts and the names of
decorators say which run of a step it is, the segments in between say which step. Used by `why`, and by the engine, which must
know whether something critical runs.
"""

import re
from collections.abc import Iterator
from typing import Final

from formiga_bt.lang.model import Call, Step, Task
from formiga_bt.lang.walk import children

_SEG: Final = re.compile(r"[a-z_]+\d*\[\d+\]")


def steps_around(task: Task, key: str) -> tuple[Step, ...]:
    """Return the steps from the section's own down to the one that the key stands for; empty if the task has no such step."""
    section, _, rest = key.partition("/")
    inside = {
        "steps": task.steps,
        "on_failure": task.on_failure,
        "on_abort": task.on_abort,
        "finally": task.finally_,
    }.get(section, ())
    found: list[Step] = []
    for seg in _SEG.findall(rest):
        step = next((one for one in inside if one.seg == seg), None)
        if step is None:
            return ()
        found.append(step)
        inside = step.subtree.steps if isinstance(step, Call) else children(step)
    return tuple(found)


def static_path(key: str) -> str:
    """Return which step a key stands for, whatever the round, item or attempt: `steps/steps[1].steps[0]`."""
    section, _, rest = key.partition("/")
    return f"{section}/{'.'.join(_SEG.findall(rest))}"


def steps_with_paths(task: Task) -> Iterator[tuple[str, Step]]:
    """Iterate over every step of a task, those of called subtrees included, with its static path; parents first."""
    sections = {"steps": task.steps, "on_failure": task.on_failure, "on_abort": task.on_abort, "finally": task.finally_}
    for section, steps in sections.items():
        yield from _below(f"{section}/", steps)


def _below(prefix: str, steps: tuple[Step, ...]) -> Iterator[tuple[str, Step]]:
    for step in steps:
        path = prefix + step.seg
        yield path, step
        yield from _below(f"{path}.", step.subtree.steps if isinstance(step, Call) else children(step))
