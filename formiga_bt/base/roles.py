"""Roles of accounts, and what each may do: one table, read by the API, by its docs and by the commands.

A role says what somebody may do, never who they are; an account may have several. Who speaks without an account, on the
engine's own machine, is `local` and may do everything that its word is taken for.
"""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final


class Role(StrEnum):
    """What an account is for."""

    VIEWER = "viewer"
    REQUESTER = "requester"
    PICKER = "picker"
    RESPONDER = "responder"
    OPERATOR = "operator"
    PILOT = "pilot"
    APPROVER = "approver"
    ADMIN = "admin"


class Deed(StrEnum):
    """What may be done; the text says it to people."""

    WHO = "ask who they are"
    SEE = "see tasks, machines, and the past"
    METRICS = "read the engine's figures"
    INBOX = "see open questions"
    ANSWER = "answer as the agent of their account"
    EVENT = "report events as the agent of their account"
    ATTACH = "send the bytes of an attachment"
    REQUEST = "request tasks"
    ABORT_OWN = "end a task that they requested"
    ABORT = "end any task"
    STOP = "order hold, return or land"
    CUT = "order cut"
    CONTINUE = "let machines and tasks go on"
    LOCKDOWN = "press lockdown"
    RELEASE = "release lockdown"
    ASSIGN = "give agents to tasks by hand, and take them back"
    PRIORITY = "say which of the tasks that wait goes first"
    ACKNOWLEDGE = "acknowledge alarms"
    OUT = "take machines out of service, and back"
    ZONES = "close regions for machines, and open them"
    CLEAR = "take back a machine that somebody looked at"
    RULES = "start or dismiss what a rule asks about"
    LOAD_SIMULATED = "load tasks into an engine in mode simulation"
    HANDBACK = "give a machine back to the engine"
    DUTY = "go on and off duty"
    APPROVE = "approve tasks"
    LOAD = "load tasks into an engine in mode real"
    FLEET = "add and remove machines, save and load fleets"
    CATALOGUE = "take over actions that agents announce"
    NEWS = "send a test of the news"
    ENGINE = "drain and stop the engine"


_ANY: Final = frozenset({Deed.WHO})
_VIEWER: Final = _ANY | {Deed.SEE, Deed.METRICS, Deed.INBOX}
_REQUESTER: Final = _VIEWER | {Deed.REQUEST, Deed.ABORT_OWN}
_AGENT: Final = frozenset({Deed.ANSWER, Deed.EVENT, Deed.ATTACH, Deed.INBOX})
"""Of an account that is an agent: a person who is asked."""

MAY: Final[Mapping[Role, frozenset[Deed]]] = MappingProxyType(
    {
        Role.VIEWER: _VIEWER,
        Role.REQUESTER: _REQUESTER,
        Role.PICKER: _ANY | _AGENT | {Deed.REQUEST, Deed.ABORT_OWN},
        Role.RESPONDER: _VIEWER | _AGENT | {Deed.LOCKDOWN, Deed.ACKNOWLEDGE},
        Role.OPERATOR: _REQUESTER
        | _AGENT
        | {
            Deed.ABORT,
            Deed.STOP,
            Deed.CUT,
            Deed.CONTINUE,
            Deed.LOCKDOWN,
            Deed.RELEASE,
            Deed.ASSIGN,
            Deed.PRIORITY,
            Deed.OUT,
            Deed.ACKNOWLEDGE,
            Deed.CLEAR,
            Deed.ZONES,
            Deed.RULES,
            Deed.LOAD_SIMULATED,
        },
        Role.PILOT: _VIEWER
        | _AGENT
        | {
            Deed.STOP,
            Deed.CUT,
            Deed.CONTINUE,
            Deed.LOCKDOWN,
            Deed.ACKNOWLEDGE,
            Deed.HANDBACK,
            Deed.DUTY,
            Deed.OUT,
            Deed.ZONES,
        },
        Role.APPROVER: _VIEWER | {Deed.APPROVE},
        Role.ADMIN: _VIEWER
        | {Deed.LOCKDOWN, Deed.LOAD_SIMULATED, Deed.LOAD, Deed.FLEET, Deed.CATALOGUE, Deed.NEWS, Deed.ENGINE},
    }
)
"""What each role may do. An approver is not an admin by that, nor the reverse."""


def roles_that_may(deed: Deed) -> tuple[Role, ...]:
    """Return the roles that may do something, in the order of the table."""
    return tuple(role for role, deeds in MAY.items() if deed in deeds)
