"""Codes of the engine in plain words: what the allocator, the gate, a hold or the end of a task means, and what helps."""

from collections.abc import Mapping
from typing import Final

VERDICTS: Final[Mapping[str, str]] = {
    "chosen": "was chosen",
    "fits": "fits",
    "wrong_type": "is of another type ({detail})",
    "not_this_one": "is not the one asked for ({detail})",
    "no_action": "does not offer {detail}",
    "not_admitted": "is not admitted: {detail}",
    "quarantined": "is quarantined: {detail}",
    "not_alive": "is not heard of ({detail})",
    "control": "is not under the engine's control but its {detail}'s",
    "busy": "is busy with {detail}",
    "not_idle": "does not report to be idle but '{detail}'",
    "no_position": "has not told where it is",
    "airborne": "is not on the ground ({detail})",
    "parked_away": "stands away from its port",
    "battery": "has too little charge: {detail}",
    "reserved": "is kept free for {detail}",
}
"""Of an agent for a role, after its id."""

VERDICT_HINTS: Final[Mapping[str, str]] = {
    "quarantined": "look at the machine, then: formiga agents clear {agent}",
    "parked_away": "bring it home: formiga run MoveTask --param robot={agent}",
    "not_admitted": "list it in site.yaml under agents, with a port as its home",
    "not_alive": "is its process running, and connected to this engine?",
    "control": "its pilot must hand it back",
}

GATE: Final[Mapping[str, str]] = {
    "": "waits to be sent",
    "clearance": "waits for a person to say that people stand 15 m clear",
    "leg_busy": "waits until {text} is out of its way",
    "spot_busy": "waits until {text} has left the landing place",
    "port_busy": "waits until {text} has left the port",
    "control": "waits until the engine is in command again (now: {text})",
    "suspect": "waits until {text} is heard of again",
    "unreachable": "waits until {text} can be reached",
    "draining": "waits for the end of a former goal ({text})",
    "held": "waits: its task is held",
    "taken_over": "was taken over by a pilot; a person must hand the machine back: formiga agents handback {agent}",
}
"""Why a goal waits at the gate, after `agent.Action`."""

HOLDS: Final[Mapping[str, str]] = {
    "operator": "an operator holds it",
    "clearance": "a person must say that people stand clear of {agent}",
    "take-over": "a pilot has taken {agent} over; once the pilot gives it back: formiga agents handback {agent}",
    "lockdown": "the site is locked down",
    "resume": "it was interrupted by an outage; a person must say that it may go on",
}

REASONS: Final[Mapping[str, str]] = {
    "no_agent": "no fitting agents were free within the role's wait",
    "task_expired": "it was not started before it expired",
    "rejected": "an agent refused the order",
    "failed": "an action failed on its agent",
    "timeout": "a time limit passed",
    "expect": "an action ended, but not with what was expected",
    "check": "a check was not met",
    "guard": "the condition of a guard became false",
    "spot_busy": "another machine was on its landing place until it had to come home",
    "leg_busy": "another machine was in its way until it had to come home",
    "bad_result": "an agent's result could not be read",
    "nothing_applied": "none of the alternatives applied",
    "zip_length": "lists that belong together have different lengths",
    "agent_busy": "an agent had another order of this task",
    "agent_lost": "an agent was not heard of for too long",
    "taken_over": "a pilot took a machine over",
    "cancel_unconfirmed": "an agent never confirmed that it stopped",
    "in_doubt": "it is unknown whether an order was carried out, and it may not be repeated",
    "goal_expired": "an order reached its agent too late",
    "unknown_state": "a condition reads something that is not known",
    "no_clearance": "nobody said that people stand clear",
    "released": "the agent had been released before",
    "aborted": "a person ended it",
    "preempted": "a more urgent task took its agents",
    "runaway": "it visited more steps at one instant than a sane task does",
    "exception": "something could not be computed; this is a mistake in the task, or in formiga",
    "upgrade": "it was begun by another version of formiga",
    "foreign_port": "it would land on the port of another machine",
}

REPEATS: Final = frozenset(
    {
        "the agent is lost",
        "a pilot took over",
        "nobody knows how the goal ended",
        "the agent never confirmed the cancel",
    }
)
"""Reasons of the engine that say no more than the words of their codes."""


def say(table: Mapping[str, str], code: str, **values: str) -> str:
    """Return the words of a code; an unknown code speaks for itself."""
    text = table.get(code) or table.get(code.split(":", 1)[0])
    return text.format(**values) if text else " ".join(part for part in (code, values.get("detail", "")) if part)
