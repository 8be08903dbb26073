"""Agents in this process: deterministic, over a `Scheduler`, with delays and seeded faults.

Why: tests, `sim` and dry runs need a wire whose every delay is known, that can lose, repeat and reorder messages, and
whose agents can be killed or frozen. Messages pass as JSON, by value, so that nothing works here that a real wire
cannot carry. No threads: all deliveries are calls of the scheduler, and `poll` hands over what has arrived.

A hub joins one engine side (`hub.transport`) with many agents: `link = hub.link(id)`, then
`side = AgentSide(card, body, link, now=scheduler.now)`, then `link.serve(side)`. A second `serve` under the same id is
a restart: the earlier one is killed.

A little long, because link, hub and transport are three views of one thing and call each other's insides.
"""

import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros, Scheduler, Timer
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import FileError, KeepsFiles
from formiga_bt.transport.codec import (
    Asked,
    CancelRequest,
    GoalsRequest,
    WireError,
    check_agent_event,
    check_card,
    check_event,
    check_status,
    decode,
    decode_card,
    decode_site,
    encode,
    read_reply,
    serve_request,
)
from formiga_bt.transport.messages import (
    TERMINAL,
    AgentCard,
    AgentEvent,
    AgentGone,
    AgentSeen,
    AgentStatus,
    BadMessage,
    ClockBeat,
    EventArrived,
    GoalEvent,
    GoalReported,
    GoalRequest,
    SendFailed,
    SiteMessage,
    StatusArrived,
    TransportEvent,
    UpdateRequest,
)


class Faults(Struct, frozen=True, kw_only=True):
    """How bad a link is, both ways. Chances are 0..1. Presence is never lost."""

    drop: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    """Chance that a message takes up to five more delays and may be overtaken; the others keep their order."""
    jitter_us: Micros = 0
    """Greatest extra delay of any message."""


NO_FAULTS: Final = Faults()


class _Ask:
    """A goal, cancel or query that waits for its answer."""

    __slots__ = ("agent", "goal_id", "open", "timer", "what")

    def __init__(self, agent: str, what: Asked, goal_id: str) -> None:
        self.agent = agent
        self.what = what
        self.goal_id = goal_id
        self.open = True
        self.timer: Timer | None = None


class MemoryLink:
    """One agent's end of the hub, from `serve` to `close` (or `hub.kill`). A restart takes a new one."""

    def __init__(self, hub: "MemoryHub", agent: str) -> None:
        self.agent = agent
        self.side: AgentSide | None = None
        self.card: AgentCard | None = None
        self.dead = False
        self.frozen = False
        self.is_cut = False
        self.seen = False
        self.beats = False
        """Whether its process gives signs of life all the time, besides its statuses: they are not sent one by one."""
        self.last_beat: Micros = 0
        """The last of them before it was frozen or cut off."""
        self.held: list[Callable[[], None]] = []
        """What was sent to it while it was frozen."""
        self.unsaid: list[Callable[[], None]] = []
        """What it meant to say meanwhile: one process's words leave in the order in which it says them."""
        self.asks: list[_Ask] = []
        self._hub = hub

    def serve(self, side: AgentSide) -> None:
        """Take part in the hub under `side`'s rules, and announce its card and status."""
        assert side.card.id == self.agent, "the side has another id than the link"
        self.side = side
        self._hub.join(self)
        self.hear_site()
        side.announce()

    def send_file(self, digest: str, data: bytes, done: Callable[[str], None]) -> None:
        """Send bytes of an attachment."""
        try:
            if self._hub.files is None or self.dead or self.is_cut:
                raise FileError("not_kept: nobody keeps attachments")
            self._hub.files.put(digest, data)
        except FileError as error:
            done(str(error))
        else:
            done("")

    def hear_site(self) -> None:
        """Ask for the site, as an agent does that connects: at once, it is asked for until it is heard."""
        if self._hub.site is not None and self.side is not None and not (self.dead or self.frozen or self.is_cut):
            self.side.on_site(self._hub.site)

    def close(self) -> None:
        """Leave: the engine sees AgentGone."""
        self._hub.leave(self)

    def publish_status(self, status: AgentStatus) -> None:
        """Send a status."""
        raw = encode(status)
        self._tell(lambda: StatusArrived(check_status(self.agent, decode(raw, AgentStatus))))

    def publish_event(self, event: GoalEvent) -> None:
        """Send news of a goal."""
        if event.state in TERMINAL and self._hub.loses_result(self.agent):
            return
        raw = encode(event)
        self._tell(lambda: GoalReported(check_event(self.agent, decode(raw, GoalEvent))))

    def publish_agent_event(self, event: AgentEvent) -> None:
        """Send an event of the agent's own."""
        raw = encode(event)
        self._tell(lambda: EventArrived(check_agent_event(self.agent, decode(raw, AgentEvent))))

    def publish_card(self, card: AgentCard) -> None:
        """Announce the agent; a card announced before is replaced."""
        self.card = decode_card(encode(card))
        self.seen = True
        self._hub.show(self)

    def _tell(self, make: Callable[[], TransportEvent]) -> None:
        self._hub.to_engine(self, lambda: self._hub.transport.told(self.agent, make))


class MemoryHub:
    """Joins agents and one `MemoryTransport`; holds delays and faults.

    Args:
        scheduler: time, virtual or real.
        delay_us: one-way delay of every message.
        faults: for links that have none of their own.
        seed: of the faults; equal seeds and equal calls give equal deliveries.
        reply_timeout_us: after that an unanswered request is a SendFailed with outcome "unknown".
        lease_us: a frozen agent's presence is gone after that.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        *,
        delay_us: Micros = 20_000,
        faults: Faults | None = None,
        seed: int = 0,
        reply_timeout_us: Micros = 5 * SECOND,
        lease_us: Micros = 3 * SECOND,
    ) -> None:
        self.scheduler = scheduler
        self.reply_timeout_us = reply_timeout_us
        self.transport = MemoryTransport(self)
        self.files: KeepsFiles | None = None
        """Who keeps the bytes of attachments."""
        self.site: SiteMessage | None = None
        """What agents that connect are told of the site."""
        self.delay_us = delay_us
        """One-way delay of links that have none of their own."""
        self._lease_us = lease_us
        self._faults = faults or Faults()
        self._random = random.Random(seed)
        self._links: dict[str, MemoryLink] = {}
        self._own_faults, self._own_delay = dict[str, Faults](), dict[str, Micros]()
        self._lost_results: dict[str, int] = {}
        self._last_due: dict[tuple[str, bool], Micros] = {}
        self._latest_down: Micros = 0
        """When the last message to any agent is due."""

    # For tests and scenarios.

    def link(self, agent: str) -> MemoryLink:
        """Return a new link for one start of an agent."""
        return MemoryLink(self, agent)

    def set_faults(self, agent: str, faults: Faults) -> None:
        """Set how bad one agent's link is, from now on."""
        self._own_faults[agent] = faults

    def set_delay(self, agent: str, delay_us: Micros) -> None:
        """Set the one-way delay of one agent's link, from now on."""
        self._own_delay[agent] = delay_us

    def lose_results(self, agent: str, count: int = 1) -> None:
        """Lose the next `count` terminal events this agent publishes."""
        self._lost_results[agent] = self._lost_results.get(agent, 0) + count

    def kill(self, agent: str) -> None:
        """End an agent's process without a word: AgentGone, its goals and all it had not yet sent are lost."""
        link = self._links.get(agent)
        if link is not None:
            self.leave(link)

    def freeze(self, agent: str) -> None:
        """Stop an agent's process: it neither hears nor speaks. AgentGone after the lease."""
        link = self._links[agent]
        self._note_beat(link)
        link.frozen = True
        self.scheduler.call_at(self.scheduler.now() + self._lease_us, lambda: self._lease_over(link))

    def thaw(self, agent: str) -> None:
        """Let a frozen agent go on: all it meant to say leaves, before what it says to all that it hears now."""
        link = self._links[agent]
        link.frozen = False
        if not link.seen:
            link.seen = True
            self.show(link)
        link.hear_site()
        held, link.unsaid, link.held = [*link.unsaid, *link.held], [], []
        for call in held:
            call()

    def is_frozen(self, agent: str) -> bool:
        """Return whether an agent's process stands still."""
        link = self._links.get(agent)
        return link is not None and link.frozen

    def cut(self, agent: str, *, vanishes: bool = True) -> None:
        """Cut an agent's wire: all that is said either way is lost, also what is under way.

        Args:
            agent: whose; nothing happens if its process does not run.
            vanishes: whether its presence token goes too, after the lease.
        """
        link = self._links.get(agent)
        if link is None or link.is_cut:
            return
        self._note_beat(link)
        link.is_cut = True
        if vanishes:
            self.scheduler.call_at(self.scheduler.now() + self._lease_us, lambda: self._lease_over(link))

    def mend(self, agent: str) -> None:
        """Join a cut wire: what is said from now on passes, and a presence that had gone is there again."""
        link = self._links.get(agent)
        if link is None or not link.is_cut:
            return
        link.is_cut = False
        link.hear_site()
        if not link.seen:
            link.seen = True
            self.show(link)

    def _note_beat(self, link: MemoryLink) -> None:
        if not link.frozen and not link.is_cut:
            link.last_beat = self.scheduler.now()

    # For links and the transport.

    def heard(self, agent: str) -> Micros:
        """Return when the newest sign of life of an agent came in; 0 if it gives none but its statuses."""
        link = self._links.get(agent)
        if link is None or not link.beats or self._own_faults.get(agent, self._faults).drop >= 1.0:
            return 0
        return link.last_beat if link.frozen or link.is_cut else self.scheduler.now() - self._delay(agent)

    def join(self, link: MemoryLink) -> None:
        """Take a link in; one that is in under the same id is killed."""
        self.kill(link.agent)
        self._links[link.agent] = link

    def leave(self, link: MemoryLink) -> None:
        """Take a link out."""
        if link.dead or self._links.get(link.agent) is not link:
            return
        link.dead = True
        del self._links[link.agent]
        asks = tuple(link.asks)

        def gone() -> None:
            for ask in asks:
                self.transport.failed(ask, "unknown", "the agent went away before it answered")
            if link.seen:
                self.transport.arrived(AgentGone(link.agent))

        self._later(link, gone)

    def show(self, link: MemoryLink) -> None:
        """Announce a link's card to the engine."""
        card = link.card
        if card is not None and not link.dead:
            self._later(link, lambda: self.transport.told(link.agent, lambda: AgentSeen(check_card(link.agent, card))))

    def show_all(self) -> None:
        """Announce everyone whose presence stands."""
        for link in self._links.values():
            if link.seen:
                self.show(link)

    def forget_asks(self) -> None:
        """Nobody waits for answers any more."""
        for link in self._links.values():
            for ask in link.asks:
                self.transport.drop(ask)
            link.asks.clear()

    def loses_result(self, agent: str) -> bool:
        """Return True, and count it, if the next result is to be lost."""
        left = self._lost_results.get(agent, 0)
        self._lost_results[agent] = max(0, left - 1)
        return left > 0

    def to_engine(self, link: MemoryLink, deliver: Callable[[], None]) -> None:
        """Carry what an agent says to the engine's end, where `deliver` hands it over."""
        if link.frozen:
            link.unsaid.append(lambda: self.to_engine(link, deliver))
        elif not link.dead and not link.is_cut:
            self._send(link.agent, True, lambda: None if link.is_cut else deliver())

    def to_agent(self, agent: str, call: Callable[[AgentSide, MemoryLink], None], ask: _Ask | None = None) -> None:
        """Deliver what the engine says; an `ask` fails if there is nobody."""
        link = self._links.get(agent)
        if link is None:
            if ask is not None:
                self.transport.failed(ask, "unreachable", "no such agent is present")
            return
        if ask is not None:
            link.asks = [*(old for old in link.asks if old.open), ask]
        self._send(agent, False, lambda: self._hear(link, call))

    def tell_site(self, message: SiteMessage) -> None:
        """Tell everyone of the site, and who connects later."""
        self.site = decode_site(encode(message))
        for link in self._links.values():
            link.hear_site()

    def to_all(self, call: Callable[[AgentSide, MemoryLink], None]) -> None:
        """Deliver what the engine says to everyone; over a wire without faults that is one delivery, not one for each."""
        links = tuple(self._links.values())
        if self._own_faults or self._own_delay or self._faults != NO_FAULTS:
            for link in links:
                self.to_agent(link.agent, call)
            return

        def deliver() -> None:
            for link in links:
                self._hear(link, call)

        self._latest_down = max(self.scheduler.now() + self.delay_us, self._latest_down)
        self.scheduler.call_at(self._latest_down, deliver)

    def _hear(self, link: MemoryLink, call: Callable[[AgentSide, MemoryLink], None]) -> None:
        if link.dead or link.side is None or link.is_cut:
            return
        if link.frozen:
            link.held.append(lambda: self._hear(link, call))
        else:
            call(link.side, link)

    def _lease_over(self, link: MemoryLink) -> None:
        if (link.frozen or link.is_cut) and link.seen and not link.dead:
            link.seen = False
            self.transport.arrived(AgentGone(link.agent))

    def _later(self, link: MemoryLink, call: Callable[[], None]) -> None:
        # To the engine for certain, in order with what the agent said.
        self._deliver(link.agent, True, self.scheduler.now() + self._delay(link.agent), call, overtakes=False)

    def _send(self, agent: str, up: bool, call: Callable[[], None]) -> None:
        faults = self._own_faults.get(agent, self._faults)
        delay = self._delay(agent)
        if self._random.random() < faults.drop:
            return
        for _ in range(2 if self._random.random() < faults.duplicate else 1):
            due = self.scheduler.now() + delay
            due += self._random.randrange(faults.jitter_us + 1)
            overtakes = self._random.random() < faults.reorder
            due += self._random.randrange(5 * delay + 1) if overtakes else 0
            self._deliver(agent, up, due, call, overtakes=overtakes)

    def _deliver(self, agent: str, up: bool, due: Micros, call: Callable[[], None], *, overtakes: bool) -> None:
        if not overtakes:
            due = max(due, self._last_due.get((agent, up), 0))
            self._last_due[agent, up] = due
            if not up:
                self._latest_down = max(due, self._latest_down)
        self.scheduler.call_at(due, call)

    def _delay(self, agent: str) -> Micros:
        return self._own_delay.get(agent, self.delay_us)


class MemoryTransport:
    """The engine's end of a `MemoryHub`. Used from the scheduler's thread only."""

    name = "memory"
    guarantees = GUARANTEES

    def __init__(self, hub: MemoryHub) -> None:
        self._hub = hub
        self._inbox: deque[TransportEvent] = deque()
        self._wake: Callable[[], None] = lambda: None
        self._closed = False

    def open(self, wake: Callable[[], None]) -> None:
        """Start; what agents said before is kept for the first poll."""
        self._wake = wake
        if self._closed:  # an engine that comes back finds who is there
            self._closed = False
            self._hub.show_all()
        if self._inbox:
            wake()

    def close(self) -> None:
        """Stop: nothing is delivered any more."""
        self._closed = True
        self._inbox.clear()
        self._hub.forget_asks()

    def poll(self) -> Sequence[TransportEvent]:
        """Return what has arrived."""
        events = tuple(self._inbox)
        self._inbox.clear()
        return events

    def send_goal(self, request: GoalRequest) -> None:
        """Send a goal."""
        self._ask(request.agent, "goal", request.goal_id, request)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Ask for cancellation."""
        self._ask(agent, "cancel", goal_id, CancelRequest(goal_id))

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what an agent knows of these goals."""
        self._ask(agent, "query", "", GoalsRequest(tuple(goal_ids)))

    def send_update(self, update: UpdateRequest) -> None:
        """Send other fields for a goal that runs."""
        self._ask(update.agent, "update", update.goal_id, update)

    def publish_clock(self, beat: ClockBeat) -> None:
        """Send the clock to all agents."""
        self._hub.to_all(lambda side, _: side.on_clock(beat))

    def keep_files(self, store: KeepsFiles) -> None:
        """Say who keeps the bytes of attachments."""
        self._hub.files = store

    def publish_site(self, message: SiteMessage) -> None:
        """Tell all agents of the site."""
        self._hub.tell_site(message)

    def heard(self, agent: str) -> Micros:
        """Return when it last heard an agent that gives signs of life besides its statuses; else 0."""
        return self._hub.heard(agent)

    # From the hub.

    def told(self, agent: str, make: Callable[[], TransportEvent]) -> None:
        """Take in what an agent said; what cannot be read becomes a BadMessage."""
        try:
            self.arrived(make())
        except WireError as error:
            self.arrived(BadMessage(agent, str(error)))

    def arrived(self, event: TransportEvent) -> None:
        """Take in an event."""
        if self._closed:
            return
        self._inbox.append(event)
        self._wake()

    def failed(self, ask: _Ask, outcome: Literal["unreachable", "unknown"], text: str) -> None:
        """End a request that got no answer."""
        if self._end(ask):
            self.arrived(SendFailed(ask.agent, ask.what, ask.goal_id, outcome, text))

    # Inside.

    def _ask(self, agent: str, what: Asked, goal_id: str, message: object) -> None:
        ask = _Ask(agent, what, goal_id)
        try:
            raw = encode(message)
        except WireError as error:
            self.failed(ask, "unreachable", str(error))
            return
        hub = self._hub

        def heard(side: AgentSide, link: MemoryLink) -> None:
            try:
                reply = serve_request(side, what, raw)
            except WireError as error:
                text = str(error)
                hub.to_engine(link, lambda: self.failed(ask, "unknown", text))
            else:
                hub.to_engine(link, lambda: self._answered(ask, reply))

        ask.timer = hub.scheduler.call_at(
            hub.scheduler.now() + hub.reply_timeout_us, lambda: self.failed(ask, "unknown", "no answer in time")
        )
        hub.to_agent(agent, heard, ask)

    def _answered(self, ask: _Ask, reply: bytes) -> None:
        try:
            event = read_reply(ask.agent, ask.what, ask.goal_id, reply)
        except WireError as error:
            self.failed(ask, "unknown", str(error))
            self.arrived(BadMessage(ask.agent, str(error)))
        else:
            if self._end(ask):
                self.arrived(event)

    def drop(self, ask: _Ask) -> None:
        """End a request of an engine that is gone."""
        self._end(ask)

    @staticmethod
    def _end(ask: _Ask) -> bool:
        was_open, ask.open = ask.open, False
        if ask.timer is not None:
            ask.timer.cancel()
        return was_open
