"""People who are there twice: at the desk of this engine, and in a process that says it is the same person.

`formiga sim` beside an engine with `--desk` does it. What the second one says would be taken for the first one's: questions go
to the wrong place. `OneEach` notices and tells it. Two processes that are one machine: `engine.agents.process_identity`.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Final

from formiga_bt.engine.kernel.inputs import Trouble
from formiga_bt.transport.base import AgentTransport, TellsSite
from formiga_bt.transport.messages import (
    AgentGone,
    AgentSeen,
    BadMessage,
    ClockBeat,
    EventArrived,
    GoalReported,
    GoalRequest,
    QueryReplied,
    SendFailed,
    SiteMessage,
    StatusArrived,
    TransportEvent,
    UpdateAnswered,
    UpdateRequest,
)


class OneEach:
    """Another wire, of which nothing is heard that is said in the name of a person of the desk.

    Args:
        inner: the wire.
        desk: people who answer at this engine.
    """

    def __init__(self, inner: AgentTransport, desk: Collection[str]) -> None:
        self._inner, self._desk = inner, desk
        self.name, self.guarantees = inner.name, inner.guarantees
        self._twice: tuple[str, ...] = ()
        """People of the desk in whose name somebody speaks here; replaced whole, in the thread that polls."""

    def troubles(self) -> tuple[Trouble, ...]:
        """Return who is there twice now, for `StandingAlarms`; may be called from any thread."""
        return tuple(Trouble("double", agent, AT_DESK.format(agent=agent)) for agent in self._twice)

    def open(self, wake: Callable[[], None]) -> None:
        """Open the wire."""
        self._inner.open(wake)

    def close(self) -> None:
        """Close it."""
        self._inner.close()

    def poll(self) -> Sequence[TransportEvent]:
        """Return what came in, but for what is said in the name of the desk's people."""
        return [event for event in self._inner.poll() if self._takes(event)]

    def send_goal(self, request: GoalRequest) -> None:
        """Send a goal."""
        self._inner.send_goal(request)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Ask for cancellation."""
        self._inner.cancel_goal(agent, goal_id)

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what an agent knows."""
        self._inner.query_goals(agent, goal_ids)

    def send_update(self, update: UpdateRequest) -> None:
        """Send other fields for a goal that runs."""
        self._inner.send_update(update)

    def publish_site(self, message: SiteMessage) -> None:
        """Tell agents of the site, where the wire can."""
        if isinstance(self._inner, TellsSite):
            self._inner.publish_site(message)

    def publish_clock(self, beat: ClockBeat) -> None:
        """Publish the engine's clock."""
        self._inner.publish_clock(beat)

    def _takes(self, event: TransportEvent) -> bool:
        agent = _agent_of(event)
        if isinstance(event, AgentGone):
            self._twice = tuple(one for one in self._twice if one != agent)
        if agent in self._desk:
            if not isinstance(event, AgentGone | SendFailed) and agent not in self._twice:
                self._twice = (*self._twice, agent)
            return False
        return True


AT_DESK: Final = (
    "{agent} answers at this engine (--desk), and a process that is connected says that it is {agent} too: that one is not "
    "heard. Start simulated agents with formiga sim --without {agent}; or the engine without --desk {agent}"
)


def _agent_of(event: TransportEvent) -> str:
    match event:
        case AgentSeen(card):
            return card.id
        case StatusArrived(status):
            return status.id
        case GoalReported(goal):
            return goal.agent
        case EventArrived(told):
            return told.agent
        case UpdateAnswered(reply):
            return reply.agent
        case AgentGone() | QueryReplied() | SendFailed() | BadMessage():
            return event.agent
