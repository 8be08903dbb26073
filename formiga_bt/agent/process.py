"""`run`: an agent of one's own as a process over Zenoh.

The agent's coroutines run in an ordinary asyncio loop, so every library for it works. The link is pumped there too:
all rules of agents are kept in one thread.
"""

import argparse
import asyncio
import logging
import signal
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import Any, NoReturn

from formiga_bt.agent.agent import Agent, check_agent
from formiga_bt.agent.pacing import PacedScheduler, PacedSide
from formiga_bt.agent.pulse import Pulse, new_boot_id
from formiga_bt.agent.session import Session
from formiga_bt.agent.tokens import CancelToken, void
from formiga_bt.base.certificates import DAY_S, SOON_S, Keys, KeysError, read_keys
from formiga_bt.base.clock import monotonic_us, wall_clock_us
from formiga_bt.base.endpoints import check_connect
from formiga_bt.base.errors import TransportError

log = logging.getLogger("formiga_bt.agent")

CONNECT = "tcp/127.0.0.1:7447"
"""Where an engine of this machine is, unless its site file says another place."""


def run(
    agent: type[Agent],
    *,
    id: str = "",
    site: str = "",
    connect: str = CONNECT,
    keys: str | Path = "",
    arguments: Sequence[str] | None = None,
    **given: Any,
) -> NoReturn:
    """Run an agent until a signal ends it; the process ends with it.

    The command line may say `--id`, `--site`, `--connect` and `--keys`, which then count, or `--catalogue`: that prints what
    belongs into a catalogue file of the site.

    Args:
        agent: the class.
        id: the agent's name on its site.
        site: the site's name.
        connect: the engine's endpoint; the engine may come later.
        keys: the agent's folder of keys, as the site's people made it (`formiga access agent NAME`). What it says of site and
            endpoint counts before `site` and `connect`.
        arguments: the command line; None: the process's.
        **given: arguments of the class.
    """
    parser = argparse.ArgumentParser(description=(agent.__doc__ or agent.__name__).split("\n")[0])
    parser.add_argument("--id", default=id, help="the agent's name on its site (%(default)s)")
    parser.add_argument("--site", help=f"the site's name (as the keys say, or {site})")
    parser.add_argument("--connect", help=f"the engine's endpoint (as the keys say, or {connect})")
    parser.add_argument("--keys", default=keys, help="its folder of keys, at a secured site (%(default)s)")
    parser.add_argument(
        "--insecure", action="store_true", help="connect to another machine without TLS, in a simulation"
    )
    parser.add_argument("--catalogue", action="store_true", help="print the entry of a catalogue file, and end")
    options = parser.parse_args(arguments)
    if options.catalogue:
        from formiga_bt.agent.catalogue import catalogue_of

        print(catalogue_of(agent), end="")  # noqa: T201
        raise SystemExit(0)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    try:
        check_agent(agent, options.id)
        own = read_keys(Path(options.keys), wall_clock_us() / 1e6, options.id) if options.keys else None
        where = options.connect or (own.about.connect if own is not None else "") or connect
        of = options.site or (own.about.site if own is not None else "") or site
        if not of:
            raise ValueError(f"{agent.__name__} needs the name of its site: --site NAME, or run(..., site='NAME')")
        check_connect(where, keys=own is not None, insecure=options.insecure)
        one = agent(**given)
        one.id = options.id
        asyncio.run(serve(one, site=of, connect=where, keys=own))
    except (ValueError, TransportError, KeysError) as error:
        raise SystemExit(f"{options.id or agent.__name__}: {error}") from error
    raise SystemExit(0)


async def serve(
    agent: Agent, *, site: str, connect: str = CONNECT, keys: Keys | None = None, stop: asyncio.Event | None = None
) -> None:
    """Carry an agent in the loop that runs, until `stop` is set or a signal comes.

    Raises:
        TransportError: the site, the id or the endpoint cannot be used.
        Exception: what the agent's `main` raised.
    """
    from formiga_bt.transport.zenoh_agent import ZenohAgentLink  # loads the wire: only where it is needed

    loop, stopping, woken = asyncio.get_running_loop(), stop or asyncio.Event(), asyncio.Event()
    if stop is None:
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, stopping.set)
    link = ZenohAgentLink(site, connect=connect, wake=lambda: _wake(loop, woken), keys=keys)
    scheduler = PacedScheduler(monotonic_us, wall_clock_us())
    session = Session(
        agent,
        new_boot_id(agent.id),
        _AsyncioCarrier(loop, scheduler),
        lambda card, body: PacedSide(card, body, link, scheduler, lambda _: None),
        link,
    )
    pulse = Pulse(session.side, scheduler, session.report, session.watch_link)
    link.serve(session.side)
    log.info("%s (%s) serves %s at %s", agent.id, agent.kind, site, connect)
    if keys is not None:
        left_s = keys.until - wall_clock_us() / 1e6
        soon = ": have a new one made, formiga access agent NAME --renew" if left_s < SOON_S else ""
        log.log(
            logging.WARNING if soon else logging.INFO, "its certificate counts for %.1f days%s", left_s / DAY_S, soon
        )
    try:
        session.begin()
        while not stopping.is_set():
            woken.clear()
            link.pump()
            timer = loop.call_later(pulse.turn(), woken.set)
            await woken.wait()
            timer.cancel()
            if session.main is not None and session.main.done():
                session.main.result()  # a main that returns has nothing more to do; one that raised ends the agent
    finally:
        session.end()
        link.close()


def _wake(loop: asyncio.AbstractEventLoop, woken: asyncio.Event) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(woken.set)


class _AsyncioCarrier:
    """Loops and time of an agent that is a process."""

    def __init__(self, loop: asyncio.AbstractEventLoop, scheduler: PacedScheduler) -> None:
        self._loop, self._scheduler = loop, scheduler
        self._kept: set[asyncio.Task[None]] = set()

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = self._loop.create_task(work)
        self._kept.add(task)  # a loop holds its tasks weakly
        task.add_done_callback(self._kept.discard)
        return task

    def in_thread(self, call: Callable[[], Any], token: CancelToken) -> asyncio.Future[Any]:
        ended = token.canceled
        token.wait_by(lambda seconds: void(ended.wait(seconds / max(self._scheduler.speed, 0.001))))
        return self._loop.run_in_executor(None, call)

    def post(self, call: Callable[[], None]) -> None:
        try:
            here: asyncio.AbstractEventLoop | None = asyncio.get_running_loop()
        except RuntimeError:
            here = None
        if here is self._loop:
            call()
        else:
            self._loop.call_soon_threadsafe(call)

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(seconds / max(self._scheduler.speed, 0.001))
