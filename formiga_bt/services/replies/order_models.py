"""What crosses the HTTP API of orders that rank above tasks: stops, continue, lockdown, hand-back, preflight.

Apart from `models` because all of it changes together, with docs/safety.md. Units and words as there.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Name = Annotated[str, Field(max_length=200)]


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")

    by: Name = ""
    """Who gives the order."""


class AgentOrderBody(_Body):
    """An order for one machine. `cut` stops its motors, also in the air: `confirmed` must repeat the machine's id."""

    order: Literal["hold", "return", "land", "cut", "continue"]
    confirmed: Name = ""


class TaskOrderBody(_Body):
    """An order for all machines of a task; `restart`: it begins anew from its first step."""

    order: Literal["hold", "return", "land", "continue", "restart"]


class AllOrderBody(_Body):
    """An order for every machine of the site."""

    order: Literal["hold", "return", "land", "continue"]


class LockdownBody(_Body):
    """Press lockdown: machines in the air do `how`; or release it."""

    how: Literal["hold", "return", "land", "release"] = "return"


class HandbackBody(_Body):
    """Give a machine back that its pilot had taken over.

    `continue`: the interrupted step is sent again. `return`: it flies to its port, its task stays HELD. `end`: the interrupted
    step fails with `taken_over`.
    """

    how: Literal["continue", "return", "end"] = "end"


class StandingOrderOut(BaseModel):
    """An order that stands on a machine: nothing of a task is sent to it."""

    agent: str
    stop: Literal["hold", "return", "land", "cut"]
    by: str
    scope: Literal["agent", "task", "all", "lockdown", "engine"]
    """What it was given for; `engine`: after a breach of the envelope."""
    why: str
    """`envelope.<name>` for the engine's own."""
    state: Literal["open", "done", "failed"]
    task: str
    """The task that carries it out, if one does."""
    unix_millis_at: int
    since_s: float
    """For so long it stands."""
    text: str
    """What the machine does for it, and what comes next."""
    note: str
    """The same with the order, who gave it, and since when."""


class LockdownOut(BaseModel):
    """Whether the site is locked down."""

    on: bool
    how: str
    by: str
    unix_millis_at: int | None
    text: str


class OrderedOut(BaseModel):
    """A machine or task that got the order, and what it does now."""

    who: str
    text: str


class SkippedOut(BaseModel):
    """A machine or task that did not get the order, and why; code `suspect`: it is not heard of, and may not have got it."""

    who: str
    code: str
    text: str
    hint: str = ""
    may_be_airborne: bool = False


class OrderReply(BaseModel):
    """What an order did."""

    ok: Literal[True] = True
    order: str
    target: str
    """An agent, a task, or empty for all."""
    stands_already: bool
    """The same order stood before; nothing was changed."""
    text: str
    ordered: list[OrderedOut]
    skipped: list[SkippedOut]
    next: list[str]
    """Commands of which a person should give one."""


class CheckOut(BaseModel):
    """One thing that was looked at before a flight."""

    check: str
    ok: bool
    text: str


class PreflightOut(BaseModel):
    """Whether a machine is ready to fly."""

    agent: str
    ok: bool
    """Every check is. False while the machine has told none."""
    required: bool
    """The site grants a machine only when it is ready."""
    airborne: bool = False
    """It is not on the ground: its checks are what it told before it took off."""
    checks: list[CheckOut]
    text: str
