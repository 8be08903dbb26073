"""What is sent of news: an id by which doubles are known, and ids, kinds and times; texts only where the site says so."""

import hashlib
from datetime import UTC, datetime

import msgspec
from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.journal.outbox import NewsItem
from formiga_bt.lang.model.news import Channel


class Message(Struct, frozen=True):
    """News on their way."""

    id: str
    """The same each time that these news are sent to a channel, also by a later start of the engine."""
    body: bytes
    """JSON."""
    subject: str
    """In one line, without names."""


class _Body(Struct, frozen=True, kw_only=True):
    type: str
    timestamp: str
    data: dict[str, str]


def name_of(engine_id: str) -> str:
    """Return by what ids of messages tell engines apart; agents know the other one, and no receiver needs to."""
    return hashlib.sha256(f"news of {engine_id}".encode()).hexdigest()[:12]


def id_of(item: NewsItem, engine: str) -> str:
    """Return the id of news; `engine` as `name_of` says."""
    return f"{engine}.{item.at}.{item.seq}.{item.n}"


def message_of(item: NewsItem, channel: Channel, site: str, engine: str) -> Message:
    """Return news as a channel gets them; `engine` as `name_of` says."""
    data = {
        "site": site, "id": item.id, "state": item.state, "severity": item.severity, "code": item.code,
        "task": item.task, "agent": item.agent,
    }  # fmt: skip
    if channel.text:
        data |= {"text": item.text, "person": item.person, "about": item.about, "by": item.by, "note": item.note}
    body = _Body(type=item.kind, timestamp=iso(item.at), data={key: value for key, value in data.items() if value})
    what = " ".join(part for part in (site, item.id, item.kind.partition(".")[2], item.code) if part)
    return Message(id_of(item, engine), msgspec.json.encode(body), what)


def test_message(site: str, engine: str, at: Micros) -> Message:
    """Return a message that only says that it comes."""
    body = _Body(type="test", timestamp=iso(at), data={"site": site, "id": "test", "severity": "info"})
    return Message(f"{engine}.{at}.test", msgspec.json.encode(body), f"{site} test")


def iso(at: Micros) -> str:
    """Return an instant as ISO 8601, in UTC."""
    return datetime.fromtimestamp(at / 1e6, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
