"""Node memory as data: what a node must remember between steps, one frozen struct per kind.

Kept in the task's state by instance path, written only through `Run.remember`; `Node.restore` rebuilds a tree from it.
"""

from typing import Any, Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.nodes.ends import Drain

NODE_STATE_VERSION: Final = 2
"""Raised with each change after which a tree cannot be rebuilt from what nodes of the version before remembered."""


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


class SwitchMem(Struct, frozen=True, tag="switch", tag_field="mem"):
    """The case taken (from 0; None = the default) and the place in it."""

    case: int | None
    index: int = 0
    ran: bool = False


class CallMem(Struct, frozen=True, tag="call", tag_field="mem"):
    """A call's place in its body; its scope is its own path."""

    index: int = 0
    ran: bool = False


class Following(Struct, frozen=True, omit_defaults=True):
    """Of a `do` with `track`: since when its agent has not followed what moves, and why not."""

    every_us: Micros
    """How often to look."""
    within_m: float
    """How far off the target may be before the agent is told."""
    turned_at: Micros | None = None
    """When the agent took the newest target that we know of."""
    behind_since: Micros | None = None
    """The task's own time at which the target had moved first without the agent taking a new one; None = it follows."""
    why: str = ""
    """What was last said against a new one."""
    failure: Any = None
    """Decided: the goal is canceled, and the step fails so when that has ended."""


class DoMem(Struct, frozen=True, tag="do", tag_field="mem"):
    """The goal waited for, and the how-manieth it is of this step: each `continue` sends another one."""

    goal: str
    sent: int = 1
    following: Following | None = None


class AskMem(Struct, frozen=True, tag="ask", tag_field="mem"):
    """The question waited for."""

    ask: str


class WaitMem(Struct, frozen=True, tag="wait", tag_field="mem"):
    """Nothing but that it runs; the deadline is in the engine's table."""

    since: Micros


class WaitForMem(Struct, frozen=True, tag="wait_for", tag_field="mem"):
    """Whose event is waited for, and after which one."""

    agent: str
    after: int


class PassMem(Struct, frozen=True, tag="pass", tag_field="mem"):
    """A running decorator without memory of its own (`when`, `ignore_failure`)."""


class TimeoutMem(Struct, frozen=True, tag="timeout", tag_field="mem"):
    """Running; once expired, what it waits for."""

    halting: bool = False
    drain: Drain = ()


class RetryMem(Struct, frozen=True, tag="retry", tag_field="mem"):
    """The attempt (from 1), whether it waits before the next one, and the values read at entry."""

    attempts: int
    delay_us: Micros
    backoff: float
    attempt: int = 1
    waiting: bool = False
    had: tuple[str, ...] = ()
    """With `agent: another`: the agents that inner `with_agents` got in this attempt,"""
    failed: tuple[str, ...] = ()
    """and those that failed in earlier ones."""


class CleanupMem(Struct, frozen=True, tag="tidy", tag_field="mem"):
    """A sequence with `finally`: whether it tidies up now, and what the sequence had decided."""

    closing: bool = False
    failure: Any = None
    skipped: bool = False
    breaking: bool = False


class LiveMem(Struct, frozen=True, tag="live", tag_field="mem"):
    """A node with live conditions (guard, reactive): its place, and once it stopped, goals and what it decided."""

    index: int = 0
    ran: bool = False
    halting: bool = False
    drain: Drain = ()
    failure: Any = None


class GatherMem(Struct, frozen=True, tag="gather", tag_field="mem"):
    """A parallel or parallel `for`: a letter per child (. waits, R runs, S succeeded, F failed, K skipped)."""

    states: str
    failure: Any = None
    halting: bool = False
    drain: Drain = ()
    collected: tuple[Any, ...] = ()
    """Of a `for` with `collect`: what each item saved, None if nothing."""


class ItemsMem(Struct, frozen=True, tag="items", tag_field="mem"):
    """Of a `for`: the loop names of each item, read once at entry. Beside the other memory, so that it is written once."""

    items: tuple[dict[str, Any], ...]


class LoopMem(Struct, frozen=True, tag="loop", tag_field="mem"):
    """A loop: its round (from 1), the place in it, and whether it waits for the next round's start."""

    round: int
    index: int = 0
    ran: bool = False
    waiting: bool = False
    round_at: Micros = 0
    """When this round started, by the task's clock, which stands still while it is held."""
    over_at: Micros | None = None
    """`repeat: 30 min`: no round starts from here on, by the task's clock."""
    times: int | None = None
    every_us: Micros = 0
    most: int | None = None
    collected: tuple[Any, ...] = ()
    ever_ran: bool = False
    """A step of a round that ended was not skipped."""
    succeeded: int = 0
    """Of a `for` with `need`: rounds that succeeded, and the first failure of another."""
    failure: Any = None


class RequestMem(Struct, frozen=True, tag="request", tag_field="mem"):
    """The task waited for."""

    task: str


class WithMem(Struct, frozen=True, tag="with_agents", tag_field="mem"):
    """A block with agents of its own: it waits for them, runs its steps with them, or waits until they are given back."""

    state: Literal["waits", "runs", "releases"] = "waits"
    agents: dict[str, tuple[str, ...]] = {}
    """By role."""
    index: int = 0
    ran: bool = False
    failure: Any = None
    """What its steps had decided when it began to give back; likewise the next two."""
    skipped: bool = False
    breaking: bool = False
    low: dict[str, float] = {}
    """Agents that are replaced -> at which charge, percent."""
    drain: Drain = ()
    """What the stopped steps had under way: the block had lost an agent, or hands over."""
    anew: bool = False
    """It begins anew when all are given back."""
    turn: int = 0
    """How often it has begun anew: part of the paths of its steps, so that no goal has the id of an earlier one."""


class WithResourceMem(Struct, frozen=True, tag="with_resource", tag_field="mem"):
    """A block with resources: it waits for them, or runs its steps with them."""

    state: Literal["waits", "runs"] = "waits"
    index: int = 0
    ran: bool = False


Mem = (
    SequenceMem | FallbackMem | IfMem | SwitchMem | CallMem | DoMem | AskMem | WaitMem | WaitForMem | PassMem | TimeoutMem
    | RetryMem | CleanupMem | LiveMem | GatherMem | ItemsMem | LoopMem | WithMem | RequestMem
    | WithResourceMem
)  # fmt: skip
