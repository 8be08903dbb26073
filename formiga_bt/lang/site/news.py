"""`news:` of a site file: its channels, each with the way to its receiver."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final, get_args

from formiga_bt.lang.keyed import Keys, read_inside
from formiga_bt.lang.model.news import WHATS, Channel, Mail, Mqtt, Quiet, Receiver, SecretAt, Webhook, What
from formiga_bt.lang.site.keys import CHANNEL, MAIL, MQTT, SECRET, WEBHOOK
from formiga_bt.lang.text.document import Entry, Mapping_
from formiga_bt.lang.text.reading import Problems, did_you_mean, fix_word, quoted_list, read_words, shorten
from formiga_bt.lang.text.synonyms import surely

MOST_CHANNELS: Final = 20
_QUIET: Final = re.compile(r"([01]\d|2[0-3]):([0-5]\d)\s*-\s*([01]\d|2[0-3]):([0-5]\d)", re.ASCII)
_ENV: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
_ADDRESS: Final = re.compile(r"[^@\s<>,;\"']{1,64}@[A-Za-z0-9.-]{1,255}", re.ASCII)
_TOPIC: Final = re.compile(r"[^+#\x00-\x20\x7f]{1,200}")
_LAST_PORT: Final = 65_535
_LONGEST_S: Final = 7 * 86_400.0


def read_news(keys: Keys, problems: Problems) -> dict[str, Channel]:
    """Return the channels of a site, by name."""
    entries = keys.entries("news")
    if len(entries) > MOST_CHANNELS:
        problems.add("E008", entries[MOST_CHANNELS].key.mark, f"a site has at most {MOST_CHANNELS} channels of news")
    found = (_channel(entry, problems) for entry in entries[:MOST_CHANNELS])
    return {one.name: one for one in found if one is not None}


def _channel(entry: Entry, problems: Problems) -> Channel | None:
    name = entry.key.text
    keys = read_inside(entry.value, CHANNEL, problems, name, f"channel '{name}'")
    ways = [way for way in WAYS if way in keys]
    if len(ways) != 1:
        what = f"channel '{name}' has {'no way' if not ways else 'several ways'} to who is told"
        problems.add("E008", entry.key.mark, what, f"give it one of {quoted_list(WAYS)}")
        return None
    to = WAYS[ways[0]](keys, problems)
    after = keys.number("unacknowledged") or None
    if after is not None and after > _LONGEST_S:
        keys.wrong("unacknowledged", "E062", "'unacknowledged' must be at most 7 d")
        after = None
    what_ = _what(keys, problems)
    if after is not None and "what" in keys and what_ != ("alarms",):
        keys.wrong("what", "E008", "only alarms are acknowledged, so a channel with 'unacknowledged' has no other news",
                   "take 'what' out, or make another channel")  # fmt: skip
    if to is None:
        return None
    severity = keys.word("severity")
    return Channel(
        name=name, to=to, what=("alarms",) if after is not None else what_,
        severity=severity,  # type: ignore[arg-type]  # the table has the words of Severity
        tasks=tuple(keys.words("tasks")), quiet=_quiet(keys),
        unacknowledged_us=None if after is None else round(after * 1e6), text=keys.flag("text"),
    )  # fmt: skip


def _what(keys: Keys, problems: Problems) -> tuple[What, ...]:
    if "what" not in keys:
        return WHATS
    found: list[What] = []
    for at in read_words(keys["what"].value, problems, "what"):
        word = next((one for one in get_args(What) if one == at.text), None)
        if word is None:
            what = f"there are no news of '{shorten(at.text)}'{did_you_mean(at.text, WHATS)}"
            problems.add("E008", at.mark, what, f"one of {quoted_list(WHATS)}", fix_word(at, surely(at.text, WHATS)))
        elif word not in found:
            found.append(word)
    return tuple(found) or WHATS


def _quiet(keys: Keys) -> Quiet | None:
    at = keys.text("quiet")
    if at is None:
        return None
    found = _QUIET.fullmatch(at.text)
    if found is None or found.group(1, 2) == found.group(3, 4):
        keys.wrong("quiet", "E008", f"'{shorten(at.text)}' are no hours of the day", "such as: quiet: 22:00-06:00")
        return None
    start, start_min, end, end_min = map(int, found.groups())
    return Quiet(start * 60 + start_min, end * 60 + end_min)


def _webhook(keys: Keys, problems: Problems) -> Receiver | None:
    inside = read_inside(keys["webhook"].value, WEBHOOK, problems, "webhook", "a webhook")
    url, secret = read_secret(inside, "url", problems), read_secret(inside, "secret", problems)
    if url is None or secret is None:
        return None
    return Webhook(url=url, secret=secret, private=inside.flag("private"))


def _mail(keys: Keys, problems: Problems) -> Receiver | None:
    inside = read_inside(keys["mail"].value, MAIL, problems, "mail", "a mail")
    host, sender = inside.text("host"), inside.text("from")
    to = read_words(inside["to"].value, problems, "to") if "to" in inside else ()
    password = read_secret(inside, "password", problems)
    addresses = [*([sender] if sender is not None else []), *to]
    for at in addresses:
        if _ADDRESS.fullmatch(at.text) is None:
            what = f"'{shorten(at.text)}' is no address of a mail"
            problems.add("E008", at.mark, what, "such as: room@example.org")
    port = _port(inside)
    if host is None or sender is None or not to or port is None:
        return None
    return Mail(
        host=host.text, port=port, tls=inside.word("tls"),  # type: ignore[arg-type]  # the table has the words
        sender=sender.text, to=tuple(at.text for at in to), user=inside.word("user"), password=password,
        private=inside.flag("private"),
    )  # fmt: skip


def _mqtt(keys: Keys, problems: Problems) -> Receiver | None:
    inside = read_inside(keys["mqtt"].value, MQTT, problems, "mqtt", "a topic")
    host, topic = inside.text("host"), inside.text("topic")
    password = read_secret(inside, "password", problems)
    if topic is not None and _TOPIC.fullmatch(topic.text) is None:
        what = f"'{shorten(topic.text)}' is no topic that can be written to"
        problems.add("E008", topic.mark, what, "without + and #, such as: meadow/news")
    port = _port(inside)
    if host is None or topic is None or port is None:
        return None
    return Mqtt(
        host=host.text, port=port, tls=inside.word("tls"),  # type: ignore[arg-type]  # the table has the words
        topic=topic.text, user=inside.word("user"), password=password, private=inside.flag("private"),
    )  # fmt: skip


def _port(inside: Keys) -> int | None:
    """Return the port of a server, or None; report what is wrong with how it is spoken to."""
    if inside.word("tls") == "none" and not inside.flag("private"):
        inside.wrong(
            "tls", "E008", "without TLS all can be read on its way", "take it out, or private: true in your own net"
        )
    if ("user" in inside) != ("password" in inside):
        has, lacks = ("user", "password") if "user" in inside else ("password", "user")
        inside.wrong(has, "E008", f"who logs in has a user and a password: '{lacks}' is missing", "write both, or none")
    port = inside.whole("port")
    if port > _LAST_PORT:
        inside.wrong("port", "E062", f"'port' must be at most {_LAST_PORT}")
        return None
    return port


def read_secret(keys: Keys, key: str, problems: Problems) -> SecretAt | None:
    """Return where a secret stands, or None: there is none, or it is wrong (reported)."""
    if key not in keys:
        return None
    inside = read_inside(keys[key].value, SECRET, problems, key, f"'{key}'")
    file, env = inside.text("file"), inside.text("env")
    if (file is None) == (env is None):
        if len(inside) != 1 and isinstance(keys[key].value, Mapping_):
            keys.wrong(
                key, "E008", f"'{key}' stands in a file, or in the environment", "write {file: NAME}, or {env: NAME}"
            )
        return None
    if env is not None:
        if _ENV.fullmatch(env.text) is None:
            problems.add(
                "E008", env.mark, f"'{shorten(env.text)}' is no name of a variable", "such as: {env: ROOM_URL}"
            )
            return None
        return SecretAt(env=env.text)
    assert file is not None, "one of them is there"
    if Path(file.text).is_absolute() or ".." in Path(file.text).parts:
        what = f"'{shorten(file.text)}' is not below the folder of the site file"
        problems.add("E008", file.mark, what, "such as: {file: secrets/room.url}")
        return None
    return SecretAt(file=file.text)


WAYS: Final[Mapping[str, Callable[[Keys, Problems], Receiver | None]]] = MappingProxyType(
    {"webhook": _webhook, "mail": _mail, "mqtt": _mqtt}
)
"""The ways to who is told; a channel has exactly one."""
