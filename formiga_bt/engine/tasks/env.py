"""What an expression of a running task reads: names of its scope, built-ins, and agents' last known fields."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRecord, TaskRecord
from formiga_bt.engine.kernel.state import is_member
from formiga_bt.engine.resting import home_of
from formiga_bt.lang.model import UnknownState, Unset
from formiga_bt.lang.site.ground import ground_up_m
from formiga_bt.lang.types import AgentRef, Value
from formiga_bt.nodes.run import Failure

BASE = Place(0.0, 0.0)


def with_extensions(core: Core, agent_type: str) -> tuple[str, ...]:
    """Return an agent type and those that extend it, in the catalogue's order."""
    types = core.catalogue.types
    return tuple(name for name, kind in types.items() if name == agent_type or agent_type in kind.extends)


class TaskEnv:
    """Names of one scope. `task` is None while a request is bound, before there is a task."""

    __slots__ = ("_core", "_error", "_extra", "_task", "_values")

    def __init__(
        self,
        core: Core,
        task: TaskRecord | None,
        values: Mapping[str, Any],
        error: Failure | None = None,
        extra: Mapping[str, Any] | None = None,
    ) -> None:
        self._core = core
        self._task = task
        self._values = values
        self._error = error
        self._extra = extra

    def name(self, name: str) -> Value:
        """Return a name's value (see `lang.model.Env`)."""
        if self._extra is not None and name in self._extra:
            return self._extra[name]  # type: ignore[no-any-return]
        value = self._values.get(name)
        if value is not None:
            return value  # type: ignore[no-any-return]
        if ".." in self._values and self._task is not None:
            return self._around().name(name)
        return self._builtin(name)

    def _around(self) -> "TaskEnv":
        assert self._task is not None
        scopes = self._core.state.scopes[self._task.id]
        return TaskEnv(self._core, self._task, scopes[self._values[".."]], self._error, self._extra)

    def _builtin(self, name: str) -> Value:
        core, task = self._core, self._task
        match name:
            case "base":
                return BASE
            case "now":
                return core.now
            case "task" if task is not None:
                return {"id": task.id, "name": task.name, "priority": task.request.priority, "run": task.run}
            case "site":
                site = core.site
                ports = {port.name: port.at for port in site.ports.values()}
                names = {"ports": ports, "places": dict(site.places), "regions": dict(site.regions)}
                return {"name": site.name, "timezone": site.timezone, **names}
            case "error" if self._error is not None:
                e = self._error
                return {"code": e.code, "reason": e.reason, "step": e.step, "agent": e.agent, "data": dict(e.data)}
            case "abort" if task is not None and task.ending.abort_reason:
                return {"reason": task.ending.abort_reason}
        raise Unset(name)

    def is_set(self, name: str) -> bool:
        """Return whether a name has a value."""
        try:
            return self.name(name) is not None
        except Unset:
            return False

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        """Return an agent's field as last known (see `lang.model.Env`)."""
        record = self._core.state.agents.get(agent.id)
        if record is None:
            raise UnknownState(f"/fleet/?/{agent.id}")
        value = self._field(record, name)
        if value is None:
            raise UnknownState(f"/fleet/{record.type}/{record.id}/{name}")
        return value

    def _field(self, agent: AgentRecord, name: str) -> Value:
        match name:
            case "id" | "type" | "control" | "position" | "battery":
                return getattr(agent, name)  # type: ignore[no-any-return]
            case "payload":
                return agent.payload_kg
            case "status":
                return agent.pool
            case "airborne":
                return None if agent.landed == "unknown" else agent.landed == "airborne"
            case "age":
                return (self._core.now - agent.heard_at) / 1e6
            case "transit_height":
                return agent.layer_m
            case "home":
                return home_of(self._core, agent)
        return agent.fields.get(name)  # of its type's own

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Return the agents of a type that are there (see `lang.model.Env`)."""
        core = self._core
        kinds = with_extensions(core, agent_type)
        found = [one for one in core.state.agents.values() if one.type in kinds and is_member(one)]
        return tuple(AgentRef(one.id) for one in sorted(found, key=lambda one: one.order))

    def lat_lng(self, point: Place | Position) -> tuple[float, float]:
        """Return WGS84 degrees of a point."""
        return self._core.frame.lat_lng(point)

    def place(self, lat: float, lng: float) -> Place:
        """Return the place at WGS84 degrees."""
        return self._core.frame.place(lat, lng)

    def ground_up_m(self, place: Place) -> float:
        """Return the ground's height over the base's ground in metres: 0 on flat sites, else what the height file has."""
        return ground_up_m(self._core.site, place)
