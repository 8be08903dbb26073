"""What the engine knows of an alarm: its state, who takes care of it, and how it came to that.

| from | to | by |
|---|---|---|
| | raised | what is wrong; the same of the same subject, while it is open, only counts up |
| raised | acknowledged | a person, who takes care of it: its owner |
| raised, acknowledged | cleared | the end of what was wrong; where nothing lasts, the word of a person |
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.severities import Severity

AlarmState = Literal["raised", "acknowledged", "cleared"]
TRANSITIONS: Final[Mapping[AlarmState, frozenset[AlarmState]]] = MappingProxyType(
    {
        "raised": frozenset({"acknowledged", "cleared"}),
        "acknowledged": frozenset({"cleared"}),
        "cleared": frozenset(),
    }
)
"""From which state an alarm comes into which."""
KEPT_TURNS: Final = 10
"""So many of the newest turns of an alarm are kept beside its first."""
NOTIFY: Final = "notify"
"""The code of an alarm that a step of a task raises: `notify` with `severity: alarm`."""

CRITICAL: Final = frozenset(
    {
        "agent_needs_help", "cut", "deposed", "double", "found_airborne", "journal_full", "journal_gone", "lockdown",
        "no_free_port", "no_way_home", "not_resumed", "quarantined_airborne", "router_gone", "secret_guessed",
        "taken_over", NOTIFY,
    }
)  # fmt: skip
"""Codes of what cannot wait for the morning: a machine in the air may need help, or nothing is safe any more."""
WARNING: Final = frozenset(
    {
        "action_refused", "action_unknown", "attachment_refused", "bad_status", "clock_off", "events_unheard",
        "field_refused", "journal_slow", "keys_expire", "parked_away", "recover_slow", "update_refused",
    }
)  # fmt: skip
"""Codes of what somebody should look at some time."""
BREACH: Final = "envelope."


def severity_of(code: str) -> Severity:
    """Return how loud an alarm of this code is."""
    if code in CRITICAL or code.startswith(BREACH):
        return "critical"
    return "warning" if code in WARNING else "alarm"


class AlarmTurn(Struct, frozen=True, omit_defaults=True):
    """One thing that became of an alarm."""

    at: Micros
    what: Literal["raised", "acknowledged", "cleared", "escalated"]
    by: str = ""
    """The person; "" = the engine."""
    note: str = ""
    """In the person's own words."""
    to: str = ""
    """Of an escalation: the channel of the site's news."""


class AlarmRecord(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that a person must act on."""

    id: str
    """`A7`, for people."""
    code: str
    """Its kind."""
    severity: Severity
    state: AlarmState = "raised"
    text: str
    task: str = ""
    agent: str = ""
    human: bool = False
    """Its agent is a person."""
    about: str = ""
    """What of the engine's own house it is about, if it is: `clock`, or a file's name."""
    owner: str = ""
    """Who acknowledged it."""
    times: int = 1
    """How often it was raised while it was open."""
    lasts: bool = False
    """What is wrong lasts, and the engine sees its end."""
    raised_at: Micros
    at: Micros
    """When it was raised last."""
    history: tuple[AlarmTurn, ...]
    """Oldest first."""

    @property
    def is_open(self) -> bool:
        """Return whether it is not cleared."""
        return self.state != "cleared"

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Return what tells alarms apart: while one is open, none of the same key is raised beside it."""
        return self.code, self.task, self.agent, self.about

    def turned(self, turn: AlarmTurn) -> "AlarmRecord":
        """Return it after a turn; one to another state is in `TRANSITIONS`."""
        state = self.state
        if turn.what != "escalated":
            assert turn.what in TRANSITIONS[state], f"{self.id} is {state}, and cannot be {turn.what}"
            state = turn.what
        first, *others = self.history
        kept = (first, *others[-KEPT_TURNS + 1 :], turn)
        return replace(self, state=state, history=kept, owner=turn.by if turn.what == "acknowledged" else self.owner)
