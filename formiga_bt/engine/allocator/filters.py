"""Filters: may this agent take this role now? Each refusal has a code and, where it helps, the numbers."""

from collections.abc import Callable, Sequence
from typing import Final

from formiga_bt.base.machines import MOVING
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.energy import never_enough, short_of
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest, Verdict

FOR_EVER: Final = frozenset({"wrong_type", "not_this_one", "no_action", "not_admitted", "failed_before"})
"""Refusals that waiting does not change."""


MOST_NAMED: Final = 3
"""So many near misses are named; the explanation has all."""


def hopeless(request: AgentRequest, verdicts: Sequence[Verdict], find: Callable[[str], Candidate | None]) -> str:
    """Return why no known agent could ever serve a request, or ""; `find` returns an agent by its id."""
    for role in request.roles:
        possible, near_misses = 0, []
        for verdict in verdicts:
            if verdict.role != role.role:
                continue
            never = _never(role, verdict, find)
            if never is None:
                possible += 1
                if possible >= role.count:  # most roles end here: the others are not looked at
                    break
            elif never:
                near_misses.append(f"{verdict.agent}: {never}")
        else:
            if possible < role.count:
                what = f"{role.count} agents" if role.count > 1 else "an agent"
                wanted = role.id or " or ".join(role.types)
                more = [f"and {len(near_misses) - MOST_NAMED} more"] if len(near_misses) > MOST_NAMED else []
                told = f" ({'; '.join(near_misses[:MOST_NAMED] + more)})" if near_misses else ""
                return (
                    f"role '{role.role}' needs {what} ({wanted}), this fleet has {possible} that could ever serve{told}"
                )
    return ""


def _never(role: RoleRequest, verdict: Verdict, find: Callable[[str], Candidate | None]) -> str | None:
    """Return why an agent could never take a role, "" if that is not worth a word; None: it may, one day."""
    if verdict.code in FOR_EVER:
        return "" if verdict.code == "wrong_type" else f"{verdict.code} {verdict.detail}".rstrip()
    if role.shared or role.away or not role.near:
        return None  # one that may begin away from its port may be brought nearer
    agent = find(verdict.agent)
    lacks = never_enough(agent.charge, role.near) if agent is not None and agent.charge is not None else ""
    return f"too_far, full, from its port, in calm air: {lacks}" if lacks else None


def refusal(agent: Candidate, role: RoleRequest) -> tuple[str, str] | None:
    """Return (code, detail) of the first filter that refuses the agent, or None if it fits."""
    return refused_anywhere(agent, role) or refused_there(agent, role)


def refused_anywhere(agent: Candidate, role: RoleRequest) -> tuple[str, str] | None:
    """Return (code, detail) of the first filter that refuses the agent wherever it is to go."""
    if agent.type not in role.types:
        return "wrong_type", agent.type
    if role.id and agent.id != role.id:
        return "not_this_one", role.id
    if agent.id in role.but_not:
        return "failed_before", ""
    if agent.id in role.taken_back:
        return "taken_back", ""
    if role.is_full_by_hand and agent.id not in role.by_hand:
        return "by_hand", ", ".join(role.by_hand)
    missing = [action for action in role.actions if action not in agent.actions]
    if missing:
        return "no_action", missing[0]
    if agent.refused:
        return "not_admitted", agent.refused
    if role.shared:
        return None  # people are shared and wait for nobody: an unreachable one still holds no task up
    if agent.out:
        return "out", agent.out
    if agent.pool == "QUARANTINED":
        return "quarantined", agent.detail
    if agent.liveness != "ALIVE":
        return "not_alive", agent.liveness
    if agent.control != "engine":
        return "control", agent.control
    if agent.taken:
        return "control", "pilot"
    if agent.ordered:
        return "ordered", agent.ordered
    if agent.task:
        return "busy", agent.task
    if agent.goal:
        return "busy", agent.goal
    if agent.word != "STANDBY":
        return "not_idle", agent.word
    if agent.position is None and agent.mobility in MOVING:
        return "no_position", ""
    if not role.away and agent.landed != "grounded":
        return "airborne", agent.landed
    if not role.away and not agent.at_port:
        return "parked_away", ""
    if agent.battery < role.battery_min:
        return "battery", f"{agent.battery:.0f} % < {role.battery_min:.0f} %"
    return None


def refused_there(agent: Candidate, role: RoleRequest) -> tuple[str, str] | None:
    """Return (code, detail) of the filters that come last, of an agent that fits but for those: energy, readiness."""
    if role.shared:
        return None
    lacks = short_of(agent.charge, role.near) if agent.charge is not None else ""
    if lacks:
        return "energy", lacks
    return _not_ready(agent)


def looked(request: AgentRequest, agents: Sequence[Candidate]) -> tuple[Verdict, ...]:
    """Return what there is to say of each agent for a request that no policy sees: it fits, or why not."""
    found = []
    for role in request.roles:
        for agent in agents:
            code, detail = refusal(agent, role) or ("fits", "")
            found.append(Verdict(role.role, agent.id, code, None, detail))
    return tuple(found)


def could_serve(request: AgentRequest, agents: Sequence[Candidate]) -> bool:
    """Return whether each role has as many agents as it needs that fit now, or would once they are free."""
    verdicts = [v for v in looked(request, agents) if v.code in ("fits", "busy")]
    return all(sum(v.role == role.role for v in verdicts) >= role.count for role in request.roles)


def _not_ready(agent: Candidate) -> tuple[str, str] | None:
    """Return the first check before the flight that is not ok; in the air a machine tells of none."""
    if not agent.preflight or agent.landed == "airborne":
        return None
    if not agent.checks:
        return "no_checks", ""
    bad = next((check for check in agent.checks if not check.ok), None)
    return None if bad is None else ("preflight", f"{bad.check}: {bad.text or 'not ok'}")
