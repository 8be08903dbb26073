"""How a task comes in: on a person's request, or on that of a step of another task."""

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import PublishState, Submit
from formiga_bt.engine.kernel.records import TaskEvents, TaskFamily, TaskRecord, TaskRequest, TaskTimes
from formiga_bt.engine.tasks.authority import Authority
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.taskmodel import root_values
from formiga_bt.engine.tasks.when import check_when
from formiga_bt.nodes.run import TaskOrder

MAX_QUEUED = 10_000
"""Tasks that may wait for agents at once."""


class Intake:
    """Admits tasks; keeps nothing itself."""

    def __init__(self, core: Core, authority: Authority, requests: Requests) -> None:
        self._core = core
        self._authority = authority
        self._requests = requests

    def check(self, request: Submit) -> None:
        """Return if a request is let in, whatever its params are.

        Raises:
            TaskError: not allowed (`Authority.admit`), unknown task, or too many wait already (`busy`).
        """
        self._authority.admit(request)
        if len(self._core.state.requests) >= MAX_QUEUED:
            raise TaskError("busy", f"{MAX_QUEUED:,} tasks wait already")

    def submit(self, request: Submit, parent: TaskRecord | None = None, order: TaskOrder | None = None) -> str:
        """Admit a task, of a person or of a step of its parent; return its id.

        Raises:
            TaskError: not allowed (`Authority.admit`), unknown task, too many wait already (`busy`), it could only be late
                (`late`), or never begin (`after_failed`), or a parameter, var or role cannot be evaluated.
        """
        core = self._core
        self.check(request)
        check_when(core, request)
        model = core.library.wanted(request)
        number = core.state.counters.get("task", 0) + 1
        family = TaskFamily()
        if parent is not None and order is not None:
            depth = parent.family.depth + 1
            family = TaskFamily(parent=parent.id, node=order.owner, depth=depth, detached=order.detached)
        task = TaskRecord(
            id=f"{model.name}-{number}",
            name=model.name,
            order=number,
            request=TaskRequest(
                bundle=model.bundle,
                version=core.library.number(model),
                library=core.state.counters.get("library", 0) if parent is None else parent.request.library,
                priority=request.priority or model.priority,
                by=request.by,
                wait=request.wait,
                expires=request.expires,
                params=dict(request.params),
                cause=request.cause,
                key=request.key,
                asked=request.asked,
                when=request.when,
            ),
            family=family,
            times=TaskTimes(submitted_at=core.now),
            events=TaskEvents(since=core.state.counters.get("agent_event", 0)),
        )
        values = root_values(core, model, task)
        wish = self._requests.request(task, values)  # both raise before anything is recorded
        core.count("task")
        core.emit(ch.TaskPut(task))
        core.emit(ch.ScopePut(task.id, "", values))
        core.effect(PublishState(task.id, task.status))
        self._requests.enqueue(wish)
        return task.id
