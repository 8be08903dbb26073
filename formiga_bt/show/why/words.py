"""Codes of the engine in plain words: what the allocator, the gate, a hold or the end of a task means, and what helps."""

from collections.abc import Iterable, Mapping
from typing import Final

from formiga_bt.base.clock import Micros
from formiga_bt.transport.messages import PreflightCheck

VERDICTS: Final[Mapping[str, str]] = {
    "chosen": "was chosen",
    "fits": "fits",
    "wrong_type": "is of another type ({detail})",
    "not_this_one": "is not the one asked for ({detail})",
    "no_action": "does not offer {detail}",
    "failed_before": "failed in an earlier attempt",
    "not_admitted": "is not admitted: {detail}",
    "quarantined": "is quarantined: {detail}",
    "not_alive": "is not heard of ({detail})",
    "control": "is not under the engine's control but its {detail}'s",
    "busy": "is busy with {detail}",
    "kept": "is busy with {detail}",
    "preempting": "is being freed: {detail} steps aside",
    "not_idle": "does not report to be idle but '{detail}'",
    "no_position": "has not reported where it is",
    "airborne": "is not on the ground ({detail})",
    "parked_away": "stands away from its port",
    "battery": "has too little charge: {detail}",
    "energy": "has too little charge to go there and come home: {detail}",
    "reserved": "is kept free for {detail}",
    "ordered": "has a standing order ({detail})",
    "preflight": "is not ready to fly: {detail}",
    "no_checks": "has not reported whether it is ready to fly",
    "out": "is out of service: {detail}",
    "by_hand": "is not the one that a person gave it ({detail})",
    "taken_back": "was taken back from it by a person",
}
"""Of an agent for a role, after its id."""

DOUBLE: Final = "double"
"""The quarantine of a machine of which two processes are heard: it ends when one is."""

VERDICT_HINTS: Final[Mapping[str, str]] = {
    "quarantined": "look at the machine, then: formiga agents clear {agent}",
    "parked_away": "bring it home: formiga return {agent}",
    "not_admitted": "formiga agents add ID, or list it in site.yaml under agents, with a port as its home",
    "not_alive": "is its process running, and connected to this engine?",
    "control": "its pilot must give it back, then: formiga handback {agent} --continue|--return|--end",
    "ordered": "formiga continue {agent}",
    "preflight": "formiga preflight {agent}",
    "no_checks": "formiga preflight {agent}",
    "out": "once it is fit: formiga agents in {agent}",
    "by_hand": "formiga assign TASK {agent} once that one is taken back: formiga unassign",
    "taken_back": "formiga assign TASK {agent} gives it again",
}

BLOCKED: Final[Mapping[str, str]] = {
    "not_before": "it is not to begin before {detail}",
    "after": "it begins once this has succeeded: {detail}",
    "lockdown": "{detail}",
    "not_approved": "it may not fly: {detail}",
    "no_pilot": "it has no pilot: {detail}",
    "held": "the task is held ({detail})",
    "safe_order": "if it had this now, {detail} might wait for ever; {detail} goes first",
}
"""What keeps a request from being granted whoever is free."""

CLAIMS: Final[Mapping[str, str]] = {
    **BLOCKED,
    "resource_busy": "not enough of it is free: {detail}",
    "resource_queue": "another block waits for the same before it: {detail}",
}
"""What keeps a block from getting its resources."""

BLOCKED_HINTS: Final[Mapping[str, str]] = {"no_pilot": "formiga duty PILOT on"}

GATE: Final[Mapping[str, str]] = {
    "": "waits to be sent",
    "clearance": "waits for a person to say that people stand 15 m clear",
    "leg_busy": "waits until {text} is out of its way",
    "route_busy": "waits until {text} has left the routes ahead of it",
    "route_order": "waits: if it went on now, {text} might never come to where it drives",
    "spot_busy": "waits until {text} has left the landing place",
    "port_busy": "waits until {text} has left the port",
    "control": "waits until the engine is in command again (now: {text})",
    "control:handback": "waits until a person hands it back: formiga handback {agent} --continue|--return|--end",
    "stopped": "waits: the order `{text}` stands on {agent}",
    "lockdown": "waits: the site is locked down ({text})",
    "epoch": "is not sent any more: {text} commands this site",
    "suspect": "waits until {text} is heard of again",
    "quarantined": "waits: {text} is quarantined (formiga agents says why)",
    "unreachable": "waits until {text} can be reached",
    "draining": "waits for the end of a former goal ({text})",
    "held": "waits: its task is held",
    "reconcile": "waits until it is known what {text} did while the engine was away",
    "resource_busy": "waits for room in {text}",
    "no_claim": "waits: its way leads through {text}, which its task does not hold",
    "rebooted": "waits: {text} was started anew, and nobody has looked at it since: formiga agents clear {text}",
}
"""Why a goal waits at the gate, after `agent.Action`."""

HOLDS: Final[Mapping[str, str]] = {
    "operator": "it was stopped, and waits for a person's word",
    "operator:": "a person stopped {agent}",
    "clearance": "a person must say that people stand clear of {agent}",
    "take-over": "a pilot, or its own failsafe, has taken {agent} over",
    "lockdown": "the site is locked down",
    "resume": "it was interrupted by an outage; a person must say that it may go on",
}

REASONS: Final[Mapping[str, str]] = {
    "no_agent": "it got no agents",
    "request": "the task that a step requested did not succeed, or was not admitted",
    "task_expired": "it was not started before it expired",
    "late": "it had not ended by its deadline",
    "after_failed": "a task that it was to begin after did not succeed",
    "rejected": "an agent refused the order",
    "failed": "an action failed on its agent",
    "timeout": "a time limit passed",
    "expect": "an action ended, but not with what was expected",
    "check": "a check was not met",
    "guard": "the condition of a guard became false",
    "spot_busy": "another machine was on its landing place until it had to come home",
    "leg_busy": "another machine was in its way until it had to come home",
    "off_routes": "it was sent where no route ends: to no station, and to no node marked park",
    "no_route": "no route leads there from where the machine is",
    "no_update": "a machine could not be told of a target that moved",
    "port_busy": "its port, and every other, was taken until it had to come down",
    "bad_result": "an agent's result could not be read",
    "contradicted": "a machine said that an action was done, and its own status says otherwise",
    "nothing_applied": "none of the alternatives applied",
    "zip_length": "lists that belong together have different lengths",
    "agent_busy": "an agent had another order of this task",
    "agent_lost": "an agent was not heard of for too long",
    "taken_over": "a pilot, or a machine's own failsafe, took over",
    "cancel_unconfirmed": "an agent never confirmed that it stopped",
    "in_doubt": "it is unknown whether an order was carried out, and it may not be repeated",
    "goal_expired": "an order reached its agent too late",
    "unknown_state": "a condition reads something that is not known",
    "no_clearance": "nobody said that people stand clear",
    "released": "the agent had been released before",
    "aborted": "a person ended it",
    "restarted": "a person has it begin anew",
    "preempted": "a more urgent task took its agents",
    "resource_timeout": "a block got its resources not in time",
    "no_resource": "this site does not have the resources that a block asks for",
    "occupied": "a machine was in what an action would shut",
    "at_port": "a machine stood at its port, so that nothing was left of its way home",
    "cannot_continue": "an action was interrupted and cannot be done again as things stand",
    "lockdown": "the site was locked down",
    "no_action": "a machine does not offer the action that it was given",
    "requires": "a machine was not in the air, or not on the ground, as the action needs it",
    "envelope.reserve": "too little charge to come home with its reserve",
    "envelope.max_height": "higher than is allowed",
    "envelope.terrain_clearance": "too near to the ground",
    "envelope.keep_in": "outside the fence",
    "envelope.keep_out": "in or through a no-fly zone",
    "envelope.wind_max": "more wind than is allowed",
    "envelope.daylight_only": "outside daylight",
    "envelope.people_clearance": "too near to a person",
    "envelope.position": "it is not known where a machine is",
    "envelope": "a limit of the safety envelope was broken",
    "runaway": "it visited more steps at one instant than a sane task does",
    "cannot_compute": "an expression of the task has no value; look at what it reads",
    "exception": "a step raised an error; this is a bug of formiga",
    "upgrade": "it was begun by another version of formiga",
    "foreign_port": "it would land on the port of another machine",
}

REPEATS: Final = frozenset(
    {
        "the agent is lost",
        "its pilot, or its own failsafe, took over",
        "nobody knows how the goal ended",
        "the agent never confirmed the cancel",
    }
)
"""Reasons of the engine that say no more than the words of their codes."""


def not_ready(checks: Iterable[PreflightCheck]) -> str:
    """Return the preflight checks that are not ok: `gnss: 4 satellites, storage: full`."""
    return ", ".join(f"{c.check}: {c.text}" if c.text else c.check for c in checks if not c.ok)


def say(table: Mapping[str, str], code: str, **values: str) -> str:
    """Return the words of a code; an unknown code speaks for itself."""
    text = table.get(code) or table.get(code.split(":", 1)[0]) or table.get(code.split(".", 1)[0])
    return text.format(**values) if text else " ".join(part for part in (code, values.get("detail", "")) if part)


def span(micros: Micros) -> str:
    """Return a time span in words."""
    seconds = max(0, micros) / 1e6
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 172_800 else f"{seconds / 86_400:.1f} days"


def quarantine_hint(agent: str, why: str) -> str:
    """Return what helps a quarantined machine that is heard of."""
    if why == DOUBLE:
        return f"two processes say that they are {agent}: end one of them; it comes back by itself"
    return f"look at it, then: formiga agents clear {agent}"
