"""A task with those that it, or a standing rule of its site, requests: what must be there so that it can be played by itself.

Called by whatever runs tasks without a service around them: `formiga dryrun`, cases of test files, scenarios, the MCP server.
"""

from collections.abc import Callable
from pathlib import Path

from formiga_bt.lang.model import Site, Task


def with_requested(task: Task, load: Callable[[Path], Task | None], site: Site | None = None) -> list[Task]:
    """Return a task and all that it requests, and what those request; the task itself comes first.

    Args:
        task: the one that is to run.
        load: returns the task of a file, None = it has none that can run (which `load` has reported).
        site: where it runs; what its standing rules request may be requested, too.
    """
    found: dict[str, Task | None] = {task.name: task}
    queue = [task]
    for rule in site.rules.values() if site is not None else ():
        if rule.task not in found and rule.file:
            found[rule.task] = other = load(Path(rule.file))
            queue += [other] if other is not None else []
    while queue:
        for name, file in queue.pop(0).requests.items():
            if name in found:
                continue
            found[name] = other = load(Path(file))
            queue += [other] if other is not None else []
    return [one for one in found.values() if one is not None]
