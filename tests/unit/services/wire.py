"""A transport of simple machines for tests of the service: they do at once what they are told, or when the test says so."""

import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any
from uuid import uuid4

from formiga_bt.base.geo import Place, Position
from formiga_bt.base.machines import Mobility
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.transport.cards import CardAction
from formiga_bt.transport.messages import (
    AgentCard,
    AgentGone,
    AgentSeen,
    AgentStatus,
    ClockBeat,
    GoalEvent,
    GoalReported,
    GoalRequest,
    QueryReplied,
    SiteMessage,
    StatusArrived,
    TransportEvent,
)

MINUTE = 60_000_000
"""Between two stamps: it goes far in no time, and must not seem to have jumped."""
ACTIONS = ("TakeOff", "GoTo", "LandIn")


class Machine:
    """One drone."""

    def __init__(self, agent: str, kind: str, at: Place, boot: str) -> None:
        self.id, self.kind, self.boot = agent, kind, boot
        self.at = Position(at.east_m, at.north_m, 0.0)
        self.landed: Any = "grounded"
        self.control: Any = "engine"
        self.checks: tuple[Any, ...] = ()
        self.goal: GoalRequest | None = None
        self.seq = 0
        self.epoch = 0
        self.site = ""

    def status(self) -> AgentStatus:
        self.seq += 1
        return AgentStatus(
            id=self.id, type=self.kind, status="EXECUTING ACTION" if self.goal else "STANDBY", position=self.at,
            landed=self.landed, control=self.control, seq=self.seq, stamp=self.seq * MINUTE, boot_id=self.boot,
            checks=self.checks, epoch=self.epoch, site=self.site,
        )  # fmt: skip

    def finish(self) -> None:
        assert self.goal is not None
        fields, here = self.goal.fields, self.at
        if self.goal.action == "TakeOff":
            self.at, self.landed = Position(here.east_m, here.north_m, fields["altitude"]), "airborne"
        elif self.goal.action == "GoTo":
            self.at = Position(**fields["to"])
        else:
            self.at, self.landed = Position(fields["at"]["east_m"], fields["at"]["north_m"], 0.0), "grounded"
        self.goal = None


class Wire:
    """An `AgentTransport`. With `auto` goals succeed at once; else `finish` ends them."""

    name = "test"
    guarantees = GUARANTEES

    def __init__(self, *, auto: bool = True) -> None:
        self.auto = auto
        self.boot = uuid4().hex
        self.machines: dict[str, Machine] = {}
        self._inbox: deque[TransportEvent] = deque()
        self._lock = threading.RLock()
        self._site = ""
        self._wake: Callable[[], None] = lambda: None

    def add(
        self, agent: str, kind: str, at: Place, *, control: str = "engine", mobility: Mobility = "air",
        besides: tuple[CardAction, ...] = (),
    ) -> Machine:  # fmt: skip
        with self._lock:
            machine = self.machines[agent] = Machine(agent, kind, at, f"{agent}-{self.boot}")
            machine.control = control
            machine.site = self._site
            actions = ("Confirm",) if mobility == "people" else ACTIONS
            card = AgentCard(id=agent, type=kind, boot_id=machine.boot, actions=(*actions, *besides), mobility=mobility)
            self._inbox.append(AgentSeen(card))
            self._inbox.append(StatusArrived(machine.status()))
        self._wake()
        return machine

    def say(self, agent: str) -> None:
        with self._lock:
            self._inbox.append(StatusArrived(self.machines[agent].status()))
        self._wake()

    def gone(self, agent: str) -> None:
        """End the connection of a machine; it says nothing more."""
        with self._lock:
            del self.machines[agent]
            self._inbox.append(AgentGone(agent))
        self._wake()

    def finish(self, agent: str, state: Any = "succeeded", code: str = "") -> None:
        with self._lock:
            machine = self.machines[agent]
            assert machine.goal is not None
            goal = machine.goal.goal_id
            if state == "succeeded":
                machine.finish()
            machine.goal = None
            event = GoalEvent(goal_id=goal, agent=agent, state=state, code=code, n=9, status=machine.status())
            self._inbox.append(GoalReported(event))
        self._wake()

    # AgentTransport.

    def publish_site(self, message: SiteMessage) -> None:
        with self._lock:
            self._site = message.version
            for machine in self.machines.values():
                machine.site = self._site

    def open(self, wake: Callable[[], None]) -> None:
        self._wake = wake

    def close(self) -> None:
        self._wake = lambda: None

    def poll(self) -> Sequence[TransportEvent]:
        with self._lock:
            events = tuple(self._inbox)
            self._inbox.clear()
        return events

    def send_goal(self, request: GoalRequest) -> None:
        with self._lock:
            self.machines[request.agent].goal = request
            accepted = GoalEvent(goal_id=request.goal_id, agent=request.agent, state="accepted", n=1)
            self._inbox.append(GoalReported(accepted))
            if self.auto:
                self.finish(request.agent)
        self._wake()

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        with self._lock:
            machine = self.machines[agent]
            if machine.goal is not None and machine.goal.goal_id == goal_id:
                self.finish(agent, "canceled")

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        with self._lock:
            goals = tuple(GoalEvent(goal_id=g, agent=agent, state="unknown") for g in goal_ids)
            self._inbox.append(QueryReplied(agent, f"{agent}-1", goals))
        self._wake()

    def publish_clock(self, beat: ClockBeat) -> None:
        for agent in self.machines:
            self.say(agent)
