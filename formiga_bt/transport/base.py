"""The seam between the engine and the wires: `AgentTransport`, and the agent's side of it.

Engine side: a driver owns some transports. It calls `poll()` (never blocks) and turns the events into engine inputs; it
calls `send_goal`, `cancel_goal`, `query_goals` to carry out effects. No call blocks; what comes of it arrives as events.
Wire threads only enqueue, then call the `wake` function given to `open`.

Agent side: `AgentBody` is what a machine (or a person's app) can do, `AgentLink` is how its words reach an engine. The
rules in between (remembered ids, epochs, expiry, repeated goals) live once, in `agent_side.py`.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from formiga_bt.base.clock import Micros
from formiga_bt.base.wires import Guarantee
from formiga_bt.transport.attachments import KeepsFiles
from formiga_bt.transport.messages import (
    AgentCard,
    AgentEvent,
    AgentStatus,
    ClockBeat,
    GoalEvent,
    GoalRequest,
    SiteMessage,
    TransportEvent,
    UpdateRequest,
)


class AgentTransport(Protocol):
    """One wire to many agents, as the driver sees it."""

    @property
    def name(self) -> str:
        """Return the short name used in messages and in site.yaml (memory, zenoh, desk)."""
        ...

    @property
    def guarantees(self) -> Sequence[Guarantee]:
        """Return what agents on this wire do, and the engine may rely on (`base.wires`)."""
        ...

    def open(self, wake: Callable[[], None]) -> None:
        """Start; never waits for absent peers. `wake` may be called from any thread when `poll` has something.

        Raises:
            TransportError: the wire cannot be opened at all (port taken, bad configuration).
        """
        ...

    def close(self) -> None:
        """Stop within a bound of 2 s; may be called twice."""
        ...

    def poll(self) -> Sequence[TransportEvent]:
        """Return what came in since the last call, in order of arrival. Never blocks."""
        ...

    def send_goal(self, request: GoalRequest) -> None:
        """Send a goal. Exactly one GoalReported (accepted, rejected or a recorded state) or SendFailed answers it."""
        ...

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Ask for cancellation. Answered by GoalReported (canceling, a terminal state, or cancel_refused) or SendFailed."""
        ...

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what an agent knows of these goals. Answered by QueryReplied or SendFailed."""
        ...

    def send_update(self, update: UpdateRequest) -> None:
        """Send other fields for a goal that runs. Answered by UpdateAnswered or SendFailed.

        Never called on a wire without the guarantee `update`.
        """
        ...

    def publish_clock(self, beat: ClockBeat) -> None:
        """Publish the engine's clock to all agents of this wire."""
        ...


@runtime_checkable
class Hearing(Protocol):
    """A wire that knows of an agent's life besides its statuses: in virtual time these come seldom."""

    def heard(self, agent: str) -> Micros:
        """Return when it last heard the agent, in wall time; 0 if it does not know."""
        ...


@runtime_checkable
class CarriesFiles(Protocol):
    """A wire by which agents send the bytes of attachments."""

    def keep_files(self, store: KeepsFiles) -> None:
        """Say who keeps them; called once, before `open`. The store is called from a thread of the wire."""
        ...


@runtime_checkable
class SendsFiles(Protocol):
    """An agent's link that sends the bytes of attachments."""

    def send_file(self, digest: str, data: bytes, done: Callable[[str], None]) -> None:
        """Send bytes. `done` is called from any thread, with "" or why they were not taken."""
        ...


@runtime_checkable
class TellsSite(Protocol):
    """A wire that tells agents of the site: at each change, and whenever one connects."""

    def publish_site(self, message: SiteMessage) -> None:
        """Publish the site, and keep it for agents that connect later."""
        ...


@runtime_checkable
class Listening(Protocol):
    """A wire that agents connect to."""

    @property
    def endpoint(self) -> str:
        """Return where; after `open` with the true port."""
        ...


@runtime_checkable
class Secured(Protocol):
    """A wire that knows by itself what is wrong with it, beyond its agents."""

    def troubles(self) -> Iterable[tuple[str, str, str]]:
        """Return what is wrong now: code, subject, text. Called in any thread, never waits."""
        ...


class AgentBody(Protocol):
    """What an agent can do; implemented by simulated agents and by integrators. Called from one thread."""

    def start(self, request: GoalRequest) -> str:
        """Begin a goal. Return "" if accepted, else the code of the refusal (the goal is then not begun)."""
        ...

    def cancel(self, goal_id: str) -> bool:
        """Begin to cancel the running goal. Return False to refuse (it then goes on to its natural end)."""
        ...


@runtime_checkable
class UpdatableBody(Protocol):
    """A body whose goals can be given other fields while they run."""

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        """Follow other fields (wire values) of a goal that runs. Return "" if taken, else the code of the refusal."""
        ...


class AgentLink(Protocol):
    """How an agent's words leave it; implemented once per wire."""

    def publish_status(self, status: AgentStatus) -> None:
        """Publish a status."""
        ...

    def publish_event(self, event: GoalEvent) -> None:
        """Publish news of a goal."""
        ...

    def publish_agent_event(self, event: AgentEvent) -> None:
        """Publish an event of the agent's own."""
        ...

    def publish_card(self, card: AgentCard) -> None:
        """Announce the agent and what it can do."""
        ...
