"""`news:` of a site file: what is read, and that each mistake has its place and its repair."""

import pytest

from formiga_bt.lang.model.news import WHATS, Channel, Mail, Mqtt, Quiet, SecretAt, Webhook
from formiga_bt.lang.site import load_site_text

BASE = "formiga_site: 1\nname: meadow\nbase: {lat: 66.5, lng: 25.7}\n"
HOOK = "webhook: {url: {file: room.url}, secret: {env: ROOM_SECRET}}"


def read(text: str) -> tuple[dict[str, Channel], list[tuple[str, int]]]:
    site, problems, _ = load_site_text(f"{BASE}news:\n{text}\n", "site.yaml", None)
    return (dict(site.news) if site is not None else {}), [(one.code, one.mark.line) for one in problems]


def test_a_channel_of_few_words_tells_everything_but_texts() -> None:
    found, problems = read(f"  room: {{{HOOK}}}")
    assert problems == []
    to = Webhook(url=SecretAt(file="room.url"), secret=SecretAt(env="ROOM_SECRET"))
    assert found == {"room": Channel(name="room", to=to)}
    assert found["room"].what == WHATS
    assert found["room"].takes("ends", "info", "PickUp-1")


def test_all_that_can_be_said_of_a_channel() -> None:
    found, problems = read(
        f"  room: {{{HOOK[:-1]}, private: true}}, what: [ends, alarms], severity: warning, tasks: [PickUp],\n"
        f"    quiet: 22:00-06:00, text: true}}\n"
        f"  chief: {{{HOOK}, severity: critical, unacknowledged: 5 min}}"
    )
    assert problems == []
    room, chief = found["room"], found["chief"]
    assert (room.what, room.severity, room.tasks, room.text) == (("ends", "alarms"), "warning", ("PickUp",), True)
    assert room.quiet == Quiet(22 * 60, 6 * 60)
    assert room.to.private
    assert (chief.what, chief.unacknowledged_us) == (("alarms",), 300_000_000)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("  room: {what: [ends]}", "E008"),
        (f"  room: {{{HOOK}, what: [alarm]}}", "E008"),
        (f"  room: {{{HOOK}, severity: loud}}", "E008"),
        (f"  room: {{{HOOK}, quiet: at night}}", "E008"),
        (f"  room: {{{HOOK}, quiet: 22:00-22:00}}", "E008"),
        (f"  room: {{{HOOK}, quiet: 24:00-06:00}}", "E008"),
        (f"  room: {{{HOOK}, unacknowledged: 0 s}}", "E062"),
        (f"  room: {{{HOOK}, unacknowledged: 5}}", "E017"),
        (f"  room: {{{HOOK}, unacknowledged: 5 min, what: [ends]}}", "E008"),
        ("  room: {webhook: {url: {file: room.url}}}", "E008"),
        ("  room: {webhook: {url: https://example.org/key, secret: {env: S}}}", "E008"),
        ("  room: {webhook: {url: {file: /etc/passwd}, secret: {env: S}}}", "E008"),
        ("  room: {webhook: {url: {file: ../../room.url}, secret: {env: S}}}", "E008"),
        ("  room: {webhook: {url: {file: a, env: B}, secret: {env: S}}}", "E008"),
        ("  room: {webhook: {url: {env: 'A B'}, secret: {env: S}}}", "E008"),
        ("  room: {webhook: {url: {env: A}, secret: {env: S}, proxy: x}}", "E004"),
        ("  room: {pigeon: {}}", "E004"),
    ],
)
def test_a_mistake_is_told_where_it_is(text: str, code: str) -> None:
    found, problems = read(text)
    assert found == {}
    assert (code, 5) in problems


MAIL = "host: smtp.example.org, from: a@example.org, to: [b@example.org, c@example.org]"


def test_a_mail_goes_by_tls_unless_it_says_otherwise() -> None:
    found, problems = read(f"  room: {{mail: {{{MAIL}, user: formiga, password: {{env: WORD}}}}}}")
    assert problems == []
    to = found["room"].to
    assert isinstance(to, Mail)
    assert (to.port, to.tls, to.to, to.user) == (587, "starttls", ("b@example.org", "c@example.org"), "formiga")
    assert to.password == SecretAt(env="WORD")


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ("tls: none", "E008"), ("tls: maybe", "E008"), ("port: 70000", "E062"), ("port: 0", "E062"), ("user: formiga", "E008"),
        ("password: {env: W}", "E008"), ("password: sesame", "E008"), ("cc: x", "E004"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_mail_is_told(more: str, code: str) -> None:
    assert (code, 5) in read(f"  room: {{mail: {{{MAIL}, {more}}}}}")[1]


@pytest.mark.parametrize(
    "address", ["b", "b@", "a b@example.org", "'b@example.org\\r'", "'<b@example.org>'", "b@exa_mple;x"]
)
def test_what_is_no_address_is_told(address: str) -> None:
    assert "E008" in [code for code, _ in read(f"  room: {{mail: {{host: h, from: a@b.c, to: [{address}]}}}}")[1]]


def test_a_topic_of_a_broker() -> None:
    found, problems = read("  room: {mqtt: {host: broker.example.org, topic: meadow/news}}")
    assert problems == []
    assert found["room"].to == Mqtt(host="broker.example.org", port=8883, topic="meadow/news")


@pytest.mark.parametrize("topic", ["meadow/#", "+/news", "''", "a b"])
def test_what_is_no_topic_is_told(topic: str) -> None:
    assert "E008" in [code for code, _ in read(f"  room: {{mqtt: {{host: h, topic: {topic}}}}}")[1]]


def test_a_channel_has_one_way() -> None:
    assert read(f"  room: {{{HOOK}, mail: {{{MAIL}}}}}")[1] == [("E008", 5)]


def test_there_is_an_end_to_channels() -> None:
    _, problems = read("\n".join(f"  room_{n}: {{{HOOK}}}" for n in range(21)))
    assert problems == [("E008", 25)]
