"""Mail over real sockets: what a mail says, what an answer means, and that nothing is said in the clear that must not."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.lang.model.news import Mail, SecretAt
from formiga_bt.services.news.mail import MailSender
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import Outcome
from tests.unit.services.news.mailbox import Mailbox, mailbox

pytestmark = pytest.mark.network
BODY = (
    b'{"type":"alarm.raised","timestamp":"2026-11-28T12:00:00.000Z",'
    b'"data":{"site":"meadow","id":"A7","text":"a\\r\\nBcc: x@y.z"}}'
)
MESSAGE = Message("e1.7.3.0", BODY, "meadow A7 raised\r\nBcc: x@y.z")


def send(box: Mailbox, folder: Path, times: int = 1, **more: Any) -> list[Outcome]:
    given = {"host": "127.0.0.1", "port": box.port, "tls": "none", "private": True, **more}
    sender = MailSender(Mail(sender="formiga@example.org", to=("ann@example.org", "bob@example.org"), **given), folder)

    async def go() -> list[Outcome]:
        return [await sender.send(MESSAGE) for _ in range(times)]

    return asyncio.run(go())


def test_a_mail_has_the_news_in_it_and_a_double_is_known_by_its_id(tmp_path: Path) -> None:
    with mailbox() as box:
        assert [one.how for one in send(box, tmp_path, times=2)] == ["delivered", "delivered"]
        first, second = box.mails
        assert first["Message-ID"] == second["Message-ID"] == "<e1.7.3.0@formiga.invalid>"
        assert (first["To"], first["From"]) == ("ann@example.org, bob@example.org", "formiga@example.org")
        assert first["Subject"] == "meadow A7 raised Bcc: x@y.z"
        assert first["Bcc"] is None
        lines = first.get_content().splitlines()
        assert lines[:2] == ["type: alarm.raised", "timestamp: 2026-11-28T12:00:00.000Z"]
        assert "text: a Bcc: x@y.z" in lines


def test_a_server_that_does_not_speak_tls_gets_neither_mail_nor_password(tmp_path: Path) -> None:
    (tmp_path / "word").write_text("sesame", encoding="utf-8")
    (tmp_path / "word").chmod(0o600)
    with mailbox() as box:
        (outcome,) = send(box, tmp_path, tls="starttls", user="formiga", password=SecretAt(file="word"))
        assert outcome.how == "failed"
        assert {"AUTH", "MAIL", "DATA"} & set(box.words) == set()


def test_who_logs_in_has_a_password_that_others_cannot_read(tmp_path: Path) -> None:
    with mailbox() as box:
        given = {"user": "formiga", "password": SecretAt(file="word")}
        assert send(box, tmp_path, **given)[0].how == "unusable"
        (tmp_path / "word").write_text("sesame", encoding="utf-8")
        (tmp_path / "word").chmod(0o600)
        assert send(box, tmp_path, **given)[0].how == "delivered"
        assert "AUTH" in box.words
        box.says["AUTH"] = "535 no, sesame is wrong"
        (outcome,) = send(box, tmp_path, **given)
        assert (outcome.how, outcome.text) == ("failed", "it answered 535")


@pytest.mark.parametrize(
    ("word", "says", "how"),
    [
        ("", "421 not now", "failed"),
        ("RCPT", "550 who?", "failed"),
        (".", "451 later", "failed"),
        (".", "554 never", "refused"),
    ],
)
def test_what_an_answer_means(tmp_path: Path, word: str, says: str, how: str) -> None:
    with mailbox() as box:
        box.says[word] = says
        assert send(box, tmp_path)[0].how == how


def test_this_machine_is_refused_unless_the_site_says_otherwise(tmp_path: Path) -> None:
    with mailbox() as box:
        (outcome,) = send(box, tmp_path, private=False)
        assert (outcome.how, box.words) == ("failed", [])
        assert "private" in outcome.text
        assert "link-local" in send(box, tmp_path, host="169.254.169.254")[0].text


def test_nobody_there(tmp_path: Path) -> None:
    with mailbox() as box:
        pass
    (outcome,) = send(box, tmp_path)
    assert outcome.how == "failed"
    assert str(box.port) not in outcome.text
