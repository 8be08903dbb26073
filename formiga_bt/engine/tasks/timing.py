"""Requests in time: which of those that wait may not be served yet, and what becomes of a task at its deadline.

| a request | until | then |
|---|---|---|
| `not_before` | that time | it waits for agents as any other |
| `after` | each task named has SUCCEEDED | the same; if one ended otherwise it ends FAILED `after_failed` |
| `deadline` | its task has ended | an alarm, and `if_late` says what becomes of it |

`if_late`: `run`: it goes on; `drop`: it ends FAILED `late` if it has not begun; `fail`: it ends so in any case.

What a request still waits for is in the request itself; the allocator has it looked over before each of its own looks.
"""

from typing import assert_never

from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.engine.tasks.when import local_time, why_never


class Timing:
    """Looks over requests that may not be served yet, and over deadlines; keeps nothing itself."""

    def __init__(self, core: Core, requests: Requests, tasks: Tasks) -> None:
        self._core = core
        self._requests = requests
        self._tasks = tasks

    def review(self) -> None:
        """Let requests be served whose time has come; end those that can never begin."""
        core = self._core
        for request in [r for r in core.state.requests.values() if not r.is_ripe]:
            if why := why_never(core, request.after):
                self._tasks.refuse(request.task, "after_failed", why)
                continue
            left = tuple(one for one in request.after if one in core.open)
            early = request.not_before is not None and request.not_before > core.now
            if not left and not early:
                self._requests.ripen(request)
            elif left != request.after or (request.not_before is not None and not early):
                waits = replace(request, after=left, not_before=request.not_before if early else None)
                core.emit(ch.RequestPut(request.task, waits))

    def late(self, task_id: str) -> None:
        """The deadline of a task has come, and it has not ended."""
        core = self._core
        task = core.task(task_id)
        when = task.request.when
        if task.section == "done" or when.deadline is None:
            return
        text = f"{task_id} is late: it was to end by {local_time(when.deadline, core.site.timezone)}"
        match when.if_late:
            case "run":
                ends = False
            case "drop":
                ends = task.status == "PENDING"
            case "fail":
                ends = True
            case _:
                assert_never(when.if_late)
        core.effect(Alarm("late", f"{text}; {'it ends' if ends else 'it goes on'}", task_id))
        if not ends:
            return
        if task.status == "PENDING":
            self._tasks.refuse(task_id, "late", text)
        elif task.section == "steps":  # else it ends already, and its cleanup is not cut short
            self._tasks.fail(task_id, "late", text)
