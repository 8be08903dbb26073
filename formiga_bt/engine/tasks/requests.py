"""Requests: what a task, or a block of a running one, wants of the allocator (`/allocation/requests/<task>`).

The expressions of its roles are read once, here; what waits is data.
"""

from collections.abc import Mapping
from typing import Any

from msgspec.structs import replace

from formiga_bt.base.clock import Micros, micros
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import UNSAID_US, AgentRequest, RoleRequest, TaskRecord
from formiga_bt.engine.kernel.timers import TaskDue
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.engine.tasks.taskmodel import CANNOT_COMPUTE
from formiga_bt.lang.model import Env, Role, Some, Unset, why_not_computed
from formiga_bt.lang.types import AgentRef

MOST_AGENTS = 1000
"""More than any fleet has: what `count: all` may take."""

WAIT_US: Micros = 900_000_000
"""Default of a role's `wait` while its task, or the one that waits for its end, holds agents already."""


class Requests:
    """Makes requests, and lets them wait; keeps nothing itself."""

    def __init__(self, core: Core) -> None:
        self._core = core

    def request(self, task: TaskRecord, values: Mapping[str, Any]) -> AgentRequest:
        """Return a task's request; the expressions of its roles are read now, once.

        Raises:
            TaskError: one of them cannot be evaluated.
        """
        core = self._core
        model = core.model(task)
        env = TaskEnv(core, task, values)
        waits = (
            WAIT_US if task.family.parent and not task.family.detached else None
        )  # its parent holds agents while it waits
        try:
            roles = tuple(self._role(role, env, waits) for role in model.roles.values())
            expires = core.now + micros(model.expires.run(env)) if model.expires else None
        except CANNOT_COMPUTE as error:
            raise TaskError(
                "bad_role", f"{model.name}: a role cannot be evaluated: {why_not_computed(error)}"
            ) from error
        if task.request.wait is not None:
            roles = tuple(replace(role, wait_until=core.now + task.request.wait) for role in roles)
        if task.restart.taken_back:
            roles = tuple(replace(role, taken_back=task.restart.taken_back) for role in roles)
        if task.request.expires is not None:
            expires = core.now + task.request.expires
        when = task.request.when
        early = when.not_before is not None and when.not_before > core.now
        return AgentRequest(
            holder=task.id, priority=task.request.priority, order=task.order, due=_due(task), at=core.now, roles=roles,
            expires=expires,
            not_before=when.not_before if early else None,
            after=tuple(one for one in when.after if one in core.open),
        )  # fmt: skip

    def want(
        self, task_id: str, node: str, roles: Mapping[str, Role], env: Env, but_not: tuple[str, ...] = ()
    ) -> AgentRequest:
        """Let a block of a running task wait for agents; return its request. Its `wait` is the node's own deadline."""
        core = self._core
        task = core.task(task_id)
        wanted = tuple(
            replace(
                self._role(role, env, WAIT_US),
                but_not=but_not,
                rebind=role.if_lost == "rebind",
                taken_back=task.restart.taken_back,
            )
            for role in roles.values()
        )
        request = AgentRequest(
            holder=task_id,
            node=node,
            priority=task.request.priority,
            order=task.order,
            due=_due(task),
            at=core.now,
            roles=wanted,
        )
        core.emit(ch.RequestPut(request.task, request))
        return request

    def want_units(self, task_id: str, node: str, units: Mapping[str, int]) -> None:
        """Let a block of a running task wait for resources. Its `wait` is the node's own deadline."""
        core = self._core
        task = core.task(task_id)
        request = AgentRequest(
            holder=task_id, node=node, priority=task.request.priority, order=task.order, due=_due(task), at=core.now, roles=(),
            units=dict(units),
        )  # fmt: skip
        core.emit(ch.RequestPut(request.task, request))

    def enqueue(self, request: AgentRequest) -> None:
        """Let a request wait for agents, once it may be served."""
        core = self._core
        when = core.task(request.holder).request.when
        if when.deadline is not None and (when.deadline > core.now or when.if_late != "run"):
            core.set_deadline(TaskDue(request.task, "deadline"), max(core.now, when.deadline), request.task)
        if request.not_before is not None:
            core.set_deadline(TaskDue(request.task, "not_before"), request.not_before, request.task)
        if request.is_ripe:
            self._wait(request)
        else:
            core.emit(ch.RequestPut(request.task, request))

    def ripen(self, request: AgentRequest) -> None:
        """Let a request be served from now on: how long it may wait counts from here."""
        by = self._core.now - request.at
        roles = tuple(
            role if role.wait_until is None else replace(role, wait_until=role.wait_until + by)
            for role in request.roles
        )
        expires = None if request.expires is None else request.expires + by
        self._wait(replace(request, at=self._core.now, roles=roles, expires=expires, not_before=None, after=()))

    def _wait(self, request: AgentRequest) -> None:
        core = self._core
        core.emit(ch.RequestPut(request.task, request))
        waits = [role.wait_until for role in request.roles if role.wait_until is not None]
        if waits:
            core.set_deadline(TaskDue(request.task, "wait"), min(waits), request.task, pausable=True)
        if request.expires is not None:
            core.set_deadline(TaskDue(request.task, "expires"), request.expires, request.task)

    def _role(self, role: Role, env: Env, otherwise: Micros | None) -> RoleRequest:
        """Return a role as it is wanted; without a `wait` of its own it waits for so long, None: as long as it takes."""
        core = self._core
        types = tuple(
            t for t in core.catalogue.types if t in role.types or any(x in role.types for x in _line(core, t))
        )
        wait = micros(role.wait.run(env)) if role.wait else otherwise
        return RoleRequest(
            role=role.name,
            types=types,
            shared=all(core.catalogue.types[t].shared for t in types) if types else False,
            count=role.open.min if role.open else role.count or 1,
            more=_beyond(role.open) if role.open else 0,
            is_list=role.is_list,
            id=_agent_id(role.id, env),
            near=_places(role.near, env),
            prefer=_agent_id(role.prefer, env),
            battery_min=float(role.battery_min.run(env)) if role.battery_min else 0.0,
            away=role.away,
            preempt=role.preempt,
            actions=tuple(dict.fromkeys((*role.actions, *role.capabilities))),
            wait_until=None if wait is None else core.now + wait,
        )


def _beyond(some: Some) -> int:
    return (MOST_AGENTS if some.max is None else some.max) - some.min


def _line(core: Core, type_name: str) -> tuple[str, ...]:
    return core.catalogue.types[type_name].extends


def _agent_id(expr: Any, env: Env) -> str:
    if expr is None:
        return ""
    try:
        value = expr.run(env)
    except Unset:
        return ""  # an optional param that was not given: the key counts as absent
    return value.id if isinstance(value, AgentRef) else str(value or "")


def _places(expr: Any, env: Env) -> tuple[Place, ...]:
    if expr is None:
        return ()
    try:
        value = expr.run(env)
    except Unset:
        return ()
    places = value if isinstance(value, tuple) else (value,)
    return tuple(p.ground if isinstance(p, Position) else p for p in places)


def _due(task: TaskRecord) -> Micros:
    """Return by when a task is to end: what its request says, or an hour after the task was, or may be, begun."""
    when = task.request.when
    return when.deadline or max(task.times.submitted_at, when.not_before or 0) + UNSAID_US
