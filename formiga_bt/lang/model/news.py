"""The channels of a site's news: who is told what, by which way, when."""

from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.severities import Severity, at_least

What = Literal["alarms", "questions", "ends"]
WHATS: Final[tuple[What, ...]] = ("alarms", "questions", "ends")
"""What goes out: alarms, questions to people, ends of tasks."""


class SecretAt(Struct, frozen=True):
    """Where a secret stands: never in the site file itself."""

    file: str = ""
    """Relative to the folder of the site file; nobody else may read it (mode 0600)."""
    env: str = ""
    """A variable of the engine's environment."""


class Webhook(Struct, frozen=True, kw_only=True, tag="webhook"):
    """A POST to a URL, signed as standardwebhooks.com says."""

    url: SecretAt
    secret: SecretAt
    """`whsec_` and base64."""
    private: bool = False
    """Its address may be of this machine or a private net, and plain HTTP."""


class Mail(Struct, frozen=True, kw_only=True, tag="mail"):
    """A mail by a mail server."""

    host: str
    port: int
    tls: Literal["starttls", "direct", "none"] = "starttls"
    sender: str
    """An address, as `to`."""
    to: tuple[str, ...]
    user: str = ""
    password: SecretAt | None = None
    private: bool = False
    """The server's address may be of this machine or a private net; only then `tls` may be none."""


class Mqtt(Struct, frozen=True, kw_only=True, tag="mqtt"):
    """A message on a topic of a broker."""

    host: str
    port: int
    tls: Literal["direct", "none"] = "direct"
    topic: str
    user: str = ""
    password: SecretAt | None = None
    private: bool = False
    """The broker's address may be of this machine or a private net; only then `tls` may be none."""


Receiver = Webhook | Mail | Mqtt
"""How a channel reaches who is told: a closed union."""


class Quiet(Struct, frozen=True):
    """Hours of the day, in the site's time zone, in which only what is critical goes out; `end` may be on the next day."""

    start: int
    """Minutes after midnight."""
    end: int

    def holds(self, minute: int) -> bool:
        """Return whether a minute of the day is one of them."""
        if self.start <= self.end:
            return self.start <= minute < self.end
        return minute >= self.start or minute < self.end


class Channel(Struct, frozen=True, kw_only=True):
    """Who is told what."""

    name: str
    to: Receiver
    what: tuple[What, ...] = WHATS
    severity: Severity = "info"
    """At least."""
    tasks: tuple[str, ...] = ()
    """Only news of these tasks; empty: of all, and of what is no task's."""
    quiet: Quiet | None = None
    unacknowledged_us: Micros | None = None
    """Only alarms that nobody acknowledged within so long (engine time): it is the one that they are escalated to."""
    text: bool = False
    """Whether texts and names go along, which may be those of people."""

    def takes(self, what: What, severity: Severity, task: str) -> bool:
        """Return whether news are for this channel; `task`: the id of a task, or empty."""
        if what not in self.what or not at_least(severity, self.severity):
            return False
        return not self.tasks or task.rpartition("-")[0] in self.tasks
