"""One's own agent in a test: in this process, in virtual time, with a stand-in for the engine.

    bench = AgentBench(Rover())
    end = bench.do("Drive", to=Place(10, 0))
    assert end.state == "succeeded"

`bench.start` begins a goal and returns at once; `bench.run_for(5)` lets 5 s of engine time pass. All rules of agents
hold.
"""

import itertools
from collections.abc import Callable
from typing import Any

from formiga_bt.agent.agent import Agent
from formiga_bt.agent.scheduled import join
from formiga_bt.base.clock import SECOND, VirtualScheduler, micros
from formiga_bt.transport.memory import MemoryHub
from formiga_bt.transport.messages import (
    TERMINAL,
    AgentCard,
    AgentEvent,
    AgentSeen,
    AgentStatus,
    ClockBeat,
    EventArrived,
    GoalEvent,
    GoalReported,
    GoalRequest,
    StatusArrived,
    UpdateAnswered,
    UpdateReply,
    UpdateRequest,
    to_wire,
)


class AgentBench:
    """One agent and who sends it goals.

    Args:
        agent: of one's own.
        id: its name.
        start: engine time, microseconds.
    """

    def __init__(self, agent: Agent, *, id: str = "agent_1", start: int = 0) -> None:
        self.agent = agent
        self.statuses: list[AgentStatus] = []
        self.news: list[GoalEvent] = []
        self.events: list[AgentEvent] = []
        self.cards: list[AgentCard] = []
        self.replies: list[UpdateReply] = []
        self.bad: list[Any] = []
        self.scheduler = VirtualScheduler(start)
        self.hub = MemoryHub(self.scheduler, delay_us=1000)
        self._beat = 0
        self._goals = itertools.count(1)
        self.hub.transport.open(lambda: None)
        self.session = join(agent, self.hub, self.scheduler, id=id, status_every_s=0.5)
        self._tick()
        self.run_for(0.01)

    @property
    def status(self) -> AgentStatus:
        """Return the newest status."""
        return self.statuses[-1]

    def start(self, action: str, /, **fields: Any) -> str:
        """Send a goal; return its id."""
        goal = f"bench/{next(self._goals)}"
        given = {name: to_wire(value) for name, value in fields.items()}
        self.send(GoalRequest(goal_id=goal, agent=self.agent.id, action=action, fields=given, epoch=1, beat=self._beat))
        return goal

    def send(self, request: GoalRequest) -> None:
        """Send a goal as it stands."""
        self.hub.transport.send_goal(request)
        self.run_for(0.01)

    def do(self, action: str, /, *, within_s: float = 3600.0, **fields: Any) -> GoalEvent:
        """Send a goal and return its end.

        Raises:
            TimeoutError: it has not ended after `within_s` seconds of engine time.
        """
        return self.end_of(self.start(action, **fields), within_s)

    def update(self, goal: str, n: int, /, **fields: Any) -> UpdateReply | None:
        """Give a goal that runs other fields; return the agent's answer."""
        given = {name: to_wire(value) for name, value in fields.items()}
        self.hub.transport.send_update(
            UpdateRequest(goal_id=goal, agent=self.agent.id, action="", n=n, fields=given, epoch=1, beat=self._beat)
        )
        self.run_for(0.01)
        return self.replies[-1] if self.replies else None

    def cancel(self, goal: str) -> None:
        """Cancel a goal."""
        self.hub.transport.cancel_goal(self.agent.id, goal)
        self.run_for(0.01)

    def end_of(self, goal: str, within_s: float = 3600.0) -> GoalEvent:
        """Return how a goal ended, when it has.

        Raises:
            TimeoutError: it has not ended after `within_s` seconds of engine time.
        """

        def ended() -> GoalEvent | None:
            return next((one for one in self.news if one.goal_id == goal and one.state in TERMINAL), None)

        found = self._run(within_s, lambda: ended() is not None) and ended()
        if not found:
            raise TimeoutError(f"{goal} has not ended after {within_s:g} s of engine time; news: {self.news[-3:]}")
        return found

    def run_for(self, seconds: float) -> None:
        """Let engine time pass."""
        self._run(seconds, lambda: False)

    def _run(self, seconds: float, done: Callable[[], bool]) -> bool:
        end = self.scheduler.now() + micros(seconds)
        while not done():
            due = self.scheduler.next_time()
            if due is None or due > end:
                self.scheduler.advance_to(end)
                return done()
            self.scheduler.run_next()
            self._take()
        return True

    def _take(self) -> None:
        for event in self.hub.transport.poll():
            match event:
                case StatusArrived(status):
                    self.statuses.append(status)
                case GoalReported(news):
                    self.news.append(news)
                case EventArrived(told):
                    self.events.append(told)
                case AgentSeen(card):
                    self.cards.append(card)
                case UpdateAnswered(reply):
                    self.replies.append(reply)
                case _:
                    self.bad.append(event)

    def _tick(self) -> None:
        self._beat += 1
        now = self.scheduler.now()
        self.hub.transport.publish_clock(ClockBeat(wall_us=now, engine_us=now, speed=1.0, epoch=1, beat=self._beat))
        self.scheduler.call_at(now + SECOND, self._tick)
