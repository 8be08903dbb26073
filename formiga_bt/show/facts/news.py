"""Facts of the news that leave the engine: the channels of a site, and how each stands. Never where they lead."""

from typing import Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros


class ChannelFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A channel of the site's news."""

    name: str
    way: str
    """webhook, mail or mqtt."""
    what: tuple[str, ...]
    """alarms, questions, ends."""
    severity: str
    """At least."""
    state: Literal["ok", "quiet", "failing", "unusable"]
    """quiet: only what is critical goes out at this hour. failing: the last try went wrong. unusable: a package is missing."""
    sent: int
    """Since the start of the engine."""
    passed_over: int = 0
    """Messages that the receiver could not take, since then."""
    waits_since: Micros | None = None
    """Engine time of the oldest news that are on their way."""
    text: str = ""
    """What became of the last try."""


class ChannelList(Struct, frozen=True):
    """The channels of a site's news."""

    channels: tuple[ChannelFact, ...]


class ChannelTried(Struct, frozen=True):
    """What became of a test message."""

    channel: str
    delivered: bool
    text: str
    """What came back."""
    took_s: float
