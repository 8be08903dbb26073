"""MQTT: one message to a topic of a broker, with QoS 1: the broker says that it has it.

The broker's name is looked up and its address judged first; then that address is called, and its certificate must be for the
name. Loaded only where a site has such a channel.
"""

import asyncio
import ssl
from pathlib import Path
from typing import Any, Final

import aiomqtt
import msgspec

from formiga_bt.lang.model.news import Mqtt
from formiga_bt.services.news.addresses import ForbiddenAddressError, allowed
from formiga_bt.services.news.message import Message
from formiga_bt.services.news.sending import NoSecret, Outcome, read_secret

WITHIN_S: Final = 15.0
"""The whole of one try."""


class MqttSender:
    """Sends each message over a connection of its own.

    Args:
        to: the broker and the topic.
        beside: the folder of the site file.
    """

    def __init__(self, to: Mqtt, beside: Path) -> None:
        self._to, self._beside = to, beside

    async def send(self, message: Message) -> Outcome:
        """Try once; see `Sender.send`."""
        to = self._to
        try:
            password = read_secret(to.password, self._beside) if to.password is not None else None
        except NoSecret as error:
            return Outcome("unusable", str(error).replace("\n  help: ", "; "))
        try:
            async with asyncio.timeout(WITHIN_S):
                address = await allowed(to.host, to.port, private=to.private)
                client = aiomqtt.Client(
                    address, to.port, username=to.user or None, password=password, timeout=WITHIN_S,
                    tls_context=await asyncio.to_thread(_NamedContext.of, to.host) if to.tls == "direct" else None,
                )  # fmt: skip
                async with client:
                    await client.publish(to.topic, payload_of(message), qos=1)
        except TimeoutError:
            return Outcome("failed", f"it did not answer within {WITHIN_S:g} s")
        except ForbiddenAddressError as error:
            return Outcome("failed", str(error))
        except aiomqtt.MqttCodeError as error:
            return Outcome("failed", f"it does not take it (code {error.rc})")
        except (aiomqtt.MqttError, OSError, ValueError) as error:
            return Outcome("failed", f"it cannot be reached ({type(error).__name__})")
        return Outcome("delivered", "the broker has it")

    async def close(self) -> None:
        """Do nothing: no connection is kept."""


def payload_of(message: Message) -> bytes:
    """Return a message as it stands on a topic: with its id, by which doubles are known."""
    found: dict[str, Any] = msgspec.json.decode(message.body)
    return msgspec.json.encode({"id": message.id, **found})


class _NamedContext(ssl.SSLContext):
    """TLS to an address that must prove to be a name's."""

    name = ""

    @classmethod
    def of(cls, name: str) -> "_NamedContext":
        """Return the context for a name; reads certificates, so in a thread."""
        context = cls(ssl.PROTOCOL_TLS_CLIENT)
        context.load_default_certs()
        context.name = name
        return context

    def wrap_socket(self, *args: Any, **given: Any) -> ssl.SSLSocket:
        """Wrap a socket of a connection to the address."""
        return super().wrap_socket(*args, **{**given, "server_hostname": self.name})
