"""A request that is sent again with the same key is carried out once: the second time its answer is given again."""

import hashlib
import json
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Final, Generic, TypeVar

from formiga_bt.services.refused import Refused

T = TypeVar("T")

KEYS_KEPT: Final = 10_000
"""Keys remembered."""


class _Keyed(Generic[T]):
    """A request with a key: what it was, and what became of it."""

    def __init__(self, digest: str) -> None:
        self.digest = digest
        self.lock = threading.Lock()
        self.answers: list[T] = []
        """None before it was carried out, then one."""


class Once(Generic[T]):
    """Remembers answers by key. Called in many threads: who asks while the first is under way waits for its answer."""

    def __init__(self) -> None:
        self._keys: OrderedDict[str, _Keyed[T]] = OrderedDict()
        self._lock = threading.Lock()

    def know(self, key: str, digest: str, answer: T) -> None:
        """Take over what became of a request before this start."""
        self._entry(key, digest).answers = [answer]

    def do(self, key: str, digest: str, act: Callable[[], T]) -> T:
        """Carry a request out, or return what it was answered the first time. One that was refused may be tried again.

        Args:
            key: of the request, and whose it is; empty: it has none.
            digest: of all that it asks for (`digest_of`).
            act: carries it out.

        Raises:
            Refused: `idempotency_conflict`: the key came with another request.
        """
        if not key:
            return act()
        entry = self._entry(key, digest)
        if entry.digest != digest:
            raise Refused(
                "idempotency_conflict",
                f"the key {key.partition(SEP)[2]!r} came with another request before",
                "use a new key for each new request",
            )
        with entry.lock:
            if not entry.answers:
                entry.answers = [act()]
            return entry.answers[0]

    def _entry(self, key: str, digest: str) -> _Keyed[T]:
        with self._lock:
            entry = self._keys.setdefault(key, _Keyed(digest))
            if len(self._keys) > KEYS_KEPT:
                self._keys.popitem(last=False)
            return entry


SEP: Final = "/"


def key_of(principal: str, key: str) -> str:
    """Return a key as it is kept: nobody meets another's. Empty, if there is none."""
    return f"{principal}{SEP}{key}" if key else ""


def digest_of(*asked: Any) -> str:
    """Return a digest of all that a request asks for."""
    return hashlib.sha256(json.dumps(asked, sort_keys=True, default=str).encode()).hexdigest()[:32]
