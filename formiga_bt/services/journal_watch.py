"""Looks each second whether the journal's files are still those that the engine writes, also while nothing happens.

In a thread of its own, on the clock of the wall: the engine's thread never waits for a disk that does not answer.
"""

import threading
from collections.abc import Callable
from typing import Final

EVERY_S: Final = 1.0
"""Wall seconds between two looks."""


class JournalWatch:
    """Looks, and has the driver look, too, when something has changed.

    Args:
        is_changed: returns whether the files are gone or back, and the engine does not know it.
        look_again: has the driver's thread ask the journal how it stands.
    """

    def __init__(self, is_changed: Callable[[], bool], look_again: Callable[[], None]) -> None:
        self._is_changed, self._look_again = is_changed, look_again
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="formiga-journal-watch", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End; may be called twice."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join(2.0)

    def _run(self) -> None:
        while not self._end.wait(EVERY_S):
            if self._is_changed():
                self._look_again()
