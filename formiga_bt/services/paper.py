"""The services of the FORMIGA paper (3.1.2, 3.1.3): their requests, replies and status words, over the orders of the engine.

| service | what |
|---|---|
| `formiga/add_task` | requests a task |
| `task_manager/abort_task` | ends one |
| `fleet_manager_front/get_mex_list` | all agents, as Fig. 5 has them |
| `fleet_manager_front/assign_task` | gives an agent to a task that waits |
| `fleet_manager_front/unassign_task` | takes it back |

Whoever calls speaks as `http.speaking` knows it: the roles are looked at here as at the HTTP routes. `calling` serves them.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, NamedTuple

import msgspec
from msgspec import Struct

from formiga_bt.base.geo import Frame
from formiga_bt.base.roles import Deed
from formiga_bt.engine.kernel.records import Priority, TaskStatus
from formiga_bt.lang.model import Site
from formiga_bt.services.http.speaking import SPEAKER, require_abort, require_task, speaker
from formiga_bt.services.mex import Mex, mex_of
from formiga_bt.services.once import Once, digest_of, key_of
from formiga_bt.services.orders import ServiceOrders
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView

PaperStatus = Literal["PENDING", "ASSIGNED", "ACTIVE", "COMPLETED", "ABORTED"]
STATUS: Final[Mapping[TaskStatus, PaperStatus]] = MappingProxyType(
    {
        "PENDING": "PENDING",
        "ASSIGNED": "ASSIGNED",
        "ACTIVE": "ACTIVE",
        "ENDING": "ACTIVE",
        "SUCCEEDED": "COMPLETED",
        "FAILED": "ABORTED",
        "CANCELED": "ABORTED",
    }
)
"""Status of a task -> the paper's. One that is HELD keeps that of its steps."""
PRIORITY: Final[Mapping[str, Priority]] = MappingProxyType({"LOW": "low", "MEDIUM": "medium", "HIGH": "high"})


class _Request(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    by: str = ""
    """Who asks, where callers have no account; an account's word is its own."""
    key: str = ""
    """The same request with the same key once more is answered as the first, and changes nothing."""


class AddTask(_Request, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Request a task."""

    keyword: str
    """Its name, or an alias."""
    priority: Literal["LOW", "MEDIUM", "HIGH"] | None = None
    """None: the task's own."""
    arguments: dict[str, Any] = {}
    """Its parameters by name, each as text ("60 m", "camp") or JSON."""


class AbortTask(_Request, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """End a task: its steps stop, its cleanup runs, its machines come home."""

    task_id: str


class GetMexList(_Request, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """List the agents."""


class AssignTask(_Request, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Give an agent to a task that waits for agents."""

    task_id: str
    mex_id: str
    role: str = ""
    """Of the task; needed if the agent could take several."""


class UnassignTask(_Request, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Take an agent back: what flies comes home, and its task begins anew without it."""

    mex_id: str


class TaskAnswer(Struct, frozen=True):
    """A task, and how it stands."""

    task_id: str
    status: PaperStatus
    text: str = ""


class MexAnswer(Struct, frozen=True):
    """An agent, and how it stands; `task_id` "None": it has none."""

    mex_id: str
    task_id: str
    status: str
    text: str = ""


class MexList(Struct, frozen=True):
    """All agents."""

    mex: tuple[Mex, ...]


class _Service(NamedTuple):
    request: type[_Request]
    may: Deed
    """What its caller must be allowed; looked at before the request is."""
    act: Callable[[Any], Struct]
    changes: bool = True


class PaperServices:
    """The five services, for whoever carries the calls.

    Args:
        orders: of the engine.
        view: its read-only copy.
        site: what it was made of.
    """

    def __init__(self, orders: ServiceOrders, view: EngineView, site: Site) -> None:
        self._orders = orders
        self._view = view
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)
        self._once = Once[Struct]()
        self.table: Final[Mapping[str, _Service]] = MappingProxyType(
            {
                "formiga/add_task": _Service(AddTask, Deed.REQUEST, self._add),
                "task_manager/abort_task": _Service(AbortTask, Deed.ABORT_OWN, self._abort),
                "fleet_manager_front/get_mex_list": _Service(GetMexList, Deed.SEE, self._list, changes=False),
                "fleet_manager_front/assign_task": _Service(AssignTask, Deed.ASSIGN, self._assign),
                "fleet_manager_front/unassign_task": _Service(UnassignTask, Deed.ASSIGN, self._unassign),
            }
        )

    def carry_out(self, name: str, payload: bytes) -> bytes:
        """Carry out a call of a service of the table; the speaker may do it. Return the reply as JSON.

        Raises:
            Refused: `bad_request`: it is no such request; or the engine's reason.
        """
        service = self.table[name]
        try:
            request = msgspec.json.decode(payload or b"{}", type=service.request)
        except (msgspec.DecodeError, RecursionError) as error:
            fields = ", ".join(service.request.__struct_fields__)
            raise Refused("bad_request", f"{name}: {error}", f"it is a JSON object with the fields {fields}") from error
        if (
            name == "formiga/add_task" or not service.changes
        ):  # the engine itself knows a task by its key, after a start too
            return msgspec.json.encode(service.act(request))
        key = key_of(SPEAKER.get().name, request.key)
        digest = digest_of(name, msgspec.to_builtins(request))
        return msgspec.json.encode(self._once.do(key, digest, lambda: service.act(request)))

    def _add(self, asked: AddTask) -> TaskAnswer:
        who = require_task(asked.keyword)
        priority = PRIORITY[asked.priority] if asked.priority is not None else None
        key, by = key_of(who.name, asked.key), speaker(asked.by)
        task_id = self._orders.submit(asked.keyword, asked.arguments, priority, by, key, most_open=who.most_open)
        return TaskAnswer(task_id, "PENDING")

    def _abort(self, asked: AbortTask) -> TaskAnswer:
        require_abort(lambda: self._orders.task(asked.task_id).task.by)
        text = self._orders.abort(asked.task_id, "", speaker(asked.by))
        with self._view.reading() as state:
            task = state.tasks.get(asked.task_id)
            return TaskAnswer(asked.task_id, STATUS[task.status] if task is not None else "ABORTED", text)

    def _list(self, asked: GetMexList) -> MexList:  # noqa: ARG002 - it says nothing
        with self._view.reading() as state:
            return MexList(mex_of(state, self._frame))

    def _assign(self, asked: AssignTask) -> MexAnswer:
        found = self._orders.by_hand.assign(asked.task_id, asked.mex_id, asked.role, speaker(asked.by))
        return self._mex(asked.mex_id, found.text)

    def _unassign(self, asked: UnassignTask) -> MexAnswer:
        found = self._orders.by_hand.unassign(asked.mex_id, speaker(asked.by))
        return self._mex(asked.mex_id, found.text)

    def _mex(self, agent: str, text: str) -> MexAnswer:
        with self._view.reading() as state:
            (found,) = mex_of(state, self._frame, only=agent)
        return MexAnswer(agent, found.task_id, found.status, text)
