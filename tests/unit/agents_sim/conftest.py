"""A world on a virtual clock: a hub, a referee, a fleet, and the engine's words and ears."""

from collections.abc import Sequence
from typing import Any

import pytest

from agents_sim.referee import Referee
from agents_sim.world import SimFleet
from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler, micros
from formiga_bt.transport.memory import MemoryHub
from formiga_bt.transport.messages import (
    TERMINAL,
    AgentStatus,
    Clearance,
    GoalEvent,
    GoalReported,
    GoalRequest,
    StatusArrived,
    TransportEvent,
)


class World:
    """Messages take no time here, so that all times are the bodies' own."""

    def __init__(self) -> None:
        self.clock = VirtualScheduler(1000 * SECOND)
        self.hub = MemoryHub(self.clock, delay_us=0)
        self.referee = Referee()
        self.fleet = SimFleet(self.clock, self.hub, recorder=self.referee)
        self.heard: list[tuple[Micros, TransportEvent]] = []
        self.hub.transport.open(self._listen)

    def _listen(self) -> None:
        self.heard += [(self.clock.now() - 1000 * SECOND, event) for event in self.hub.transport.poll()]

    def order(
        self, agent: str, action: str, goal_id: str = "", clearance: Clearance | None = None, **fields: Any
    ) -> str:
        goal_id = goal_id or f"{agent}-{action}-{len(self.heard)}"
        self.hub.transport.send_goal(
            GoalRequest(goal_id=goal_id, agent=agent, action=action, fields=fields, clearance=clearance)
        )
        self.run(0)
        return goal_id

    def run(self, for_s: float) -> None:
        """Run all that happens in the next `for_s` seconds, the ends included."""
        until = self.clock.now() + micros(for_s)
        while (due := self.clock.next_time()) is not None and due <= until:
            self.clock.run_next()
        self.clock.advance_to(until)

    def events(self, goal_id: str) -> list[GoalEvent]:
        return [e.event for _, e in self.heard if isinstance(e, GoalReported) and e.event.goal_id == goal_id]

    def end(self, goal_id: str) -> tuple[float, GoalEvent]:
        """Return when (seconds after the start of the world) a goal ended, and how."""
        return next(
            (at / SECOND, e.event)
            for at, e in self.heard
            if isinstance(e, GoalReported) and e.event.goal_id == goal_id and e.event.state in TERMINAL
        )

    def statuses(self, agent: str) -> Sequence[AgentStatus]:
        return [e.status for _, e in self.heard if isinstance(e, StatusArrived) and e.status.id == agent]


@pytest.fixture
def world() -> World:
    return World()


def point(east_m: float, north_m: float, up_m: float | None = None) -> dict[str, float]:
    """Return a wire place, or a wire position."""
    place = {"east_m": float(east_m), "north_m": float(north_m)}
    return place if up_m is None else {**place, "up_m": float(up_m)}
