"""The engine's end of the Zenoh wire: a router on a loopback (or other) endpoint to which agents connect.

With keys it listens nowhere: the site's own router (`zenoh_router.py`) does, by TLS, and the engine connects to it as the
agents do. What comes under an agent's key is then that agent's, and nothing is heard of one whose keys were revoked.

Why Zenoh: one Python wheel, no broker, presence tokens, queries with a reply. Keys and messages: `docs/wire.md`.

Threads: Zenoh's threads only append to one queue and call `wake`; everything else happens in the driver's thread, in
`poll` and the `send_...` calls. None of them waits: queries are answered by callback, and what a congested link cannot
take is dropped (a request then ends with outcome "unknown", as if the agent were frozen).

What a query's outcome tells: a reply is a reply. An error "Timeout" means that the agent may have carried the request
out. No reply at all means it is not there, unless it was present when we asked: it may then have died of the request.
"""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import zenoh

from formiga_bt.base.authority import Revoked, day
from formiga_bt.base.certificates import DAY_S, ENGINE, read_keys
from formiga_bt.base.endpoints import reached_at
from formiga_bt.base.errors import TransportError
from formiga_bt.base.wires import GUARANTEES, WireSetup
from formiga_bt.transport.attachments import KeepsFiles
from formiga_bt.transport.calls import AnswersCalls, CallError
from formiga_bt.transport.codec import (
    FRAME_LIMIT,
    Asked,
    CancelRequest,
    GoalsRequest,
    WireError,
    check_agent_event,
    check_card,
    check_event,
    check_size,
    check_status,
    decode,
    decode_card,
    encode,
    read_reply,
)
from formiga_bt.transport.messages import (
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
from formiga_bt.transport.zenoh_calls import CallDesk, encoded
from formiga_bt.transport.zenoh_files import FileDesk
from formiga_bt.transport.zenoh_keys import (
    ALIVE,
    CANCEL,
    CARD,
    CLOCK,
    ENGINE_ALIVE,
    EVENT,
    FILES,
    GOAL,
    GOALS,
    SITE,
    STATUS,
    TOLD,
    UPDATE,
    WireKey,
)
from formiga_bt.transport.zenoh_queries import refuse
from formiga_bt.transport.zenoh_session import (
    DEFAULT_ENDPOINT,
    DEFAULT_TLS,
    LEASE_MS,
    check_name,
    close_session,
    free_endpoint,
    on_network_thread,
    open_session,
)

HOUSE_SOON_S: Final = 30 * DAY_S
"""So long before it expires the engine's own certificate is spoken of."""
CUT_S: Final = 3.0
"""So long the engine may be without its router before that is an alarm: a restart takes less."""
HEARD_S: Final = 10.0
"""So long after it was heard an agent whose keys were revoked still speaks."""
CARD_RETRY_S: Final = 0.5
"""How long after asking in vain an agent is asked for its card again."""
KEPT_ACTIONS: Final = 20_000
"""Of so many goals the action is remembered, to cancel them by their own key. Older ones are asked for with `*`."""


class _Ask:
    """A query on its way. Zenoh's thread adds replies (True: ok) and, at the end, puts it into the queue."""

    __slots__ = ("agent", "deaths", "goal_id", "present", "replies", "what")

    def __init__(self, agent: str, what: Asked | Literal["card"], goal_id: str, present: bool, deaths: int) -> None:
        self.agent = agent
        self.what = what
        self.goal_id = goal_id
        self.present = present
        self.deaths = deaths
        self.replies: list[tuple[bool, bytes]] = []


class _Peer:
    """What is known of an agent; kept after it is gone, for its type."""

    __slots__ = ("asked_card_at", "card", "deaths", "held", "present", "type")

    def __init__(self, agent_type: str) -> None:
        self.type = agent_type
        self.present = False
        self.card: AgentCard | None = None
        self.held: AgentStatus | None = None
        self.asked_card_at = float("-inf")
        self.deaths = 0


class _Raw:
    """A message as it came in: which of our subscriptions, its key, its bytes (None: too long to be copied)."""

    __slots__ = ("kind", "payload", "rest", "size")

    def __init__(self, kind: Literal["status", "event", "told", "card", "alive", "gone"], sample: Any) -> None:
        self.kind = kind
        self.rest = str(sample.key_expr).split("/")
        self.size = len(sample.payload)
        self.payload: bytes = sample.payload.to_bytes() if self.size <= FRAME_LIMIT else b""


class ZenohTransport:
    """All agents that reach this engine by Zenoh.

    Args:
        site: the site's name, the namespace of all keys.
        listen: where agents connect; port 0 takes a free one (see `endpoint`).
        connect: routers to join besides, for agents of other networks.
        reply_timeout_s: a goal, cancel or query without answer fails after that with outcome "unknown" (wall time).
        lease_ms: a frozen or cut-off agent is gone after that.
        keys: the site's folder of keys; `listen` is then where its router listens.
    """

    name = "zenoh"
    guarantees = GUARANTEES
    """Whoever reaches the endpoint may use any key."""

    def __init__(
        self,
        site: str,
        *,
        listen: str = DEFAULT_ENDPOINT,
        connect: Sequence[str] = (),
        reply_timeout_s: float = 5.0,
        lease_ms: int = LEASE_MS,
        keys: Path | None = None,
    ) -> None:
        self._keys = keys
        self.binds_names = keys is not None
        """A router lets each holder of keys use its own name only."""
        self._revoked: Revoked | None = None
        self._ignored: frozenset[str] = frozenset()
        """Agents whose keys were revoked, as the last `poll` saw it."""
        self._until = 0
        """When the engine's own certificate expires, seconds since 1970."""
        self._linked_at = 0.0
        """When the link to the router was last seen, by a clock that never goes back."""
        self._heard_revoked: dict[str, float] = {}
        """Agent whose keys were revoked -> when it was last heard, by a clock that never goes back."""
        self._site = site
        self._listen = listen
        self._connect = tuple(connect)
        self._reply_timeout_s = reply_timeout_s
        self._lease_ms = lease_ms
        self._session: Any = None
        self._kept: list[Any] = []
        self._queue: deque[_Raw | _Ask | TransportEvent] = deque()
        self._wake: Callable[[], None] = lambda: None
        self._peers: dict[str, _Peer] = {}
        self._actions: dict[str, str] = {}
        self._closed = True
        self._site_raw = b""
        self._files = FileDesk()
        self._calls = CallDesk()

    @property
    def endpoint(self) -> str:
        """Return where agents connect; after `open` with the true port."""
        return self._listen

    def open(self, wake: Callable[[], None]) -> None:
        """Open the router's session. Takes about half a second.

        Raises:
            KeysError: the keys cannot be used.
            TransportError: the port is taken, or the site's name or an endpoint is bad.
        """
        if self._session is not None:
            raise TransportError("the zenoh transport is open already")
        self._wake = wake
        self._closed = False
        self._files.open()
        self._calls.open()
        if self._keys is not None:
            own, self._revoked = read_keys(self._keys / "engine", time.time(), ENGINE), Revoked(self._keys)
            self._until, self._linked_at = own.until, time.monotonic()
            session = open_session(
                "router", self._site, connect=[reached_at(self._listen)], lease_ms=self._lease_ms, keys=own
            )
        else:
            self._listen = free_endpoint(self._listen)
            session = open_session(
                "router", self._site, listen=[self._listen], connect=self._connect, lease_ms=self._lease_ms
            )
        self._session = session
        try:
            self._kept = [
                session.declare_subscriber(STATUS.of_all, on_network_thread(lambda s: self._take(_Raw("status", s)))),
                session.declare_subscriber(EVENT.of_all, on_network_thread(lambda s: self._take(_Raw("event", s)))),
                session.declare_subscriber(TOLD.of_all, on_network_thread(lambda s: self._take(_Raw("told", s)))),
                session.declare_subscriber(CARD.of_all, on_network_thread(lambda s: self._take(_Raw("card", s)))),
                session.liveliness().declare_subscriber(ALIVE.of_all, on_network_thread(self._on_token), history=True),
                session.declare_queryable(SITE.of_all, on_network_thread(self._tell_site)),
                session.declare_queryable(FILES.of_all, on_network_thread(self._files.take)),
                *(session.declare_queryable(key, on_network_thread(self._take_call)) for key in self._calls.keys),
                session.liveliness().declare_token(ENGINE_ALIVE.of_all),
            ]
        except zenoh.ZError as error:
            self.close()
            raise TransportError(f"cannot listen to agents: {error}") from error

    def close(self) -> None:
        """Close the session; takes at most 2 s."""
        self._closed = True
        self._files.close()
        self._calls.close()
        session, self._session = self._session, None
        self._kept = []
        if session is not None:
            close_session(session)
        self._queue.clear()
        self._peers.clear()

    def poll(self) -> Sequence[TransportEvent]:
        """Return what has come in."""
        events: list[TransportEvent] = []
        if self._revoked is not None and self._queue:
            before, self._ignored = self._ignored, self._revoked.look()
            for agent in self._ignored - before:
                if (peer := self._peers.get(agent)) is not None:
                    self._gone(agent, peer.type, events)
        for _ in range(len(self._queue)):
            item = self._queue.popleft()
            if isinstance(item, _Raw):
                if item.rest[1] in self._ignored:
                    self._heard_revoked[item.rest[1]] = time.monotonic()
                else:
                    self._read(item, events)
            elif isinstance(item, _Ask) and item.agent in self._ignored:
                if item.what != "card":
                    events.append(SendFailed(item.agent, item.what, item.goal_id, "unknown", "its keys were revoked"))
            elif isinstance(item, _Ask):
                self._conclude(item, events)
            else:
                events.append(item)
        return events

    def send_goal(self, request: GoalRequest) -> None:
        """Send a goal."""
        self._actions[request.goal_id] = request.action
        if len(self._actions) > KEPT_ACTIONS:
            del self._actions[next(iter(self._actions))]
        self._ask(request.agent, "goal", request.goal_id, GOAL, request, request.action)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Ask for cancellation. Of a goal sent before the engine's restart the action is not known: all are asked."""
        action = self._actions.get(goal_id, "*")
        self._ask(agent, "cancel", goal_id, CANCEL, CancelRequest(goal_id), action)

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what an agent knows of these goals."""
        self._ask(agent, "query", "", GOALS, GoalsRequest(tuple(goal_ids)))

    def send_update(self, update: UpdateRequest) -> None:
        """Send other fields for a goal that runs."""
        self._ask(update.agent, "update", update.goal_id, UPDATE, update, update.action)

    def publish_clock(self, beat: ClockBeat) -> None:
        """Publish the clock; also the time to ask once more for cards that did not come."""
        if self._session is None:
            return
        drop = zenoh.CongestionControl.DROP
        self._session.put(
            CLOCK.of_all, encode(beat), congestion_control=drop, express=True, encoding="application/json"
        )
        for agent, peer in self._peers.items():
            if peer.present and peer.card is None:
                self._ask_card(agent, peer)

    def troubles(self) -> list[tuple[str, str, str]]:
        """Return what is wrong with a secured wire now: code, subject, text. Called in any thread."""
        session = self._session
        if self._keys is None or session is None:
            return []
        found = []
        with contextlib.suppress(zenoh.ZError):  # closed meanwhile
            now = time.monotonic()
            if session.info.routers_zid():
                self._linked_at = now
            elif now - self._linked_at > CUT_S:
                text = f"no link to the site's router at {reached_at(self._listen)}: no agent is heard: formiga router"
                found.append(("router_gone", "router", text))
        left_s = self._until - time.time()
        if left_s < HOUSE_SOON_S:
            text = f"the engine's certificate expires on {day(self._until)}: formiga access ca, then start both anew"
            found.append(("keys_expire", "engine", text))
        for agent, at in sorted(self._heard_revoked.copy().items()):
            if time.monotonic() - at < HEARD_S:
                text = f"{agent} still speaks, whose keys were revoked; it is ignored. Shut it out: formiga router --restart"
                found.append(("keys_revoked", agent, text))
        return found

    def keep_files(self, store: KeepsFiles) -> None:
        """Say who keeps the bytes of attachments."""
        self._files.store = store

    def serve_calls(self, desk: AnswersCalls, *, bare: bool) -> None:
        """Say who answers programs that call services; before `open`."""
        self._calls.serve(desk, bare=bare)

    def publish_site(self, message: SiteMessage) -> None:
        """Publish the site, and answer with it whoever asks."""
        self._site_raw = encode(message)
        if self._session is not None:
            drop = zenoh.CongestionControl.DROP  # whoever misses it asks
            self._session.put(SITE.of_all, self._site_raw, congestion_control=drop, encoding="application/json")

    # On Zenoh's threads.

    def _tell_site(self, query: Any) -> None:
        with query:
            if self._site_raw:
                query.reply(SITE.of_all, self._site_raw, encoding="application/json")
            else:
                query.reply_err(b"the engine is not ready: ask again")

    def _take_call(self, query: Any) -> None:
        caller = str(query.key_expr).split("/")[1:2]
        if self._revoked is not None and self._revoked.look().intersection(caller):
            refuse(query, encoded(CallError("keys_revoked", f"the keys of {caller[0]} were revoked")))
        else:
            self._calls.take(query)

    def _take(self, item: _Raw | _Ask) -> None:
        if not self._closed:
            self._queue.append(item)
            self._wake()

    def _on_token(self, sample: Any) -> None:
        self._take(_Raw("alive" if sample.kind == zenoh.SampleKind.PUT else "gone", sample))

    # Requests.

    def _ask(self, agent: str, what: Asked, goal_id: str, key: WireKey, message: Any, action: str = "*") -> None:
        peer = self._peers.get(agent)
        ask = _Ask(agent, what, goal_id, peer is not None and peer.present, peer.deaths if peer else 0)
        text = "no such agent has been seen"
        if agent in self._ignored:
            text = "its keys were revoked"
        elif peer is not None:
            try:
                if action != "*":
                    check_name("action", action)
                self._get(ask, key.of(peer.type, agent).replace("*", action), encode(message))
                return
            except TransportError as error:
                text = str(error)
        self._queue.append(SendFailed(agent, what, goal_id, "unreachable", text))
        self._wake()

    def _ask_card(self, agent: str, peer: _Peer) -> None:
        now = time.monotonic()
        if now - peer.asked_card_at < CARD_RETRY_S:
            return
        peer.asked_card_at = now
        with contextlib.suppress(TransportError):  # asked again with the next status or beat
            self._get(_Ask(agent, "card", "", peer.present, peer.deaths), CARD.of(peer.type, agent), b"")

    def _get(self, ask: _Ask, key: str, payload: bytes) -> None:
        if self._session is None:
            raise TransportError("the zenoh transport is not open")

        def reply(answer: Any) -> None:
            ok = answer.ok
            value = (ok if ok is not None else answer.err).payload
            ask.replies.append((ok is not None, value.to_bytes() if len(value) <= FRAME_LIMIT else b"{too long}"))

        try:
            self._session.get(
                key,
                on_network_thread(reply, lambda: self._take(ask)),
                payload=payload,
                timeout=self._reply_timeout_s,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                congestion_control=zenoh.CongestionControl.DROP,
                express=True,
            )
        except zenoh.ZError as error:
            raise TransportError(f"cannot ask {ask.agent}: {error}") from error

    def _conclude(self, ask: _Ask, events: list[TransportEvent]) -> None:
        good = [raw for ok, raw in ask.replies if ok]
        if ask.what == "card":
            self._take_card(ask, good[0] if good else None, events)
            return
        answers: list[TransportEvent] = []
        for raw in good:
            try:
                answers.append(read_reply(ask.agent, ask.what, ask.goal_id, raw))
            except WireError as error:
                events.append(BadMessage(ask.agent, str(error)))
        if answers:
            events.append(next((answer for answer in answers if not _is_unknown(answer)), answers[0]))
            return
        refusals = [raw.decode(errors="replace")[:500] for ok, raw in ask.replies if not ok and raw != b"Timeout"]
        if good or len(refusals) < len(ask.replies):
            text = "its answer cannot be read" if good else "no answer in time"
            events.append(SendFailed(ask.agent, ask.what, ask.goal_id, "unknown", text))
        elif refusals and ask.what == "goal":
            events.append(
                GoalReported(
                    GoalEvent(
                        goal_id=ask.goal_id, agent=ask.agent, state="rejected", n=1, code="refused", text=refusals[0]
                    )
                )
            )
        elif refusals:
            events.append(SendFailed(ask.agent, ask.what, ask.goal_id, "unreachable", refusals[0]))
        elif ask.present:
            text = "it was present but gave no answer; it may have died of the request"
            events.append(SendFailed(ask.agent, ask.what, ask.goal_id, "unknown", text))
        else:
            events.append(SendFailed(ask.agent, ask.what, ask.goal_id, "unreachable", "the agent is not there"))

    # What agents say.

    def _read(self, raw: _Raw, events: list[TransportEvent]) -> None:
        agent_type, agent = raw.rest[0], raw.rest[1]
        try:
            check_size(raw.size)
            if raw.kind == "status":
                status = check_status(agent, decode(raw.payload, AgentStatus))
                if status.type != agent_type:
                    raise WireError(f"a status of a {status.type} came from a {agent_type}")
                self._take_status(self._peer(agent, agent_type), status, events)
            elif raw.kind == "event":
                self._peer(agent, agent_type)
                events.append(GoalReported(check_event(agent, decode(raw.payload, GoalEvent))))
            elif raw.kind == "told":
                self._peer(agent, agent_type)
                told = check_agent_event(agent, decode(raw.payload, AgentEvent))
                if told.event != raw.rest[3]:
                    raise WireError(f"an event {told.event!r} came under the key of {raw.rest[3]!r}")
                events.append(EventArrived(told))
            elif raw.kind == "card":
                self._show(self._peer(agent, agent_type), check_card(agent, decode_card(raw.payload)), events)
            elif raw.kind == "alive":
                peer = self._peer(agent, agent_type)
                peer.present = True
                peer.asked_card_at = float("-inf")
                self._ask_card(agent, peer)
            else:
                self._gone(agent, agent_type, events)
        except WireError as error:
            events.append(BadMessage(agent, str(error)))

    def _peer(self, agent: str, agent_type: str) -> _Peer:
        peer = self._peers.get(agent)
        if peer is None or (not peer.present and peer.type != agent_type):
            peer = self._peers[agent] = _Peer(agent_type)
        if peer.type != agent_type:
            raise WireError(f"{agent!r} is a {peer.type}; a {agent_type} says it has the same id")
        return peer

    def _take_status(self, peer: _Peer, status: AgentStatus, events: list[TransportEvent]) -> None:
        if peer.card is not None and peer.present and status.boot_id in ("", peer.card.boot_id):
            events.append(StatusArrived(status))
            return
        # Not announced yet, started anew without a sign, or its token was lost: the card goes first.
        peer.held = status
        self._ask_card(status.id, peer)

    def _take_card(self, ask: _Ask, raw: bytes | None, events: list[TransportEvent]) -> None:
        peer = self._peers.get(ask.agent)
        if raw is None or peer is None or peer.deaths != ask.deaths:
            return
        try:
            self._show(peer, check_card(ask.agent, decode_card(raw)), events)
        except WireError as error:
            events.append(BadMessage(ask.agent, str(error)))

    def _show(self, peer: _Peer, card: AgentCard, events: list[TransportEvent]) -> None:
        if card.type != peer.type:
            raise WireError(f"the card of {card.id!r} says it is a {card.type}; its keys say {peer.type}")
        peer.card, peer.present = card, True
        events.append(AgentSeen(card))
        held, peer.held = peer.held, None
        if held is not None:
            events.append(StatusArrived(held))

    def _gone(self, agent: str, agent_type: str, events: list[TransportEvent]) -> None:
        peer = self._peers.get(agent)
        if peer is None or peer.type != agent_type or not peer.present:
            return
        seen = peer.card is not None
        peer.present, peer.card, peer.held = False, None, None
        peer.deaths += 1
        if seen:
            events.append(AgentGone(agent))


def _is_unknown(event: TransportEvent) -> bool:
    return isinstance(event, GoalReported) and event.event.state == "unknown"


def make(setup: WireSetup) -> ZenohTransport:
    """Return the wire that a site file describes (`base.wires.ZENOH`)."""
    keys = str(setup.options.get("keys", ""))
    listen = str(setup.options.get("listen", DEFAULT_TLS if keys else DEFAULT_ENDPOINT))
    return ZenohTransport(setup.site, listen=listen, keys=Path(keys) if keys else None)
