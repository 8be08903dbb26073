"""The news of a site: a thread with a loop in which each channel works by itself, and what people ask of it.

The driver's thread only hands over what a step has of news. How far the channels have come goes back to the engine each second,
as an input of its own, and with it into the journal.
"""

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Final
from zoneinfo import ZoneInfo

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import FormigaError
from formiga_bt.engine.kernel.inputs import EngineStep, NewsDelivered, Trouble
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.journal.outbox import NewsItem, news_of
from formiga_bt.lang.model import Site
from formiga_bt.lang.model.news import Channel
from formiga_bt.services.news.channel import ChannelWork
from formiga_bt.services.news.log import NewsLog, Read
from formiga_bt.services.news.message import Message, message_of, name_of, test_message
from formiga_bt.services.news.sending import Outcome
from formiga_bt.services.news.ways import lacks, sender_of
from formiga_bt.services.refused import Refused
from formiga_bt.show.facts import ChannelFact, ChannelList, ChannelTried

MARK_S: Final = 1.0
"""So often it is noted how far the channels have come: after a kill no more than this is told twice."""
FAILING_S: Final = 60.0
"""A channel that cannot tell its news for so long is an alarm."""
PASSED_OVER_S: Final = 3600.0
"""For so long it is an alarm that a message was passed over."""
THREADS: Final = 64
"""For names that are looked up, and reading the outbox: one receiver whose name servers are dead holds up no other."""
TEST_S: Final = 25.0
STOP_S: Final = 5.0
log = logging.getLogger("formiga.news")


class NewsDesk:
    """Delivers the news of a site. `feed_step` is called in the driver's thread, all else from any.

    Args:
        site: with its channels.
        beside: the folder of its file, in which secrets stand.
        engine_id: which engine tells.
        began: `seq` of the last step before those that are fed.
        marks: how far each channel had come by then.
        read: reads the outbox; None: there is no journal.
        note: takes an input for the engine.
        keep: the same, and returns when it is kept.
        now: engine time.
    """

    def __init__(
        self,
        site: Site,
        beside: Path,
        *,
        engine_id: str,
        began: int,
        marks: Mapping[str, NewsMark],
        read: Read | None,
        note: Callable[[NewsDelivered], object],
        keep: Callable[[NewsDelivered], object],
        now: Callable[[], Micros],
    ) -> None:
        self._site, self._beside, self._name = site, beside, name_of(engine_id)
        self._note, self._keep, self._now = note, keep, now
        self._zone = ZoneInfo(site.timezone)
        self._news = NewsLog(began, read)
        begin = NewsMark(began, began)
        self._marks = {name: marks.get(name, begin) for name in site.news}
        self._noted = dict(marks)
        self._works: tuple[ChannelWork, ...] = ()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._up = threading.Event()
        self._ended = ""
        """Why no more news leave the engine, or empty."""
        self._main_task: asyncio.Task[None] | None = None

    # -- the thread --------------------------------------------------------------------------------------------------
    def start(self) -> None:
        """Start to deliver, if the site has channels."""
        if self._marks != self._noted:  # before anything happens: after a kill, a new channel begins here and not later
            try:
                self._keep(NewsDelivered(self._marks))
                self._noted = self._marks
            except FormigaError as error:
                log.warning("it is not kept yet where the news begin: %s", error.text)
        if not self._site.news:
            return
        self._thread = threading.Thread(target=self._run, name="formiga-news", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Note how far the channels have come, and end; what is under way is told again at the next start."""
        thread = self._thread
        if thread is None:
            return
        self._up.wait(STOP_S)
        loop, self._loop = self._loop, None
        if loop is None:
            return
        with suppress(RuntimeError):  # it has ended
            loop.call_soon_threadsafe(self._cancel)
        thread.join(STOP_S)

    def feed_step(self, step: EngineStep) -> None:
        """Take the news of a step; returns at once."""
        if not self._site.news:
            return
        items = news_of(step)
        if items:
            self._news.add(items)
            loop = self._loop
            if loop is not None:
                with suppress(RuntimeError):  # it has ended
                    loop.call_soon_threadsafe(self._wake)

    def _run(self) -> None:
        try:
            asyncio.run(self._main())
        except asyncio.CancelledError:
            pass
        except Exception:  # the engine goes on without
            log.exception("no more news leave the engine")
            self._ended = "by a bug, which the log tells; a new start of the engine tells them"
        finally:
            self._up.set()

    async def _main(self) -> None:
        loop = asyncio.get_running_loop()
        loop.set_default_executor(ThreadPoolExecutor(THREADS, thread_name_prefix="formiga-news"))
        self._works = tuple(
            ChannelWork(
                channel, sender, self._news, self._marks[channel.name], self._message,
                hour=lambda: datetime.now(self._zone), clock=time.monotonic,
            )
            for channel in self._site.news.values()
            if (sender := sender_of(channel.to, self._beside)) is not None
        )  # fmt: skip
        tasks = [asyncio.ensure_future(work.run()) for work in self._works]
        self._main_task = asyncio.current_task()
        self._loop = loop
        self._up.set()
        try:
            while True:
                self._note_marks()
                await asyncio.sleep(MARK_S)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._note_marks()
            for work in self._works:
                with suppress(Exception):  # it ends anyway
                    await work.close()

    def _cancel(self) -> None:
        if self._main_task is not None:
            self._main_task.cancel()

    def _wake(self) -> None:
        for work in self._works:
            work.more.set()

    def _note_marks(self) -> None:
        marks = {**self._marks, **{work.channel.name: work.mark for work in self._works}}
        if marks != self._noted:
            self._note(NewsDelivered(marks))
            self._noted = marks

    def _message(self, item: NewsItem, channel: Channel) -> Message:
        return message_of(item, channel, self._site.name, self._name)

    # -- what people ask -----------------------------------------------------------------------------------------------
    def all(self) -> ChannelList:
        """Return the channels, and how each stands."""
        works = {work.channel.name: work for work in self._works}
        return ChannelList(tuple(self._fact(one, works.get(one.name)) for one in self._site.news.values()))

    def _fact(self, channel: Channel, work: ChannelWork | None) -> ChannelFact:
        stands = work.stands if work is not None else None
        failing = stands is not None and stands.failing_since is not None
        waits = work.waits if work is not None else None
        return ChannelFact(
            name=channel.name, way=str(type(channel.to).__struct_config__.tag), what=channel.what, severity=channel.severity,
            state="unusable" if work is None else "failing" if failing else "quiet" if work.is_quiet else "ok",
            sent=stands.sent if stands is not None else 0,
            passed_over=stands.passed_over if stands is not None else 0,
            waits_since=waits.at if waits is not None else None,
            text=stands.text if stands is not None else lacks(channel.to),
        )  # fmt: skip

    def troubles(self) -> Iterable[Trouble]:
        """Return which channels cannot tell their news, for `StandingAlarms`."""
        now = time.monotonic()
        for channel in self._site.news.values():
            if lack := self._ended or lacks(channel.to):
                yield Trouble(
                    "news_failing", channel.name, f"the channel {channel.name} of the news cannot be used: {lack}"
                )
        for work in self._works:
            name, stands = work.channel.name, work.stands
            if stands.failing_since is not None and now - stands.failing_since >= FAILING_S:
                text = f"the channel {name} of the news tells nobody: {stands.text}; formiga news test {name}"
                yield Trouble("news_failing", name, text)
            if stands.passed_over_at is not None and now - stands.passed_over_at < PASSED_OVER_S:
                text = f"the channel {name} of the news passed over {stands.passed_over} that its receiver cannot take"
                yield Trouble("news_passed_over", name, text)

    def test(self, name: str) -> ChannelTried:
        """Send a message that only says that it comes, once, and return what came back.

        Raises:
            Refused: `unknown_channel`, `no_reply`.
        """
        channel = self._site.news.get(name)
        if channel is None:
            known = ", ".join(self._site.news) or "none"
            raise Refused("unknown_channel", f"the site has no channel '{name}' of news", f"it has: {known}")
        self._up.wait(STOP_S)
        loop = self._loop
        if loop is None or (lack := lacks(channel.to)):
            return ChannelTried(name, False, lack if loop is not None else "no news leave this engine now", 0.0)
        began = time.monotonic()
        future: Future[Outcome] = asyncio.run_coroutine_threadsafe(self._try(channel), loop)
        try:
            outcome = future.result(TEST_S)
        except TimeoutError:
            future.cancel()
            raise Refused("no_reply", f"nothing came back within {TEST_S:g} s") from None
        text = f"{outcome.text}: {outcome.said}" if outcome.said else outcome.text
        return ChannelTried(name, outcome.how == "delivered", text, time.monotonic() - began)

    async def _try(self, channel: Channel) -> Outcome:
        sender = sender_of(channel.to, self._beside)
        assert sender is not None, "its packages are there"
        try:
            return await sender.send(test_message(self._site.name, self._name, self._now()))
        finally:
            await sender.close()
