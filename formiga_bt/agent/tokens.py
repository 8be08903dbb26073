"""How a plain function hears of a cancel: a token that it asks, or sleeps on."""

import threading
from collections.abc import Callable


class CanceledError(Exception):
    """Raised in a plain function by its token: its goal was canceled."""


class CancelToken:
    """Whether the goal of a plain function was canceled. Asked from the function's own thread.

    Args:
        wait: waits so many seconds (engine time), or until the goal is canceled.
    """

    def __init__(self, wait: Callable[[float], None] | None = None) -> None:
        self.canceled = threading.Event()
        self._wait: Callable[[float], None] = wait or (lambda seconds: void(self.canceled.wait(seconds)))
        self.on_cancel: Callable[[], None] = lambda: None

    def __bool__(self) -> bool:
        return self.canceled.is_set()

    def check(self) -> None:
        """Go on, unless the goal was canceled.

        Raises:
            CanceledError: it was.
        """
        if self:
            raise CanceledError

    def sleep(self, seconds: float) -> None:
        """Wait so many seconds.

        Raises:
            CanceledError: the goal was canceled before or meanwhile.
        """
        self.check()
        self._wait(max(0.0, seconds))
        self.check()

    def wait_by(self, wait: Callable[[float], None]) -> None:
        """Wait in another way from now on: in virtual time."""
        self._wait = wait

    def cancel(self) -> None:
        """Say that the goal was canceled: from the agent's loop."""
        if not self:
            self.canceled.set()
            self.on_cancel()


def void(_: object) -> None:
    """Forget a value."""
