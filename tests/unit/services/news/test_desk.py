"""The thread that delivers: what it cannot go on with is an alarm, and the engine goes on."""

from pathlib import Path

import pytest

from formiga_bt.engine.kernel.inputs import NewsDelivered
from formiga_bt.lang.site import load_site_text
from formiga_bt.services.news import desk
from formiga_bt.services.news.desk import NewsDesk
from formiga_bt.services.news.message import name_of

SITE = """\
formiga_site: 1
name: meadow
base: {lat: 66.5, lng: 25.7}
news:
  room: {webhook: {url: {env: U}, secret: {env: S}}}
"""


def made(folder: Path, text: str, noted: list[NewsDelivered], kept: list[NewsDelivered]) -> NewsDesk:
    site, problems, _ = load_site_text(text, "site.yaml", None)
    assert site is not None, problems
    return NewsDesk(
        site, folder, engine_id="e1", began=7, marks={}, read=None, note=noted.append, keep=kept.append, now=lambda: 0
    )


def test_a_bug_ends_no_engine_and_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(desk, "sender_of", broken)
    one = made(tmp_path, SITE, [], [])
    one.start()
    one.stop()
    assert [(trouble.code, trouble.subject) for trouble in one.troubles()] == [("news_failing", "room")]


def test_a_channel_that_is_new_begins_now_and_one_that_is_gone_leaves_no_mark(tmp_path: Path) -> None:
    noted: list[NewsDelivered] = []
    kept: list[NewsDelivered] = []
    one = made(tmp_path, SITE, noted, kept)
    one.start()  # when it returns it is on disk where the news begin: a kill in the next moment loses none
    assert [(name, mark.all, mark.urgent) for name, mark in kept[0].marks.items()] == [("room", 7, 7)]
    one.stop()
    assert noted == []
    assert not list(one.troubles())


def test_what_tells_engines_apart_is_not_what_agents_know_them_by() -> None:
    assert name_of("e1") == name_of("e1") != name_of("e2")
    assert len(name_of("a very long name of an engine")) == 12
