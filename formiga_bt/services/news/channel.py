"""One channel at work: in order, one at a time, again and again until they are taken; what is urgent overtakes the rest.

Two lanes, each with a mark in the journal. The news of a step that was told, and whose mark was not kept yet, are told again
after a kill, with the same id. A receiver that is dead is tried ever less often, at least once a minute, and holds up nobody.
"""

import asyncio
import contextlib
import logging
import random
from collections.abc import Callable
from datetime import datetime
from typing import Final, assert_never

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.errors import FormigaError
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.journal.outbox import NewsItem
from formiga_bt.lang.model.news import Channel
from formiga_bt.services.news.log import NewsLog
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import Outcome, Sender

FIRST_WAIT_S: Final = 0.5
MOST_WAIT_S: Final = 60.0
"""Between two tries."""
MOST_AFTER_S: Final = 600.0
"""As a receiver may ask for."""
TRIES_OF_REFUSED: Final = 3
"""So often a message is tried that the receiver cannot take; then it is passed over, which an alarm tells."""
LOOK_S: Final = 20.0
"""So long at most a channel sleeps: then it looks at the hour."""
log = logging.getLogger("formiga.news")


class Lane(Struct):
    """News of a channel that are, or are not, urgent."""

    urgent: bool
    told: int
    """`seq` of the last step of which all was told: its mark."""
    read: int
    """`seq` of the last step that was read."""
    items: list[NewsItem] = []
    """That were read and not told yet."""

    def tell(self, item: NewsItem) -> None:
        """Note that the first of its items was told."""
        del self.items[0]
        self.told = item.seq - 1 if self.items and self.items[0].seq == item.seq else item.seq


class ChannelStands(Struct, frozen=True, kw_only=True):
    """How a channel stands; may be read from any thread."""

    sent: int = 0
    passed_over: int = 0
    """That the receiver could not take."""
    passed_over_at: float | None = None
    """When it was last, as `monotonic` tells."""
    failing_since: float | None = None
    """As `monotonic` tells; None: the last try went well, or there was none."""
    text: str = ""
    """What became of the last try."""


class ChannelWork:
    """Tells a channel its news.

    Args:
        channel: of the site.
        sender: the way to its receiver.
        news: all of them.
        mark: how far it has come.
        make: makes a message of news.
        hour: wall time in the site's time zone.
        clock: seconds that never go back.
        chance: a number from 0 to 1, by which waits differ.
    """

    def __init__(
        self,
        channel: Channel,
        sender: Sender,
        news: NewsLog,
        mark: NewsMark,
        make: Callable[[NewsItem, Channel], Message],
        *,
        hour: Callable[[], datetime],
        clock: Callable[[], float],
        chance: Callable[[], float] = random.random,
    ) -> None:
        self.channel = channel
        self.stands = ChannelStands()
        self.more = asyncio.Event()
        """Set when there may be more to tell."""
        self._sender, self._news, self._make = sender, news, make
        self._lanes = (Lane(True, mark.urgent, mark.urgent), Lane(False, mark.all, mark.all))
        self._hour, self._clock, self._chance = hour, clock, chance
        self._tries = 0
        """Of the message that is tried now."""
        self._not_before = clock()

    @property
    def mark(self) -> NewsMark:
        """Return how far it has come."""
        urgent, rest = self._lanes
        return NewsMark(rest.told, urgent.told)

    @property
    def is_quiet(self) -> bool:
        """Return whether only what is urgent goes out now."""
        quiet = self.channel.quiet
        if quiet is None:
            return False
        now = self._hour()
        return quiet.holds(now.hour * 60 + now.minute)

    @property
    def waits(self) -> NewsItem | None:
        """Return the oldest of the news that were read and not told; may be called from any thread."""
        found = [items[0] for lane in self._lanes if (items := list(lane.items))]
        return min(found, key=lambda one: one.seq, default=None)

    async def close(self) -> None:
        """Give back what its way holds."""
        await self._sender.close()

    async def run(self) -> None:
        """Tell news until it is canceled."""
        while True:
            self.more.clear()
            try:
                wait_s = await self.turn()
            except Exception:  # a bug in one channel must not end it, nor the others
                log.exception("the channel %s could not go on", self.channel.name)
                wait_s = MOST_WAIT_S
            if wait_s > 0:
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self.more.wait(), wait_s)

    async def turn(self) -> float:
        """Tell one message, if there is one and its time has come; return how many seconds there is nothing to do then."""
        left = self._not_before - self._clock()
        if left > 0:
            return left
        try:
            lane = await self._next()
        except FormigaError as error:
            return self._fail(Outcome("failed", f"the outbox cannot be read: {error.text}"))
        if lane is None:
            return LOOK_S
        item = lane.items[0]
        outcome = await self._sender.send(self._make(item, self.channel))
        match outcome.how:
            case "delivered":
                lane.tell(item)
                self._tries = 0
                self.stands = replace(self.stands, sent=self.stands.sent + 1, failing_since=None, text=outcome.text)
                return 0.0
            case "refused" if self._tries + 1 >= TRIES_OF_REFUSED:
                log.warning("news %s: %s is passed over: %s", self.channel.name, item.id, outcome.text)
                lane.tell(item)
                self._tries = 0
                self.stands = replace(
                    self.stands, passed_over=self.stands.passed_over + 1, passed_over_at=self._clock(),
                    failing_since=None, text=outcome.text,
                )  # fmt: skip
                return 0.0
            case "failed" | "refused" | "unusable":
                return self._fail(outcome)
            case _:
                assert_never(outcome.how)

    def _fail(self, outcome: Outcome) -> float:
        now = self._clock()
        backoff: float = min(MOST_WAIT_S, FIRST_WAIT_S * 2.0 ** min(self._tries, 10)) * (0.75 + 0.25 * self._chance())
        wait_s = max(backoff, min(MOST_AFTER_S, outcome.after_s or 0.0))
        self._tries += 1
        self._not_before = now + wait_s
        since = self.stands.failing_since
        self.stands = replace(self.stands, failing_since=now if since is None else since, text=outcome.text)
        return wait_s

    async def _next(self) -> Lane | None:
        """Return the lane whose first item is to be told next; what is not for this channel is passed over."""
        for lane in self._lanes:
            if not lane.urgent and self.is_quiet:
                continue
            while True:
                if not lane.items:
                    items = await self._news.after(lane.read, urgent=lane.urgent)
                    if not items:
                        break
                    lane.items, lane.read = items, items[-1].seq
                while lane.items and not self._wants(lane.items[0]):
                    lane.tell(lane.items[0])
                if lane.items:
                    return lane
        return None

    def _wants(self, item: NewsItem) -> bool:
        channel = self.channel
        if (item.to or channel.unacknowledged_us is not None) and item.to != channel.name:
            return False
        return channel.takes(item.what, item.severity, item.task)
