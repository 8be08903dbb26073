"""A client without an engine, for tests of what verbs send and print: the real one, but for the wire."""

from collections.abc import Mapping
from typing import Any

import msgspec

from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.client import Client
from formiga_bt.show.facts import (
    AgentFact,
    AgentList,
    LockdownFact,
    OrderedFact,
    OrderFact,
    OrderReply,
    TaskFact,
    TaskList,
)

NO_LOCKDOWN = LockdownFact(on=False)


class PaperClient(Client):
    """`look` answers what is asked, `take` what is sent: with facts, or what JSON holds of them."""

    def __init__(self) -> None:
        super().__init__(EngineAddress("meadow", 1, 1, "http://127.0.0.1:1", "tcp/127.0.0.1:1"), token="")

    def look(self, path: str, query: Mapping[str, Any]) -> Any:
        raise AssertionError(f"nobody asks {path}")

    def take(self, path: str, body: Any) -> Any:
        raise AssertionError(f"nobody sends {path}")

    def read(self, path: str, query: Mapping[str, Any]) -> bytes:
        return msgspec.json.encode(
            self.look(path, {name: value for name, value in query.items() if value not in ("", None)})
        )

    def send(self, path: str, body: Any = None, *, key: str = "", headers: Mapping[str, str] | None = None) -> bytes:
        return msgspec.json.encode(self.take(path, body))


def agents(*found: AgentFact, orders: tuple[OrderFact, ...] = (), lockdown: LockdownFact = NO_LOCKDOWN) -> AgentList:
    return AgentList(at=0, agents=found, orders=orders, lockdown=lockdown)


def tasks(
    *found: TaskFact, orders: tuple[OrderFact, ...] = (), lockdown: LockdownFact = NO_LOCKDOWN, at: int = 0
) -> TaskList:
    return TaskList(at=at, tasks=found, total=len(found), orders=orders, lockdown=lockdown)


def reply(*ordered: OrderedFact, **more: Any) -> OrderReply:
    given = {"order": "hold", "target": "", "stands_already": False, "text": "done", "skipped": (), "next": (), **more}
    return OrderReply(ordered=ordered, **given)
