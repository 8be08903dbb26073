"""Orders of a person who watches, and the seam through which they leave."""

from typing import Final, Literal, Protocol

from msgspec import Struct

Verb = Literal[
    "hold", "return", "land", "continue", "cut", "abort", "lockdown", "release", "handback", "clear", "answer", "ack"
]
Kind = Literal["agent", "task", "question", "alarm", "all"]

HANDBACKS: Final = ("continue", "return", "end")
"""What can become of the task of a machine that is handed back."""


class WatchOrder(Struct, frozen=True, kw_only=True):
    """One order. Its target was fixed when the key was pressed, and never changes."""

    verb: Verb
    kind: Kind
    target: str = ""
    """An agent, a task, a question or an alarm; "" for all."""
    how: str = ""
    """Of `answer` the option, of `handback` continue, return or end."""
    by: str = ""
    """Of `answer`: who answers, if several people here are asked."""
    confirmed: str = ""
    """Of `cut`: the machine's id, typed by a person."""

    @property
    def words(self) -> str:
        """Return it as one would type it: `answer Q7 clear`, `hold hwd_1`, `land --all`."""
        words = [self.verb, self.target if self.kind != "all" or self.verb in ("lockdown", "release") else "--all"]
        words.append(f"--{self.how}" if self.verb == "handback" and self.how else self.how)
        if self.by:
            words.append(f"--by {self.by}")
        return " ".join(word for word in words if word)


class WatchReply(Struct, frozen=True):
    """What the engine said to an order."""

    text: str
    good: bool = True
    """False: it was refused, or a machine that may be in the air did not get it."""


class Actor(Protocol):
    """Carries orders to the engine."""

    def send(self, order: WatchOrder) -> WatchReply:
        """Send an order and wait for what the engine says.

        Raises:
            FormigaError: no answer came; the engine may have got it or not.
        """
        ...
