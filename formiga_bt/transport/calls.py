"""Programs call services of the engine over a wire: what is called, in whose name, and who answers.

A wire that can do this is a `CarriesCalls`; which services there are, and who may call them, is said by `services.calling`.
"""

from collections.abc import Collection
from typing import NamedTuple, Protocol, runtime_checkable

from msgspec import Struct


class Call(NamedTuple):
    """What a program calls, and in whose name."""

    principal: str
    """As the key says it; empty: the key names nobody."""
    service: str
    payload: bytes


class CallError(Struct, frozen=True):
    """Why a call was not carried out; JSON on the wire."""

    code: str
    """A stable word."""
    text: str
    help: str = ""
    near: tuple[str, ...] = ()
    """Names that may have been meant."""
    problems: tuple[str, ...] = ()
    """All of them, where several are wrong."""


class AnswersCalls(Protocol):
    """Who answers programs that call services of the engine."""

    services: Collection[str]
    urgent: Collection[str]
    """Those of them that must get through in a crowd."""

    def answer(self, call: Call) -> bytes | CallError:
        """Carry a call out, and return the reply as JSON. Called in threads of the wire; may wait for the engine, 10 s."""
        ...


@runtime_checkable
class CarriesCalls(Protocol):
    """A wire by which programs call services of the engine."""

    binds_names: bool
    """The wire lets a caller use only keys with its own name. False: a caller may say any."""

    def serve_calls(self, desk: AnswersCalls, *, bare: bool) -> None:
        """Say who answers; `bare`: also calls that name nobody. Before the wire is opened."""
        ...
