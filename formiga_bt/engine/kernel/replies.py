"""What the engine replies to an order of a person."""

from msgspec import Struct

from formiga_bt.base.errors import TaskError


class Accepted(Struct, frozen=True, tag=True):
    """A task was admitted, under this id."""

    task: str


class Done(Struct, frozen=True, tag=True):
    """The order is carried out; not `kept`: the journal cannot be written, and after a crash nothing is known of it."""

    kept: bool = True


class Refusal(Struct, frozen=True, tag=True):
    """It was not carried out, and why."""

    code: str
    text: str


Reply = Accepted | Done | Refusal


def granted(reply: Reply | None) -> Accepted | Done:
    """Return the reply to an order that was not refused.

    Raises:
        TaskError: it was.
    """
    if isinstance(reply, Refusal):
        raise TaskError(reply.code, reply.text)
    return Done() if reply is None else reply
