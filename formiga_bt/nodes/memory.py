"""Node memory as data: what a node must remember between steps, one frozen struct per kind.

Kept in the task's state by instance path, written only through `Run.remember`; `Node.restore` rebuilds a tree from it.
"""

from typing import Any

from msgspec import Struct

from formiga_bt.clock import Micros


class SequenceMem(Struct, frozen=True, tag="sequence", tag_field="mem"):
    """The running child, and whether any child so far was not skipped."""

    index: int = 0
    ran: bool = False


class FallbackMem(Struct, frozen=True, tag="fallback", tag_field="mem"):
    """The running child, and the failure of the child before it (None: all before were skipped)."""

    index: int = 0
    failure: Any = None


class IfMem(Struct, frozen=True, tag="if", tag_field="mem"):
    """The branch taken (`then` or `else`) and its place in it."""

    branch: str
    index: int = 0
    ran: bool = False


class CallMem(Struct, frozen=True, tag="call", tag_field="mem"):
    """A call's place in its body; its scope is its own path."""

    index: int = 0
    ran: bool = False


class DoMem(Struct, frozen=True, tag="do", tag_field="mem"):
    """The goal waited for."""

    goal: str


class AskMem(Struct, frozen=True, tag="ask", tag_field="mem"):
    """The question waited for."""

    ask: str


class WaitMem(Struct, frozen=True, tag="wait", tag_field="mem"):
    """Nothing but that it runs; the deadline is in the engine's table."""

    since: Micros


class PassMem(Struct, frozen=True, tag="pass", tag_field="mem"):
    """A running decorator without memory of its own (`when`, `ignore_failure`)."""


class TimeoutMem(Struct, frozen=True, tag="timeout", tag_field="mem"):
    """Running; once expired, the goals whose end it waits for."""

    halting: bool = False
    drain: tuple[str, ...] = ()


class RetryMem(Struct, frozen=True, tag="retry", tag_field="mem"):
    """The attempt (from 1), whether it waits before the next one, and the values read at entry."""

    attempts: int
    delay_us: Micros
    backoff: float
    attempt: int = 1
    waiting: bool = False


Mem = (
    SequenceMem | FallbackMem | IfMem | CallMem | DoMem | AskMem | WaitMem | PassMem | TimeoutMem | RetryMem
)  # fmt: skip
