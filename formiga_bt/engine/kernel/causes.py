"""Why a task is HELD: each cause is a value that says what holds it, and of which machine.

Outward (API, show) a cause is in words: `operator`, `operator:<agent>`, `clearance:<agent>`, `take-over:<agent>`, `lockdown`,
`resume`.
"""

from typing import assert_never

from msgspec import Struct


class OperatorHold(Struct, frozen=True, tag="operator", array_like=True, omit_defaults=True):
    """A person stopped the task, or one machine of it, and must say what comes next."""

    agent: str = ""
    """"" = the task as a whole."""


class ClearanceHold(Struct, frozen=True, tag="clearance", array_like=True):
    """A person must say that people stand clear of a machine. The task's clock goes on."""

    agent: str


class TakeOverHold(Struct, frozen=True, tag="take-over", array_like=True):
    """A pilot, or its own failsafe, has taken a machine over."""

    agent: str


class LockdownHold(Struct, frozen=True, tag="lockdown", array_like=True):
    """The site is locked down."""


class ResumeHold(Struct, frozen=True, tag="resume", array_like=True):
    """The engine was away, and a person must say that the task may go on."""


HoldCause = OperatorHold | ClearanceHold | TakeOverHold | LockdownHold | ResumeHold
"""A cause of HELD."""


def kind_and_agent(cause: HoldCause) -> tuple[str, str]:
    """Return the word of a cause, and its machine or ""."""
    match cause:
        case OperatorHold(agent):
            return "operator", agent
        case ClearanceHold(agent):
            return "clearance", agent
        case TakeOverHold(agent):
            return "take-over", agent
        case LockdownHold():
            return "lockdown", ""
        case ResumeHold():
            return "resume", ""
        case _:
            assert_never(cause)


def in_words(cause: HoldCause) -> str:
    """Return a cause as it is shown, for example `operator:hwd_1`."""
    kind, agent = kind_and_agent(cause)
    return f"{kind}:{agent}" if agent else kind


def waits_for_word(cause: HoldCause) -> bool:
    """Return whether `continue` ends a cause: a person's stop, or an outage of the engine."""
    return isinstance(cause, OperatorHold | ResumeHold)
