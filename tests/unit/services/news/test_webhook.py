"""A webhook over real sockets: signed, sent where it may, no redirect followed, and never a secret in what is told of it."""

import asyncio
import socket
from pathlib import Path

import pytest

from formiga_bt.lang.model.news import SecretAt, Webhook
from formiga_bt.services.news import webhook
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import Outcome
from formiga_bt.services.news.webhook import WebhookSender
from tests.unit.services.news.receiver import SECRET, receiving

pytestmark = pytest.mark.network
MESSAGE = Message("e1.7.3.0", b'{"type":"test","timestamp":"2026-11-28T12:00:00.000Z","data":{}}', "a test")


class Site:
    """A folder with a URL and a secret, and a sender that reads them."""

    def __init__(self, folder: Path, *, private: bool = True) -> None:
        self.folder = folder
        self.put("secret", SECRET)
        to = Webhook(url=SecretAt(file="url"), secret=SecretAt(file="secret"), private=private)
        self.sender = WebhookSender(to, folder)

    def put(self, name: str, text: str, mode: int = 0o600) -> None:
        (self.folder / name).write_text(text + "\n", encoding="utf-8")
        (self.folder / name).chmod(mode)

    def send(self, url: str, times: int = 1) -> list[Outcome]:
        self.put("url", url)

        async def go() -> list[Outcome]:
            try:
                return [await self.sender.send(MESSAGE) for _ in range(times)]
            finally:
                await self.sender.close()

        return asyncio.run(go())


def test_a_message_is_signed_and_the_same_each_time(tmp_path: Path) -> None:
    with receiving() as receiver:
        outcomes = Site(tmp_path).send(receiver.url, times=2)
        assert [one.how for one in outcomes] == ["delivered", "delivered"]
        assert [ident for ident, _ in receiver.got] == ["e1.7.3.0"] * 2


@pytest.mark.parametrize(
    "url", ["http://127.0.0.1:{}/", "http://localhost:{}/", "http://2130706433:{}/", "http://[::1]:{}/"]
)
def test_this_machine_is_refused_unless_the_site_says_otherwise(tmp_path: Path, url: str) -> None:
    with receiving() as receiver:
        site = Site(tmp_path, private=False)
        (outcome,) = site.send(url.format(receiver.port).replace("http:", "https:"))
        assert outcome.how in ("failed", "unusable")
        assert any(word in outcome.text for word in ("private", "name is not known", "URL is none"))
        assert site.send(url.format(receiver.port))[0].how == "unusable"  # plain http
        assert receiver.got == []


@pytest.mark.parametrize("url", ["http://169.254.169.254/latest/meta-data/", "http://[fe80::1]/", "http://0.0.0.0/"])
def test_link_local_addresses_are_refused_whatever_the_site_says(tmp_path: Path, url: str) -> None:
    (outcome,) = Site(tmp_path).send(url)
    assert outcome.how == "failed"
    assert "address is" in outcome.text


def test_a_name_that_means_another_machine_the_next_time_is_looked_at_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = socket.getaddrinfo

    def rebound(host: object, *more: object, **options: object) -> object:
        return real("169.254.169.254" if host == "hook.example" else host, *more, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(socket, "getaddrinfo", rebound)
    (outcome,) = Site(tmp_path).send("http://hook.example/")
    assert "link-local" in outcome.text


def test_no_redirect_is_followed(tmp_path: Path) -> None:
    with receiving() as receiver:
        receiver.answer = lambda: (307, {"location": receiver.url + "/elsewhere"}, b"")
        assert Site(tmp_path).send(receiver.url)[0].how == "failed"
        assert receiver.paths == ["/hook"]


@pytest.mark.parametrize(
    ("status", "how"),
    [(200, "delivered"), (400, "refused"), (422, "refused"), (401, "failed"), (410, "failed"), (500, "failed")],
)
def test_what_an_answer_means(tmp_path: Path, status: int, how: str) -> None:
    with receiving() as receiver:
        receiver.answer = lambda: (status, {}, b"because\x1b[31m")
        (outcome,) = Site(tmp_path).send(receiver.url)
        assert (outcome.how, outcome.text, outcome.said) == (how, f"it answered {status}", "because [31m")


def test_a_busy_receiver_says_when(tmp_path: Path) -> None:
    with receiving() as receiver:
        receiver.answer = lambda: (429, {"retry-after": "7"}, b"")
        assert Site(tmp_path).send(receiver.url)[0].after_s == 7.0
        receiver.answer = lambda: (429, {"retry-after": "Wed, 21 Oct 2026 07:28:00 GMT"}, b"")
        assert Site(tmp_path).send(receiver.url)[0].after_s is None


def test_of_a_huge_answer_little_is_read(tmp_path: Path) -> None:
    with receiving() as receiver:
        receiver.answer = lambda: (200, {}, b"x" * 5_000_000)
        outcomes = Site(tmp_path).send(receiver.url, times=3)
        assert {one.how for one in outcomes} == {"delivered"}
        assert max(len(one.said) for one in outcomes) <= 200


def test_a_receiver_that_takes_the_call_and_says_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webhook, "WITHIN_S", 0.3)
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        (outcome,) = Site(tmp_path).send(f"http://127.0.0.1:{deaf.getsockname()[1]}/")
        assert outcome.text == "it did not answer within 0.3 s"


def test_nobody_there(tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (outcome,) = Site(tmp_path).send(f"http://127.0.0.1:{port}/")
    assert outcome.how == "failed"
    assert "refused" in outcome.text
    assert str(port) not in outcome.text


def test_a_secret_that_was_mended_is_used_at_the_next_try(tmp_path: Path) -> None:
    site = Site(tmp_path)
    with receiving() as receiver:
        site.put("secret", "whsec_no base64 at all!")
        outcome = site.send(receiver.url)[0]
        assert outcome.how == "unusable"
        assert "whsec_no" not in outcome.text
        site.put("secret", SECRET, mode=0o644)
        assert site.send(receiver.url)[0].text == "secret can be read by others; chmod 600 secret"
        site.put("secret", SECRET)
        assert site.send(receiver.url)[0].how == "delivered"
        (tmp_path / "secret").unlink()
        assert site.send(receiver.url)[0].how == "unusable"


@pytest.mark.parametrize("url", ["", "ftp://example.org/key123", "https://", "no url key123", "http://[::1/key123"])
def test_a_url_that_is_none_is_told_without_it(tmp_path: Path, url: str) -> None:
    (outcome,) = Site(tmp_path).send(url)
    assert outcome.how == "unusable"
    assert "key123" not in outcome.text
