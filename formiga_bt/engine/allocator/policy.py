"""The seam for policies, and two: `closest_charged`, which the engine uses, and the paper's `closest`.

A policy sees all waiting requests (in order of service) and all agents at one instant, and returns grants and, for every
request, a verdict on every agent. All roles of a request are granted together or none.

`closest` (the paper's choose_closest_mex, section 3.3): highest priority first, then first come first served; each role gets
the nearest agent that fits; a role with several places gets the best one-to-one assignment. A role that takes as many as
there are is filled up after all roles have what they need.

`closest_charged` differs in one thing: nearness is weighed with the charge that the job leaves (`allocator.cost`).
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.cost import CostOf, far, far_and_low, in_words
from formiga_bt.engine.allocator.filters import refused_there
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.kernel.records import PRIORITIES, AgentRequest, RoleRequest, Verdict


class Grant(Struct, frozen=True):
    """Agents for the roles of one task, in the order of the roles' places."""

    task: str
    roles: dict[str, tuple[str, ...]]


class Decision(Struct, frozen=True):
    """What a policy decided."""

    grants: tuple[Grant, ...]
    verdicts: dict[str, tuple[Verdict, ...]]


class Policy(Protocol):
    """Chooses agents for requests. Deterministic: equal inputs, equal decision."""

    def __call__(self, requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
        """Return the decision."""
        ...


def closest(requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
    """Grant the nearest fitting agents, request by request in the given order."""
    return _decide(requests, agents, far)


def closest_charged(requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
    """Grant the nearest fitting agents whose charge lasts, request by request in the given order."""
    return _decide(requests, agents, far_and_low)


def _decide(requests: Sequence[AgentRequest], agents: Sequence[Candidate], cost_of: CostOf) -> Decision:
    roster = agents if isinstance(agents, Roster) else Roster(agents)
    taken: dict[str, str] = {}
    grants: list[Grant] = []
    verdicts: dict[str, tuple[Verdict, ...]] = {}
    machines = {agent.id: place for place, agent in enumerate(roster) if not agent.shared}
    given = _given_by_hand(requests)
    for request in requests:
        away = {**_kept_from(request, given), **taken} if given else taken
        roles, seen = _serve(request, roster, away, machines, cost_of)
        verdicts[request.task] = roster.shared(request.roles, seen)
        if roles is not None:
            grants.append(Grant(request.task, roles))
            taken.update({agent: request.task for group in roles.values() for agent in group if agent in machines})
        elif request.reserves:
            taken.update(_reserved(request, seen))
    return Decision(tuple(grants), verdicts)


def _given_by_hand(requests: Sequence[AgentRequest]) -> dict[str, AgentRequest]:
    """Return machine -> the request to which a person gave it."""
    return {
        agent: request for request in requests for role in request.roles if not role.shared for agent in role.by_hand
    }


def _kept_from(request: AgentRequest, given: Mapping[str, AgentRequest]) -> dict[str, str]:
    """Return the machines that persons gave to others, which keep them from all but a more urgent request."""
    rank = PRIORITIES[request.priority]
    return {
        agent: holder.task
        for agent, holder in given.items()
        if holder.task != request.task and PRIORITIES[holder.priority] <= rank
    }


def _reserved(request: AgentRequest, verdicts: Sequence[Verdict]) -> dict[str, str]:
    """Return the agents that an incomplete team keeps for itself: for each role the nearest that fit."""
    kept: dict[str, str] = {}
    for role in request.roles:
        if role.shared:
            continue
        fits = sorted((v.cost or 0.0, v.agent) for v in verdicts if v.role == role.role and v.code == "fits")
        kept.update({agent: request.task for _, agent in [f for f in fits if f[1] not in kept][: role.count]})
    return kept


Costs = dict[tuple[str, str], tuple[float, int]]
"""(role, agent) of each that fits -> its cost, and its place in the order of admission."""


def _serve(
    request: AgentRequest, agents: Roster, taken: dict[str, str], machines: Mapping[str, int], cost_of: CostOf
) -> tuple[dict[str, tuple[str, ...]] | None, list[Verdict]]:
    costs: Costs = {}
    verdicts: list[Verdict] = []
    fits: list[int] = []
    for role in request.roles:
        looked = agents.look(role)
        seen: list[Any] = looked.verdicts.copy()
        for agent_id, by in taken.items():
            if machines[agent_id] in looked.types:
                seen[machines[agent_id]] = agents.verdict(role.role, agent_id, "busy", by)
        for place in looked.fit:
            if seen[place] is not None:
                continue
            agent = agents[place]
            refused = refused_there(agent, role)
            if refused is not None:
                seen[place] = agents.verdict(role.role, agent.id, *refused)
                continue
            ways = max(1, min(role.count + role.more, len(role.near)))
            cost = cost_of(agent, role, 0) if ways == 1 else min(cost_of(agent, role, index) for index in range(ways))
            costs[role.role, agent.id] = cost.metres, agent.order
            told = in_words(agent, role, cost)
            seen[place] = Verdict(role.role, agent.id, "fits", cost.metres, told, cost.short)
            fits.append(len(verdicts) + place)
        verdicts += seen
    counts = {role.role: role.count for role in request.roles}
    chosen = _assign(_slots(request, counts), agents, costs, cost_of)
    if chosen is None:
        return None, verdicts
    for role in request.roles:
        if role.more:
            chosen = _fill_up(request, role, counts, chosen, agents, costs, cost_of)
    slots = _slots(request, counts)
    roles: dict[str, tuple[str, ...]] = {role.role: () for role in request.roles}
    for (role, _), agent_id in zip(slots, chosen, strict=True):
        roles[role.role] = (*roles[role.role], agent_id)
    for place in fits:
        verdict = verdicts[place]
        if verdict.agent in roles[verdict.role]:
            verdicts[place] = replace(verdict, code="chosen")
    return roles, verdicts


Slots = list[tuple[RoleRequest, int]]
"""A role as often as it has agents, numbered."""


def _slots(request: AgentRequest, counts: Mapping[str, int]) -> Slots:
    return [(role, index) for role in request.roles for index in range(counts[role.role])]


def _fill_up(
    request: AgentRequest,
    role: RoleRequest,
    counts: dict[str, int],
    chosen: list[str],
    agents: Sequence[Candidate],
    costs: Costs,
    cost_of: CostOf,
) -> list[str]:
    """Give a role as many agents beyond its count as fit and are free; `counts` is raised, the choice for all is returned."""
    least = counts[role.role]
    fit = sum((role.role, agent.id) in costs for agent in agents)
    most = max(least, min(least + role.more, fit))
    while least < most:  # if so many can be had, then fewer can: halve the rest each time
        tried = (least + most + 1) // 2
        found = _assign(_slots(request, {**counts, role.role: tried}), agents, costs, cost_of)
        if found is None:
            most = tried - 1
        else:
            least, chosen = tried, found
    counts[role.role] = least
    return chosen


def _assign(
    slots: Sequence[tuple[RoleRequest, int]], agents: Sequence[Candidate], costs: Costs, cost_of: CostOf
) -> list[str] | None:
    """Return an agent per slot of least total cost, or None if the slots cannot all be filled."""
    if len(slots) == 1:
        role = slots[0][0]
        fits = [(*cost, agent) for (name, agent), cost in costs.items() if name == role.role]
        return [min(fits)[2]] if fits else None
    machines = [slot for slot in slots if not slot[0].shared]
    picked: dict[tuple[str, int], str] = {}
    for role, index in slots:
        if role.shared:  # people are shared: each role of people is served by itself
            fits = sorted((*cost, agent) for (name, agent), cost in costs.items() if name == role.role)
            if index >= len(fits):
                return None
            picked[role.role, index] = fits[index][2]
    if len(machines) == 1:
        single = _assign(machines, agents, costs, cost_of)
        if single is None:
            return None
        picked[machines[0][0].role, machines[0][1]] = single[0]
    elif machines:
        ids = _best_team(machines, agents, costs, cost_of)
        if ids is None:
            return None
        for (role, index), agent_id in zip(machines, ids, strict=True):
            picked[role.role, index] = agent_id
    return [picked[role.role, index] for role, index in slots]


def _best_team(
    slots: Sequence[tuple[RoleRequest, int]], agents: Sequence[Candidate], costs: Costs, cost_of: CostOf
) -> list[str] | None:
    """Return an agent per slot of least total cost, no agent twice; None if there is no such team."""
    import numpy as np
    from lap import lapjvc

    roles = dict.fromkeys(role.role for role, _ in slots)
    some = [agent for agent in agents if any((role, agent.id) in costs for role in roles)]
    if len(slots) > len(some):
        return None
    matrix = np.full((len(slots), len(some)), np.inf)  # infinite: this agent does not fit this slot
    for row, (role, index) in enumerate(slots):
        for column, agent in enumerate(some):
            if (role.role, agent.id) in costs:
                matrix[row, column] = cost_of(agent, role, index).metres
    # Of n slots none needs more than its n cheapest: one of these is free whatever the others take.
    cheap = np.unique(np.argsort(matrix, axis=1, kind="stable")[:, : len(slots)])
    rows, columns = lapjvc(matrix[:, cheap], return_cost=False)
    if len(rows) < len(slots):
        return None
    return [some[column].id for column in cheap[columns]]
