"""MQTT over real sockets: delivered when the broker says so, and never to an address that the site did not allow."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.lang.model.news import Mqtt, SecretAt
from formiga_bt.services.news import mqtt
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.mqtt import MqttSender
from formiga_bt.services.news.sending import Outcome
from tests.unit.services.news.broker import Broker, broker

pytestmark = pytest.mark.network
MESSAGE = Message("e1.7.3.0", b'{"type":"test","timestamp":"2026-11-28T12:00:00.000Z","data":{"id":"A7"}}', "a test")


def send(to: Broker, folder: Path, times: int = 1, **more: Any) -> list[Outcome]:
    given = {"host": "127.0.0.1", "port": to.port, "tls": "none", "private": True, "topic": "meadow/news", **more}
    sender = MqttSender(Mqtt(**given), folder)

    async def go() -> list[Outcome]:
        return [await sender.send(MESSAGE) for _ in range(times)]

    return asyncio.run(go())


def test_a_message_is_on_its_topic_with_its_id(tmp_path: Path) -> None:
    with broker() as made:
        assert [one.how for one in send(made, tmp_path, times=2)] == ["delivered", "delivered"]
        assert [(topic, qos) for topic, _, qos in made.got] == [("meadow/news", 1)] * 2
        assert json.loads(made.got[0][1]) == {"id": "e1.7.3.0", **json.loads(MESSAGE.body)}


def test_what_the_broker_does_not_confirm_is_not_delivered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mqtt, "WITHIN_S", 0.5)
    with broker() as made:
        made.confirms = False
        assert send(made, tmp_path)[0].how == "failed"
        assert len(made.got) == 1


def test_a_broker_that_lets_nobody_in(tmp_path: Path) -> None:
    (tmp_path / "word").write_text("sesame", encoding="utf-8")
    (tmp_path / "word").chmod(0o600)
    with broker() as made:
        made.accepts = 5
        (outcome,) = send(made, tmp_path, user="formiga", password=SecretAt(file="word"))
        assert (outcome.how, made.got) == ("failed", [])
        assert b"sesame" in made.connects[0]
        assert "sesame" not in outcome.text


# paho leaves the socket of a handshake that failed to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_broker_that_does_not_speak_tls_gets_no_password(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mqtt, "WITHIN_S", 2.0)
    (tmp_path / "word").write_text("sesame", encoding="utf-8")
    (tmp_path / "word").chmod(0o600)
    with broker() as made:
        given = {"tls": "direct", "user": "formiga", "password": SecretAt(file="word")}
        assert send(made, tmp_path, **given)[0].how == "failed"
        assert not [one for one in made.connects if b"sesame" in one or b"MQTT" in one]


def test_this_machine_is_refused_unless_the_site_says_otherwise(tmp_path: Path) -> None:
    with broker() as made:
        (outcome,) = send(made, tmp_path, private=False)
        assert (outcome.how, made.connects) == ("failed", [])
        assert "private" in outcome.text
        assert "link-local" in send(made, tmp_path, host="169.254.169.254")[0].text


def test_nobody_there(tmp_path: Path) -> None:
    with broker() as made:
        pass
    assert send(made, tmp_path)[0].how == "failed"
