"""Facts of what ranks above tasks: orders of people, lockdown, preflight, approvals and pilots.

They change together, with docs/safety.md.
"""

from typing import Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.show.facts.site import AgentFact, TaskFact


class OrderFact(Struct, frozen=True, kw_only=True):
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
    since: Micros
    text: str
    """What the machine does for it, and what comes next."""
    note: str
    """The same with the order, who gave it, and since when."""
    next: tuple[str, ...] = ()
    """Commands of which a person should give one; none of them would be refused now."""


class LockdownFact(Struct, frozen=True, kw_only=True):
    """Whether the site is locked down."""

    on: bool
    how: str = ""
    by: str = ""
    since: Micros | None = None
    text: str = ""


class TaskList(Struct, frozen=True, kw_only=True):
    """Tasks: those under way (ASSIGNED, ACTIVE, ENDING), then all others, each newest first."""

    at: Micros
    tasks: tuple[TaskFact, ...]
    total: int
    """So many fit the filter."""
    orders: tuple[OrderFact, ...]
    """Orders that stand on machines of these tasks."""
    lockdown: LockdownFact


class AgentList(Struct, frozen=True, kw_only=True):
    """All agents: machines, then people, each by name (hwd_2 before hwd_10)."""

    at: Micros
    agents: tuple[AgentFact, ...]
    orders: tuple[OrderFact, ...]
    """Orders that stand on them."""
    lockdown: LockdownFact


class OrderedFact(Struct, frozen=True):
    """A machine or task that got the order, and what it does now."""

    who: str
    text: str


class SkippedFact(Struct, frozen=True, kw_only=True):
    """A machine or task that did not get the order, and why; code `suspect`: it is not heard of, and may not have got it."""

    who: str
    code: str
    text: str
    hint: str = ""
    may_be_airborne: bool = False


class OrderReply(Struct, frozen=True, kw_only=True):
    """What an order did."""

    order: str
    target: str
    """An agent, a task, or empty for all."""
    stands_already: bool
    """The same order stood before; nothing was changed."""
    text: str
    ordered: tuple[OrderedFact, ...]
    skipped: tuple[SkippedFact, ...]
    next: tuple[str, ...]
    """Commands of which a person should give one."""


class AssignedFact(Struct, frozen=True, kw_only=True):
    """What became of an agent that a person gave to a task, or took back."""

    task: str
    agent: str
    role: str
    """That it has, or for which it is kept; empty: it was taken back."""
    granted: bool
    """The task has it now: of one that was taken back, until it is home."""
    text: str


class OrderDone(Struct, frozen=True):
    """An order was taken."""

    text: str


class SpeakerFact(Struct, frozen=True):
    """Who a caller is to an engine."""

    name: str
    """The account whose token came; `local`: who calls on the engine's own machine, or with the site's token."""
    roles: tuple[str, ...]
    agent: str
    """The agent that this account is; "" = none."""
    tasks: tuple[str, ...]
    """Tasks that it may request; empty = all, if it may request any."""
    may: tuple[str, ...]
    """What it may do."""


class TaskRequested(Struct, frozen=True):
    """A task was taken; follow it at `/v1/tasks/{id}`."""

    id: str


class CheckFact(Struct, frozen=True):
    """One thing that was looked at before a flight."""

    check: str
    ok: bool
    text: str


class PreflightFact(Struct, frozen=True, kw_only=True):
    """Whether a machine is ready to fly."""

    agent: str
    ok: bool
    """Every check is. False while the machine has told none."""
    required: bool
    """The site grants a machine only when it is ready."""
    airborne: bool = False
    """It is not on the ground: its checks are what it told before it took off."""
    checks: tuple[CheckFact, ...]
    text: str


class DraftFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A model wrote a task: who asked for it, and which model."""

    by: tuple[str, ...]
    model: str = ""
    also: tuple[str, ...] = ()
    """Other names of those who asked."""


class ApprovalFact(Struct, frozen=True, kw_only=True):
    """An approval that stands, of one version of a task."""

    task: str
    digest: str
    by: str
    at: Micros


class ServedFact(Struct, frozen=True, kw_only=True):
    """A task that is served, and whether it may fly in mode real."""

    task: str
    digest: str
    """Of its text, imports, catalogue and the site's fences: what is approved."""
    lands_away: tuple[str, ...]
    """Where it lands away from its machine's home."""
    drafted: DraftFact | None
    approval: ApprovalFact | None


class ApprovalList(Struct, frozen=True, kw_only=True):
    """Every task that is served, whether it is approved, and the approvals of other versions that stand."""

    mode: str
    tasks: tuple[ServedFact, ...]
    others: tuple[ApprovalFact, ...]


class PilotFact(Struct, frozen=True, kw_only=True):
    """A pilot of the site."""

    pilot: str
    since: Micros | None
    """On duty since then; null: off duty."""
    max_airborne: int
    machines: tuple[str, ...]
    """Under this name now."""


class PilotList(Struct, frozen=True, kw_only=True):
    """The site's pilots."""

    mode: str
    pilots: tuple[PilotFact, ...]


class ZoneFact(Struct, frozen=True, kw_only=True):
    """A region, or a place with 30 m around it, that somebody closed for machines."""

    name: str
    reason: str
    by: str
    at: Micros
    """Since when, engine time."""


class ZoneList(Struct, frozen=True):
    """What is closed for machines, in the order of closing."""

    zones: tuple[ZoneFact, ...]
