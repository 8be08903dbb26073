"""The agent's end of the Zenoh wire: a peer that connects to an engine, now or whenever there is one.

For simulated agents and integrators: give a `ZenohAgentLink` to an `AgentSide`, then `serve` it and call `pump` in the
agent's own loop. Zenoh's threads only put requests into a queue; `AgentSide` and the body are called by `pump` alone,
and replies leave from there too.
"""

import contextlib
import queue
import typing
from collections.abc import Callable
from typing import Any, Final, Literal

import zenoh

from formiga_bt.base.certificates import Keys
from formiga_bt.base.errors import TransportError
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.codec import (
    Asked,
    UnsentReplyError,
    WireError,
    check_clock,
    check_size,
    decode,
    decode_site,
    encode,
    serve_request,
)
from formiga_bt.transport.messages import AgentCard, AgentEvent, AgentStatus, ClockBeat, GoalEvent
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
from formiga_bt.transport.zenoh_session import (
    DEFAULT_ENDPOINT,
    LEASE_MS,
    check_name,
    close_session,
    on_network_thread,
    open_session,
)

FILE_S: Final = 30.0
"""So long an answer to the bytes of an attachment is waited for."""
_JSON: Final = "application/json"

_What = Asked | Literal["clock", "site", "engine"]
_Item = tuple[_What, Any]


class ZenohAgentLink:
    """One agent's session.

    Args:
        site: the site's name, the namespace of all keys.
        connect: the engine's endpoint. It may be absent; the link joins when it appears, and again after a restart.
        wake: called from Zenoh's threads when `pump` has work, for agents with a loop of their own.
        lease_ms: how long this process may stand still before it counts as gone.
        keys: what the agent proves who it is with, at a secured site.
    """

    def __init__(
        self,
        site: str,
        *,
        connect: str = DEFAULT_ENDPOINT,
        wake: Callable[[], None] = lambda: None,
        lease_ms: int = LEASE_MS,
        keys: Keys | None = None,
    ) -> None:
        self._keys = keys
        self._site = site
        self._endpoint = connect
        self._wake = wake
        self._lease_ms = lease_ms
        self._session: Any = None
        self._side: AgentSide | None = None
        self._queue: queue.SimpleQueue[_Item] = queue.SimpleQueue()
        self._card = b""
        self._kept: list[Any] = []
        self._token: Any = None
        self._is_cut = False

    def serve(self, side: AgentSide) -> None:
        """Open the session, take requests for `side`, then announce it. Takes about half a second.

        Raises:
            TransportError: the site, the type, the id or the endpoint cannot be used.
        """
        if self._session is not None:
            raise TransportError("this link serves already")
        for what, name in (("type", side.card.type), ("id", side.card.id), *(("action", a) for a in side.card.names)):
            check_name(f"agent {what}", name)
        session = open_session("peer", self._site, connect=[self._endpoint], lease_ms=self._lease_ms, keys=self._keys)
        self._session, self._side = session, side
        try:
            self._declare(session)
        except zenoh.ZError as error:
            self.close()
            raise TransportError(f"cannot take requests for {side.card.id}: {error}") from error
        side.announce()

    def close(self) -> None:
        """Leave the site: the engine sees this agent gone. Takes at most 2 s; may be called twice."""
        session, self._session = self._session, None
        self._kept, self._token = [], None
        if session is not None:
            close_session(session)

    def cut(self, *, vanishes: bool = True) -> None:
        """Play a broken link, for trials: what comes in goes unanswered and nothing leaves, until `mend`.

        Args:
            vanishes: whether the presence token goes too.
        """
        self._is_cut = True
        if vanishes and self._token is not None:
            self._token.undeclare()
            self._token = None

    def mend(self) -> None:
        """Let the link carry again."""
        self._is_cut = False
        if self._token is None and self._session is not None:
            self._token = self._session.liveliness().declare_token(self._key(ALIVE))

    def pump(self, timeout_s: float = 0.0) -> int:
        """Answer all that came in, waiting up to `timeout_s` for the first of it. Return how many there were."""
        done = 0
        try:
            item = self._queue.get(timeout=timeout_s) if timeout_s > 0 else self._queue.get_nowait()
            while True:
                done += 1
                self._handle(*item)
                item = self._queue.get_nowait()
        except queue.Empty:
            return done

    def publish_status(self, status: AgentStatus) -> None:
        """Publish a status; a link that cannot take it drops it."""
        if not self._is_cut:
            self._put(self._key(STATUS), encode(status), zenoh.CongestionControl.DROP)

    def publish_event(self, event: GoalEvent) -> None:
        """Publish news of a goal."""
        assert self._side is not None, "serve(side) comes first"
        action = self._side.action_of(event.goal_id) or "any"
        if not self._is_cut:
            self._put(self._key(EVENT, action), encode(event), zenoh.CongestionControl.BLOCK)

    def publish_agent_event(self, event: AgentEvent) -> None:
        """Publish an event of the agent's own."""
        if not self._is_cut:
            key = self._key(TOLD, check_name("event", event.event))
            self._put(key, encode(event), zenoh.CongestionControl.BLOCK)

    def publish_card(self, card: AgentCard) -> None:
        """Announce the agent: the first time by its presence token, later by the changed card."""
        self._card = encode(card)
        if self._session is None:
            return
        if self._token is None:
            self._token = self._session.liveliness().declare_token(self._key(ALIVE))
        else:
            self._put(self._key(CARD), self._card, zenoh.CongestionControl.BLOCK)

    def publish_extra(self, name: str, message: Any) -> None:
        """Publish something no engine reads, under `<type>/<id>/<name>` (a simulated motion, a camera's own data)."""
        self._put(f"{self._root}/{check_name('extra', name)}", encode(message), zenoh.CongestionControl.DROP)

    def _declare(self, session: Any) -> None:
        card = self._key(CARD)
        self._kept = [
            session.declare_queryable(card, on_network_thread(lambda query: query.reply(card, self._card))),
            session.declare_queryable(self._key(GOAL), self._into("goal")),
            session.declare_queryable(self._key(CANCEL), self._into("cancel")),
            session.declare_queryable(self._key(UPDATE), self._into("update")),
            session.declare_queryable(self._key(GOALS), self._into("query")),
            session.declare_subscriber(CLOCK.of_all, self._into("clock")),
            session.declare_subscriber(SITE.of_all, self._into("site")),
            session.liveliness().declare_subscriber(ENGINE_ALIVE.of_all, self._into("engine"), history=True),
        ]

    def _put(self, key: str, raw: bytes, congestion: Any) -> None:
        if self._session is not None:
            self._session.put(key, raw, congestion_control=congestion, express=True, encoding=_JSON)

    def _key(self, key: WireKey, word: str = "*") -> str:
        """Return a key of this agent's; `word` is an action or an event."""
        assert self._side is not None, "serve(side) comes first"
        return key.of(self._side.card.type, self._side.card.id).replace("*", word)

    @property
    def _root(self) -> str:
        assert self._side is not None, "serve(side) comes first"
        return f"{self._side.card.type}/{self._side.card.id}"

    def _into(self, what: _What) -> Any:
        def enqueue(item: Any) -> None:
            self._queue.put((what, item))
            self._wake()

        return on_network_thread(enqueue)

    def send_file(self, digest: str, data: bytes, done: Callable[[str], None]) -> None:
        """Send bytes of an attachment to the engine."""
        said: list[str] = []

        def reply(answer: Any) -> None:
            said.append("" if answer.ok is not None else answer.err.payload.to_bytes().decode(errors="replace")[:500])

        def over() -> None:
            done(said[0] if said else "unreachable: no engine answered")

        if self._session is None or self._is_cut:
            done("unreachable: the link is not open")
            return
        try:
            self._session.get(
                FILES.of_all.replace("*", digest), on_network_thread(reply, over), payload=data, timeout=FILE_S,
                congestion_control=zenoh.CongestionControl.BLOCK,
            )  # fmt: skip
        except zenoh.ZError as error:
            done(f"unreachable: {error}")

    def _ask_site(self) -> None:
        """Ask the engine for the site; called at each connect, and with each beat until it has answered."""

        def reply(answer: Any) -> None:
            if answer.ok is not None:
                self._queue.put(("site", answer.ok))
                self._wake()

        if self._session is not None:
            with contextlib.suppress(zenoh.ZError):  # asked again with the next beat
                self._session.get(SITE.of_all, on_network_thread(reply), timeout=1.0)

    def _handle(self, what: _What, item: Any) -> None:
        side = self._side
        assert side is not None
        if what in ("clock", "site", "engine"):
            if not self._is_cut:
                self._hear(side, what, item)
            return
        with item as query:
            if self._is_cut:
                return  # no reply
            key = str(query.key_expr)
            payload = query.payload
            try:
                check_size(len(payload) if payload is not None else 0)
                raw = payload.to_bytes() if payload is not None else b""
                asked = typing.cast(Asked, what)
                query.reply(key.replace("*", "any"), serve_request(side, asked, raw), encoding=_JSON)
            except UnsentReplyError:
                pass  # no reply: the engine must think it may have been carried out, and it was
            except WireError as error:
                query.reply_err(str(error).encode())

    def _hear(self, side: AgentSide, what: _What, item: Any) -> None:
        with contextlib.suppress(WireError):  # an engine of another version: its goals will tell
            if what == "clock":
                side.on_clock(check_clock(decode(item.payload.to_bytes(), ClockBeat)))
                if side.wants_site:
                    self._ask_site()
            elif what == "site":
                check_size(len(item.payload))
                side.on_site(decode_site(item.payload.to_bytes()))
            elif item.kind == zenoh.SampleKind.PUT:
                self._ask_site()


class ZenohObserver:
    """Hears what agents and the engine of a site publish, and asks nothing: a referee, a recorder.

    A client of the engine's router, because peers hear the engine only. Used from one thread; `poll` never waits.
    """

    def __init__(
        self, site: str, *, connect: str = DEFAULT_ENDPOINT, lease_ms: int = LEASE_MS, keys: Keys | None = None
    ) -> None:
        self._keys = keys
        self._site = site
        self._endpoint = connect
        self._lease_ms = lease_ms
        self._session: Any = None
        self._queue: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def open(self, *keys: str) -> None:
        """Subscribe to keys below the site (`*/*/motion`). The engine must be there: repeat while it is not.

        Raises:
            TransportError: no engine, or a bad key or endpoint.
        """
        session = open_session("client", self._site, connect=[self._endpoint], lease_ms=self._lease_ms, keys=self._keys)
        try:
            for key in keys:
                session.declare_subscriber(key, on_network_thread(self._hear))
        except zenoh.ZError as error:
            close_session(session)
            raise TransportError(f"cannot listen to {keys}: {error}") from error
        self._session = session

    def close(self) -> None:
        """Leave; takes at most 2 s."""
        session, self._session = self._session, None
        if session is not None:
            close_session(session)

    def poll(self) -> list[tuple[str, bytes]]:
        """Return what came in: keys below the site, and the bytes."""
        found: list[tuple[str, bytes]] = []
        with contextlib.suppress(queue.Empty):
            while True:
                found.append(self._queue.get_nowait())
        return found

    def put(self, key: str, message: Any) -> None:
        """Publish something under a key below the site."""
        if self._session is not None:
            self._session.put(key, encode(message), congestion_control=zenoh.CongestionControl.DROP, encoding=_JSON)

    def _hear(self, sample: Any) -> None:
        self._queue.put((str(sample.key_expr), sample.payload.to_bytes()))
