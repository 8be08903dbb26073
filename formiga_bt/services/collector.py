"""Garbage collection of a process that runs for months with very many objects: short stalls, whatever there is.

Python looks at all objects whenever a quarter more has been made than there was: with 100,000 tasks that takes seconds, in
which nothing else happens. Nearly nothing of an engine is garbage in circles (trees are taken apart when their task ends),
so what a full look found alive is set aside (`gc.freeze`) and the next one looks at what is new only. What is set aside
is freed all the same when nobody refers to it. Only a circle that was alive then and is garbage later stays; `thaw` lets the
next look see everything again, when there is time for it. Used by `formiga up`; a process with other aims decides itself.
"""

import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, Literal

from msgspec import Struct

THRESHOLDS: Final = (1000, 10, 5)
"""A full look comes when so many objects more than before are there: some 50,000, looked at within tens of milliseconds."""
THAW_EVERY_S: Final = 3600.0


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect nothing inside: where very much is read that all stays, looks at it take twice as long as reading it."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


class CollectorLoad(Struct, frozen=True):
    """What collecting has cost."""

    looks: int
    """Full ones."""
    longest_s: float
    """Of any look."""


class Collector:
    """A context manager: sets all aside that there is, and from then on what each full look found alive."""

    def __init__(self) -> None:
        self._former = gc.get_threshold()
        self._began = 0.0
        self._looks = 0
        self._longest_s = 0.0
        self._thawed = 0.0

    def __enter__(self) -> "Collector":
        gc.collect()
        gc.freeze()
        gc.set_threshold(*THRESHOLDS)
        gc.callbacks.append(self._on_look)
        self._thawed = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        gc.callbacks.remove(self._on_look)
        gc.set_threshold(*self._former)
        gc.unfreeze()

    def statistics(self) -> CollectorLoad:
        """Return what it has cost since the start."""
        return CollectorLoad(self._looks, self._longest_s)

    @property
    def is_due(self) -> bool:
        """Return whether everything should be looked at again, when there is time for it."""
        return time.monotonic() - self._thawed >= THAW_EVERY_S

    def thaw(self) -> None:
        """Look at everything; call it when nothing is to be done."""
        self._thawed = time.monotonic()
        gc.unfreeze()
        gc.collect()  # sets aside what is alive

    def _on_look(self, phase: Literal["start", "stop"], told: dict[str, Any]) -> None:
        if phase == "start":
            self._began = time.perf_counter()
            return
        self._longest_s = max(self._longest_s, time.perf_counter() - self._began)
        if told["generation"] == 2:
            self._looks += 1
            gc.freeze()
