"""Calls that may take long, away from the screen: each in a thread of its own, which ends with the process.

A poll that hangs never keeps an order from leaving, nor the watch from ending.
"""

import asyncio
import threading
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


class Away(Protocol):
    """Calls a function somewhere else and waits for what it returns."""

    async def __call__(self, call: Callable[[], Any]) -> Any:
        """Return what it returns, or raise what it raises."""
        ...


async def in_a_thread(call: Callable[[], T]) -> T:
    """Call a function in a thread that nobody waits for when the process ends."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[T] = loop.create_future()

    def finish(result: T | None, error: BaseException | None) -> None:
        if not done.done():
            if error is not None:
                done.set_exception(error)
            else:
                done.set_result(result)  # type: ignore[arg-type]

    def work() -> None:
        result, error = None, None
        try:
            result = call()
        except BaseException as raised:  # noqa: BLE001 - it is raised where it is waited for
            error = raised
        if not loop.is_closed():
            loop.call_soon_threadsafe(finish, result, error)

    threading.Thread(target=work, name="watch", daemon=True).start()
    return await done


async def here(call: Callable[[], T]) -> T:
    """Call a function at once: for tests."""
    return call()
