"""asyncio on a `Scheduler`: an agent of one's own in this process, in virtual time, with the same class.

`ScheduledLoop` is an event loop without sockets, whose time is the scheduler's: `asyncio.sleep(60)` takes 60 s of
engine time and no time at all. Plain functions run in threads that take turns with the loop: one of them runs at a
time, so equal runs are equal.
"""

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import Any

from formiga_bt.agent.agent import Agent, check_agent
from formiga_bt.agent.session import Session
from formiga_bt.agent.tokens import CancelToken
from formiga_bt.base.clock import SECOND, Scheduler, Timer, micros
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.memory import MemoryHub

log = logging.getLogger("formiga_bt.agent")

STATUS_EVERY_S = 5.0
"""In virtual time a status comes on change and this often."""


class _Handle(asyncio.TimerHandle):
    """A scheduled call and its timer."""

    timer: Timer | None = None


class ScheduledLoop(asyncio.AbstractEventLoop):
    """The part of an event loop that tasks, futures, sleeps and timeouts need, on a scheduler."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler

    def time(self) -> float:
        """Return the scheduler's time in seconds."""
        return self._scheduler.now() / SECOND

    def get_debug(self) -> bool:
        """Return False."""
        return False

    def is_running(self) -> bool:
        """Return True: the scheduler runs it."""
        return True

    def is_closed(self) -> bool:
        """Return False."""
        return False

    def call_soon(self, callback: Any, *args: Any, context: Context | None = None) -> asyncio.Handle:  # type: ignore[override]
        """Run a callback at this instant, after what is due."""
        return self.call_at(self.time(), callback, *args, context=context)

    def call_soon_threadsafe(self, callback: Any, *args: Any, context: Context | None = None) -> asyncio.Handle:  # type: ignore[override]
        """Run a callback at this instant; threads take turns with the loop, so this is the same."""
        return self.call_soon(callback, *args, context=context)

    def call_later(  # type: ignore[override]
        self, delay: float, callback: Any, *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Run a callback after so many seconds."""
        return self._call(self._scheduler.now() + micros(delay), callback, args, context)

    def call_at(self, when: float, callback: Any, *args: Any, context: Context | None = None) -> asyncio.TimerHandle:  # type: ignore[override]
        """Run a callback at a time in seconds."""
        return self._call(micros(when), callback, args, context)

    def create_future(self) -> asyncio.Future[Any]:
        """Return a future of this loop."""
        return asyncio.Future(loop=self)

    def create_task(self, coro: Any, **more: Any) -> asyncio.Task[Any]:
        """Run a coroutine."""
        task: asyncio.Task[Any] = asyncio.Task(coro, loop=self, **more)
        task._log_destroy_pending = False  # type: ignore[attr-defined]  # time may end while it waits
        return task

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        """Log what nobody caught."""
        log.error("%s", context.get("message"), exc_info=context.get("exception"))

    def _timer_handle_cancelled(self, handle: asyncio.TimerHandle) -> None:
        if isinstance(handle, _Handle) and handle.timer is not None:
            handle.timer.cancel()

    def _call(self, at: int, callback: Any, args: Any, context: Context | None) -> _Handle:
        handle = _Handle(at / SECOND, callback, args, self, context)

        def run() -> None:
            before = asyncio._get_running_loop()
            asyncio._set_running_loop(self)
            try:
                handle._run()
            finally:
                asyncio._set_running_loop(before)

        handle.timer = self._scheduler.call_at(at, run)
        return handle


class _Turns:
    """A plain function in a thread that runs while the loop waits, until it ends or sleeps on its token."""

    def __init__(self, loop: ScheduledLoop, call: Callable[[], Any], token: CancelToken) -> None:
        self.future = loop.create_future()
        self._loop, self._call, self._token = loop, call, token
        self._mine, self._yours = threading.Semaphore(0), threading.Semaphore(0)
        self._end: Callable[[], None] | None = None
        self._sleeps = 0.0
        self._timer: asyncio.TimerHandle | None = None
        token.wait_by(self._wait)
        token.on_cancel = self._canceled
        threading.Thread(target=self._run, daemon=True, name="formiga-action").start()
        loop.call_soon(self._turn)

    def _run(self) -> None:
        self._mine.acquire()
        try:
            result = self._call()
            self._end = lambda: self.future.set_result(result)
        except BaseException as error:  # noqa: BLE001  (handed to who waits for it)
            raised = error
            self._end = lambda: self.future.set_exception(raised)
        self._yours.release()

    def _wait(self, seconds: float) -> None:
        self._sleeps = seconds
        self._yours.release()
        self._mine.acquire()

    def _turn(self) -> None:
        self._timer = None
        self._mine.release()
        self._yours.acquire()
        if self._end is None:
            self._timer = self._loop.call_later(self._sleeps, self._turn)
        elif not self.future.done():
            self._end()

    def _canceled(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = self._loop.call_later(0.0, self._turn)


class ScheduledCarrier:
    """Loops and time of agents on a scheduler."""

    def __init__(self, scheduler: Scheduler) -> None:
        self.loop = ScheduledLoop(scheduler)  # type: ignore[abstract]  # sockets and processes: of real loops

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Run a coroutine."""
        return self.loop.create_task(work)

    def in_thread(self, call: Callable[[], Any], token: CancelToken) -> asyncio.Future[Any]:
        """Run a plain function in a thread that takes turns with the loop."""
        return _Turns(self.loop, call, token).future

    def post(self, call: Callable[[], None]) -> None:
        """Run a call: threads take turns with the loop."""
        call()

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        await asyncio.sleep(seconds)


def join(
    agent: Agent, hub: MemoryHub, scheduler: Scheduler, *, id: str, status_every_s: float = STATUS_EVERY_S
) -> Session:
    """Let an agent of one's own take part in a hub of this process.

    Raises:
        ValueError: it has no type, no id, or nothing to do.
    """
    agent.id = id
    check_agent(type(agent), id)
    carrier = ScheduledCarrier(scheduler)
    link = hub.link(id)
    boot = f"{id}-{scheduler.now():x}"
    session = Session(agent, boot, carrier, lambda card, body: AgentSide(card, body, link, now=scheduler.now), link)
    link.beats = True

    async def tend() -> None:
        while not link.dead:
            await asyncio.sleep(status_every_s)
            session.watch_link()
            session.report()
        session.end()

    link.serve(session.side)
    session.begin()
    carrier.spawn(tend())
    return session
