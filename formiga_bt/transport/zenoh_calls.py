"""Programs call services of the engine: queries of `svc/<principal>/<service>`, and of the bare `<service>` where that is open.

A queryable learns nothing of who asks: the principal is what the key says. Only a router that lets each holder of a certificate
use the keys with its own name makes that true; without one, whoever reaches the wire may say any name (`services.calling`).
"""

from typing import Any, Final

import msgspec

from formiga_bt.transport.calls import AnswersCalls, Call, CallError
from formiga_bt.transport.codec import FRAME_LIMIT
from formiga_bt.transport.zenoh_queries import QueryWorkers, refuse

CALLS_KEY: Final = "svc"
THREADS: Final = 4
WAITING: Final = 64
"""So many calls wait at most, and as many of those that stop something; more are told to call again."""
JSON: Final = "application/json"


class CallDesk:
    """Takes the calls; those that stop something have a queue and a thread of their own."""

    def __init__(self) -> None:
        self._desk: AnswersCalls | None = None
        self._names: frozenset[str] = frozenset()
        full = encoded(CallError("crowded", "too many calls wait at this engine", "call again in some seconds"))
        bug = encoded(CallError("bug", "the engine met a bug with this call", "its log has more"))
        self._plain = QueryWorkers("formiga-calls", self._answer, threads=THREADS, waiting=WAITING, full=full, bug=bug)
        self._stops = QueryWorkers("formiga-stops", self._answer, waiting=WAITING, full=full, bug=bug)

    def serve(self, desk: AnswersCalls, *, bare: bool) -> None:
        """Say who answers; `bare`: also to keys without a principal. Before the wire is opened."""
        self._desk = desk
        names = [f"{CALLS_KEY}/*/{service}" for service in desk.services]
        self._names = frozenset([*names, *(desk.services if bare else ())])

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the keys of the queryables, relative to the site."""
        return tuple(sorted(self._names))

    def take(self, query: Any) -> None:
        """Take a query; on a thread of Zenoh's."""
        key = str(query.key_expr)
        size = len(query.payload) if query.payload is not None else 0
        if "*" in key:  # a look at many keys at once: nothing may be ordered by it
            refuse(query, encoded(CallError("bad_key", f"'{key}' names no one service", "call one key, without *")))
        elif size > FRAME_LIMIT:
            refuse(query, encoded(CallError("too_large", f"a call has at most {FRAME_LIMIT} bytes")))
        else:
            desk = self._desk
            assert desk is not None
            (self._stops if _call(key, b"").service in desk.urgent else self._plain).take(query)

    def open(self) -> None:
        """Take calls again, after an end."""
        self._plain.open()
        self._stops.open()

    def close(self) -> None:
        """Stop; what waits goes unanswered."""
        self._plain.close()
        self._stops.close()

    def _answer(self, query: Any) -> None:
        desk, key = self._desk, str(query.key_expr)
        assert desk is not None
        answer = desk.answer(_call(key, query.payload.to_bytes() if query.payload is not None else b""))
        if isinstance(answer, CallError):
            query.reply_err(encoded(answer), encoding=JSON)
        else:
            query.reply(key, answer, encoding=JSON)


def _call(key: str, payload: bytes) -> Call:
    """Return what a key calls, and in whose name."""
    first, _, rest = key.partition("/")
    principal, _, service = rest.partition("/")
    return Call(principal, service, payload) if first == CALLS_KEY else Call("", key, payload)


def encoded(error: CallError) -> bytes:
    """Return an error as its reply has it."""
    return msgspec.json.encode(error)
