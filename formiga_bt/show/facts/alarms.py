"""Facts of alarms: what a person must act on, who takes care of it, and what became of it."""

from msgspec import Struct

from formiga_bt.base.clock import Micros


class AlarmTurnFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that became of an alarm."""

    at: Micros
    what: str
    """raised, acknowledged, cleared, or escalated (its news went to another channel)."""
    by: str = ""
    """The person; "" = the engine."""
    note: str = ""
    to: str = ""
    """The channel that an escalation went to."""


class AlarmFact(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that a person must act on."""

    id: str
    """`A7`."""
    code: str
    """Its kind: docs/reasons.md says of each what to do."""
    severity: str
    """warning, alarm or critical."""
    state: str
    """raised, acknowledged or cleared."""
    text: str
    task: str = ""
    agent: str = ""
    about: str = ""
    """What of the engine's own house it is about: `clock`, or a file's name."""
    owner: str = ""
    """Who acknowledged it, and takes care of it."""
    times: int = 1
    """How often it was raised while it was open."""
    lasts: bool = False
    """What is wrong lasts, and the engine sees its end: then the alarm is cleared."""
    raised_at: Micros
    at: Micros
    """When it was raised last."""
    history: tuple[AlarmTurnFact, ...] = ()
    """Oldest first."""


class AlarmList(Struct, frozen=True):
    """The alarms of a site: those that nobody acknowledged first, then by severity, the newest first."""

    at: Micros
    alarms: tuple[AlarmFact, ...]
    total: int
    """So many are open."""
