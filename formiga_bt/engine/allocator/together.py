"""Requests of one rank served together: who is served goes by their order, which agent each gets by the cost of all.

A request is served if it can be, whole, beside all that are served before it; for that those may get other agents, never fewer.
So nobody waits for ever because others are nearer. Among all ways to serve just these, the one of least total cost is taken.
Equal costs go to the agents that were known first, those of the first requests first. Pure functions.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.cost import CostOf
from formiga_bt.engine.allocator.teams import Costs, Roles, Slots, least, roles_of, slots_of
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest

MOST_PLACES: Final = 64
"""So many places of roles are looked at together; more would hold the engine up. The rest comes after them."""

TIE_M: Final = 4e-4
"""Metres that all ties together weigh: less than half of the millimetre to which ways are rounded."""


def batches(requests: Iterable[AgentRequest]) -> Iterator[list[AgentRequest]]:
    """Yield the requests in their order, those that are served together in one list.

    One that keeps agents while it waits, or takes as many as there are, is served by itself.
    """
    batch: list[AgentRequest] = []
    places = 0
    for request in requests:
        size = sum(role.count for role in request.roles if not role.shared)
        alone = request.reserves or any(role.more for role in request.roles)
        if batch and (alone or request.priority != batch[0].priority or places + size > MOST_PLACES):
            yield batch
            batch, places = [], 0
        batch.append(request)
        places += size
        if alone:
            yield batch
            batch, places = [], 0
    if batch:
        yield batch


def share(
    requests: Sequence[AgentRequest], costs: Sequence[Costs], agents: Sequence[Candidate], cost_of: CostOf
) -> list[Roles | None]:
    """Return what each request gets, None: nothing.

    Args:
        requests: in the order of service.
        costs: of each request, what each agent that fits costs it.
        agents: all of them, in the order of their admission.
        cost_of: the cost of an agent for one place of a role.
    """
    column = {agent.id: place for place, agent in enumerate(agents)}
    matching = _Matching()
    served: list[tuple[int, Slots]] = []
    people: dict[int, dict[tuple[str, int], str]] = {}
    for number, (request, cost) in enumerate(zip(requests, costs, strict=True)):
        slots = slots_of(request, {role.role: role.count for role in request.roles})
        shared = _people(slots, cost)
        machines = [slot for slot in slots if not slot[0].shared]
        fit: dict[str, set[int]] = {role.role: set() for role, _ in machines}
        for name, agent in cost:
            if name in fit:
                fit[name].add(column[agent])
        if shared is not None and matching.add([fit[role.role] for role, _ in machines]):
            served.append((number, machines))
            people[number] = shared
    rows = [(number, *slot) for number, machines in served for slot in machines]
    chosen = iter(_cheapest([(costs[number], role, index) for number, role, index in rows], agents, cost_of))
    found: list[Roles | None] = [None] * len(requests)
    for number, machines in served:
        picked = people[number] | {(role.role, index): next(chosen) for role, index in machines}
        slots = slots_of(requests[number], {role.role: role.count for role in requests[number].roles})
        found[number] = roles_of(requests[number], slots, [picked[role.role, index] for role, index in slots])
    return found


def _people(slots: Slots, costs: Mapping[tuple[str, str], tuple[float, int]]) -> dict[tuple[str, int], str] | None:
    """Return a person for each place of people, who are shared; None if there are too few."""
    picked: dict[tuple[str, int], str] = {}
    for role, index in slots:
        if role.shared:
            fits = sorted((*cost, agent) for (name, agent), cost in costs.items() if name == role.role)
            if index >= len(fits):
                return None
            picked[role.role, index] = fits[index][2]
    return picked


def _cheapest(
    rows: Sequence[tuple[Costs, RoleRequest, int]], agents: Sequence[Candidate], cost_of: CostOf
) -> list[str]:
    """Return an agent per row of least total cost; there is a way to serve them all."""
    import numpy as np

    if not rows:
        return []
    some = [a for a in agents if any((role.role, a.id) in costs for costs, role, _ in rows)]
    some.sort(key=lambda agent: agent.order)
    matrix = np.full((len(rows), len(some)), np.inf)
    for row, (costs, role, index) in enumerate(rows):
        for column, agent in enumerate(some):
            known = costs.get((role.role, agent.id))
            if known is not None:
                one = known[0] if max(1, min(role.count, len(role.near))) == 1 else cost_of(agent, role, index).metres
                matrix[row, column] = one + TIE_M * column * (len(rows) - row) / (len(rows) ** 2 * len(some))
    columns = least(matrix)
    assert columns is not None, "places that can all be served have no cheapest way to be"
    return [some[column].id for column in columns]


class _Matching:
    """Which places can be served at once: a row each, with the columns of the agents that fit."""

    def __init__(self) -> None:
        self._rows: list[set[int]] = []
        self._row_of: dict[int, int] = {}
        """Column -> the row that has it."""
        self._used_up: set[int] = set()
        """Columns from which no way leads to a free one, nor ever will."""

    def add(self, rows: Sequence[set[int]]) -> bool:
        """Add the rows of a request if all of them can be served beside those that are; say whether."""
        before = self._row_of.copy()
        for number, row in enumerate(rows):
            self._rows.append(row)
            tried = self._place(len(self._rows) - 1)
            if tried is not None:
                if number == 0:
                    self._used_up |= tried
                self._row_of = before
                del self._rows[len(self._rows) - number - 1 :]
                return False
        return True

    def _place(self, row: int) -> set[int] | None:
        """Give a row a column, others may move for it; return the columns tried in vain."""
        came_from: dict[int, int] = {}  # column -> the row that wants it
        tried: set[int] = self._used_up.copy()
        queue = [row]
        for wanting in queue:
            fresh = self._rows[wanting] - tried
            came_from.update(dict.fromkeys(fresh, wanting))
            free = fresh - self._row_of.keys()
            if free:
                self._move(min(free), came_from)
                return None
            tried |= fresh
            queue += [self._row_of[column] for column in sorted(fresh)]
        return tried

    def _move(self, free: int, came_from: Mapping[int, int]) -> None:
        has = {row: column for column, row in self._row_of.items()}
        column: int | None = free
        while column is not None:
            row = came_from[column]
            column_before = has.get(row)
            self._row_of[column] = row
            column = column_before
