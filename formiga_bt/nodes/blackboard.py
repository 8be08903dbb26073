"""The blackboard: where the allocator, the trees and people's tools meet. One instance per engine, never global.

Keys are paths (`/fleet/hwd/hwd_1/battery`, `/allocation/requests/PickUp-12`, `/tasks/PickUp-12/status`). Every write that
changes a value raises the key's version and reports the key's readers, so nothing is ever polled. Only `engine.state.apply`
writes. The allocator listens to whole branches (`/fleet/`, `/allocation/requests/`); a node watches single keys.
"""

from collections.abc import Iterator
from typing import Any

Reader = tuple[str, str]
"""A task, and the key of one of its nodes."""


class Blackboard:
    """Versioned keys with readers."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._versions: dict[str, int] = {}
        self._readers: dict[str, dict[Reader, None]] = {}
        self.hits: dict[Reader, None] = {}
        """Readers hit since `take_hits`, in the order of the writes."""
        self._branches: tuple[str, ...] = ()
        self._heard: dict[str, None] = {}

    def put(self, key: str, value: Any) -> bool:
        """Write a value; return whether it differs from the former one. Readers of a changed key are noted as hit."""
        if key in self._values and self._values[key] == value:
            return False
        self._values[key] = value
        self._versions[key] = self._versions.get(key, 0) + 1
        self.touch(key)
        return True

    def touch(self, key: str) -> None:
        """Note the readers of a key as hit, without keeping a value: for what lives elsewhere (a task's names)."""
        readers = self._readers.get(key)
        if readers:
            self.hits.update(readers)
        if key.startswith(self._branches):
            self._heard[key] = None

    def drop(self, key: str) -> None:
        """Forget a key, if it exists."""
        if key in self._values:
            del self._values[key]
            self.touch(key)
        self._versions.pop(key, None)

    def get(self, key: str, default: Any = None) -> Any:
        """Return the value of a key."""
        return self._values.get(key, default)

    def version(self, key: str) -> int:
        """Return how often the key has changed; 0 = never written."""
        return self._versions.get(key, 0)

    def watch(self, key: str, reader: Reader) -> None:
        """Note that `reader` wants to know of changes of `key`."""
        self._readers.setdefault(key, {})[reader] = None

    def unwatch(self, key: str, reader: Reader) -> None:
        """Forget a reader of a key."""
        readers = self._readers.get(key)
        if readers is not None:
            readers.pop(reader, None)
            if not readers:
                del self._readers[key]

    def take_hits(self) -> tuple[Reader, ...]:
        """Return the readers hit since the last call, in the order of the writes."""
        hits = tuple(self.hits)
        self.hits.clear()
        return hits

    def listen(self, *branches: str) -> dict[str, None]:
        """Return where each key below these branches is noted when it changes, until the one listener empties it."""
        self._branches = branches
        return self._heard

    def under(self, prefix: str) -> Iterator[tuple[str, Any]]:
        """Yield the keys below a prefix with their values, in the order of first writing."""
        for key, value in self._values.items():
            if key.startswith(prefix):
                yield key, value
