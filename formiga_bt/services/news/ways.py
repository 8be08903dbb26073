"""The ways to receivers: which packages each needs, which secrets, and what sends. Loads none of them before it is used."""

from importlib.util import find_spec
from pathlib import Path
from typing import assert_never

from formiga_bt.base.extras import install
from formiga_bt.lang.model.news import Mail, Mqtt, Receiver, SecretAt, Webhook
from formiga_bt.services.news.sending import Sender


def sender_of(to: Receiver, beside: Path) -> Sender | None:
    """Return the way to a receiver; None: its packages are not installed."""
    if lacks(to):
        return None
    match to:
        case Webhook():
            from formiga_bt.services.news.webhook import WebhookSender

            return WebhookSender(to, beside)
        case Mail():
            from formiga_bt.services.news.mail import MailSender

            return MailSender(to, beside)
        case Mqtt():
            from formiga_bt.services.news.mqtt import MqttSender

            return MqttSender(to, beside)
        case _:
            assert_never(to)


def lacks(to: Receiver) -> str:
    """Return what is to be installed for a receiver, or an empty text."""
    match to:
        case Webhook():
            needed: tuple[str, ...] = ("aiohttp", "standardwebhooks")
        case Mail():
            needed = ("aiosmtplib",)
        case Mqtt():
            needed = ("aiomqtt",)
        case _:
            assert_never(to)
    missing = [name for name in needed if find_spec(name) is None]
    return f"{' and '.join(missing)} not installed here: {install('news')}" if missing else ""


def secrets_of(to: Receiver) -> tuple[SecretAt, ...]:
    """Return where the secrets of a way stand."""
    match to:
        case Webhook():
            return to.url, to.secret
        case Mail() | Mqtt():
            return (to.password,) if to.password is not None else ()
        case _:
            assert_never(to)
