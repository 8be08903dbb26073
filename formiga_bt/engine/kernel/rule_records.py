"""What the engine knows of standing rules: what each watches, what it started, and what waits for a person."""

from typing import Any, Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros

KEPT_FIRINGS: Final = 20
"""So many of the newest firings of a rule are kept for people."""


class RuleCause(Struct, frozen=True, omit_defaults=True):
    """Which rule requested a task, or the task that requested it, and why."""

    rule: str
    agent: str
    what: str
    """What happened to the agent: `sos`, `leaves field`."""
    at: Micros
    """Engine time when it happened."""
    by: str = ""
    """Who said that it may start, if it had waited for a person."""
    through: tuple[str, ...] = ()
    """Rules whose tasks led to it, oldest first, without this one."""


class RuleWatch(Struct, frozen=True, omit_defaults=True):
    """What a rule has seen of one agent."""

    inside: bool | None = None
    """On which side of its border the agent is; None: not known yet."""
    since: Micros | None = None
    """Since when it is on the other side, while that has not lasted for the rule's `for`."""
    silent: bool = False
    """Its silence was noted already; it has not been heard since."""
    starts: tuple[Micros, ...] = ()
    """When the newest tasks of the rule for this agent were started."""


class RuleWait(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something happened, and its task could not be started: a person decides."""

    agent: str
    what: str
    at: Micros
    event: dict[str, Any] = {}
    """What `event` is in the rule's arguments."""
    through: tuple[str, ...] = ()
    code: str
    """Why not: a refusal's code (`lockdown`, `not_approved`, ...)."""
    text: str
    times: int = 1
    """How often it has happened since it waits."""


class RuleFiring(Struct, frozen=True, omit_defaults=True):
    """What became of one thing that happened."""

    agent: str
    at: Micros
    outcome: Literal["started", "running", "own", "waits", "dismissed"]
    """`running`: as many of its tasks run as may. `own`: a task of the rule moves this very machine."""
    task: str = ""
    code: str = ""
    by: str = ""


class RuleRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A rule of the site, and what became of it so far."""

    name: str
    on: str
    """As written."""
    after_us: Micros = 0
    of: tuple[str, ...] = ()
    task: str
    limit: str = ""
    watched: str = ""
    """Of what it watches: if that differs, all that it saw is forgotten."""
    running: tuple[tuple[str, str], ...] = ()
    """Agent and task of what it started; those that ended are left out at its next firing."""
    waits: dict[str, RuleWait] = {}
    """By agent."""
    fired: int = 0
    """How often something happened, whatever became of it."""
    last: tuple[RuleFiring, ...] = ()
    """The newest `KEPT_FIRINGS`, oldest first."""
