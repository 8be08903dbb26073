"""`news:` of a site file: what is read, and that each mistake has its place and its repair."""

import pytest

from formiga_bt.lang.model.news import WHATS, Channel, Quiet, SecretAt, Webhook
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


def test_there_is_an_end_to_channels() -> None:
    _, problems = read("\n".join(f"  room_{n}: {{{HOOK}}}" for n in range(21)))
    assert problems == [("E008", 25)]
