"""Teams of least cost: an agent for each place of a request's roles. Pure functions."""

from collections.abc import Mapping, Sequence
from typing import Any

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.cost import CostOf
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest

Costs = dict[tuple[str, str], tuple[float, int]]
"""(role, agent) of each that fits -> its cost, and its place in the order of admission."""

Slots = list[tuple[RoleRequest, int]]
"""A role as often as it has agents, numbered."""


Roles = dict[str, tuple[str, ...]]
"""Role -> its agents, in the order of its places."""


def roles_of(request: AgentRequest, slots: Slots, chosen: Sequence[str]) -> Roles:
    """Return the agents of each role; `chosen` has one for each place."""
    roles: Roles = {role.role: () for role in request.roles}
    for (role, _), agent_id in zip(slots, chosen, strict=True):
        roles[role.role] = (*roles[role.role], agent_id)
    return roles


def slots_of(request: AgentRequest, counts: Mapping[str, int]) -> Slots:
    """Return the places of a request's roles, each role as often as `counts` says."""
    return [(role, index) for role in request.roles for index in range(counts[role.role])]


def fill_up(
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
        found = assign(slots_of(request, {**counts, role.role: tried}), agents, costs, cost_of)
        if found is None:
            most = tried - 1
        else:
            least, chosen = tried, found
    counts[role.role] = least
    return chosen


def assign(
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
        single = assign(machines, agents, costs, cost_of)
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

    roles = dict.fromkeys(role.role for role, _ in slots)
    some = [agent for agent in agents if any((role, agent.id) in costs for role in roles)]
    if len(slots) > len(some):
        return None
    matrix = np.full((len(slots), len(some)), np.inf)  # infinite: this agent does not fit this slot
    for row, (role, index) in enumerate(slots):
        for column, agent in enumerate(some):
            if (role.role, agent.id) in costs:
                matrix[row, column] = cost_of(agent, role, index).metres
    columns = least(matrix)
    return None if columns is None else [some[column].id for column in columns]


def least(matrix: Any) -> list[int] | None:
    """Return a column per row of least total cost, no column twice; None if there is none. Infinite: not this one."""
    import numpy as np
    from lap import lapjvc

    # Of n rows none needs more than its n cheapest: one of these is free whatever the others take.
    cheap = np.unique(np.argsort(matrix, axis=1, kind="stable")[:, : len(matrix)])
    rows, columns = lapjvc(matrix[:, cheap], return_cost=False)
    return None if len(rows) < len(matrix) else [int(column) for column in cheap[columns]]
