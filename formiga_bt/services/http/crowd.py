"""How many callers one door takes at once, so that no crowd uses up the descriptors and threads of the engine.

A connection waits (for its request), is busy (its request is whole, and worked on), or is stuck (its client does not read the
answer). When all places are taken, the connection that has waited longest gives way to a new one, then the one that was stuck
first: whoever sends a request at once is served, however many only hold connections. Some places are never given to busy
requests that are not urgent.
"""

import resource
import threading
from typing import Final, Generic, TypeVar

from msgspec import Struct

T = TypeVar("T")
LANE: Final = 16
"""So many places at least are left to connections that wait and to urgent requests. In each of the few turns of the event loop
until a new connection's request is read, `AT_ONCE` more come in; it must not have to give way to them."""
AT_ONCE: Final = 4
UNLIMITED: Final = 4096
"""Descriptors that are reckoned with where the system sets no limit."""


class DoorLimits(Struct, frozen=True):
    """How many may be at a door at once."""

    connections: int
    requests: int
    """Busy at once, of those that are not urgent; fewer than connections."""
    streams: int
    """Of the requests, those that read events."""


def descriptors() -> int:
    """Return how many descriptors this process may have."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return UNLIMITED if soft == resource.RLIM_INFINITY else min(soft, UNLIMITED)


def http_places(limit: int) -> DoorLimits:
    """Return the places of the HTTP door: a quarter of the descriptors. The rest is for the journal, agents and files."""
    return _places(min(max(limit // 4, 2 * LANE), 512))


def local_places(limit: int) -> DoorLimits:
    """Return the places of the local door: an eighth of the descriptors."""
    return _places(min(max(limit // 8, 2 * LANE), 64))


def _places(connections: int) -> DoorLimits:
    return DoorLimits(connections, connections - max(connections // 4, LANE), connections // 4)


class Crowd(Generic[T]):
    """Who is at one door. Connections come and go in its event loop; the lock is for whoever looks.

    Args:
        places: how many there are.
    """

    def __init__(self, places: DoorLimits) -> None:
        self.places = places
        self._lock = threading.Lock()
        self._all: set[T] = set()
        self._waiting: dict[T, None] = {}
        """Those that wait for their request, longest first."""
        self._stuck: dict[T, None] = {}
        self._requests = self._streams = 0

    def __len__(self) -> int:
        return len(self._all)

    def come(self, who: T) -> T | None:
        """Take a new connection in; return the one that must be closed for it: itself, if all others are busy."""
        with self._lock:
            out: T | None = None
            if len(self._all) >= self.places.connections:
                out = next(iter(self._waiting), next(iter(self._stuck), who))
                self._leave(out)
                if out is who:
                    return who
            self._all.add(who)
            self._waiting[who] = None
            return out

    def wait(self, who: T) -> None:
        """Note that a connection waits for its (next) request."""
        with self._lock:
            if who in self._all:
                self._waiting.setdefault(who)

    def busy(self, who: T) -> None:
        """Note that the request of a connection is whole: it gives way to nobody."""
        with self._lock:
            self._waiting.pop(who, None)

    def stuck(self, who: T, *, is_stuck: bool) -> None:
        """Note that the client of a busy connection does not read its answer, or reads on."""
        with self._lock:
            self._stuck.pop(who, None)
            if is_stuck and who in self._all:
                self._stuck[who] = None

    def leave(self, who: T) -> None:
        """Note that a connection is closed; may be called twice."""
        with self._lock:
            self._leave(who)

    def _leave(self, who: T) -> None:
        self._all.discard(who)
        self._waiting.pop(who, None)
        self._stuck.pop(who, None)

    def begin(self, *, urgent: bool, stream: bool = False) -> str:
        """Begin with a request; return why not (`crowded`, `too_many_streams`), or an empty text: then `end` must follow."""
        with self._lock:
            if stream and self._streams >= self.places.streams:
                return "too_many_streams"
            if not urgent and self._requests >= self.places.requests:
                return "crowded"
            self._requests += not urgent
            self._streams += stream
            return ""

    def end(self, *, urgent: bool, stream: bool = False) -> None:
        """End with a request that was begun."""
        with self._lock:
            self._requests -= not urgent
            self._streams -= stream
