"""What can go wrong with one agent while it runs: spoiled statuses, refusals, silence, a slow link, a pilot.

`FaultyBody` and `FaultyLink` stand between an agent's rules and its body and wire, in process and as an OS process
alike; `obey` carries out an `Order`. What ends or stops the whole process (kill, freeze) belongs to who runs it.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal, Protocol

import msgspec
from msgspec import Struct

from agents_sim.body import Body
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.transport.base import AgentLink
from formiga_bt.transport.messages import TERMINAL, AgentCard, AgentEvent, AgentStatus, GoalEvent, GoalRequest

OrderKind = Literal[
    "nan", "wrong_id", "slow", "refuse", "take_over", "hand_back", "lose_result", "never_confirm",
    "link_loss", "battery", "wind", "preflight", "drift", "unsure", "event",
]  # fmt: skip


class Order(Struct, frozen=True, kw_only=True):
    """A fault to play. Which of the others count depends on the kind."""

    kind: OrderKind
    count: int = 1
    """How many statuses, goals or results (nan, wrong_id, refuse, lose_result)."""
    as_id: str = "somebody_else"
    """The id in the statuses (wrong_id)."""
    code: str = "not_now"
    """Why goals are refused (refuse)."""
    delay_s: float = 0.0
    """How late all it says is from now on, in wall time; 0 ends it (slow)."""
    on: bool = True
    """False ends never_confirm, link_loss, preflight, drift, unsure."""
    vanishes: bool = True
    """Whether the presence token goes with the link (link_loss)."""
    percent: float = 100.0
    """The charge from now on (battery)."""
    east: float = 0.0
    north: float = 0.0
    """Where the wind blows to, m/s (wind); how far the fix is off, metres (drift)."""
    check: str = ""
    """Which check fails (preflight)."""
    event: str = ""
    """What the agent reports of itself (event)."""
    fields: Mapping[str, Any] = {}
    """The fields of the event, as wire values."""
    text: str = "broken"
    """What the drone says of it (preflight)."""


class StandIn(Protocol):
    """Takes goals in the place of a body: a test's answer, a goal that fails when the test wants it."""

    def start(self, request: GoalRequest) -> str | None:
        """Take a goal ("" ) or refuse it (a code); None leaves it to the body."""
        ...

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal if it is one that was taken and the body knows nothing of; return whether it was."""
        ...


class FaultyBody:
    """Stands before a body and refuses its next goals (an `AgentBody`)."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.refusals: list[str] = []
        self.stand_in: StandIn | None = None
        """Asked first about each goal."""
        self.begun: Callable[[], None] = lambda: None
        """Told when the body has begun a goal."""

    def start(self, request: GoalRequest) -> str:
        """Refuse with the next code in `refusals`, else let the body begin."""
        code = self.refusals.pop(0) if self.refusals else self._start(request)
        if not code:
            self.begun()
        return code

    def cancel(self, goal_id: str) -> bool:
        """Let the body cancel, unless a stand-in has the goal."""
        if self.stand_in is not None and self.stand_in.cancel(goal_id):
            return True
        return self.body.cancel(goal_id)

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        """Let the body follow other fields."""
        return self.body.update(goal_id, fields)

    def _start(self, request: GoalRequest) -> str:
        code = self.stand_in.start(request) if self.stand_in is not None else None
        return self.body.start(request) if code is None else code


class FaultyLink:
    """Stands before a link: spoils the next statuses, loses the next results, lets all leave late (an `AgentLink`).

    Args:
        link: the link that carries.
        wall: the clock by which news is late; who gives one calls `flush` in its loop.
    """

    def __init__(self, link: AgentLink, wall: Callable[[], Micros] = lambda: 0) -> None:
        self.nan_statuses = 0
        self.wrong_ids: list[str] = []
        self.lost_results = 0
        self.delay_us: Micros = 0
        self._link = link
        self._wall = wall
        self._late: deque[tuple[Micros, Callable[[], None]]] = deque()

    def publish_status(self, status: AgentStatus) -> None:
        """Publish, spoiled if so ordered."""
        if self.nan_statuses > 0:
            self.nan_statuses -= 1
            status = msgspec.structs.replace(status, battery=math.nan)
        if self.wrong_ids:
            status = msgspec.structs.replace(status, id=self.wrong_ids.pop(0))
        self._leave(lambda: self._link.publish_status(status))

    def publish_event(self, event: GoalEvent) -> None:
        """Publish, or lose it if it is a result and so ordered."""
        if self.lost_results > 0 and event.state in TERMINAL:
            self.lost_results -= 1
            return
        self._leave(lambda: self._link.publish_event(event))

    def publish_agent_event(self, event: AgentEvent) -> None:
        """Publish."""
        self._leave(lambda: self._link.publish_agent_event(event))

    def publish_card(self, card: AgentCard) -> None:
        """Publish."""
        self._link.publish_card(card)

    def flush(self) -> None:
        """Let leave what is late enough."""
        while self._late and self._late[0][0] <= self._wall():
            self._late.popleft()[1]()

    def _leave(self, call: Callable[[], None]) -> None:
        if self.delay_us == 0 and not self._late:
            call()  # nothing waits that it could overtake
        else:
            self._late.append((self._wall() + self.delay_us, call))


FLIGHT_ORDERS: Final = ("take_over", "hand_back", "battery", "wind")
"""What befalls a drone's body, whether or not its process runs."""


def obey(order: Order, body: Body, front: FaultyBody, link: FaultyLink) -> None:
    """Play a fault; one that does not fit the agent (a person has no pilot) is passed over.

    `link_loss` befalls the wire below the link: whoever owns that plays it.
    """
    match order.kind:
        case "nan":
            link.nan_statuses += order.count
            body.report()
        case "wrong_id":
            link.wrong_ids += [order.as_id] * order.count
            body.report()
        case "slow":
            link.delay_us = round(order.delay_s * SECOND)
        case "refuse":
            front.refusals += [order.code] * order.count
        case "lose_result":
            link.lost_results += order.count
        case "never_confirm":
            body.confirms_cancel = not order.on
        case "event":
            body.tell(order.event, order.fields)
        case "take_over":
            body.take_over()
        case "hand_back":
            body.hand_back()
        case "battery":
            body.set_battery(order.percent)
        case "wind":
            body.set_wind((order.east, order.north))
        case "drift":
            body.set_drift(*((order.east, order.north) if order.on else (0.0, 0.0)))
        case "unsure":
            body.set_unsure(order.on)
        case "preflight":
            body.set_broken(order.check, order.text if order.on else None)
