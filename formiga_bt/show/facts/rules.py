"""Facts of standing rules: what each is on, what it started, and what waits for a person."""

from msgspec import Struct

from formiga_bt.base.clock import Micros


class RuleWaitFact(Struct, frozen=True, kw_only=True):
    """Something happened, and a person decides whether its task starts."""

    agent: str
    what: str
    at: Micros
    """When it happened first since it waits."""
    code: str
    text: str
    """Why its task did not start."""
    times: int = 1


class FiringFact(Struct, frozen=True, kw_only=True):
    """What became of one thing that happened."""

    agent: str
    at: Micros
    outcome: str
    """started, running (as many of its tasks run as may), own (its own task moves that machine), waits, dismissed."""
    task: str = ""
    code: str = ""
    by: str = ""
    """Who decided, of what had waited."""


class RuleFact(Struct, frozen=True, kw_only=True):
    """A standing rule of the site."""

    name: str
    on: str
    """As written."""
    after_us: Micros
    """For so long it must be so."""
    of: tuple[str, ...]
    """The agents that it is for; empty: any."""
    task: str
    limit: str
    """How many of its tasks run at once at most."""
    fired: int
    """How often something happened, whatever became of it."""
    running: tuple[str, ...]
    waits: tuple[RuleWaitFact, ...]
    last: tuple[FiringFact, ...]
    """The newest, oldest first."""
    approved: bool = True
    """In mode real: whether the rules are approved as they are."""


class RuleList(Struct, frozen=True):
    """The standing rules of a site."""

    at: Micros
    rules: tuple[RuleFact, ...]
